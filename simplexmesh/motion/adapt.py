"""Curvature-adapted metric parameters, which concentrate vertices where the surface bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.motion import _kernels_adapt

Array = NDArray[np.float64]

LOWEST, HIGHEST = 0.05, 0.833
"""Bounds of the metric parameters (thesis, section 5.5.1), which keep vertices off their neighbors."""

FLAT = 0.005
"""Turn of the normal along a mean edge, in radians, below which a surface is flat and curvature is rounding error."""


def curvedness(vertices: Array, normals: Array, neighbors: NDArray[np.int32], *, shortest: float = 0.0) -> Array:
    """Return a discrete curvedness at each vertex, which tends to sqrt((k1^2 + k2^2) / 2) under refinement.

    The root mean square over the three neighbors of the change of normal per edge length. Unlike |H| it does not vanish
    on minimal saddles, which adaptation to |H| would drain of vertices until the mesh spans them.

    Parameters
    ----------
    vertices, normals : (n, 3) array of float
    neighbors : (n, 3) array of int
    shortest : float
        Lower bound of the edge lengths: over tiny edges any noise is a large curvature.

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
    plain = *_contiguous(vertices, normals), _check.frozen(neighbors, np.int32)
    _kernels_adapt.curvedness(*plain, float(shortest), out)
    return out


def adapted_metric(metric: Array, curvature: Array, neighbors: NDArray[np.int32], *, strength: float) -> Array:
    """Return reference metric parameters moved half way towards those that favor neighbors of higher curvature.

    Each wanted parameter is ``1/3 + strength * dC_j`` with ``dC_j = (C_j - mean_k C_k) / C`` over the three
    neighbors, `strength` reduced where needed to keep all three within `LOWEST`..`HIGHEST` (Delingette 1994, 5.5.1,
    with C = |H|).
    C in the denominator is at least its mean over the mesh: on flat parts the thesis's ratio amplifies noise, and
    drained them of vertices until faces were several times longer than wide.

    Parameters
    ----------
    metric : (n, 3) array of float
        Present reference metric parameters; rows sum to 1.
    curvature : (n,) array of float
        Any curvature measure C, such as `curvedness` or |H|; its sign is ignored.
    neighbors : (n, 3) array of int
    strength : float
        0 spaces vertices evenly, 0.25 is strong.

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
    plain, size = _contiguous(metric, curvature)
    adapt_metric(plain, size, _check.frozen(neighbors, np.int32), strength, out)
    return out


def adapt_metric(
    metric: Array, curvature: Array, neighbors: NDArray[np.int32], strength: float, out: Array, *, least: float = 1e-300
) -> None:
    """Fill `out`, which must not be `metric`, as `adapted_metric` does; C in the denominator is at least `least`."""
    floor = max(float(np.abs(curvature).mean()), least)
    _kernels_adapt.adapted(metric, curvature, floor, neighbors, float(strength), LOWEST, HIGHEST, out)


def _contiguous(*arrays: Array) -> list[Array]:
    """Return fresh C-contiguous float64 arrays, the layout that kernels are compiled for."""
    return [np.array(array, dtype=np.float64, order="C") for array in arrays]
