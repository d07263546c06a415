"""Normals of bare points: planes through neighbors, all turned the same way by the indicator they bring about."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from simplexmesh._vec import dot
from simplexmesh.motion.initial.flood import Flood, flooded
from simplexmesh.motion.initial.indicator import Indicator, areas, frame_for, solved

Array = NDArray[np.float64]

GRIDS = (16, 24, 32, 48, 64, 96, 128, 192, 256)
FEW, MANY = 16, 40
NOISY = 0.45
_FINEST = 0.6
_TURNED = 1e-3


@dataclass(frozen=True, eq=False)
class Planes:
    """Planes through the neighbors of each point.

    Attributes
    ----------
    normals : (n, 3) array of float
        Of either sign.
    spacing : float
        Median distance between neighboring points, the side of the square that each point stands for.
    noise : float
        Median distance of points to the planes of their neighbors.
    """

    normals: Array
    spacing: float
    noise: float


def planes(points: Array, neighbors: int | None = None) -> Planes:
    """Return the planes through the nearest neighbors of each point: 16, or 40 where the points are a thick layer."""
    tree = cKDTree(points)
    out = _fitted(points, tree, neighbors or min(FEW, len(points)))
    if neighbors is None and out.noise > NOISY * out.spacing and len(points) > 2 * MANY:
        out = _fitted(points, tree, MANY)
    return out


def _fitted(points: Array, tree: cKDTree, count: int) -> Planes:
    distance, near = tree.query(points, k=count, workers=-1)
    local = points[near]
    local -= local.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local) / count)
    spacing = float(np.median(distance[:, -1])) * np.sqrt(np.pi / count)
    return Planes(vectors[:, :, 0], spacing, float(np.sqrt(max(0.0, np.median(values[:, 0])))))


def best_flood(points: Array, spacing: float) -> Flood:
    """Return the flood that encloses the largest volume: the finest of a series of grids that does not leak.

    Finer walls are thinner and leave more inside, until they leak and leave nothing.
    """
    longest = float(np.ptp(points, axis=0).max())
    best = flooded(points, longest / GRIDS[0])
    for cells in GRIDS[1:]:
        if longest / cells < _FINEST * spacing:
            break
        flood = flooded(points, longest / cells)
        if flood.hollow > best.hollow:
            best = flood
    return best


def turned(points: Array, found: Planes, flood: Flood, cell: float) -> tuple[Array, Indicator]:
    """Return the normals of the planes turned outwards, and the indicator of the body that they bound.

    The flood says first which way is out. From then on the indicator of the normals does, solved anew until hardly
    any normal turns: first on cells of twice the side, then on the cells asked for.

    References
    ----------
    F. Hou, C. Wang, W. Wang, H. Qin, C. Qian, Y. He, Iterative Poisson surface reconstruction for unoriented points,
    ACM Trans. Graph. 41, 2022 (there from random normals).
    """
    smooth = ndimage.gaussian_filter(np.where(flood.outside, np.float32(-0.5), np.float32(0.5)), 1.5)
    normals = _facing(found.normals, Indicator(flood.frame, smooth).at(points)[1])
    for side, most in ((2 * cell, 4), (cell, 8)):
        frame = frame_for(points, side)
        weight = areas(points, frame)
        for _ in range(most):
            indicator = solved(points, normals, frame, weight)
            again = _facing(normals, indicator.at(points)[1])
            changed = np.count_nonzero(dot(again, normals) < 0)
            normals = again
            if changed < _TURNED * len(points):
                break
    return normals, indicator


def _facing(normals: Array, gradients: Array) -> Array:
    """Return the normals turned to point where the indicator falls."""
    return np.where(dot(normals, gradients)[:, None] > 0, -normals, normals)
