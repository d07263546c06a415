"""Sphere, cylinder, torus and ellipsoid: points and exact values at two parameters, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.bench.truth.exact import Exact, of_level_set, paired

Surface = tuple[Array, Exact]


def sphere(longitude: ArrayLike, latitude: ArrayLike, radius: float = 2.0) -> Surface:
    """Return points of a sphere around the origin and their exact values."""
    u, v = paired(longitude, latitude)
    return _revolved(u, radius * np.cos(v), radius * np.sin(v), v, 1 / radius)


def cylinder(angle: ArrayLike, height: ArrayLike, radius: float = 2.0) -> Surface:
    """Return points of a cylinder around the z axis and their exact values."""
    u, z = paired(angle, height)
    return _revolved(u, radius + 0 * z, z, 0 * z, 0.0)


def torus(around_axis: ArrayLike, around_tube: ArrayLike, radius: float = 1.0, tube: float = 0.35) -> Surface:
    """Return points of a torus around the z axis and their exact values; its outer equator is at 0 around the tube."""
    checks.number("radius", radius, checks.number("tube", tube, 0.0, open_low=True), open_low=True)
    u, v = paired(around_axis, around_tube)
    return _revolved(u, radius + tube * np.cos(v), tube * np.sin(v), v, 1 / tube)


def _revolved(u: Array, away: Array, height: Array, tilt: Array, bending: float) -> Surface:
    """Return a profile turned by angles u: distance from the z axis, height, slope of the normal, curvature."""
    out, east = (np.stack([x, y, 0 * u], axis=1) for x, y in ((np.cos(u), np.sin(u)), (-np.sin(u), np.cos(u))))
    up = np.array([0.0, 0.0, 1.0])
    cosine, sine = np.cos(tilt)[:, None], np.sin(tilt)[:, None]
    around = np.cos(tilt) / away  # the normal curvature along a parallel (Meusnier)
    first = (around >= bending)[:, None]
    d1 = np.where(first, east, cosine * up - sine * out)
    points = away[:, None] * out + height[:, None] * up
    return points, Exact(cosine * out + sine * up, np.maximum(around, bending), np.minimum(around, bending), d1)


def ellipsoid(longitude: ArrayLike, latitude: ArrayLike, axes: tuple[float, float, float] = (1.0, 0.7, 0.5)) -> Surface:
    """Return points of the unit sphere scaled by the axes, and their exact values."""
    points = sphere(longitude, latitude, 1.0)[0] * np.asarray(axes)
    inverse = 1 / np.asarray(axes) ** 2
    return points, of_level_set(2 * points * inverse, np.broadcast_to(np.diag(2 * inverse), (len(points), 3, 3)))
