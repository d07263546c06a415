"""Circles of high curvature: the rim of a hole or of a boss, its center, radius and axis (Charton 2014, 5.2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import cross, norm
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.fields import known_curvature
from simplexmesh.surface.samples import as_samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TRIALS = 300
MOST = 2000
"""Of more points so many, drawn by their weights, say which of the circles tried is the best."""

ROUNDS = 60
EXACT = 1e-9
"""Distances to the circle below this, in units of how far the points reach, are none."""

SHARP = 0.5
"""A rim's points bend by at least this share of what the sharpest near the pick do (their 95th percentile)."""

FEWEST = 6

WHOLE, NEAR = 3.0, np.radians(10)
"""What counts of the arcs between points; see `_covered`."""


@dataclass(frozen=True, eq=False, repr=False)
class Circle:
    """A circle in space, and what it was fitted to.

    Attributes
    ----------
    center, normal : (3,) array of float
        The normal is a unit vector; of a rim it points out of the surface.
    radius : float
        In the surface's unit of length.
    rms : float
        Root mean square distance of the points used to the circle.
    vertices : (m,) array of int
        The points used.
    covered : float
        Which share of the circle has points near, from 0 to 1: half a rim has 0.5.

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
    """Return the circle nearest to points in space, strays left out.

    Circles through three of the points are tried first; that which most lie on is then fitted by Gauss and Newton's
    method with Geman and McClure's weights, at twice the spread of the distances.

    Parameters
    ----------
    points : (n, 3) array of float
        At least three, not on a line.
    weights : (n,) array of float, optional
        How much each counts, at least 0.

    Returns
    -------
    Circle

    Raises
    ------
    ValueError
        Fewer than three points, or all on a line, or of a size beyond what areas can be multiplied in.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.fit_circle([[1, 0, 0], [0, 1, 0], [-1, 0, 0]]).radius
    1.0
    """
    at = _check.array("points", points, (None, 3))
    if len(at) < 3:
        raise ValueError(f"points must be at least 3, not {len(at)}")
    _check.size("points", np.stack([at.min(axis=0), at.max(axis=0)]))
    trust = np.ones(len(at)) if weights is None else _check.array("weights", weights, (len(at),))
    if (trust < 0).any() or not trust.any():
        raise ValueError("weights must be at least 0, and some above")
    middle = at.mean(axis=0)
    size = float(norm(at - middle).max())
    unit = (at - middle) / (size or 1.0)  # lengths and angles are fitted together, so lengths must be about one
    start = _tried(unit, trust)
    if start is None:
        raise ValueError("points must not lie on one line")
    center, normal, radius, spread = _settled(unit, trust, *start)
    lack = norm(_residuals(unit, center, normal, radius)[0])
    used = np.flatnonzero((lack <= 3 * spread) & (trust > 0))
    rms = size * float(np.sqrt(np.average(lack[used] ** 2, weights=trust[used])))
    covered = _covered(unit[used], center, normal)
    frozen = _check.frozen
    return Circle(frozen(middle + size * center), frozen(normal), size * radius, rms, frozen(used), covered)


def rim_circle(
    surface: Any, pick: ArrayLike, *, radius: float, curvature: Curvature | None = None, sharpness: float = SHARP
) -> Circle:
    """Return the circle through the points of highest curvature around a pick: the rim of a hole, a foramen, a boss.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What the rim is on.
    pick : int or (3,) array of float
        A vertex, or a point near the middle of the hole, where there need be no surface.
    radius : float
        How far from the pick the rim may be, in the surface's unit of length.
    curvature : Curvature, optional
        Of the surface, when already known; otherwise it is measured.
    sharpness : float
        Points count that bend outward (k1) by this share of what the sharpest 5 % in the ball do, more the more they
        bend.

    Returns
    -------
    Circle
        Its `vertices` are those of the surface.

    Raises
    ------
    ValueError
        Fewer than six sharp points near the pick, or all on a line.

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
    samples = as_samples(surface)
    radius = _check.number("radius", radius, 0.0, open_low=True)
    share = _check.number("sharpness", sharpness, 0.0, 1.0)
    if np.ndim(pick) == 0:
        point = samples.points[_check.indices("pick", np.atleast_1d(pick), (1,), len(samples.points))[0]]
    else:
        point = _check.array("pick", pick, (3,))
    known = known_curvature(samples, curvature)
    near = np.sort(np.asarray(samples.tree.query_ball_point(point, radius), np.int64))
    near = near[~known.failed[near]]
    bend = np.maximum(known.k1[near], 0.0)
    least = share * float(np.percentile(bend, 95)) if len(bend) else 0.0
    sharp = bend > least
    if sharp.sum() < FEWEST:
        raise ValueError(f"pick must have at least {FEWEST} sharp points within {radius:g}, it has {int(sharp.sum())}")
    near, bend = near[sharp], bend[sharp]
    top = float(np.percentile(bend, 95))
    found = fit_circle(samples.points[near], weights=np.minimum(bend, top) - least + 1e-3 * top)
    used = near[found.vertices]
    outward = known.normals[used].mean(axis=0)
    normal = found.normal if found.normal @ outward >= 0 else -found.normal
    return Circle(found.center, _check.frozen(normal), found.radius, found.rms, _check.frozen(used), found.covered)


def _frame(normal: Array) -> tuple[Array, Array]:
    helper = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(normal, helper)
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def _residuals(at: Array, center: Array, normal: Array, radius: float) -> tuple[Array, Array]:
    """Return (n, 2) distances to the circle, along its plane and along its axis, and their (n, 2, 6) derivatives."""
    u, v = _frame(normal)
    arm = at - center
    height = arm @ normal
    flat = arm - height[:, None] * normal
    length = np.maximum(norm(flat), 1e-300)
    out = flat / length[:, None]
    rows = np.zeros((len(at), 2, 6))
    rows[:, 0, :3], rows[:, 0, 5] = -out, -1.0
    rows[:, 0, 3], rows[:, 0, 4] = -height * (out @ u), -height * (out @ v)
    rows[:, 1, :3] = -normal
    rows[:, 1, 3], rows[:, 1, 4] = arm @ u, arm @ v
    return np.stack([length - radius, height], axis=1), rows


def _settled(at: Array, trust: Array, center: Array, normal: Array, radius: float) -> tuple[Array, Array, float, float]:
    """Return the circle that steps of Gauss and Newton lead to, and the spread of the distances to it."""
    spread = EXACT
    for _ in range(ROUNDS):
        lack, rows = _residuals(at, center, normal, radius)
        spread = max(2 * 1.4826 * float(np.median(norm(lack))), EXACT)
        w = np.repeat(trust / (1 + (norm(lack) / spread) ** 2) ** 2, 2)
        flat = rows.reshape(-1, 6)
        x = -np.linalg.pinv((flat * w[:, None]).T @ flat, rcond=1e-12, hermitian=True) @ (flat.T @ (w * lack.ravel()))
        u, v = _frame(normal)
        center, radius = center + x[:3], abs(radius + float(x[5]))
        normal = normal + x[3] * u + x[4] * v
        normal = normal / np.linalg.norm(normal)
        if np.linalg.norm(x) < 1e-12:
            break
    return center, normal, radius, spread


def _tried(at: Array, trust: Array) -> tuple[Array, Array, float] | None:
    """Return the circle through three points that most points lie on, None where all triples are on lines."""
    rng = np.random.default_rng(0)
    if len(at) > MOST:
        at, trust = at[rng.choice(len(at), MOST, replace=False, p=_shares(trust))], np.ones(MOST)
    if len(at) == 3:
        triples = np.array([[0, 1, 2]])
    else:
        triples = np.stack([rng.choice(len(at), 3, replace=False, p=_shares(trust)) for _ in range(TRIALS)])
    a, b, c = (at[triples[:, k]] for k in range(3))
    across = cross(b - a, c - a)
    double = norm(across)
    sound = double > 1e-9
    if not sound.any():
        return None
    a, b, c, across, double = a[sound], b[sound], c[sound], across[sound], double[sound]
    normals = across / double[:, None]
    one, other = ((c - a) ** 2).sum(axis=1)[:, None], ((b - a) ** 2).sum(axis=1)[:, None]
    arms = (one * cross(across, b - a) + other * cross(c - a, across)) / (2 * double[:, None] ** 2)
    centers, radii = a + arms, norm(arms)
    # the least weighted median: half of the points, by weight, are nearer than that; none much larger than what is seen
    off = [
        _median(norm(_residuals(at, *circle)[0]), trust) + 0.01 * circle[2] * (circle[2] > 2)
        for circle in zip(centers, normals, radii, strict=True)
    ]
    best = int(np.argmin(off))
    return centers[best], normals[best], float(radii[best])


def _shares(trust: Array) -> Array:
    shares = trust + 1e-6 * trust.max()
    return np.asarray(shares / shares.sum())


def _median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    mass = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(mass, 0.5 * mass[-1])]])


def _covered(at: Array, center: Array, normal: Array) -> float:
    """Return the share of the circle that has points near.

    Arcs between neighboring points count whole up to three times the middle one, or ten degrees: a rim of few
    vertices is whole too. Of longer ones ten degrees count.
    """
    u, v = _frame(normal)
    turn = np.sort(np.arctan2((at - center) @ v, (at - center) @ u))
    arcs = np.diff(turn, append=turn[0] + 2 * np.pi)
    counted = np.where(arcs <= max(WHOLE * float(np.median(arcs)), NEAR), arcs, NEAR)
    return min(float(counted.sum()) / (2 * np.pi), 1.0)
