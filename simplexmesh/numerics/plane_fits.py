"""Local plane fits to points: unoriented normals, spacing and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

FEW_NEIGHBORS, MANY_NEIGHBORS = 16, 40
NOISE_RATIO = 0.45


@dataclass(frozen=True, eq=False)
class Planes:
    """Least-squares planes through the nearest neighbors of each point."""

    normals: Array  # (n, 3) unit normals of either sign
    spacing: float  # median distance between neighboring points: the side of the square each represents
    noise: float  # median root mean square distance of the neighbors to their plane


def planes(points: Array, neighbors: int | None = None) -> Planes:
    """Return the planes through the nearest neighbors of each point: 16, or 40 if the noise exceeds 0.45 spacings."""
    tree = cKDTree(points)
    out = _fit(points, tree, neighbors or min(FEW_NEIGHBORS, len(points)))
    if neighbors is None and out.noise > NOISE_RATIO * out.spacing and len(points) > 2 * MANY_NEIGHBORS:
        out = _fit(points, tree, MANY_NEIGHBORS)
    return out


def spacing_of(points: Array, most: int = 5000) -> float:
    """Estimate the median distance between neighboring points from a subset of `most` to twice as many."""
    some = points[:: max(1, len(points) // most)]
    count = min(FEW_NEIGHBORS, len(points))
    distance = cKDTree(points).query(some, k=[count], workers=-1)[0]
    return float(np.median(distance)) * np.sqrt(np.pi / count)


def _fit(points: Array, tree: cKDTree, count: int) -> Planes:
    distance, near = tree.query(points, k=count, workers=-1)
    local = points[near]
    local -= local.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local) / count)
    spacing = float(np.median(distance[:, -1])) * np.sqrt(np.pi / count)
    return Planes(vectors[:, :, 0], spacing, float(np.sqrt(max(0.0, np.median(values[:, 0])))))
