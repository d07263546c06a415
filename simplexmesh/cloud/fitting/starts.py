"""Initial values of fits, from points and their normals of either sign (Chaperon 2002, 4.4).

All return None where the points tell no primitive of the kind, and none is more than a start: `solver.solve` follows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, dot, norm, normalized, tangents
from simplexmesh.data.primitives import Circle, Cone, Cylinder, Line, Plane, Primitive, Sphere, Torus
from simplexmesh.numerics.circle_fits import sampled_circle
from simplexmesh.numerics.round_fits import across_normals, ball, cone_apex, from_axis, met_axis

LARGEST = 1e3
"""Of the points' extent: with a larger radius they are flat for all that can be seen."""

STEEPEST = np.radians(89)
"""Half angle above which a cone is flat."""


def start(kind: str, points: Array, normals: Array | None = None) -> Primitive | None:
    """Return a primitive near points (n, 3) with normals, which planes, spheres, lines and circles do not need."""
    middle = points.mean(axis=0)
    size = float(norm(points - middle).max())
    if not size > 0:
        return None
    with np.errstate(all="ignore"):
        found = STARTS[kind]((points - middle) / size, normals if normals is not None else np.zeros((0, 3)))
    return None if found is None else scaled(found, size, middle)


def scaled(primitive: Primitive, size: float, shift: Array) -> Primitive:
    """Return a primitive made larger about the origin, then shifted."""
    origin, axis = primitive._pose
    return primitive._with(size * origin + shift, axis, *primitive._scaled(size))


def plane(points: Array, normals: Array) -> Plane | None:
    """Return the plane of the least squares, through the middle (App. C.1.1)."""
    return Plane(points.mean(axis=0), _principal(points)[0])


def line(points: Array, normals: Array) -> Line | None:
    """Return the line of the least squares, through the middle."""
    return Line(points.mean(axis=0), _principal(points)[2])


def sphere(points: Array, normals: Array) -> Sphere | None:
    """Return the sphere of Pratt's fit (App. C.1.6 has a norm that depends on the origin)."""
    center, radius = ball(points)
    return Sphere(center, radius) if _sound(center, radius) else None


def circle(points: Array, normals: Array) -> Circle | None:
    """Return Pratt's circle in the plane of the points; of an arc too flat for that the best of triples."""
    middle, frame = points.mean(axis=0), _principal(points)[::-1]
    center, radius = ball((points - middle) @ frame[:2].T)
    if _sound(center, radius):
        return Circle(middle + center @ frame[:2], frame[2], radius)
    found = sampled_circle(points, np.ones(len(points)))
    return None if found is None or found[2] > LARGEST else Circle(*found)


def cylinder(points: Array, normals: Array) -> Cylinder | None:
    """Return the cylinder whose axis is most perpendicular to the normals, and Pratt's circle across it (4.4.1)."""
    return cylinder_along(points, across_normals(normals)[2])


def cylinder_along(points: Array, axis: Array) -> Cylinder | None:
    """Return the cylinder of a known axis direction."""
    frame = np.stack(tangents(axis))
    center, radius = ball(points @ frame.T)
    return Cylinder(center @ frame, axis, radius) if _sound(center, radius) else None


def cylinder_of_patch(points: Array) -> Cylinder | None:
    """Return the cylinder of the largest curvature of a quadric over the plane of the points, which need no normals.

    Noise that is as large as the sagitta draws circles to small radii, but leaves curvatures of heights as they are.
    """
    middle, frame = points.mean(axis=0), _principal(points)
    z, x, y = frame @ (points - middle).T
    rows = np.column_stack([np.ones_like(x), x, y, x * x / 2, x * y, y * y / 2])
    height, _, _, xx, xy, yy = np.linalg.lstsq(rows, z, rcond=None)[0]
    values, vectors = np.linalg.eigh([[xx, xy], [xy, yy]])
    k = int(np.abs(values).argmax())
    if abs(values[k]) * LARGEST < 1:
        return None
    axis = vectors[:, 1 - k] @ frame[1:]
    return Cylinder(middle + (height + 1 / values[k]) * frame[0], axis, 1 / abs(values[k]))


def cone(points: Array, normals: Array) -> Cone | None:
    """Return the cone whose apex is in all tangent planes, and from which the points are at one angle to the axis.

    Unlike the center of a sphere (4.4.1), the apex also serves cones that are nearly cylinders.
    """
    apex = cone_apex(points, normals)
    return cone_from(points, apex) if norm(apex) < LARGEST else None


def cone_from(points: Array, apex: Array) -> Cone | None:
    """Return the cone of a known apex."""
    toward = normalized(points - apex)
    axis = _principal(toward)[0]
    axis = axis if dot(toward.mean(axis=0), axis) > 0 else -axis
    angle = float(np.median(np.arccos(np.clip(toward @ axis, -1, 1))))
    return Cone(apex, axis, angle) if 0 < angle < STEEPEST else None


def cone_along(points: Array, axis: Array) -> Cone | None:
    """Return the cone of a known axis direction: a cylinder's axis, and how the distance from it grows along it."""
    across = cylinder_along(points, axis)
    return None if across is None else tapered(points, across)


def tapered(points: Array, around: Cylinder) -> Cone | None:
    """Return the cone about a cylinder's axis."""
    rho, z = from_axis(points, around.point, around.axis)
    growth, radius = np.polyfit(z, rho, 1) if np.ptp(z) > 0 else (0.0, 0.0)
    if not np.isfinite(growth) or growth == 0 or radius <= 0:
        return None
    apex = around.point - radius / growth * around.axis
    return Cone(apex, np.sign(growth) * around.axis, float(np.arctan(abs(growth))))


def bent(points: Array, around: Cylinder) -> Torus | None:
    """Return the torus that a cylinder is a piece of, by how its radius all round, fitted with it, varies with height.

    Unlike the line that all normals meet, it serves short arcs, whose noisy normals are met as well by lines far away.
    """
    u, v = tangents(around.axis)
    x, y, z = np.stack([u, v, around.axis]) @ (points - around.point).T
    rho = np.maximum(np.hypot(x, y), np.finfo(float).tiny)
    waves = np.stack([x, y]) / rho
    rows = np.concatenate([np.ones((1, len(z))), waves, waves * z, waves * z**2 / 2])
    tube, *rest = np.linalg.lstsq(rows.T, rho, rcond=None)[0]
    shift, tilt, curvature = np.reshape(rest, (3, 2)) @ np.stack([u, v])
    size = float(norm(curvature))
    if not size * LARGEST > 1 or not tube > 0:
        return None
    axis = normalized(cross(around.axis + tilt, curvature))
    return Torus(around.point + shift + curvature / size**2, axis, max(1 / size, tube), float(tube))


def torus(points: Array, normals: Array) -> Torus | None:
    """Return the torus about the line that all normals meet, with Pratt's circle in the half-plane through that."""
    found = met_axis(points, normals)
    return None if found is None else torus_about(points, *found)


def torus_along(points: Array, normals: Array, axis: Array) -> Torus | None:
    """Return the torus of a known axis direction, which all normals meet."""
    frame = np.stack(tangents(axis))
    rows = cross(normals, np.broadcast_to(axis, normals.shape))
    foot = np.linalg.lstsq(rows @ frame.T, dot(rows, points), rcond=None)[0]
    return torus_about(points, np.asarray(foot @ frame), axis)


def torus_about(points: Array, on: Array, axis: Array) -> Torus | None:
    """Return the torus about a known axis."""
    rho, z = from_axis(points, on, axis)
    center, tube = ball(np.column_stack([rho, z]))
    if not _sound(center, tube) or not 0 < center[0] < LARGEST:
        return None
    return Torus(on + center[1] * axis, axis, float(center[0]), min(tube, float(center[0])))


def torus_around(points: Array, normals: Array) -> Torus | None:
    """Return the torus whose tube follows the circle through the points: a thin one, of any visible side."""
    ring = circle(points, normals)
    if ring is None:
        return None
    tube = float(np.sqrt(np.mean(ring.distance(points) ** 2)))
    return Torus(ring.center, ring.normal, ring.radius, tube) if 0 < tube <= ring.radius else None


def _sound(center: Array, radius: float) -> bool:
    """Return whether a circle or sphere is a size that can be seen."""
    return bool(np.isfinite(center).all() and 0 < radius < LARGEST)


def _principal(points: Array) -> Array:
    """Return the principal directions (3, 3) of points, in rows, from that of their least extent."""
    apart = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(apart.T @ apart)[1].T)


STARTS: dict[str, Callable[[Array, Array], Primitive | None]] = {
    "plane": plane,
    "sphere": sphere,
    "cylinder": cylinder,
    "cone": cone,
    "torus": torus,
    "line": line,
    "circle": circle,
}
"""Kinds from the one of the fewest parameters on, curves last; they take points about the origin and of unit size."""
