"""Parametric sphere, cylinder, torus, ellipsoid and cone: position, normal and curvatures in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.truth.exact import Exact, of_level_set, paired

Array = NDArray[np.float64]


def _stack(x: Array, y: Array, z: Array) -> Array:
    return np.stack(np.broadcast_arrays(x, y, z), axis=1).astype(float)


@dataclass(frozen=True)
class Sphere:
    """A sphere around the origin.

    Examples
    --------
    >>> points, exact = Sphere(2.0).at(0.0, 0.0)
    >>> points.tolist(), exact.k1.tolist()
    ([[2.0, 0.0, 0.0]], [0.5])
    """

    radius: float = 2.0

    def at(self, longitude: ArrayLike, latitude: ArrayLike) -> tuple[Array, Exact]:
        """Return points and their exact values."""
        u, v = paired(longitude, latitude)
        normals = _stack(np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v))
        east = _stack(-np.sin(u), np.cos(u), 0 * u)
        curvature = np.full(len(u), 1 / self.radius)
        return self.radius * normals, Exact(normals, curvature, curvature, east)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder around the z axis."""

    radius: float = 2.0

    def at(self, angle: ArrayLike, height: ArrayLike) -> tuple[Array, Exact]:
        """Return points and their exact values."""
        u, z = paired(angle, height)
        normals, around = _stack(np.cos(u), np.sin(u), 0 * u), _stack(-np.sin(u), np.cos(u), 0 * u)
        points = _stack(self.radius * np.cos(u), self.radius * np.sin(u), z)
        return points, Exact(normals, np.full(len(u), 1 / self.radius), np.zeros(len(u)), around)


@dataclass(frozen=True)
class Torus:
    """A torus around the z axis, with major radius `radius` and minor radius `tube`.

    H = (R + 2 r cos v) / (2 r (R + r cos v)) and K = cos v / (r (R + r cos v)).
    """

    radius: float = 1.0
    tube: float = 0.35

    def __post_init__(self) -> None:
        _check.number("radius", self.radius, _check.number("tube", self.tube, 0.0, open_low=True), open_low=True)

    def at(self, around_axis: ArrayLike, around_tube: ArrayLike) -> tuple[Array, Exact]:
        """Return points and their exact values; the angle around the tube is 0 on the outer equator."""
        u, v = paired(around_axis, around_tube)
        normals = _stack(np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v))
        middle = self.radius * _stack(np.cos(u), np.sin(u), 0 * u)
        curvature = np.cos(v) / (self.radius + self.tube * np.cos(v))
        across = _stack(-np.sin(v) * np.cos(u), -np.sin(v) * np.sin(u), np.cos(v))
        return middle + self.tube * normals, Exact(normals, np.full(len(u), 1 / self.tube), curvature, across)


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid around the origin, its axes along x, y, z."""

    axes: tuple[float, float, float] = (1.0, 0.7, 0.5)

    def at(self, longitude: ArrayLike, latitude: ArrayLike) -> tuple[Array, Exact]:
        """Return points, those of the unit sphere at these angles scaled by the axes, and their exact values."""
        points = Sphere(1.0).at(longitude, latitude)[0] * np.asarray(self.axes)
        return points, self.exact(points)

    def exact(self, points: Array) -> Exact:
        """Return the exact values at (n, 3) points of the surface."""
        inverse = 1 / np.asarray(self.axes, float) ** 2
        return of_level_set(2 * points * inverse, np.broadcast_to(np.diag(2 * inverse), (len(points), 3, 3)))


@dataclass(frozen=True)
class Cone:
    """The side of a cone: circle of `radius` at z = 0, apex at z = `height`.

    Its curvature is cos(slope) / distance from the axis around the axis, 0 along the rulings.
    """

    radius: float = 1.0
    height: float = 1.0

    def at(self, angle: ArrayLike, share: ArrayLike) -> tuple[Array, Exact]:
        """Return points at a share of the height, below 1, and their exact values."""
        u, t = paired(angle, share)
        slant = np.hypot(self.radius, self.height)
        out, up = self.height / slant, self.radius / slant
        normals = _stack(out * np.cos(u), out * np.sin(u), up + 0 * u)
        away = self.radius * (1 - t)
        points = _stack(away * np.cos(u), away * np.sin(u), self.height * t)
        with np.errstate(divide="ignore"):
            curvature = out / away
        return points, Exact(normals, curvature, np.zeros(len(u)), _stack(-np.sin(u), np.cos(u), 0 * u))
