"""Occlusion: the small rigid motion that brings two surfaces into contact, teeth against teeth or fragment to bone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import cross, dot, norm
from simplexmesh.data.convert import as_triangles
from simplexmesh.errors import warn
from simplexmesh.recognition.gaps import OPPOSED, Gaps, Part, gaps
from simplexmesh.recognition.least_motion import least_motion
from simplexmesh.recognition.limits import Limits, bounds_of
from simplexmesh.recognition.rigid import rigid_fit
from simplexmesh.recognition.rotation_vectors import rotation_matrices

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

REACH, TOLERANCE = 0.1, 0.002
"""How far surfaces attract each other at first, and how near they touch, as shares of the moving part's diagonal."""

STAGES = 7
ROUNDS = 25
STILL = 0.02
"""A stage ends when no point moves by more than this share of its gap."""

AROUND = 8.0
"""Vertices nearer than so many widths are followed through a stage; half of that is as far as they have a say."""

MOST = 6000
"""Of more vertices so many, drawn at random, say where a part goes; all say when it is out of the other."""

MET = 1e-3
"""Limits are met within this share of the tolerance."""


@dataclass(frozen=True, eq=False, repr=False)
class Occlusion:
    """Where a part is in contact with another.

    Attributes
    ----------
    T_fixed_moving : (4, 4) array of float
        Brings the moving part to its place.
    distances : (n,) array of float
        From the moving part's vertices, in the order they were given, to the fixed one after that, in the data's unit:
        positive outside, negative inside; NaN beyond its border.
    contact : (n,) array of bool
        The vertices that touch: near enough, and facing the other surface.
    contact_area, area_before : float
        The area these stand for, and what it was before, in the unit squared.
    penetration : float
        How deep one surface is in the other at most, at the vertices of both; 0 when it is not.
    slack : float
        How far apart pairs are at most; NaN without any.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball, ground = sm.sphere(12), sm.plane(20, 20, size=(4.0, 4.0))
    >>> found = sm.occlude(ball.moved(ball.vertices + [0, 0, 1.05]), ground, tolerance=0.01)
    >>> found.T_fixed_moving[2, 3].round(2), bool(found.penetration < 1e-4)
    (np.float64(-0.05), True)
    """

    T_fixed_moving: Array
    distances: Array
    contact: NDArray[np.bool_]
    contact_area: float
    area_before: float
    penetration: float
    slack: float

    def __repr__(self) -> str:
        return (
            f"Occlusion(contact_area {self.contact_area:.4g}, before {self.area_before:.4g}, "
            f"penetration {self.penetration:.3g}, turned {np.degrees(self.angle):.3g} degrees)"
        )

    @property
    def angle(self) -> float:
        """By how much the part was turned, in radians."""
        return float(np.arccos(np.clip((np.trace(self.T_fixed_moving[:3, :3]) - 1) / 2, -1.0, 1.0)))


def occlude(
    moving: Any,
    fixed: Any,
    *,
    tolerance: float | None = None,
    penetration: float = 0.0,
    reach: float | None = None,
    pairs: tuple[ArrayLike, ArrayLike] | None = None,
    slack: float | None = None,
) -> Occlusion:
    """Return the rigid motion, near the start, that brings most of a surface into contact with another.

    The lower teeth against the upper, a fragment to the bone it broke from, a guide onto the bone it was made for:
    surfaces that face each other are drawn together, and neither goes into the other deeper than is allowed.

    Parameters
    ----------
    moving, fixed : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        Faces counter-clockwise seen from outside; closed, or open as scans of crowns are. In one unit, and near each
        other: the motion is a matter of small turns and shifts.
    tolerance : float, optional
        Surfaces no farther apart than this touch, in their unit; by default 0.2 % of the moving part's diagonal.
    penetration : float
        How deep one may go into the other, at the vertices of both.
    reach : float, optional
        How far surfaces attract each other at first; by default 10 % of the diagonal.
    pairs : pair of (k, 3) arrays of float, optional
        Points of the moving part, where they lie, and points of the fixed one that they belong to: cusps and the gaps
        between teeth that they go into. Three pairs or more give the start; with `slack` any number bounds the motion.
    slack : float, optional
        How far each pair may be apart in the end.

    Returns
    -------
    Occlusion

    Raises
    ------
    ValueError, TypeError, OSError
        Not surfaces; numbers that are not positive; pairs of other lengths; a slack without pairs, or one that no
        motion can meet; nothing within reach.

    Warns
    -----
    SimplexMeshWarning
        Nothing touches, or parts so deep in each other at the start that they stay deeper than is allowed.

    Notes
    -----
    What becomes largest is the sum of a_i / (1 + (g_i / s)^2) over vertices, a the area they stand for, g their gap,
    s falling from the reach to the tolerance: a soft area of contact. It is raised by weighted least squares, each step
    the least one that no vertex of either surface is made to go too deep by (a quadratic program, solved as least
    distance by non-negative least squares). Contact is seen at vertices: divide long edges first.

    References
    ----------
    J. Charton, thesis, 2014, 5.1 (occlusion by small turns and shifts, under constraints from cusps); Y.-B. Chang et
    al., An automatic and robust algorithm of reestablishment of digital dental occlusion, 2010 (distances with
    collision constraints as quadratic programs).

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> lower = sm.plane(24, 24, size=(2.0, 2.0)).triangulated("dual")
    >>> x, y, _ = lower.vertices.T
    >>> hills = np.stack([x, y, 0.1 * np.sin(5 * x) * np.cos(4 * y) + 0.05 * x * y], axis=1)
    >>> lower, upper = sm.TriangleMesh(hills, lower.faces), sm.TriangleMesh(hills, lower.faces[:, ::-1])
    >>> off = sm.TriangleMesh(hills + [0.04, -0.03, 0.1], upper.faces)
    >>> found = sm.occlude(off, lower)
    >>> found.T_fixed_moving[:3, 3].round(2).tolist(), bool(found.contact_area > 0.9 * upper.area)
    ([-0.04, 0.03, -0.1], True)
    """
    meshes = {"moving": as_triangles(moving, "moving"), "fixed": as_triangles(fixed, "fixed")}
    for name, mesh in meshes.items():
        _check.size(name, mesh.bounds)
    one, other = Part(meshes["moving"]), Part(meshes["fixed"])
    near = _share("tolerance", tolerance, TOLERANCE, one.diagonal)
    far = max(_share("reach", reach, REACH, one.diagonal), near)
    limits = Limits(near, far, _check.number("penetration", penetration, 0.0), *bounds_of(pairs, slack))
    start = np.eye(4) if pairs is None or len(limits.here) < 3 else rigid_fit(limits.here, limits.there)
    before, distances = _contact(one, other, start, limits)
    if not (np.abs(distances[np.isfinite(distances)]) <= far).any():
        raise ValueError(f"moving must be within the reach {far:.4g} of fixed and not beyond its border, it is not")
    T, among = start, (_some(one), _some(other))
    for width in np.geomspace(far, near, STAGES):
        T = _drawn(one, other, T, float(width), limits, float(width) if width > near else 0.0, among)
    T = _freed(one, other, T, limits)
    found = _told(one, other, T, limits, float(one.areas[before].sum()))
    own = getattr(moving, "n_vertices", None) if hasattr(moving, "connectivity") else None
    return replace(found, distances=found.distances[:own], contact=found.contact[:own])  # centers of faces come last


def _some(part: Part) -> Indices:
    """Return the vertices that say where a part goes: all, or as many as are needed for that."""
    n = len(part.points)
    return np.arange(n) if n <= MOST else np.sort(np.random.default_rng(0).choice(n, MOST, replace=False))


def _share(name: str, value: float | None, share: float, diagonal: float) -> float:
    return share * diagonal if value is None else _check.number(name, value, 0.0, open_low=True)


def _drawn(
    one: Part, other: Part, T: Array, width: float, limits: Limits, give: float, among: tuple[Indices, Indices]
) -> Array:
    """Return the motion after surfaces were drawn together, gaps much wider than `width` hardly.

    They may go deeper into each other by `give`. Steps that lose contact are halved. Only the vertices `among` all
    those of either part are looked at.
    """
    looser = limits._replace(deep=limits.deep + give)
    found = gaps(one, other, T, AROUND * width, limits.far, among)
    among, most = (found.mine, found.its), width
    for _ in range(ROUNDS):
        gap = _gap(found, limits)
        weight = found.area / (1 + (gap / width) ** 2) ** 2
        if not weight.any():
            return T
        further, moved = _stepped(T, found, weight, gap, looser, most)
        ahead = gaps(one, other, further, AROUND * width, limits.far, among)
        if _merit(ahead, further, width, looser, limits) >= _merit(found, T, width, looser, limits):
            T, found, most = further, ahead, min(2 * most, width)
            if moved < STILL * width:
                break
        else:
            most = moved / 2
            if most < STILL * width:
                break
    return T


def _gap(found: Gaps, limits: Limits) -> Array:
    """Return how far vertices are from contact: above, or deeper than is allowed."""
    return np.asarray(np.maximum(found.distance, 0.0) + np.minimum(found.distance + limits.deep, 0.0))


def _merit(found: Gaps, T: Array, width: float, looser: Limits, limits: Limits) -> float:
    """Return the soft area of contact, less what of it limits are exceeded by, in widths."""
    soft = float((found.area / (1 + (_gap(found, limits) / width) ** 2)).sum())
    over = max(-float(found.distance.min(initial=0.0)) - looser.deep, limits.apart(T).max(initial=0.0) - limits.slack)
    return soft - float(found.area.sum()) * max(over - MET * limits.near, 0.0) / width


def _freed(one: Part, other: Part, T: Array, limits: Limits) -> Array:
    """Return the motion after the least further one that brings parts out of each other as far as they must be."""
    for _ in range(ROUNDS):
        found = gaps(one, other, T, limits.near, limits.far)
        deepest = -found.distance.min(initial=0.0) - limits.deep
        apart = limits.apart(T).max(initial=-np.inf) - limits.slack
        if max(deepest, apart) <= MET * limits.near:
            break
        T, _ = _stepped(T, found, np.zeros(len(found.area)), found.distance, limits, one.diagonal)
    return T


def _stepped(T: Array, found: Gaps, weight: Array, gap: Array, limits: Limits, most: float) -> tuple[Array, float]:
    """Return the motion one step on, and how far its points move by that."""
    bounds, floor = [found.rows], [-(found.distance + limits.deep)]
    if np.isfinite(limits.slack) and len(limits.here):
        at = limits.here @ T[:3, :3].T + T[:3, 3]
        off = at - limits.there
        apart = norm(off)
        way = -off / np.maximum(apart, 1e-300)[:, None]
        bounds.append(np.hstack([cross((at - found.middle) / found.arm, way), way]))
        floor.append(apart - limits.slack)
    x = least_motion(found.rows, weight, gap, np.vstack(bounds), np.concatenate(floor))
    size = float(np.linalg.norm(x[:3]) + np.linalg.norm(x[3:]))
    x *= most / max(size, most)
    step = np.eye(4)
    step[:3, :3] = rotation_matrices(x[None, :3] / found.arm)[0]
    step[:3, 3] = found.middle + x[3:] - step[:3, :3] @ found.middle
    return step @ T, min(size, most)


def _told(one: Part, other: Part, T: Array, limits: Limits, before: float) -> Occlusion:
    """Return what was found, measured; say so if pairs could not be met."""
    contact, distances = _contact(one, other, T, limits)
    lowest = float(gaps(one, other, T, limits.near, limits.far).distance.min(initial=0.0))
    apart = float(limits.apart(T).max()) if len(limits.here) else float("nan")
    if np.isfinite(limits.slack) and apart > limits.slack + max(MET * limits.near, 1e-9 * one.diagonal):
        raise ValueError(
            f"slack must let the pairs be met and the parts stay out of each other, "
            f"not be {limits.slack:g}: they are left {apart:.4g} apart"
        )
    if -lowest - limits.deep > max(MET * limits.near, 1e-9 * one.diagonal):
        warn(f"moving is left {-lowest:.3g} deep in fixed: no small motion gets it out, begin with the parts apart")
    elif not contact.any():
        warn("nothing of moving touches fixed: surfaces that face each other must be within the reach")
    frozen = _check.frozen
    area = float(one.areas[contact].sum())
    return Occlusion(frozen(T), frozen(distances), frozen(contact), area, before, max(0.0, -lowest), apart)


def _contact(one: Part, other: Part, T: Array, limits: Limits) -> tuple[NDArray[np.bool_], Array]:
    """Return which vertices of the moving part touch, and how far all are."""
    distance, away = other.known(one.points @ T[:3, :3].T + T[:3, 3])
    facing = dot(one.normals @ T[:3, :3].T, away) < OPPOSED
    with np.errstate(invalid="ignore"):
        touching = (distance <= limits.near * (1 + MET)) & (distance >= -limits.deep - limits.near)
    return facing & touching, distance
