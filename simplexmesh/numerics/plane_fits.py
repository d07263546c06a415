"""Local plane fits to points: unoriented normals, spacing and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.numerics import _kernels_local_fits, scan_lines
from simplexmesh.numerics.scan_lines import Even

FEW_NEIGHBORS, MANY_NEIGHBORS = 16, 40
NOISE_RATIO = 0.45

SAME_SIDE = 0.5
"""Least cosine between the normals of neighbors on one side: the other side of a thin wall, or of an edge, is not."""


@dataclass(frozen=True, eq=False)
class Planes:
    """Least-squares planes through the nearest neighbors of each point."""

    normals: Array  # (n, 3) unit normals of either sign
    places: Array  # (n, 3) the points, projected onto their planes
    spacing: float  # median distance between neighboring points: the side of the square each represents
    noise: float  # median root mean square distance of the neighbors to their plane
    near: Indices  # (n, k) the nearest neighbors of each point, itself first


def planes(points: Array) -> Planes:
    """Return the planes through the nearest neighbors of each point: 16, or 40 if the noise exceeds 0.45 spacings."""
    even = scan_lines.even(cKDTree(points))
    some = _fit_some(even)
    return some if len(some.normals) == len(points) else _fit(even, np.arange(len(points)), some.near.shape[1])


def subsampled(points: Array) -> Array:
    """Return every, every second, fourth ... of the points, such that they are as far apart as their noise or more.

    Neighbors nearer than that lie about a point in all directions, and tell no plane.
    """
    while True:
        some = _fit_some(scan_lines.even(cKDTree(points)))
        if some.noise <= some.spacing or some.near.shape[1] < MANY_NEIGHBORS:
            return points
        points = points[::2]


def spacing_of(tree: cKDTree) -> float:
    """Estimate the median distance between neighboring points of a tree from some."""
    count = min(FEW_NEIGHBORS, tree.n)
    distance = tree.query(tree.data[_some(tree.n)], k=[count], workers=-1)[0]
    return spacing_within(distance, count)


def _fit_some(even: Even) -> Planes:
    """Return planes at some of the points, through as many neighbors as their noise asks for."""
    places = _some(len(even.points))
    some = _fit(even, places, min(FEW_NEIGHBORS, len(even.rows)))
    if some.noise > NOISE_RATIO * some.spacing and len(even.rows) > 2 * MANY_NEIGHBORS:
        return _fit(even, places, MANY_NEIGHBORS)
    return some


def _some(count: int) -> Indices:
    """Return the numbers of 5,000 to twice as many of so many points, or of all if they are fewer."""
    return np.arange(0, count, max(1, count // 5000))


def fitted(points: Array, near: Indices) -> tuple[Array, Array, Array]:
    """Return normals (m, 3), mean squared distances (m,) and projections (m, 3) of planes through neighbors (m, k)."""
    out = np.empty((len(near), 3)), np.empty(len(near)), np.empty((len(near), 3))
    _kernels_local_fits.fit_planes(len(near), np.ascontiguousarray(points), np.ascontiguousarray(near), *out)
    return out


def spacing_within(farthest: Array, count: int) -> float:
    """Return the spacing of points from the distances within which they have `count` neighbors, themselves included."""
    return float(np.median(farthest)) * np.sqrt(np.pi / count)


def sided(points: Array, normals: Array, near: Indices) -> Array:
    """Return normals (n, 3) of planes through those of the nearest neighbors on the side that rough unit ones tell."""
    out = np.empty_like(normals)
    _kernels_local_fits.fit_sides(len(near), np.ascontiguousarray(points), near, normals, SAME_SIDE, out)
    return out


def _fit(even: Even, places: Indices, count: int) -> Planes:
    distance, near = even.near(places, count)
    normals, variance, projected = fitted(even.points, near)
    noise = float(np.sqrt(np.median(variance)))
    return Planes(normals, projected, spacing_within(distance[:, -1], count), noise, near)
