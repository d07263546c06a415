"""Fit a primitive to points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Mask
from simplexmesh._base.errors import warn
from simplexmesh.cloud.fitting import selection
from simplexmesh.cloud.fitting.candidates import Known
from simplexmesh.cloud.fitting.describe import described
from simplexmesh.cloud.fitting.inputs import KINDS, Given, checked, held, rows
from simplexmesh.cloud.fitting.refine import Cloud, cloud_of, deviation, fitted, is_thin, spread, without_outliers
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.fitting.starts import scaled
from simplexmesh.data.primitives import Primitive

MISFIT, ROUNDED = 2.0, 1e-3
"""Of the spread of points about a free fit, that about one with known values at which these are doubted; that which
rounded values have, in the least known length, but at most the size of the points."""


def fit_primitive(
    points: Any,
    kind: str,
    *,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    point: ArrayLike | None = None,
    tube_radius: float | None = None,
    half_angle: float | None = None,
    measures: Mapping[str, float] | None = None,
    start: Primitive | None = None,
    normals: ArrayLike | None = None,
    robust: bool = False,
    noise: float | None = None,
    weights: ArrayLike | None = None,
    rng: np.random.Generator | int = 0,
) -> Primitive:
    """Fit a plane, cylinder, beam, flange or other primitive to points, or the simplest surface that suits them.

    The sum of the squared distances is least; these are exact, not algebraic. Of several initial values, from normals,
    from directions all over the sphere and from simpler primitives, the best one is refined (Levenberg-Marquardt in
    local charts, so that no direction is singular).

    Parameters
    ----------
    points : (n, 3) array of float, PointCloud, or path
        At least as many different ones as the kind has parameters.
    kind : str
        "plane", "sphere", "cylinder", "cone", "torus", "line", "circle", "beam" (of I or H section), "flange", "flange
        pair", or "any": of the first five the one of the fewest parameters than which no other one is clearly better
        (by the Bayesian information criterion).
    radius : float, optional
        Known radius of a sphere, cylinder, circle or flange, or of the middle of the tube of a torus.
    axis : (3,) array of float, optional
        Known axis of a cylinder, cone or torus, direction of a line, or normal of a plane or circle.
    point : (3,) array of float, optional
        Known center of a sphere, torus or circle, apex of a cone, or a point of a plane, line or cylinder's axis.
    tube_radius : float, optional
        Known radius of the tube of a torus.
    half_angle : float, optional
        Known angle between the axis and the surface of a cone, in radians.
    measures : mapping of str to float, optional
        Known measures of a beam or flange by their names, `{"web_thickness": 0.008}`: those that no point tells.
    start : Primitive, optional
        One of the kind to start from instead.
    normals : (n, 3) array of float, optional
        Normals of the points, of either sign, for the initial values; otherwise the cloud's, or estimated ones.
    robust : bool
        Whether there may be outliers: the fit then starts from random subsets too, and uses the points that are within
        three deviations of their noise. Up to 30 % of outliers do no harm.
    noise : float, optional
        Known deviation of the points along normals, for the covariance and the validation.
    weights : (n,) array of float, optional
        Weights of the squared distances, at least 0: inverse variances, up to a factor.
    rng : Generator or int
        Draws the points of initial values.

    Returns
    -------
    Primitive
        Its `fit` has the rms distance, the deviation of the noise, the covariance of the parameters (0 of known ones),
        the extent of the points, how many were used and whether the distances are those of noise.

    Raises
    ------
    ValueError
        Points that do not determine the primitive: too few, all the same, on a line or in a plane.

    Warns
    -----
    SimplexMeshWarning
        A simpler kind suits the points as well: the parameters of the wanted one are hardly determined. Points are
        over twice as far away as without what is taken as known.

    References
    ----------
    T. Chaperon, *Segmentation de nuage de points 3D*, 2002, chapters 4 and 5.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> turn, along = np.random.default_rng(0).uniform([0, 0], [3, 8], (500, 2)).T
    >>> points = np.stack([2 * np.cos(turn), 2 * np.sin(turn), along], axis=1)
    >>> sm.fit_primitive(points, "any").kind, round(sm.fit_primitive(points, "cylinder").radius, 6)
    ('cylinder', 2.0)
    """
    known = {"axis": axis, "point": point, "radius": radius, "tube_radius": tube_radius, "half_angle": half_angle}
    known |= _measured(checks.choice("kind", kind, [*KINDS, "any"]), measures, known)
    given = checked(kind, known, start, rows(points, normals, weights), robust=robust, noise=noise, rng=rng)
    cloud = cloud_of(given)
    found = _chosen(cloud, given) if kind == "any" else _wanted(kind, cloud, given)
    mask = held(found.kind, given.known)
    used = np.ones(len(given.points), bool)
    if given.robust:
        found, used = without_outliers(found, cloud.points, mask)
    else:
        found = solve(found, cloud.points, weights=given.weights, fixed=mask)
    out = scaled(found, given.size, given.middle)
    return described(out, given, used, mask)


def _measured(kind: str, measures: Mapping[str, float] | None, known: Known) -> dict[str, float]:
    """Return known measures, each a length that the kind has and that no other argument gives."""
    if measures is not None and not isinstance(measures, Mapping):
        raise TypeError(f"measures must map names to lengths, not be a {checks.type_name(measures)}")
    out = dict(measures or {})
    names = KINDS[kind]._measures() if kind in KINDS else tuple(out)
    for name, value in out.items():
        if name not in names:
            told = f"; its measures are {', '.join(names)}" if names else ""
            raise ValueError(f"{name} must be left out: a {kind} has none{told}")
        if known.get(name) is not None:
            raise ValueError(f"{name} must be given once, as an argument or among measures")
        checks.number(name, value, 0.0, open_low=True)
    return out


def _wanted(kind: str, cloud: Cloud, given: Given) -> Primitive:
    """Return the primitive of a kind, near its place; warn if a simpler kind suits the points as well."""
    mask = held(kind, given.known)
    found = fitted(kind, cloud, mask, robust=given.robust, start=given.start)
    if found is None:
        flat = "these are as flat as can be seen"
        why = f"these, or {' and '.join(given.known)} as known, lead to none" if given.known else flat
        raise ValueError(f"points must determine a {kind}, but {why}")
    if mask is None:
        some = without_outliers(found, cloud.some, None)[1] if given.robust else np.ones(len(cloud.some), bool)
        _compare_with_simpler(found, cloud, some, robust=given.robust)
    else:
        _compare_with_free(found, cloud, given)
    return found


def _compare_with_free(found: Primitive, cloud: Cloud, given: Given) -> None:
    """Warn if points are much nearer to a primitive of other values than those taken as known."""
    free = fitted(found.kind, replace(cloud, known={}), None, robust=given.robust, start=None)
    if free is None or len(cloud.some) <= free.n_parameters:
        return
    near, far = (spread(each, cloud.some, robust=given.robust) for each in (free, found))
    lengths = [abs(value) for name, value in cloud.known.items() if np.ndim(value) == 0 and name != "half_angle"]
    if far <= max(MISFIT * near, ROUNDED * min([1.0, *lengths])):
        return
    if selection.score(free, cloud.some) < selection.score(found, cloud.some):
        held_to, nearest = " and ".join(given.known), scaled(free, given.size, given.middle)
        warn(f"with {held_to} as known the points are {far / near:.3g} times as far away as from {nearest}")


def _compare_with_simpler(found: Primitive, cloud: Cloud, some: Mask, *, robust: bool) -> None:
    """Warn if points do not tell a kind from a simpler one, or from a layer of noise."""
    points, kind = cloud.some[some], found.kind
    for name in selection.SIMPLER.get(kind, ()):
        other = fitted(name, cloud, None, robust=robust, start=None)
        if other is not None and selection.score(other, points) < selection.score(found, points) + selection.DECISIVE:
            warn(f"the points are as well on a {name}: the parameters of the {kind} are hardly determined")
            return
    if is_thin(found, points, spread(found, points, robust=False)):
        warn(f"the points are a layer about as thick as the {kind} is: its parameters are hardly determined")


def _chosen(cloud: Cloud, given: Given) -> Primitive:
    """Return the simplest surface that is as good as any."""
    kinds = selection.SURFACES[:1] if given.flat else selection.SURFACES
    tried = [fitted(kind, cloud, None, robust=given.robust, start=None) for kind in kinds]
    found = [each for each in tried if each is not None and len(cloud.some) > each.n_parameters]
    if not found:
        raise ValueError(f"points must be more than determine a plane, 3, to tell its kind, not {len(cloud.some)}")
    some = cloud.some
    if given.robust:
        best = min(found, key=lambda each: deviation(each, np.abs(each.distance(some))))
        some = some[without_outliers(best, some, None)[1]]
        found = [solve(each, some) for each in found]
    found = [each for each in found if not is_thin(each, some, spread(each, some, robust=False))]
    return selection.simplest(found, some)
