"""Contacts of a surface with itself across its inside: two films back to back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def contacts(
    vertices: Array, normals: Array, edges: Array, rows: NDArray[np.integer]
) -> tuple[NDArray[np.int64], Array]:
    """Return, for some vertices, the shallowest vertex (n,) within two `edges` (n,) behind it with an opposed normal.

    It is -1 for none and for other vertices; the second array (n,) is its depth, negative where the surface crosses
    itself.
    """
    meets, depth = np.full(len(vertices), -1), np.zeros(len(vertices))
    if not len(rows):
        return meets, depth
    length = edges[rows]
    behind = vertices[rows] - 0.8 * length[:, None] * normals[rows]
    near = cKDTree(vertices).query_ball_point(behind, 1.2 * length, workers=-1)
    counts = np.array([len(found) for found in near])
    mine = np.repeat(rows, counts)
    other = np.concatenate([np.asarray(found, np.int64) for found in near])
    offset = vertices[other] - vertices[mine]
    along = -np.einsum("ij,ij->i", offset, normals[mine])
    lateral = np.sqrt(np.maximum(np.einsum("ij,ij->i", offset, offset) - along**2, 0.0))
    opposed = np.einsum("ij,ij->i", normals[other], normals[mine]) < -0.3
    valid = np.flatnonzero(opposed & (along > -0.4 * edges[mine]) & (lateral < 0.9 * edges[mine]))
    valid = valid[np.lexsort((-other[valid], -along[valid]))]  # the shallowest is written last, of equals the first
    meets[mine[valid]], depth[mine[valid]] = other[valid], along[valid]
    return meets, depth
