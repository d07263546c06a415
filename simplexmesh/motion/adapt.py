"""Metric parameters that follow curvature: vertices gather where the surface bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.motion import _kernels_adapt

Array = NDArray[np.float64]

LOWEST, HIGHEST = 0.05, 0.833
"""Metric parameters stay in this range (thesis, section 5.5.1): no vertex lands on a neighbor."""

FLAT = 0.005
"""Radians that normals turn along a mean edge where nothing bends: less is rounding, which vertices must not follow."""


def curvedness(vertices: Array, normals: Array, neighbors: NDArray[np.int32], *, shortest: float = 0.0) -> Array:
    """Return how much the surface bends at each vertex, sqrt((k1^2 + k2^2) / 2) in the limit, from the turn of normals.

    The root mean square over the three neighbors of the normal's turn per length. Unlike |H| it does not vanish on
    saddles, which would otherwise be emptied of vertices and webbed over.

    Parameters
    ----------
    vertices, normals : (n, 3) array of float
    neighbors : (n, 3) array of int
    shortest : float
        Edges count as at least so long: over tiny ones any unevenness is a strong bend.

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
    out = np.zeros(len(vertices))
    plain = *_plain(vertices, normals), _check.frozen(neighbors, np.int32)
    _kernels_adapt.curvedness(*plain, float(shortest), out)
    return out


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
    out = np.zeros((len(metric), 3))
    plain, size = _plain(metric, curvature)
    adapt(plain, size, _check.frozen(neighbors, np.int32), strength, out)
    return out


def adapt(
    metric: Array, curvature: Array, neighbors: NDArray[np.int32], strength: float, out: Array, *, least: float = 1e-300
) -> None:
    """Do what `adapted_metric` does, into `out`, which is not `metric`; curvature below `least` counts as none."""
    floor = max(float(np.abs(curvature).mean()), least)
    _kernels_adapt.adapted(metric, curvature, floor, neighbors, float(strength), LOWEST, HIGHEST, out)


def _plain(*arrays: Array) -> list[Array]:
    """Return arrays as kernels were compiled for them: their own, of float64."""
    return [np.array(array, dtype=np.float64, order="C") for array in arrays]
