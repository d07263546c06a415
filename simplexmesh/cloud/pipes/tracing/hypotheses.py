"""Cylinders through a picked point that most points about it are on: what else is near them takes no part.

The least squares of all points about a pick are drawn to the floor, the wall or the next pipe of a rack beside it.
Normals tell the axis, and points the radius, as normals at the border of what is seen are those of places farther in.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, dot, norm, tangents
from simplexmesh.cloud.extraction.working import FEW, from_quadrics
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.pipes.tolerances import FACING, FEWEST
from simplexmesh.cloud.pipes.tracing import _kernels_tracing
from simplexmesh.data.primitives import Cylinder
from simplexmesh.numerics.plane_fits import fitted

SIZES = (FEWEST, 2 * FEWEST, 4 * FEWEST)
"""Points of the neighborhoods: larger ones where small ones are in the noise."""

NORMALS = (8, 16, 40)
"""Neighbors that tell a normal: few where points are sparse, many where they are noisy."""

TURNED, ACROSS = 0.15, 0.2
"""Sine of the angle between two normals that tell an axis, at least, and cosine between an axis and normals."""

TRIED, PAIRED = 64, 24
"""Points whose normals tell axes, and points of which each pair tells a circle, at most."""

FLAT = 100.0
"""Radius over that of a neighborhood from which it is flat: its cylinder would be looked for in the whole cloud."""


class Fitting(NamedTuple):
    """How many points are on a circle, the way to its center, its axis and radius."""

    support: float
    center: Array
    axis: Array
    radius: float


def noise_at(tree: cKDTree, place: Array) -> float:
    """Return the noise of the points about a place."""
    points, ranks = np.asarray(tree.data), np.arange(1, min(2 * FEW, tree.n) + 1)
    near = points[tree.query(place, k=ranks)[1]]
    return float(np.median(from_quadrics(points[tree.query(near, k=ranks[:FEW])[1]]))) if tree.n > FEW else np.inf


def hypotheses(tree: cKDTree, place: Array, limits: tuple[float, float], noise: float) -> Iterator[Cylinder]:
    """Yield the cylinders through a place, of radii within limits, that most of ever more of its neighbors are on."""
    points = np.asarray(tree.data)
    near = points[tree.query(place, k=[*range(1, min(SIZES[-1], tree.n) + 1)])[1]]
    around = tree.query(near, k=[*range(1, min(NORMALS[-1], tree.n) + 1)])[1]
    normals = [fitted(points, around[:, :count])[0] for count in NORMALS]
    for size in SIZES:
        axes = [(each[:size], axis_of(each[:size])) for each in normals]
        found = [circle_of(near[:size] - place, ways, axis, limits, noise) for ways, axis in axes if axis is not None]
        best = max(filter(None, found), key=lambda circle: circle.support, default=None)
        if best is not None:
            yield Cylinder(place + best.center, best.axis, best.radius)


def axis_of(normals: Array) -> Array | None:
    """Return the direction across the first of some normals and another one across which most of them are.

    Its largest coordinate is positive: which way a line runs does not hang on the pick.
    """
    axes = cross(normals[0], normals[1 :: -(-len(normals) // TRIED)])
    sines = norm(axes)
    axes = axes[sines > TURNED] / sines[sines > TURNED, None]
    if not len(axes):
        return None
    axis = axes[np.maximum(1 - (axes @ normals.T / ACROSS) ** 2, 0).sum(axis=1).argmax()]
    return np.asarray(axis * np.sign(axis[np.abs(axis).argmax()]))


def circle_of(away: Array, normals: Array, axis: Array, limits: tuple[float, float], noise: float) -> Fitting | None:
    """Return the circle about an axis through the first point, the origin, and two others that most of them are on."""
    frame, size = np.stack(tangents(axis)), float(norm(away[-1]))
    flat, facing = away @ frame.T, normals @ frame.T
    some = flat[1 :: -(-len(flat) // PAIRED)]
    first, second = (some[k] for k in np.triu_indices(len(some), 1))
    turned = dot(first, first)[:, None] * second - dot(second, second)[:, None] * first
    with np.errstate(divide="ignore", invalid="ignore"):
        centers = turned[:, ::-1] * [1, -1] / (2 * (first[:, :1] * second[:, 1:] - first[:, 1:] * second[:, :1]))
    seen = norm(centers)
    round_enough = (seen > 0) & (seen < FLAT * size)
    centers, seen = centers[round_enough], seen[round_enough]
    if not len(centers):
        return None
    radii = np.clip(seen, *limits)
    centers *= (radii / seen)[:, None]
    support = np.zeros(len(centers))
    band = WITHIN * max(noise, 1e-9 * size)
    _kernels_tracing.fill_supports(flat, facing, centers, radii, band, FACING, support)
    k = int(support.argmax())
    return Fitting(float(support[k]), centers[k] @ frame, axis, float(radii[k]))
