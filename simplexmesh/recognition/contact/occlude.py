"""Occlusion: the small rigid motion that brings two surfaces into contact, teeth against teeth or fragment to bone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import warn
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import dot, norm
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.poses import Posed
from simplexmesh.motion.targets.inward import warn_inward
from simplexmesh.numerics.rigid import plane_jacobian, rigid_fit, rotation_angle, small_motion
from simplexmesh.recognition.contact.constrained_least_squares import constrained_least_squares
from simplexmesh.recognition.contact.contact_limits import ContactLimits, pair_limits
from simplexmesh.recognition.contact.part_distances import FACING_COSINE, Part, PartDistances, part_distances
from simplexmesh.recognition.register.oriented_points import drawn_rows

REACH, TOLERANCE = 0.1, 0.002
"""Default reach and contact tolerance, relative to the diagonal of the moving part."""

ITERATIONS = 25
STEP_TOLERANCE = 0.02
"""A stage ends when the step is shorter than this fraction of its width: a smaller one takes longer."""

NEIGHBORHOOD = 8.0
"""Vertices nearer than this many widths are tracked through a stage; beyond half of that they have no weight."""

MAXIMUM_VERTICES = 6000
"""Number of vertices, drawn at random, that attract a part, for speed; all of them limit the penetration."""

LIMIT_TOLERANCE = 1e-3
"""Limits are met within this fraction of the tolerance."""


@dataclass(frozen=True, eq=False, repr=False)
class Occlusion(Posed):
    """The pose of a part in contact with another; made by `occlude`.

    Attributes
    ----------
    T_target_source : (4, 4) array of float
        Maps the source to its pose.
    distances : (n,) array of float
        Signed distances of the moved vertices to the target, in the data's unit: positive outside; NaN beyond its
        border.
    contact : (n,) array of bool
        Whether each vertex touches: within the tolerance, and facing the other surface.
    contact_area, area_before : float
        Area of the touching vertices, after and before, in the unit squared.
    penetration : float
        Maximum penetration depth, at the vertices of both; 0 if there is none.
    slack : float
        Maximum distance of the pairs; NaN without pairs.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball, ground = sm.sphere(12), sm.plane(20, 20, size=(4.0, 4.0))
    >>> found = sm.occlude(ball.moved(ball.vertices + [0, 0, 1.05]), ground, tolerance=0.01)
    >>> found.T_target_source[2, 3].round(2), bool(found.penetration < 1e-4)
    (np.float64(-0.05), True)
    """

    T_target_source: Array
    distances: Array
    contact: Mask
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
        """Angle of the rotation, in radians."""
        return rotation_angle(self.T_target_source)


def occlude(
    source: Any,
    target: Any,
    *,
    tolerance: float | None = None,
    penetration: float = 0.0,
    reach: float | None = None,
    pairs: tuple[ArrayLike, ArrayLike] | None = None,
    slack: float | None = None,
) -> Occlusion:
    """Return the rigid motion, near the start, that maximizes the contact area of a surface with another.

    For lower teeth against upper ones, a fragment and the bone it broke from, a guide and the bone it was made for:
    surfaces that face each other attract each other, and penetration is limited.

    Parameters
    ----------
    source, target : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        Faces counter-clockwise seen from outside; closed, or open as scans of crowns are. In one unit, and near each
        other: the motion, of the source, is small.
    tolerance : float, optional
        Largest gap of surfaces that touch, in their unit; by default 0.2 % of the source's diagonal.
    penetration : float
        Largest penetration depth allowed, at the vertices of both.
    reach : float, optional
        Initial range of attraction; by default 10 % of the diagonal.
    pairs : pair of (k, 3) arrays of float, optional
        Points of the source and corresponding points of the target: cusps and the gaps between teeth that they
        go into. Three pairs or more give the start; with `slack` any number of pairs limits the motion.
    slack : float, optional
        Largest distance of each pair in the end.

    Returns
    -------
    Occlusion

    Raises
    ------
    ValueError, TypeError, OSError
        Not surfaces; two units; numbers that are not positive; pairs of different lengths; a slack without pairs, or
        one that no motion can meet; no vertex within reach.

    Warns
    -----
    SimplexMeshWarning
        No vertex touches, the initial penetration is too deep to be resolved, or faces are turned inward.

    Notes
    -----
    The objective is a soft contact area, the sum of a_i / (1 + (g_i / s)^2) over vertices with areas a and gaps g; s
    decreases from the reach to the tolerance. It is maximized by iteratively reweighted least squares under linearized
    penetration limits at the vertices of both surfaces (a quadratic program, solved as a least distance problem by
    non-negative least squares). Contact is evaluated at vertices: divide long edges first.

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
    >>> shifted = sm.TriangleMesh(hills + [0.04, -0.03, 0.1], upper.faces)
    >>> found = sm.occlude(shifted, lower)
    >>> found.T_target_source[:3, 3].round(2).tolist(), bool(found.contact_area > 0.9 * upper.area)
    ([-0.04, 0.03, -0.1], True)
    """
    meshes = {"source": as_triangles(source, "source"), "target": as_triangles(target, "target")}
    for name, mesh in meshes.items():
        checks.size(name, mesh.bounds)
    common_unit("source and target", meshes.values())
    part, opposite = Part(meshes["source"]), Part(meshes["target"])
    for name, mesh in meshes.items():
        warn_inward(name, mesh.welded(report=False), "they are taken for those of a cavity")
    tolerance = _length("tolerance", tolerance, TOLERANCE, part.diagonal)
    reach = max(_length("reach", reach, REACH, part.diagonal), tolerance)
    limits = ContactLimits(tolerance, reach, checks.number("penetration", penetration, 0.0), *pair_limits(pairs, slack))
    start = np.eye(4)
    if len(limits.moving_points) >= 3:
        start = rigid_fit(limits.moving_points, limits.fixed_points)
    before, distances = _contact(part, opposite, start, limits)
    if not (np.abs(distances[np.isfinite(distances)]) <= reach).any():
        raise ValueError(f"source must be within the reach {reach:.4g} of target and not beyond its border, it is not")
    T, subset = start, (_attracting_rows(part), _attracting_rows(opposite))
    for width in np.geomspace(reach, tolerance, 7):
        T = _attracted(part, opposite, T, float(width), limits, float(width) if width > tolerance else 0.0, subset)
    T = _separated(part, opposite, T, limits)
    found = _result(part, opposite, T, limits, float(part.areas[before].sum()))
    own = getattr(source, "n_vertices", None) if hasattr(source, "connectivity") else None
    return replace(found, distances=found.distances[:own], contact=found.contact[:own])  # face centers come last


def _attracting_rows(part: Part) -> Indices:
    """Return the rows of the vertices that attract a part: all, or a random sample."""
    return drawn_rows(len(part.points), MAXIMUM_VERTICES, np.random.default_rng(0))


def _length(name: str, value: float | None, fraction: float, diagonal: float) -> float:
    """Return a positive length, by default a fraction of the diagonal."""
    return fraction * diagonal if value is None else checks.number(name, value, 0.0, open_low=True)


def _attracted(
    part: Part, opposite: Part, T: Array, width: float, limits: ContactLimits, allowance: float,
    subset: tuple[Indices, Indices],
) -> Array:  # fmt: skip
    """Return the motion after a stage of attraction of `subset`, with weights of a width and `allowance` of depth."""
    relaxed = limits._replace(penetration=limits.penetration + allowance)
    found = part_distances(part, opposite, T, NEIGHBORHOOD * width, limits.reach, subset)
    subset, longest = (found.moving_rows, found.fixed_rows), width
    value = _objective(found, T, width, relaxed, limits)
    for _ in range(ITERATIONS):
        gap = _contact_gaps(found, limits)
        weight = found.area / (1 + (gap / width) ** 2) ** 2
        if not weight.any():
            return T
        candidate, moved = _step(T, found, weight, gap, relaxed, longest)
        candidate_found = part_distances(part, opposite, candidate, NEIGHBORHOOD * width, limits.reach, subset)
        candidate_value = _objective(candidate_found, candidate, width, relaxed, limits)
        if candidate_value >= value:
            T, found, value, longest = candidate, candidate_found, candidate_value, min(2 * longest, width)
            if moved < STEP_TOLERANCE * width:
                break
        else:
            longest = moved / 2
            if longest < STEP_TOLERANCE * width:
                break
    return T


def _contact_gaps(found: PartDistances, limits: ContactLimits) -> Array:
    """Return signed distances of vertices from contact: gaps, or penetration beyond the limit."""
    return np.asarray(np.maximum(found.distance, 0.0) + np.minimum(found.distance + limits.penetration, 0.0))


def _objective(found: PartDistances, T: Array, width: float, relaxed: ContactLimits, limits: ContactLimits) -> float:
    """Return the soft contact area, less a penalty for exceeded limits, in widths."""
    soft = float((found.area / (1 + (_contact_gaps(found, limits) / width) ** 2)).sum())
    depth = -float(found.distance.min(initial=0.0)) - relaxed.penetration
    excess = max(depth, limits.pair_distances(T).max(initial=0.0) - limits.slack)
    return soft - float(found.area.sum()) * max(excess - LIMIT_TOLERANCE * limits.tolerance, 0.0) / width


def _separated(part: Part, opposite: Part, T: Array, limits: ContactLimits) -> Array:
    """Return the motion followed by the smallest ones that make it meet the limits."""
    for _ in range(ITERATIONS):
        found = part_distances(part, opposite, T, limits.tolerance, limits.reach)
        depth = -found.distance.min(initial=0.0) - limits.penetration
        excess = max(depth, limits.pair_distances(T).max(initial=-np.inf) - limits.slack)
        if excess <= LIMIT_TOLERANCE * limits.tolerance:
            break
        T, _ = _step(T, found, np.zeros(len(found.area)), found.distance, limits, part.diagonal)
    return T


def _step(
    T: Array, found: PartDistances, weight: Array, gap: Array, limits: ContactLimits, most: float
) -> tuple[Array, float]:
    """Return the motion after a step no longer than `most`, and the length of the step."""
    bounds, lower = [found.jacobian], [-(found.distance + limits.penetration)]
    if np.isfinite(limits.slack) and len(limits.moving_points):
        points = limits.moving_points @ T[:3, :3].T + T[:3, 3]
        difference = points - limits.fixed_points
        distance = norm(difference)
        directions = -difference / np.maximum(distance, 1e-300)[:, None]
        bounds.append(plane_jacobian((points - found.center) / found.radius, directions))
        lower.append(distance - limits.slack)
    x = constrained_least_squares(found.jacobian, weight, gap, np.vstack(bounds), np.concatenate(lower))
    size = float(np.linalg.norm(x[:3]) + np.linalg.norm(x[3:]))
    x *= most / max(size, most)
    step = small_motion(x[:3] / found.radius, x[3:], found.center)
    return step @ T, min(size, most)


def _result(part: Part, opposite: Part, T: Array, limits: ContactLimits, before: float) -> Occlusion:
    """Return the result, with a warning if limits are exceeded."""
    contact, distances = _contact(part, opposite, T, limits)
    lowest = float(part_distances(part, opposite, T, limits.tolerance, limits.reach).distance.min(initial=0.0))
    slack = float(limits.pair_distances(T).max()) if len(limits.moving_points) else float("nan")
    margin = max(LIMIT_TOLERANCE * limits.tolerance, 1e-9 * part.diagonal)
    if np.isfinite(limits.slack) and slack > limits.slack + margin:
        raise ValueError(
            f"slack must let the pairs be met and the parts stay out of each other, "
            f"not be {limits.slack:g}: they are left {slack:.4g} apart"
        )
    if -lowest - limits.penetration > margin:
        warn(f"source penetrates target by {-lowest:.3g}: no small motion separates them, start with the parts apart")
    elif not contact.any():
        warn("no vertex of source touches target: surfaces that face each other must be within the reach")
    frozen, area = checks.frozen, float(part.areas[contact].sum())
    return Occlusion(frozen(T), frozen(distances), frozen(contact), area, before, max(0.0, -lowest), slack)


def _contact(part: Part, opposite: Part, T: Array, limits: ContactLimits) -> tuple[Mask, Array]:
    """Return a mask of the moving part's vertices that touch, and the signed distances of all."""
    distance, outward = opposite.signed_distance(part.points @ T[:3, :3].T + T[:3, 3])
    facing = dot(part.normals @ T[:3, :3].T, outward) < FACING_COSINE
    with np.errstate(invalid="ignore"):
        near = distance <= limits.tolerance * (1 + LIMIT_TOLERANCE)
        touching = facing & near & (distance >= -limits.penetration - limits.tolerance)
    return touching, distance
