"""What extraction looks at: some points of the cloud about the origin and of unit size, their neighbors and normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.numerics import scan_lines
from simplexmesh.numerics.plane_fits import fitted, spacing_within

MOST = 100_000
"""Points that shapes are looked for in; all points are labeled in the end."""

NEIGHBORS = 16
"""Of each point, itself the first: over them shapes grow, and their plane is that of its normal."""

FINE = 0.1
"""Noise in distances between points below which half as many neighbors tell a normal."""

SAMPLED = 3000
"""Points whose surroundings tell the noise."""

FEW = 12
"""Neighbors that a quadric is fitted to, to tell whether there is any noise: twice its coefficients."""

EXACT, EXACT_PLACES = 0.1, 0.25
"""If in a share of places, the second, the deviation is less than this share of the usual one, there is no noise."""

FLOOR = 1e-2
"""Least noise in distances between points: what is below is the bend of the surface between them."""

ON_SURFACE = 0.03
"""Share of the points that have others beside their line, at least."""

FLAT = 0.12
"""Of the mean squared distance of neighbors, their variance from a plane: above they are no surface, but a volume."""


class Graph(NamedTuple):
    """Points, normals and neighbors as a tree has them, so that what is close in space is so in memory."""

    points: Array
    normals: Array
    near: NDArray[np.int32]
    rows: Indices  # (n,) of each among the points
    places: NDArray[np.int32]  # (n,) of each point here


@dataclass(frozen=True, eq=False)
class Working:
    """Points (n, 3) of unit size, neighbors (n, k), normals (n, 3), what is smooth, deviations from planes.

    `beside` (n, k) are those neighbors that have the point among theirs, as points do that are as close to each other
    as to others, and -1: a stray beyond the end of a pipe is beside none of it. `reach` (n,) is how far neighbors are.
    They are fine if noise is so small that few points tell a normal, and half as many a primitive.
    """

    points: Array
    near: Indices
    graph: Graph
    beside: Indices
    reach: Array
    normals: Array
    smooth: Mask
    rough: Array
    spacing: float
    noise: float
    fine: bool


def working(points: Array, noise: float | None, rng: np.random.Generator) -> Working:
    """Return what is looked at of points of unit size."""
    if len(points) > MOST:
        points = points[np.sort(rng.choice(len(points), MOST, replace=False))]
    steps = scan_lines.steps(cKDTree(points))
    if (steps > 0).mean() < ON_SURFACE:
        raise ValueError("cloud must be of surfaces, but its points are on a curve")
    points = points[scan_lines.thinned(points, steps)]
    tree = cKDTree(points)
    count = min(NEIGHBORS, len(points))
    rows, distance, near = tree.indices, np.empty((len(points), count)), np.empty((len(points), count), np.int64)
    distance[rows], near[rows] = tree.query(points[rows], k=count, workers=-1)
    spacing = spacing_within(distance[:, -1], count)
    deviation = noise if noise is not None else max(measured_noise(points, tree, rng), FLOOR * spacing)
    fine = deviation < FINE * spacing
    wide = near[:, : NEIGHBORS // 2] if fine else near
    normals, variance, _ = fitted(points, wide)
    spread = np.mean(distance[:, : wide.shape[1]] ** 2, axis=1)
    smooth = variance <= FLAT * spread
    reach = distance[:, -1]
    beside = np.where(distance <= reach[near], near, -1)
    places = np.argsort(rows).astype(np.int32)
    graph = Graph(points[rows], normals[rows], places[near[rows]], rows, places)
    return Working(points, near, graph, beside, reach, normals, smooth, np.sqrt(variance), spacing, deviation, fine)


def measured_noise(points: Array, tree: cKDTree, rng: np.random.Generator) -> float:
    """Return the most frequent deviation of neighbors from a quadric: that of smooth places.

    If it is next to nothing in many of the smallest places, points are exact, and what is seen in others is no noise.
    """
    some = points if len(points) <= SAMPLED else points[rng.choice(len(points), SAMPLED, replace=False)]
    fewest, most = (tree.query(some, k=min(count, len(points)), workers=-1)[1] for count in (FEW, 2 * NEIGHBORS))
    many = from_quadrics(points[most])
    least = float(np.quantile(from_quadrics(points[fewest]), EXACT_PLACES))
    usual = frequent(many)
    return least if least < EXACT * usual else usual


def from_quadrics(near: Array) -> Array:
    """Return the deviation (m,) of points near places (m, k, 3) from a quadric through them."""
    apart = near - near.mean(axis=1, keepdims=True)
    frames = np.linalg.eigh(apart.transpose(0, 2, 1) @ apart)[1]
    z, x, y = np.moveaxis(apart @ frames, 2, 0)
    size = np.maximum(np.hypot(x, y).max(axis=1, keepdims=True), 1e-300)
    x, y = x / size, y / size
    rows = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2)
    square = rows.transpose(0, 2, 1) @ rows + 1e-9 * np.eye(6)
    fitted = np.linalg.solve(square, rows.transpose(0, 2, 1) @ z[..., None])
    off = z - (rows @ fitted)[..., 0]
    return np.sqrt((off**2).sum(axis=1) / (near.shape[1] - 6))


def frequent(values: Array) -> float:
    """Return the most frequent of positive values, by halving to the densest half of their logarithms."""
    logs = np.sort(np.log(np.maximum(values, 1e-300)))
    while len(logs) > 8:
        half = (len(logs) + 1) // 2
        start = int(np.argmin(logs[half - 1 :] - logs[: len(logs) - half + 1]))
        logs = logs[start : start + half]
    return float(np.exp(logs.mean()))
