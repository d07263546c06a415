"""What a zone is: the simplest of plane, cylinder, sphere, cone and torus that it fits, or free form."""

from __future__ import annotations

import numpy as np
from scipy.optimize import leastsq

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.numerics.round_fits import across_normals, ball, cone_apex, from_axis, met_axis

FREE = "free form"
"""What is none of the others."""

MOST_POINTS = 500
"""Points and triangles that a fit looks at."""

EXACT, PRECISE = 1e-3, 1e-5
"""Of a zone's size: a fit that is so close is one, whatever the noise, and one that nothing rivals."""

NEARER = 0.1
"""Of the error of a simpler kind: a cone is that near to few corners of a plane, whose digits in a file are rounded."""

LARGEST, FARTHEST = 10.0, 300.0
"""Of a zone's size: with a larger radius it is flat for all that can be seen, with an apex farther off a cylinder."""

FACING, ALIKE = 0.9, 0.005
"""Least median cosine between the normals of triangles and of a fit, and less than the best: a rim and an apex are both
on a sphere and on a cone."""

RIVALS = ("cone", "sphere")
"""Of these the nearer one counts, as with noise a short band is near both."""


def kind_of(
    points: Array, centers: Array, normals: Array, noise: float, rims: Array | None = None
) -> tuple[str, float]:
    """Return what points (n, 3), and triangles (t, 3) with their normals, are samples of, and the rms distance to that.

    A kind is the one if the rms is within twice the noise, or a thousandth of the zone's size; that of a free form is
    the least of all. Points that are on a kind to the digits of a file are on no simpler one that they are only near.
    Too few points for a kind do not speak for it. Of `rims` (m, 3) all are as near to it as triangles are, at least.
    """
    size = float(norm(np.ptp(points, axis=0))) or 1.0
    middle, step, leap = centers.mean(axis=0), max(1, len(points) // MOST_POINTS), max(1, len(centers) // MOST_POINTS)
    rims = (centers[:0] if rims is None else rims - middle) / size
    points, centers, normals = (points[::step] - middle) / size, (centers[::leap] - middle) / size, normals[::leap]
    limit, least, fitting = max(2 * noise / size, EXACT), np.inf, list[tuple[str, float, float]]()
    for name, start, distances, parameters in FITS:
        with np.errstate(all="ignore"):
            x = start(centers, normals) if len(points) >= parameters else None
        if x is None or not np.isfinite(x).all():
            continue
        enough = np.resize(points, (max(len(points), len(x)), 3))
        settings = {"ftol": 1e-5, "maxfev": 400, "diag": np.ones(len(x)), "full_output": True}
        with np.errstate(over="ignore"):  # in a covariance that is not used, of points on a line
            x = leastsq(lambda x, fit=distances, at=enough: fit(at, x), x, **settings)[0]
        rms = float(np.sqrt(np.mean(distances(points, x) ** 2)))
        least = min(least, rms)
        rise = distances(centers + 1e-3 * normals, x) - distances(centers - 1e-3 * normals, x)
        facing = float(np.median(np.abs(rise))) / 2e-3
        if facing < FACING or np.abs(distances(rims, x)).max(initial=0.0) > np.abs(distances(centers, x)).max():
            continue
        if rms <= limit:
            fitting.append((name, rms * size, facing))
        if rms <= PRECISE and all(rms * size < NEARER * other for _, other, _ in fitting[:-1]):
            return name, rms * size
        if rms <= 2 * noise / size and facing > 1 - ALIKE and name != RIVALS[0]:
            break
    most = max((facing for _, _, facing in fitting), default=0.0)
    alike = [(name, rms) for name, rms, facing in fitting if facing > most - ALIKE]
    if alike:
        rivals = [fit for fit in alike if fit[0] in RIVALS] if alike[0][0] in RIVALS else alike[:1]
        return min(rivals, key=lambda fit: fit[1])
    return FREE, least * size if np.isfinite(least) else float("nan")


def _plane(points: Array, normals: Array) -> Array:
    """Return a point and the normal of a plane, 6 numbers."""
    mean = normals.mean(axis=0)
    return np.concatenate([points.mean(axis=0), mean / norm(mean)])


def _to_plane(points: Array, x: Array) -> Array:
    return dot(points - x[:3], x[3:] / norm(x[3:]))


def _sphere(points: Array, normals: Array) -> Array | None:
    """Return the center and radius of a sphere."""
    center, radius = ball(points)
    return np.append(center, radius) if radius < LARGEST else None


def _to_sphere(points: Array, x: Array) -> Array:
    return norm(points - x[:3]) - x[3]


def _cylinder(points: Array, normals: Array) -> Array | None:
    """Return a point on the axis most perpendicular to the normals, the axis, and the radius of a cylinder."""
    frame = across_normals(normals)
    center, radius = ball(points @ frame[:2].T)
    return np.array([*(center @ frame[:2]), *frame[2], radius]) if radius < LARGEST else None


def _to_cylinder(points: Array, x: Array) -> Array:
    return from_axis(points, x[:3], normalized(x[3:6]))[0] - x[6]


def _cone(points: Array, normals: Array) -> Array | None:
    """Return the apex of a cone, which is in all tangent planes, its axis and half its angle."""
    axis = np.linalg.svd(normals - normals.mean(axis=0))[2][-1]
    apex = cone_apex(points, normals)
    if norm(apex) > FARTHEST:
        return None
    axis = axis if dot(points.mean(axis=0) - apex, axis) > 0 else -axis
    away, along = from_axis(points, apex, axis)
    return np.array([*apex, *axis, np.arctan2(np.median(away), np.median(along))])


def _to_cone(points: Array, x: Array) -> Array:
    away, along = from_axis(points, x[:3], normalized(x[3:6]))
    return away * np.cos(x[6]) - along * np.sin(x[6])


def _torus(points: Array, normals: Array) -> Array | None:
    """Return the center and axis, which all normals meet, and the two radii of a torus."""
    found = met_axis(points, normals)
    if found is None:
        return None
    (ring, height), tube = ball(np.column_stack(from_axis(points, *found)))
    center, axis = found[0] + height * found[1], found[1]
    return np.array([*center, *axis, ring, tube]) if 0 < tube < LARGEST and 0 < ring < LARGEST else None


def _to_torus(points: Array, x: Array) -> Array:
    away, along = from_axis(points, x[:3], normalized(x[3:6]))
    return np.hypot(away - x[6], along) - x[7]


FITS = (
    ("plane", _plane, _to_plane, 3),
    ("cylinder", _cylinder, _to_cylinder, 6),
    ("cone", _cone, _to_cone, 7),
    ("sphere", _sphere, _to_sphere, 5),
    ("torus", _torus, _to_torus, 8),
)
"""Kinds, ruled ones first, as triangles between two circles are, which are on a sphere too, else the simplest first: a
start from triangles, distances, and the fewest points that speak for it."""
