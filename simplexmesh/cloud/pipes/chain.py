"""A run of pipe as one primitive: straights along a polyline, and in each of its corners a bend tangent to both."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.cloud.pipes import _kernels_chain
from simplexmesh.cloud.pipes._kernels_chain import LEAST_ANGLE
from simplexmesh.data.primitives._kernels_profiles import framed

MOST_ANGLE = np.radians(170)
"""Of a bend that is fitted, or at an end: at half a turn its corner is at infinity."""

SHORTEST = 1e-6
"""Length of a straight, in radii, that is none."""

TIGHT = 1.1
"""Radius in radii of the pipe below which a bend may be a corner: where it is 1, narrower ones are not fitted."""

LEAST_CHANGE = 1e-4
"""Length of a change of the radius, in radii, at least: more than what its derivatives are differences over."""


class Feet(NamedTuple):
    """Where points are nearest to the axis of a chain, which goes on straight at its ends.

    Attributes
    ----------
    piece : (n,) array of int
        2 j on straight j, 2 i + 1 in bend i.
    along, station : (n,) array of float
        Height from the straight's first corner, or angle turned in the bend; length along the axis.
    radius, distance : (n,) array of float
        Radius of the pipe, and signed distance of the point from its surface, positive outside.
    normal : (n, 3) array of float
        Unit outward direction in which that grows.
    """

    piece: Indices
    along: Array
    station: Array
    radius: Array
    distance: Array
    normal: Array


@dataclass(frozen=True, eq=False)
class Chain:
    """Cylinders along the segments of a polyline, and in each corner the torus tangent to two of them.

    Tangency is exact by construction: a bend has its center on the bisector of its corner, at the distance at which its
    circle touches both segments. Of radius 0 it is a miter: the cylinders end at the plane that halves the corner, and
    are not tangent. Radii change along straights, linearly between two heights, where the
    axis may be moved across as well: it is parallel on both sides, and sections are circles at right angles to it. A
    chain of one radius is closed if it ends where it begins: on the segment between its last corner and its first one.

    Attributes
    ----------
    corners : (m, 3) array of float
        Ends and corners of the axis.
    bend_radii : (m - 2,) array of float
        Of the axis in each corner; where it is 0, it stays so in fits.
    radii : (k,) array of float
        Of the pipe, in order.
    changes : (k - 1, 3) array of float
        Where the radius changes: the segment, and the heights from its first corner between which it does.
    offsets : (k - 1, 3) array of float, optional
        By which the axis is moved across there; where that is 0, by default everywhere, it stays so in fits.
    """

    corners: Array
    bend_radii: Array
    radii: Array
    changes: Array
    offsets: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        if not len(self.offsets):
            object.__setattr__(self, "offsets", np.zeros((len(self.changes), 3)))
        checks.array("offsets", self.offsets, (len(self.changes), 3))
        for each in fields(self):
            object.__setattr__(self, each.name, checks.frozen(getattr(self, each.name)))

    @cached_property
    def _axis(self) -> _kernels_chain.Axis:
        """All of the following."""
        return _kernels_chain.axis_of(self.corners, self.bend_radii, self.radii, self.changes, self.offsets)

    @property
    def directions(self) -> Array:
        """(m - 1, 3) unit directions of the segments."""
        return self._axis.directions

    @property
    def lengths(self) -> Array:
        """(m - 1,) lengths of the segments."""
        return self._axis.lengths

    @property
    def angles(self) -> Array:
        """(m - 2,) angles by which the corners turn."""
        return self._axis.angles

    @property
    def reaches(self) -> Array:
        """(m - 2,) lengths that bends take from the segments on both sides of their corner."""
        return self._axis.reaches

    @property
    def centers(self) -> Array:
        """(m - 2, 3) centers of the bends."""
        return self._axis.centers

    @property
    def outward(self) -> Array:
        """(m - 2, 3) unit directions from the centers of bends to their starts."""
        return self._axis.outward

    @property
    def limits(self) -> Array:
        """(m - 1, 2) heights from the first corner of each segment at which its straight starts and ends."""
        return self._axis.limits

    @property
    def stations(self) -> Array:
        """(2 m - 2,) lengths along the axis at which its pieces start, and at which it ends."""
        return self._axis.stations

    @cached_property
    def closed(self) -> bool:
        """Whether it ends where it begins."""
        return len(self.corners) > 4 and bool(norm(self.corners[-1] - self.corners[0]) < SHORTEST * self.radii.min())

    def at(self, stations: ArrayLike) -> tuple[Array, Array]:
        """Return points (n, 3) of the axis and its directions at lengths along it; it goes on straight at the ends."""
        lengths = np.asarray(stations, float)
        piece = np.clip(np.searchsorted(self.stations, lengths, side="right") - 1, 0, len(self.stations) - 2)
        after = lengths - self.stations[piece]
        j = piece // 2
        along = self.directions[j]
        height = self.limits[j, 0] + after
        points = self.corners[j] + height[:, None] * along
        for (segment, low, high), offset in zip(self.changes, self.offsets, strict=True):
            share = np.clip((height - low) / (high - low), 0, 1) * (j == segment)
            points += share[:, None] * offset
        bend = piece % 2 == 1
        if bend.any():
            i = j[bend]
            turn = after[bend] / self.bend_radii[i]
            cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
            out, on = self.outward[i], self.directions[i]
            points[bend] = self.centers[i] + self.bend_radii[i, None] * (cos * out + sin * on)
            along = along.copy()
            along[bend] = cos * on - sin * out
        return points, along

    def feet(self, points: ArrayLike) -> Feet:
        """Return where points (n, 3) are nearest to the axis."""
        at = np.ascontiguousarray(points, float)
        along, station, radius, distance = np.zeros((4, len(at)))
        out = Feet(np.zeros(len(at), np.int64), along, station, radius, distance, np.zeros_like(at))
        _kernels_chain.fill_feet(self._axis, at, *out)
        return out

    def measured(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return the distances (n,) of points (n, 3), and the unit outward directions (n, 3) in which they grow."""
        feet = self.feet(points)
        return feet.distance, feet.normal

    def distance(self, points: ArrayLike) -> Array:
        """Return the signed distances (n,) of points (n, 3) from the surface, positive outside."""
        return self.feet(points).distance

    @property
    def n_parameters(self) -> int:
        """Of `stepped`: ends across the axis, corners, bend radii, radii, low and high ends of changes, offsets."""
        return self.sizes.stop + 2 * len(self.changes) + 2 * int(self.eccentric.sum())

    @cached_property
    def eccentric(self) -> Mask:
        """(k - 1,) whether the axis is moved across where the radius changes."""
        return np.any(self.offsets != 0, axis=1)

    @property
    def sizes(self) -> slice:
        """Where the radii of the pipe are among the parameters."""
        start = 3 * len(self.corners) - (6 if self.closed else 2) + len(self.bend_radii)
        return slice(start, start + len(self.radii))

    @cached_property
    def _moves(self) -> Array:
        """(q, p): by the parameters, how all coordinates of corners, bend radii, radii, changes and offsets move."""
        rows, columns, ends = 3 * len(self.corners), self.n_parameters, 0 if self.closed else 2
        inner = slice(ends, ends + rows - 6)
        plain = columns - inner.stop - ends - 2 * int(self.eccentric.sum())
        out = np.zeros((rows + plain + self.offsets.size, columns))
        out[3 : rows - 3, inner] = np.eye(rows - 6)
        out[rows : rows + plain, inner.stop + ends : inner.stop + ends + plain] = np.eye(plain)
        for i, k in enumerate(np.flatnonzero(self.eccentric)):
            row, column = rows + plain + 3 * k, inner.stop + ends + plain + 2 * i
            out[row : row + 3, column : column + 2] = framed(self.directions[int(self.changes[k, 0])])[:2].T
        if self.closed:
            share = norm(self.corners[0] - self.corners[-2]) / norm(self.corners[1] - self.corners[-2])
            out[:3] = out[rows - 3 : rows] = share * out[3:6] + (1 - share) * out[rows - 6 : rows - 3]
        else:
            out[:3, :2] = framed(self.directions[0])[:2].T
            out[rows - 3 : rows, inner.stop : inner.stop + 2] = framed(self.directions[-1])[:2].T
        return out

    @property
    def ends_in_bends(self) -> tuple[bool, bool]:
        """Whether there is no straight before the first bend, and behind the last one."""
        empty = np.diff(self.limits, axis=1)[[0, -1], 0] < SHORTEST * self.radii.min() * bool(len(self.bend_radii))
        return bool(empty[0]) and not self.closed, bool(empty[1]) and not self.closed

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return the normal matrix (p, p) of the distances of points, the downhill vector (p,) and the cost."""
        q = len(self._moves)
        matrix, downhill = np.zeros((q, q)), np.zeros(q)
        given = np.zeros(0) if weights is None else weights
        scale = np.inf if loss_scale is None else loss_scale
        at = np.ascontiguousarray(points)
        cost = _kernels_chain.normal_equations(self._axis, at, given, scale, matrix, downhill)
        matrix += np.tril(matrix, -1).T
        return self._moves.T @ matrix @ self._moves, self._moves.T @ downhill, cost

    def stepped(self, step: ArrayLike) -> Chain:
        """Return the chain with its parameters moved; bends stay wide enough for the pipe, and short enough."""
        moved = self.moved(step)
        if (np.diff(moved.changes[:, 1:]) < LEAST_CHANGE * self.radii.min()).any():
            raise ValueError("changes of the radius must be of some length")
        return moved.fitting()

    def moved(self, step: ArrayLike) -> Chain:
        """Return the chain with its parameters moved, whether or not bends then have room."""
        moves = self._moves @ np.asarray(step, float)
        cuts = np.cumsum([each.size for each in self._parameters[:-1]])
        parts = [part.reshape(old.shape) for part, old in zip(np.split(moves, cuts), self._parameters, strict=True)]
        corners, bends, radii, ends, offsets = (old + part for part, old in zip(parts, self._parameters, strict=True))
        changes = np.column_stack([self.changes[:, 0], ends])
        if self.eccentric.any():
            along = Chain(corners, bends, radii, changes, offsets).directions[self.changes[:, 0].astype(int)]
            offsets -= dot(offsets, along)[:, None] * along
        return Chain(corners, bends, np.maximum(radii, 0.5 * self.radii), changes, offsets)

    @property
    def _parameters(self) -> tuple[Array, ...]:
        return self.corners, self.bend_radii, self.radii, self.changes[:, 1:], self.offsets

    def fitting(self) -> Chain:
        """Return the chain with bends at least as wide as the pipe, and that share the segments between them.

        Its ends are drawn out where bends need more than the first and the last segment. A closed one is made to begin
        in the middle of its first straight.
        """
        chain = self.begun(0.5) if self.closed else self
        bends = np.where(chain.are_miters, 0.0, np.maximum(chain.bend_radii, chain._least_bends))
        reaches = np.where(chain.angles > LEAST_ANGLE, bends * np.tan(chain.angles / 2), 0.0)
        before, after = np.append(0.0, reaches), np.append(reaches, 0.0)  # at both ends of each segment
        room_after, room_before = (np.maximum(chain.lengths / 2, chain.lengths - x) for x in (before, after))
        if not self.closed:
            room_after[0] = room_before[-1] = np.inf
        room = np.minimum(np.minimum(room_after[:-1], room_before[1:]), reaches)
        share = np.divide(room, reaches, out=np.ones_like(reaches), where=reaches > 0)
        if chain is self and (bends * share == self.bend_radii).all() and (np.diff(self.limits[[0, -1]]) >= 0).all():
            return self
        corners, changes = chain.corners.copy(), chain.changes.copy()
        if len(bends) and not self.closed:
            first, last = np.maximum((reaches * share)[[0, -1]] * (1 + 1e-9) - self.lengths[[0, -1]], 0.0)
            corners[0] -= first * self.directions[0]
            corners[-1] += last * self.directions[-1]
            changes[changes[:, 0] == 0, 1:] += first
        return Chain(corners, bends * share, self.radii, changes, self.offsets)

    @property
    def _least_bends(self) -> Array:
        """(m - 2,) radii of the pipe in the corners."""
        return self.radii[np.searchsorted(self.changes[:, 0], np.arange(1, len(self.corners) - 1) - 0.5)]

    @property
    def are_short(self) -> Mask:
        """(m - 2,) whether there was no room for a bend as wide as the pipe."""
        return (self.bend_radii < (1 - SHORTEST) * self._least_bends) & ~self.are_miters

    @property
    def are_tight(self) -> Mask:
        """(m - 2,) whether bends are hardly wider than the pipe, or less."""
        return (self.bend_radii < TIGHT * self._least_bends) & ~self.are_miters

    @property
    def are_miters(self) -> Mask:
        """(m - 2,) whether two straights are cut aslant and joined: there is no bend, and none comes in fits."""
        return self.bend_radii == 0

    def begun(self, share: float) -> Chain:
        """Return a closed chain that begins at a share of the way from its last corner to its first one."""
        corners = self.corners.copy()
        corners[[0, -1]] = (1 - share) * corners[-2] + share * corners[1]
        return replace(self, corners=corners)


def chain_of(corners: ArrayLike, bend_radii: ArrayLike, radius: float) -> Chain:
    """Return a chain of one radius."""
    return Chain(*(np.asarray(each, float) for each in (corners, bend_radii, [radius], np.zeros((0, 3)))))
