"""Planes through the neighbors of points: normals of either sign, spacing and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

FEW, MANY = 16, 40
NOISY = 0.45


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


def spacing_of(points: Array, most: int = 5000) -> float:
    """Return the median distance between neighboring points, from at most so many of them."""
    some = points[:: max(1, len(points) // most)]
    count = min(FEW, len(points))
    distance = cKDTree(points).query(some, k=[count], workers=-1)[0]
    return float(np.median(distance)) * np.sqrt(np.pi / count)


def _fitted(points: Array, tree: cKDTree, count: int) -> Planes:
    distance, near = tree.query(points, k=count, workers=-1)
    local = points[near]
    local -= local.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local) / count)
    spacing = float(np.median(distance[:, -1])) * np.sqrt(np.pi / count)
    return Planes(vectors[:, :, 0], spacing, float(np.sqrt(max(0.0, np.median(values[:, 0])))))
