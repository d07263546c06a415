"""What a zone is: the simplest of plane, cylinder, sphere, cone and torus that it fits, or free form."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.numerics.round_fits import across_normals, ball, cone_apex, from_axis, met_axis

MOST_POINTS = 500
"""Points and triangles that a fit looks at."""

EXACT = 1e-3
"""Of a zone's size: a fit that is so close is one, whatever the noise."""

LARGEST = 10.0
"""Of a zone's size: with a larger radius it is flat for all that can be seen."""

FACING, ALIKE = 0.95, 0.005
"""Least mean cosine between the normals of triangles and of a fit, and less than the best: a rim and an apex are both
on a sphere and on a cone."""


def kind_of(points: Array, centers: Array, normals: Array, noise: float) -> tuple[str, float]:
    """Return what points (n, 3), and triangles (t, 3) with their normals, are samples of, and the rms distance to that.

    A kind is the one if the rms is within twice the noise, or a thousandth of the zone's size; that of a free form is
    the least of all. Too few points for a kind do not speak for it.
    """
    size = max(float(norm(np.ptp(points, axis=0))), 1e-300)
    middle, step, leap = centers.mean(axis=0), max(1, len(points) // MOST_POINTS), max(1, len(centers) // MOST_POINTS)
    points, centers, normals = (points[::step] - middle) / size, (centers[::leap] - middle) / size, normals[::leap]
    limit, least, fitting = max(2 * noise / size, EXACT), np.inf, list[tuple[str, float, float]]()
    for name, start, distances, parameters in FITS:
        with np.errstate(all="ignore"):
            x = start(centers, normals) if len(points) >= parameters else None
        if x is None or not np.isfinite(x).all():
            continue
        enough = np.resize(points, (max(len(points), len(x)), 3))
        x = least_squares(lambda x, fit=distances, at=enough: fit(at, x), x, method="lm", max_nfev=200).x
        rms = float(np.sqrt(np.mean(distances(points, x) ** 2)))
        rise = np.abs(distances(centers + 1e-3 * normals, x) - distances(centers - 1e-3 * normals, x)) / 2e-3
        if rise.mean() < FACING:
            continue
        least = min(least, rms)
        if rms <= limit:
            fitting.append((name, rms * size, rise.mean()))
            if rise.mean() > 1 - ALIKE:
                break
    for name, rms, facing in fitting:
        if facing > max(each[2] for each in fitting) - ALIKE:
            return name, rms
    return "free form", least * size if np.isfinite(least) else float("nan")


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
    if norm(apex) > LARGEST:
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
    ("sphere", _sphere, _to_sphere, 5),
    ("cone", _cone, _to_cone, 7),
    ("torus", _torus, _to_torus, 8),
)
"""Kinds from the simplest on: a start from triangles, distances, and the fewest points that speak for it."""
