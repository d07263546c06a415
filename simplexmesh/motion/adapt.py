"""Metric parameters that follow curvature: vertices gather where the surface bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import dot

Array = NDArray[np.float64]

LOWEST, HIGHEST = 0.05, 0.833
"""Metric parameters stay in this range (thesis, section 5.5.1): no vertex lands on a neighbor."""


def curvedness(vertices: Array, normals: Array, neighbors: NDArray[np.int32]) -> Array:
    """Return how much the surface bends at each vertex, sqrt((k1^2 + k2^2) / 2) in the limit, from the turn of normals.

    The root mean square over the three neighbors of the normal's turn per length. Unlike |H| it does not vanish on
    saddles, which would otherwise be emptied of vertices and webbed over.

    Parameters
    ----------
    vertices, normals : (n, 3) array of float
    neighbors : (n, 3) array of int

    Returns
    -------
    (n,) array of float
        In 1 / unit of `vertices`; 1/R on a sphere.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(5, radius=2.0)
    >>> curvedness(ball.vertices, ball.normals, ball.neighbors).mean().round(2)
    np.float64(0.5)
    """
    total = np.zeros(len(vertices))
    for j in range(3):
        other = neighbors[:, j]
        turn = normals[other] - normals
        edge = vertices[other] - vertices
        length2 = dot(edge, edge)
        total += np.divide(dot(turn, turn), length2, out=np.zeros_like(total), where=length2 > 0)
    return np.sqrt(total / 3)


def adapted_metric(metric: Array, curvature: Array, neighbors: NDArray[np.int32], *, strength: float) -> Array:
    """Return reference metric parameters drawn half way towards the neighbors of higher curvature.

    Each wanted parameter is ``1/3 + strength * dC_j`` with ``dC_j = (C_j - mean_k C_k) / C`` over the three
    neighbors, `strength` reduced where needed to keep all three within `LOWEST`..`HIGHEST` (Delingette 1994, 5.5.1,
    with C = |H|).
    Where C is below its mean over the mesh the mean divides instead: on flat parts the thesis's ratio measures noise,
    and drew vertices out of them until faces were several times longer than wide.

    Parameters
    ----------
    metric : (n, 3) array of float
        Reference metric parameters now; rows sum to 1.
    curvature : (n,) array of float
        Any measure C of bending, such as `curvedness` or |H|; its sign does not matter.
    neighbors : (n, 3) array of int
    strength : float
        0 leaves evenly spaced vertices, 0.25 is strong.

    Returns
    -------
    (n, 3) array of float

    Examples
    --------
    >>> even = np.full((4, 3), 1 / 3)
    >>> tetrahedron = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    >>> adapted_metric(even, np.array([1.0, 1.0, 1.0, 4.0]), tetrahedron, strength=0.1)[0].round(3)
    array([0.305, 0.305, 0.39 ])
    """
    size = np.abs(curvature)
    floor = max(float(size.mean()), 1e-300)
    around = size[neighbors]
    contrast = around - around.mean(axis=1, keepdims=True)
    contrast /= np.maximum(size, floor)[:, None]
    with np.errstate(divide="ignore"):  # an even neighborhood has no contrast, hence no limit
        up = (HIGHEST - 1 / 3) / contrast.max(axis=1)
        down = (LOWEST - 1 / 3) / contrast.min(axis=1)
    limited = np.minimum(strength, np.minimum(up, np.where(down > 0, down, np.inf)))[:, None] * contrast
    return metric + 0.5 * (1 / 3 + limited - metric)
