"""Circles fitted to points in space, and to the rim of a hole or boss (Charton 2014, 5.2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import warn
from simplexmesh._base.vectors import norm, tangents
from simplexmesh.numerics.circle_fits import circle_residuals, robust_circle, sampled_circle
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.fields import known_curvature
from simplexmesh.surface.sampled_surface import as_sampled_surface

LOOSE = 0.25
"""Points farther from a circle than this share of its radius, in root mean square, are no rim."""


@dataclass(frozen=True, eq=False, repr=False)
class Circle:
    """A circle in space, fitted to points.

    Attributes
    ----------
    center, normal : (3,) array of float
        Center, and unit normal; of a rim it points out of the surface.
    radius : float
        Radius, in the surface's unit of length.
    rms : float
        Root mean square distance of the points used to the circle.
    vertices : (m,) array of int
        Indices of the points used.
    covered : float
        Share of the circle that has points near, from 0 to 1: half a rim has 0.5.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn = np.linspace(0, 6, 50)
    >>> found = sm.fit_circle(np.stack([2 * np.cos(turn), 2 * np.sin(turn), 0 * turn + 5], axis=1))
    >>> bool(np.allclose(found.center, [0, 0, 5])), round(found.radius, 6)
    (True, 2.0)
    """

    center: Array
    normal: Array
    radius: float
    rms: float
    vertices: Indices
    covered: float

    def __repr__(self) -> str:
        return f"Circle(radius {self.radius:.6g}, rms {self.rms:.3g}, {self.covered:.0%} covered)"


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
    rms = size * float(np.sqrt(np.average(residual[used] ** 2, weights=weight[used])))
    covered = _covered(unit[used], center, normal)
    frozen = checks.frozen
    return Circle(frozen(middle + size * center), frozen(normal), size * radius, rms, frozen(used), covered)


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
    found = fit_circle(samples.points[near], weights=np.minimum(k1, top) - least + 1e-3 * top)
    if found.rms > LOOSE * found.radius or found.radius > radius:
        warn(
            f"the {len(near):,} sharp points within {radius:g} of the pick are not on a circle there: "
            f"the best has radius {found.radius:.4g}, and they are {found.rms:.4g} from it"
        )
    used = near[found.vertices]
    outward = known.normals[used].mean(axis=0)
    normal = found.normal if found.normal @ outward >= 0 else -found.normal
    return Circle(found.center, checks.frozen(normal), found.radius, found.rms, checks.frozen(used), found.covered)


def _covered(at: Array, center: Array, normal: Array) -> float:
    """Return the share of the circle that has points near; gaps of three median gaps or ten degrees are covered."""
    u, v = tangents(normal)
    turn = np.sort(np.arctan2((at - center) @ v, (at - center) @ u))
    arcs = np.diff(turn, append=turn[0] + 2 * np.pi)
    gap = np.radians(10)
    counted = np.where(arcs <= max(3 * float(np.median(arcs)), gap), arcs, gap)
    return min(float(counted.sum()) / (2 * np.pi), 1.0)
