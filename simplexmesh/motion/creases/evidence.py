"""What points tell of lines: whether the surface has an edge there, or bends steadily over as little as can be seen.

Across an edge the points beside it lie on two straight sides; elsewhere a cubic polynomial, with as many coefficients,
is as close to them. Which is closer, and whether that is chance, tells the ratio of their likelihoods (Q. H. Vuong,
"Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57 (2), 1989).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, normalized, vertex_normals
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.creases.line import CreaseLine, stretches

WIDTH = 2.0
"""Of the sides, in those of the surface on which the lines were found."""

PLACES = np.linspace(-0.5, 0.5, 9)
"""In the same unit: where the edge may be beside the line."""

FEWEST = 8
"""Points of a stretch of a line from which it tells anything."""


class Evidence(NamedTuple):
    """By how much the points beside lines speak for edges: log ratios of likelihoods (k,), and their variances."""

    ratios: Array
    variances: Array

    @property
    def errors(self) -> Array:
        """The evidence of each line (k,), in standard errors."""
        return self.ratios / np.sqrt(np.maximum(self.variances, 1e-12))

    def together(self, chosen: Mask | None = None) -> float:
        """Return the evidence of some lines, or all, in standard errors."""
        some = slice(None) if chosen is None else chosen
        return float(self.ratios[some].sum() / np.sqrt(max(self.variances[some].sum(), 1e-12)))


def evidence(lines: Sequence[CreaseLine], surface: TriangleMesh, points: Array, side: float) -> Evidence:
    """Return what points (n, 3) tell of lines on a surface with sides about as long as given."""
    centers, along, of = stretches(lines, side)
    normals, tree = vertex_normals(surface.vertices, surface.faces), cKDTree(surface.vertices)
    facing, up = (normals[tree.query(places, workers=-1)[1]] for places in (points, centers))
    up = normalized(up - dot(up, along)[:, None] * along)
    at, rows = _beside(lines, centers, of, points, side)
    ways = (points[rows] - centers[at]) / side
    s, u, h = (dot(ways, axes[at]) for axes in (along, np.cross(along, up), up))
    near = (np.abs(s) < 0.5) & (np.hypot(u, h) < WIDTH) & (dot(facing[rows], up[at]) > 0)  # not behind a thin wall
    at, s, u, h = at[near], s[near], u[near], h[near]
    known = np.bincount(at, minlength=len(centers))[at] >= FEWEST
    at, s, u, h = at[known], s[known], u[known], h[known]
    smooth, sharp = _errors(at, h, s, u, u**2, u**3), np.full(len(h), np.inf)
    least = np.full(len(centers), np.inf)
    for place in PLACES:
        errors = _errors(at, h, s, np.maximum(u - place, 0.0), np.minimum(u - place, 0.0))
        total = np.bincount(at, errors, len(centers))
        better = total < least
        least[better] = total[better]
        sharp[better[at]] = errors[better[at]]
    return _compared(smooth, sharp, of[at], len(lines))


def _beside(
    lines: Sequence[CreaseLine], centers: Array, of: Indices, points: Array, side: float
) -> tuple[Indices, Indices]:
    """Return pairs of stretches (p,) and points (p,) near them, each point with stretches of the line nearest to it."""
    samples = [line.samples(0.2 * side)[0] for line in lines]
    owner = np.repeat(np.arange(len(lines)), [len(one) for one in samples])
    nearest = owner[cKDTree(np.concatenate(samples)).query(points, workers=-1)[1]]
    balls = cKDTree(points).query_ball_point(centers, np.hypot(WIDTH, 0.5) * side)
    at = np.repeat(np.arange(len(centers)), [len(ball) for ball in balls])
    rows = np.concatenate([np.asarray(ball, np.int64) for ball in balls])
    own = nearest[rows] == of[at]
    return at[own], rows[own]


def _errors(at: Indices, heights: Array, *columns: Array) -> Array:
    """Return the squared errors (n,) of heights fitted, in each group `at` (n,), by a constant and columns (n,)."""
    A = np.column_stack([np.ones_like(heights), *columns])
    k, groups = A.shape[1], int(at.max(initial=-1)) + 1
    normal = np.array([[np.bincount(at, A[:, i] * A[:, j], groups) for i in range(k)] for j in range(k)]).T
    right = np.array([np.bincount(at, A[:, i] * heights, groups) for i in range(k)]).T
    fitted = np.linalg.solve(normal + 1e-6 * np.eye(k), right[:, :, None])[:, :, 0]
    return np.asarray((heights - dot(A, fitted[at])) ** 2)


def _compared(smooth: Array, sharp: Array, of: Indices, count: int) -> Evidence:
    """Return the evidence of squared errors (n,) of both kinds, at points of lines `of` (n,)."""
    n = np.maximum(np.bincount(of, minlength=count), 1)
    one, two = (np.bincount(of, errors, count) / n + 1e-12 for errors in (smooth, sharp))
    ratio = 0.5 * (np.log(one / two)[of] + smooth / one[of] - sharp / two[of])
    total = np.bincount(of, ratio, count).astype(float)
    return Evidence(total, np.bincount(of, ratio**2, count) - total**2 / n)
