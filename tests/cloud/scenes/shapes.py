"""The exact shapes of scenes: pieces of planes, cylinders, cones, spheres and tori, sampled evenly and hit by rays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from simplexmesh._base.vectors import cross, dot, norm, normalized, tangents
from tests.cloud.scenes import rays

TURN = (-np.pi, np.pi)

LEAST = 1e-9
"""Rays meet what is farther from their start."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A piece of a surface: where `frame` (3, 3) puts its x, y and z axes, and the ranges (2, 2) of u and v.

    u is the angle about the z axis, but of planes x; v the height, but of planes y, of spheres the latitude, of tori
    the angle about the tube, from outside.
    """

    kind: ClassVar[str]

    origin: np.ndarray
    frame: np.ndarray
    extent: np.ndarray

    @property
    def point(self):
        return self.origin

    center = point

    @property
    def axis(self):
        return self.frame[2]

    normal = axis

    def moved(self, rotation, shift):
        """The shape turned, then shifted."""
        return replace(self, origin=rotation @ self.origin + shift, frame=self.frame @ rotation.T)

    def local(self, points):
        return (points - self.origin) @ self.frame.T

    @cached_property
    def area(self):
        nodes, weights = np.polynomial.legendre.leggauss(32)
        (u0, u1), (v0, v1) = self.extent
        return (u1 - u0) * (v1 - v0) / 2 * float(weights @ self.widths(v0 + (nodes + 1) / 2 * (v1 - v0)))

    @cached_property
    def ball(self):
        """The center and radius of a ball that holds the shape, hardly larger than needed."""
        grid = self.at(np.stack(np.meshgrid(*(np.linspace(*ends, 33) for ends in self.extent)), axis=-1).reshape(-1, 2))
        middle = (grid[0].min(axis=0) + grid[0].max(axis=0)) / 2
        return middle, 1.02 * float(norm(grid[0] - middle).max())

    def at(self, uv):
        """Points (n, 3) of surface coordinates (n, 2), and their unit normals (n, 3)."""
        u, v = uv.T
        rho, z, out, up = np.broadcast_arrays(*self.profile(v))
        cos, sin = np.cos(u), np.sin(u)
        points, normals = np.stack([rho * cos, rho * sin, z], axis=1), np.stack([out * cos, out * sin, up], axis=1)
        return self.origin + points @ self.frame, normals @ self.frame

    def sample(self, count, rng):
        """Surface coordinates (count, 2) spread evenly at random."""
        v = np.zeros(0)
        most = self.widths(np.linspace(*self.extent[1], 1025)).max()
        while len(v) < count:
            tried = rng.uniform(*self.extent[1], count)
            v = np.concatenate([v, tried[rng.uniform(0, most, count) < self.widths(tried)]])
        return np.stack([rng.uniform(*self.extent[0], count), v[:count]], axis=1)

    def coordinates(self, points):
        local = self.local(points)
        return np.stack([np.arctan2(local[:, 1], local[:, 0]), self.along(np.hypot(*local.T[:2]), local[:, 2])], axis=1)

    def holds(self, uv):
        """Whether coordinates are within the extent; angles may be any turns away."""
        u0, u1 = self.extent[0]
        within = np.mod(uv[..., 0] - u0, 2 * np.pi) <= u1 - u0
        return within & (uv[..., 1] >= self.extent[1, 0]) & (uv[..., 1] <= self.extent[1, 1])

    def distance(self, points):
        """Signed distances (n,) from the whole surface, positive outside."""
        local = self.local(points)
        return self.away(np.hypot(local[:, 0], local[:, 1]), local[:, 2])

    def hits(self, start, along):
        """How far along unit directions (n, 3) from a point (3,) the shape is first met: inf where it is not."""
        far = np.full(len(along), np.inf)
        middle, radius = self.ball
        to = middle - start
        ahead = along @ to
        near = np.flatnonzero((to @ to - ahead**2 < radius**2) & (ahead > -radius))
        ways = self.ways(self.frame @ (start - self.origin), along[near] @ self.frame.T)
        ray, _ = some = np.nonzero(np.isfinite(ways) & (ways > LEAST))
        met = self.holds(self.coordinates(start + ways[some][:, None] * along[near[ray]]))
        np.minimum.at(far, near[ray[met]], ways[some][met])
        return far


@dataclass(frozen=True, eq=False)
class Plane(Shape):
    kind = "plane"

    def at(self, uv):
        return self.origin + uv @ self.frame[:2], np.tile(self.frame[2], (len(uv), 1))

    def widths(self, v):
        return np.ones_like(v)

    def coordinates(self, points):
        return self.local(points)[:, :2]

    def holds(self, uv):
        return ((uv >= self.extent[:, 0]) & (uv <= self.extent[:, 1])).all(axis=-1)

    def away(self, rho, z):
        return z

    def ways(self, start, along):
        with np.errstate(divide="ignore"):
            return -start[2] / along[:, 2:]


@dataclass(frozen=True, eq=False)
class Cylinder(Shape):
    kind = "cylinder"
    radius: float

    def profile(self, v):
        return self.radius, v, 1.0, 0.0

    def widths(self, v):
        return np.full_like(v, self.radius)

    def along(self, rho, z):
        return z

    def away(self, rho, z):
        return rho - self.radius

    def ways(self, start, along):
        return rays.quadric(start, along, (1, 1, 0), self.radius**2)


@dataclass(frozen=True, eq=False)
class Cone(Shape):
    """`origin` is the apex, and `axis` points into the cone."""

    kind = "cone"
    half_angle: float

    def profile(self, v):
        return v * np.tan(self.half_angle), v, np.cos(self.half_angle), -np.sin(self.half_angle)

    def widths(self, v):
        return v * np.tan(self.half_angle) / np.cos(self.half_angle)

    def along(self, rho, z):
        return z

    def away(self, rho, z):
        return rho * np.cos(self.half_angle) - z * np.sin(self.half_angle)

    def ways(self, start, along):
        return rays.quadric(start, along, (1, 1, -(np.tan(self.half_angle) ** 2)), 0.0)


@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    kind = "sphere"
    radius: float

    def profile(self, v):
        return self.radius * np.cos(v), self.radius * np.sin(v), np.cos(v), np.sin(v)

    def widths(self, v):
        return self.radius**2 * np.cos(v)

    def along(self, rho, z):
        return np.arctan2(z, rho)

    def away(self, rho, z):
        return np.hypot(rho, z) - self.radius

    def ways(self, start, along):
        return rays.quadric(start, along, (1, 1, 1), self.radius**2)


@dataclass(frozen=True, eq=False)
class Torus(Shape):
    """`joins` are the numbers of the shapes that it leads from and to."""

    kind = "torus"
    radius: float
    tube_radius: float
    joins: tuple[int, ...] = ()

    def profile(self, v):
        cos, sin = np.cos(v), np.sin(v)
        return self.radius + self.tube_radius * cos, self.tube_radius * sin, cos, sin

    def widths(self, v):
        return self.tube_radius * (self.radius + self.tube_radius * np.cos(v))

    def along(self, rho, z):
        return np.arctan2(z, rho - self.radius)

    def away(self, rho, z):
        return np.hypot(rho - self.radius, z) - self.tube_radius

    def ways(self, start, along):
        return rays.torus(start, along, self.radius, self.tube_radius)


def frame_of(axis):
    """A frame with a z axis, the others as they come."""
    axis = normalized(np.asarray(axis, float))
    return np.stack([*tangents(axis), axis])


def plane(corner, right, up):
    """The parallel sides `right` and `up`, at right angles, from a corner; the normal is their product."""
    corner, right, up = (np.asarray(each, float) for each in (corner, right, up))
    frame = normalized(np.stack([right, up, cross(right, up)]))
    return Plane(corner, frame, np.array([[0, norm(right)], [0, norm(up)]]))


def pipe(start, end, radius):
    """A cylinder from a point to another."""
    start = np.asarray(start, float)
    return Cylinder(start, frame_of(end - start), np.array([TURN, (0, norm(end - start))]), float(radius))


def ball(center, radius):
    return Sphere(np.asarray(center, float), np.eye(3), np.array([TURN, (-np.pi / 2, np.pi / 2)]), float(radius))


def cone(apex, axis, half_angle, heights):
    """The part of a cone between two heights from its apex."""
    return Cone(np.asarray(apex, float), frame_of(axis), np.array([TURN, heights]), float(half_angle))


def bend(start, along, axis, radius, tube_radius, angle, joins=()):
    """A piece of torus that leads a pipe from a point and direction to the left about an axis at right angles to it.

    Returns it, and the point and direction that it leads to.
    """
    inward = cross(axis, along)
    center = start + radius * inward
    shape = Torus(
        center, np.stack([-inward, along, axis]), np.array([(0, angle), TURN]), float(radius), float(tube_radius), joins
    )
    end = center + radius * (np.sin(angle) * along - np.cos(angle) * inward)
    return shape, end, normalized(np.cos(angle) * along + np.sin(angle) * inward)


def sampled(shapes, count, rng, weights=None):
    """Points spread evenly over shapes, with weights of density if given: points, normals and labels.

    Every shape has its share of the count by area, rounded at random.
    """
    area = np.array([shape.area for shape in shapes]) * (1 if weights is None else weights)
    counts = rng.multinomial(count, area / area.sum())
    each = [shape.at(shape.sample(n, rng)) for shape, n in zip(shapes, counts, strict=True)]
    points, normals = (np.concatenate(parts) for parts in zip(*each, strict=True))
    return points, normals, np.repeat(np.arange(len(shapes)), counts)


def perpendicular(along, rng):
    """A random unit vector at right angles to a unit vector."""
    way = rng.normal(size=3)
    return normalized(way - dot(way, along) * along)
