"""What all primitives are: surfaces or curves of revolution, told by the profile that turns about their axis."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.data.points import PointCloud
from simplexmesh.data.primitives import _kernels_profiles as kernels
from simplexmesh.data.primitives import patch
from simplexmesh.data.primitives.fits import Fit
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.duality import dual

if TYPE_CHECKING:
    import pyvista as pv

    from simplexmesh.mesh.simplex_mesh import SimplexMesh


PLACES, DIRECTIONS = ("point", "center"), ("axis", "normal", "direction")
"""Names of points and of unit vectors; all others are of numbers above 0."""

NO_WEIGHTS = np.zeros(0)
"""All weights are 1."""

NO_CORNERS = np.zeros(0)
"""Of a profile that is smooth."""

NEWTON_STEPS = 12
"""Along a vertex' normal."""

CONVERGED = 1e-6
"""Share of its way that a vertex may still be off after these."""

ROUNDING = 1e-6
"""... in coordinates, of which distances are known to a millionth of a millionth."""


class Primitive:
    """A surface or curve that a profile makes by turning about an axis.

    A point at the distance `rho` from the axis and the height `z` along it is as far from the primitive as (rho, z) is
    from the profile, which is what kinds differ in. Distances are positive outside. Directions are taken in a local
    frame, so that no pose is singular.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> pipe = sm.primitives.Cylinder([0, 0, 0], [0, 0, 1], 0.5)
    >>> float(pipe.distance([[2, 0, 7]])[0])
    1.5
    """

    kind: ClassVar[str]
    parameter_names: ClassVar[tuple[str, ...]]
    periods: ClassVar[tuple[bool, bool]] = (True, False)
    """Which of the two surface coordinates is an angle that comes around."""

    per_point: ClassVar[int] = 1
    """How many distances a point has from it."""

    _code: ClassVar[int] = -1
    """The kind as kernels know it; -1 of those with distances of their own."""

    _least_slope: ClassVar[float] = -np.inf
    """Of the distance along a normal, with which a vertex goes on."""

    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)
    """Which motions of a frame change it: two tilts of the axis, two shifts across it, one along it, a turn."""

    across: Array | None = None
    """Where coordinates about the axis begin, of those that tell it."""

    fit: Fit | None

    def __post_init__(self) -> None:
        for name in self._names():
            value = getattr(self, name)
            if name in PLACES:
                value = checks.frozen(checks.array(name, value, (3,)))
            elif name in DIRECTIONS:
                value = _direction(name, value)
            else:
                value = checks.number(name, value, 0.0, open_low=True)
            object.__setattr__(self, name, value)
        if self.across is not None:
            object.__setattr__(self, "across", perpendicular("across", self.across, self._pose[1]))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k} {_text(getattr(self, k))}' for k in self._names())})"

    @classmethod
    @cache
    def _names(cls) -> tuple[str, ...]:
        """Return the names of place, direction, and the measures of the shape."""
        return tuple(each.name for each in fields(cast(Any, cls)) if each.name not in ("fit", "across"))

    @classmethod
    def _measures(cls) -> tuple[str, ...]:
        """Return the names of the measures of the shape, besides the pose."""
        return tuple(name for name in cls._names() if name not in PLACES + DIRECTIONS)

    @property
    def _pose(self) -> tuple[Array, Array]:
        """A point of the axis, and its direction."""
        place, direction = self._names()[:2]
        return getattr(self, place), getattr(self, direction)

    @property
    def _knots(self) -> Array:
        """Where along the second coordinate the profile has corners."""
        return NO_CORNERS

    @property
    def _shape(self) -> tuple[float, ...]:
        """The measures besides the pose."""
        return tuple(getattr(self, name) for name in self._names()[2:])

    @property
    def _is_possible(self) -> bool:
        """Whether there is a primitive of this kind and these measures."""
        return bool(kernels.possible(self._code, np.array(self._shape, float)))

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        """Return another one of this kind, without a fit."""
        return cast(Any, type(self))(origin, axis, *shape)

    def _coordinate(self, rho: Array, z: Array) -> Array:
        """Return the coordinate (n,) along the profile."""
        raise NotImplementedError

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        """Return rho and z of points of the profile."""
        raise NotImplementedError

    @property
    def n_parameters(self) -> int:
        """How many numbers tell it."""
        return len(self.parameter_names)

    @cached_property
    def frame(self) -> Array:
        """(3, 3): rows are two directions across the axis, the first where angles begin, and the axis."""
        return checks.frozen(np.concatenate([self._across(), self._pose[1][None]]))

    @property
    def rms(self) -> float:
        """The root mean square distance of the points it was fitted to; NaN of one that was given."""
        return self.fit.rms if self.fit else float("nan")

    @property
    def covariance(self) -> Array | None:
        """The covariance (p, p) of its `parameter_names`, if it was fitted."""
        return self.fit.covariance if self.fit else None

    @property
    def extent(self) -> Array | None:
        """Ranges (2, 2) of the surface coordinates of the points it was fitted to; without a fit it has no ends."""
        return self.fit.extent if self.fit else None

    def as_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain lists and numbers, angles in radians."""
        return {"kind": self.kind} | {name: np.asarray(getattr(self, name)).tolist() for name in self._names()}

    def distance(self, points: ArrayLike) -> Array:
        """Return the signed distances (n,) of points (n, 3), positive outside."""
        return self.measured(points)[0]

    def gradient(self, points: ArrayLike) -> Array:
        """Return the unit vectors (n, 3) in which the distance grows; 0 across the axis where they are undefined."""
        return self.measured(points)[1]

    def measured(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return distances (n,) and gradients (n, 3) of points (n, 3) at once."""
        at = checks.array("points", points, (None, 3))
        out = np.empty(len(at)), np.empty_like(at)
        kernels.fill_distances(self._surface, at, *out)
        return out

    def projected(self, points: ArrayLike) -> Array:
        """Return the nearest points (n, 3) of the surface or curve; one of them where several are as near."""
        return self.at(self.coordinates(points))

    def coordinates(self, points: ArrayLike) -> Array:
        """Return the surface coordinates (n, 2) of the nearest points: the angle about the axis, then the other."""
        x, y, z = self._local(points).T
        return np.stack([np.arctan2(y, x), self._coordinate(np.hypot(x, y), z)], axis=1)

    def at(self, coordinates: ArrayLike) -> Array:
        """Return the points (n, 3) of surface coordinates (n, 2)."""
        u, v = checks.array("coordinates", coordinates, (None, 2)).T
        rho, z = self._on_profile(v)
        return self._pose[0] + np.column_stack([rho * np.cos(u), rho * np.sin(u), z]) @ self.frame

    def transformed(self, T_target_source: ArrayLike) -> Self:
        """Return it in the target frame of a similarity (4, 4), without its fit."""
        matrix = checks.affine("T_target_source", T_target_source)
        scale = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
        if not np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, scale**2 * np.eye(3), atol=1e-9 * scale**2):
            raise ValueError("T_target_source must have one scale: primitives stay what they are by no other map")
        origin, axis = self._pose
        moved = matrix[:3, :3] @ origin + matrix[:3, 3]
        out = self._with(moved, matrix[:3, :3] @ axis / scale, *self._scaled(scale))
        return out if self.across is None else replace(cast(Any, out), across=matrix[:3, :3] @ self.across)

    def centered(self, points: ArrayLike) -> Self:
        """Return the same surface, where it has a choice with the point nearest to the middle of points (n, 3)."""
        free = [k for k in range(3) if k + 2 not in self._moves]
        if not free:
            return self
        origin, axis = self._pose
        along = self.frame[free]
        to = checks.array("points", points, (None, 3)).mean(axis=0) - origin
        return self._with(origin + (to @ along.T) @ along, axis, *self._shape)

    def aligned(self, points: Array) -> Self:
        """Return the same surface, where it has a choice with coordinates along the sides of points (n, 3) of it."""
        return self

    def with_fit(self, fit: Fit) -> Self:
        """Return it with how it was fitted."""
        out: Self = replace(cast(Any, self), fit=fit)
        return out

    def within(self, points: ArrayLike) -> Array:
        """Return the ranges (2, 2) of the surface coordinates of points (n, 3)."""
        values = self.coordinates(points)
        return np.stack([patch.span(values[:, k], periodic=self.periods[k]) for k in range(2)])

    def coverage(self, points: ArrayLike) -> float:
        """Return the share of the turn about the axis that has some of the points (n, 3) near, from 0 to 1.

        Gaps of three median gaps or ten degrees are covered, but none of half a turn.
        """
        turn = np.unique(self.coordinates(points)[:, 0])
        if not len(turn):
            return 0.0
        arcs = np.diff(turn, append=turn[0] + 2 * np.pi)
        gap = np.radians(10)
        counted = np.where(arcs <= np.clip(3 * np.median(arcs), gap, np.radians(179)), arcs, gap)
        return min(float(counted.sum()) / (2 * np.pi), 1.0)

    def derivatives(self, points: ArrayLike) -> Array:
        """Return the derivatives (n, p) of the distances of points (n, 3) by the parameters, for `stepped`."""
        at = checks.array("points", points, (None, 3))
        rows = np.zeros((len(at), self.n_parameters))
        kernels.fill_rows(self._surface, self._columns(), at, rows)
        return rows

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return what a step of least squares needs, of the distances of points (n, 3) with weights (n,).

        The normal matrix (p, p), the downhill vector (p,) and the cost: the sum of d^2, or with a scale s that of
        d^2 / (1 + (d / s)^2). Nothing is checked.
        """
        return self._summed(self._surface, points, NO_WEIGHTS if weights is None else weights, loss_scale or np.inf)

    def stepped(self, step: ArrayLike) -> Self:
        """Return it with its parameters moved by a step (p,): tilts of the axis, shifts, measures."""
        there = kernels.moved(self._surface, self._columns(), np.asarray(step, float).reshape(self.n_parameters))
        return self._with(there.origin, there.frame[2], *there.shape.tolist())

    def sampled(self, count: int, *, rng: np.random.Generator | int = 0) -> PointCloud:
        """Return points spread evenly at random over the part within the extent, of surfaces with their normals."""
        number = checks.integer("count", count, 1)
        points = self.at(
            patch.sampled(self._area_density, self._ends(), number, checks.generator("rng", rng), self._knots)
        )
        return PointCloud(points, self.gradient(points) if self.per_point == 1 else None)

    @property
    def bounds(self) -> Array:
        """(2, 3): the least and greatest coordinates of the part within the extent."""
        corners = patch.extremes(self.frame, self._ends(), self.periods, self._knots)
        at = self.at(corners)
        return np.stack([at.min(axis=0), at.max(axis=0)])

    def triangulated(self, edge: float | None = None) -> TriangleMesh:
        """Return the part within the extent in triangles with edges of about a length, by default 32 a turn."""
        return TriangleMesh(*patch.grid(self, edge))

    def mesh(self, edge: float | None = None) -> SimplexMesh:
        """Return the part within the extent as a simplex mesh, ready to be deformed."""
        return dual(self.triangulated(edge), outward=False)

    def to_pyvista(self) -> pv.PolyData:
        """Return the part within the extent as PyVista's."""
        return self.triangulated().to_pyvista()

    def gap(self, vertices: ArrayLike, normals: ArrayLike, reach: float) -> Array:
        """Return how far along its normal each vertex has the surface, NaN where not within reach: a target of motion.

        Only where the normal leaves the surface on its outside, and within the extent of one that was fitted.
        """
        start, along = checks.array("vertices", vertices, (None, 3)), checks.array("normals", normals, (None, 3))
        way, lost = np.zeros(len(start)), np.zeros(len(start), bool)
        with np.errstate(all="ignore"):
            for _ in range(NEWTON_STEPS):
                at = start + way[:, None] * along
                way = way - self.distance(at) / np.maximum(dot(self.gradient(at), along), self._least_slope)
                lost |= ~np.isfinite(way)
                way = np.where(lost, 0.0, way)
            way = np.where(lost, np.inf, way)
            at = start + np.clip(way, -reach, reach)[:, None] * along
        left = CONVERGED * (np.abs(way) + ROUNDING * np.abs(start).max(axis=1, initial=0.0))
        met = (np.abs(way) <= reach) & (np.abs(self.distance(at)) <= left) & (dot(self.gradient(at), along) > 0)
        if self.extent is not None:
            met &= patch.inside(self.coordinates(at), self.extent, self.periods)
        return np.where(met, way, np.nan)

    def _telling(self, points: Array, noise: float) -> Mask:
        """Return which points (n, 3) tell how well the parameters are known."""
        return np.ones(len(points), bool)

    def _across(self) -> Array:
        """Return two directions (2, 3) across the axis."""
        axis = self._pose[1]
        frame: Array = kernels.framed(axis)
        return frame[:2] if self.across is None else np.stack([self.across, np.cross(axis, self.across)])

    def _scaled(self, scale: float) -> tuple[float, ...]:
        """Return the measures of the shape when lengths are scaled."""
        return tuple(scale * measure for measure in self._shape)

    def _area_density(self, uv: Array) -> Array:
        """Return the area at coordinates (n, 2), up to a factor."""
        return self._on_profile(uv[:, 1])[0]

    def _ends(self) -> Array:
        """Return the extent, or that of the whole surface."""
        if self.extent is not None:
            return self.extent
        if all(self.periods):
            return np.array([[-np.pi, np.pi], [-np.pi, np.pi]])
        raise ValueError(f"a {self.kind} without a fit has no ends: give it an extent with_fit")

    def _local(self, points: ArrayLike) -> Array:
        """Return points (n, 3) in the frame."""
        at = checks.array("points", points, (None, 3))
        return (at - self._pose[0]) @ self.frame.T

    @cached_property
    def _surface(self) -> kernels.Revolution:
        """What kernels read of it."""
        return kernels.Revolution(self._code, self._pose[0], self.frame, np.array(self._shape, float))

    @classmethod
    @cache
    def _columns(cls) -> Indices:
        """Return the parameters (6,) that are the motions of the frame, -1 where there is none."""
        columns = np.full(6, -1)
        columns[list(cls._moves)] = range(len(cls._moves))
        return checks.frozen(columns)

    def _summed(
        self, surface: kernels.Revolution, points: Array, weights: Array, loss_scale: float
    ) -> tuple[Array, Array, float]:
        """Return the normal equations of distances from a surface in this chart."""
        matrix, downhill = np.zeros((self.n_parameters,) * 2), np.zeros(self.n_parameters)
        given = (np.ascontiguousarray(points), weights, loss_scale)
        cost = kernels.normal_equations(surface, self._columns(), *given, matrix, downhill)
        return matrix, downhill, cost


def perpendicular(name: str, value: ArrayLike, axis: Array) -> Array:
    """Return the unit direction (3,) of a vector across an axis."""
    vector = checks.array(name, value, (3,))
    across = normalized(vector - (vector @ axis) * axis)
    if not across.any():
        raise ValueError(f"{name} must not be along the axis or the normal")
    return checks.frozen(across)


def _direction(name: str, value: ArrayLike) -> Array:
    """Return a direction (3,) as a unit vector."""
    vector = checks.array(name, value, (3,))
    length = float(norm(vector))
    if not length > 0:
        raise ValueError(f"{name} must be a direction, not a vector of length 0")
    return checks.frozen(vector / length)


def _text(value: Any) -> str:
    """Return a vector or a number as representations show it."""
    return f"{value:.6g}" if np.ndim(value) == 0 else "(" + ", ".join(f"{x:.6g}" for x in value) + ")"
