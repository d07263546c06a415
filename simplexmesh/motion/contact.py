"""Contacts of a surface with itself across its inside: two films back to back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

OPPOSITE = -0.3
"""Largest cosine between the normals of vertices that meet."""


def contacts(
    vertices: Array, normals: Array, edges: Array, rows: NDArray[np.integer]
) -> tuple[NDArray[np.int64], Array]:
    """Return, for each of some vertices, a vertex behind it with an opposed normal, and its depth.

    Parameters
    ----------
    vertices, normals : (n, 3) array of float
    edges : (n,) array of float
        Mean edge length at each vertex; the search depth is twice that.
    rows : (k,) array of int
        The vertices to test.

    Returns
    -------
    meets : (n,) array of int
        The shallowest such vertex, -1 for none or for vertices not tested.
    depth : (n,) array of float
        Its distance behind, along the normal; slightly negative where the surface intersects itself.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> pill = ball.moved(ball.vertices * [1, 1, 0.05])
    >>> edges = np.full(ball.n_vertices, 0.1)
    >>> bool((contacts(pill.vertices, pill.normals, edges, np.arange(ball.n_vertices))[0] >= 0).mean() > 0.9)
    True
    >>> bool((contacts(ball.vertices, ball.normals, edges, np.arange(ball.n_vertices))[0] >= 0).any())
    False
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
    opposed = np.einsum("ij,ij->i", normals[other], normals[mine]) < OPPOSITE
    valid = np.flatnonzero(opposed & (along > -0.4 * edges[mine]) & (lateral < 0.9 * edges[mine]))
    valid = valid[np.lexsort((-other[valid], -along[valid]))]  # the shallowest is written last, of equals the first
    meets[mine[valid]], depth[mine[valid]] = other[valid], along[valid]
    return meets, depth
