"""Circles fitted to points in space, and to the rim of a hole or boss (Charton 2014, 5.2.3)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.checks import frozen
from simplexmesh._base.errors import warn
from simplexmesh._base.vectors import norm
from simplexmesh.data.points import warn_of_steps
from simplexmesh.data.primitives import Circle, fit_of
from simplexmesh.numerics.circle_fits import circle_residuals, robust_circle, sampled_circle
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.fields import known_curvature
from simplexmesh.surface.sampled_surface import as_sampled_surface

LOOSE = 0.25
"""Points farther from a circle than this share of its radius, in root mean square, are no rim."""


def fit_circle(points: ArrayLike, *, weights: ArrayLike | None = None) -> Circle:
    """Fit a circle to points in space, robustly to outliers.

    The best of a sample of circles through three points, by the median distance, is refined by Gauss-Newton iterations
    with Geman-McClure weights, at the scale of twice the robust standard deviation of the distances.

    Parameters
    ----------
    points : (n, 3) array of float
        At least three, not on a line.
    weights : (n,) array of float, optional
        Weights, at least 0.

    Returns
    -------
    Circle
        With its `rms`, `covariance`, the points used (`vertices`) and the share of it that they cover (`covered`).

    Raises
    ------
    ValueError
        Fewer than three points of positive weight, all on a line, or coordinates for which areas overflow or underflow.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.fit_circle([[1, 0, 0], [0, 1, 0], [-1, 0, 0]]).radius
    1.0
    """
    at = checks.array("points", points, (None, 3))
    if len(at) < 3:
        raise ValueError(f"points must be at least 3, not {len(at)}")
    checks.size("points", np.stack([at.min(axis=0), at.max(axis=0)]))
    warn_of_steps(at)
    weight = np.ones(len(at)) if weights is None else checks.array("weights", weights, (len(at),))
    if (weight < 0).any():
        raise ValueError(f"weights must be at least 0, not {weight.min():g}")
    if (positive := int(np.count_nonzero(weight))) < 3:
        raise ValueError(f"weights must be above 0 for at least 3 points, not {positive}")
    middle = at.mean(axis=0)
    size = float(norm(at - middle).max())
    unit = (at - middle) / (size or 1.0)  # lengths must be comparable with angles, which are fitted with them
    start = sampled_circle(unit, weight)
    if start is None:
        raise ValueError("points must not lie on one line")
    center, normal, radius, spread = robust_circle(unit, weight, *start)
    residual = norm(circle_residuals(unit, center, normal, radius)[0])
    used = np.flatnonzero((residual <= 3 * spread) & (weight > 0))
    return _described(Circle(middle + size * center, normal, size * radius), at[used], weight[used], used)


def rim_circle(
    surface: Any, pick: ArrayLike, *, radius: float, curvature: Curvature | None = None, sharpness: float = 0.5
) -> Circle:
    """Fit a circle to the points of highest curvature around a pick: the rim of a hole, a foramen, a boss.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
    pick : int or (3,) array of float
        A vertex, or a point near the middle of the hole, where there need be no surface.
    radius : float
        Largest distance of the rim from the pick, in the surface's unit of length.
    curvature : Curvature, optional
        Curvature of the surface, if known; otherwise it is measured.
    sharpness : float
        Least k1 of the points used, as a share of its 95th percentile in the ball; their weights increase with k1.

    Returns
    -------
    Circle
        Its `vertices` are indices of the surface's.

    Raises
    ------
    ValueError
        Fewer than six sharp points near the pick, or all on a line.

    Warns
    -----
    SimplexMeshWarning
        The sharp points near the pick are not on a circle there: another pick or `radius` is needed.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> sheet = sm.plane(70, 60, size=(2.0, 2.0)).triangulated("dual")
    >>> away = np.hypot(sheet.vertices[:, 0] - 0.1, sheet.vertices[:, 1])
    >>> dip = np.where(away[:, None] < 0.4, 0.3 * (0.4 - away[:, None]) * [[0, 0, -1.0]], 0)
    >>> funnel = sm.TriangleMesh(sheet.vertices + dip, sheet.faces)
    >>> curved = sm.curvature(funnel, "sine", neighborhood=sm.rings(2))
    >>> found = sm.rim_circle(funnel, [0.05, 0, 0], radius=0.6, curvature=curved)
    >>> bool(np.allclose(found.center[:2], [0.1, 0], atol=0.01)), round(found.radius, 1)
    (True, 0.4)
    """
    samples = as_sampled_surface(surface)
    radius = checks.number("radius", radius, 0.0, open_low=True)
    share = checks.number("sharpness", sharpness, 0.0, 1.0)
    if np.ndim(pick) == 0:
        point = samples.points[checks.indices("pick", np.atleast_1d(pick), (1,), len(samples.points))[0]]
    else:
        point = checks.array("pick", pick, (3,))
    known = known_curvature(samples, curvature)
    near = np.sort(np.asarray(samples.tree.query_ball_point(point, radius), np.int64))
    near = near[~known.failed[near]]
    k1 = np.maximum(known.k1[near], 0.0)
    least = share * float(np.percentile(k1, 95)) if len(k1) else 0.0
    sharp = k1 > least
    if sharp.sum() < 6:
        raise ValueError(f"pick must have at least 6 sharp points within {radius:g}, it has {int(sharp.sum())}")
    near, k1 = near[sharp], k1[sharp]
    top = float(np.percentile(k1, 95))
    weights = np.minimum(k1, top) - least + 1e-3 * top
    found = fit_circle(samples.points[near], weights=weights)
    if found.rms > LOOSE * found.radius or found.radius > radius:
        warn(
            f"the {len(near):,} sharp points within {radius:g} of the pick are not on a circle there: "
            f"the best has radius {found.radius:.4g}, and they are {found.rms:.4g} from it"
        )
    kept = found.vertices
    outward = known.normals[near[kept]].mean(axis=0)
    facing = found if found.normal @ outward >= 0 else Circle(found.center, -found.normal, found.radius)
    return _described(facing, samples.points[near[kept]], weights[kept], near[kept])


def _described(circle: Circle, points: Array, weights: Array, vertices: Indices) -> Circle:
    """Return a circle with how it fits the points (m, 3) that are used."""
    return circle.with_fit(fit_of(circle, points, weights=weights / weights.mean(), vertices=frozen(vertices)))
