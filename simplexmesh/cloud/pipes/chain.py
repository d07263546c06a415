"""A run of pipe as one primitive: straights along a polyline, and in each of its corners a bend tangent to both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.vectors import cross, dot, norm, normalized, tangents

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LEAST_ANGLE = 1e-4
"""Of a corner with a bend, in radians: below it the direction of the bend's plane is lost to rounding."""

TIGHTEST = 1.0
"""Bend radius in radii of the pipe at which a torus touches itself."""


class Feet(NamedTuple):
    """Where points are nearest to the axis of a chain."""

    piece: Indices  # (n,) 2 j for straight j, 2 i - 1 for the bend in corner i
    along: Array  # (n,) height from the straight's first corner, or angle turned in the bend
    foot: Array  # (n, 3) on the axis


@dataclass(frozen=True, eq=False)
class Chain:
    """Cylinders along the segments of a polyline, and in each corner the torus tangent to two of them.

    Tangency is exact by construction: a bend has its center on the bisector of its corner, at the distance at which its
    circle touches both segments. Radii change along straights, linearly between two heights.

    Attributes
    ----------
    corners : (m, 3) array of float
        Ends and corners of the axis.
    bend_radii : (m - 2,) array of float
        Of the axis in each corner.
    radii : (k,) array of float
        Of the pipe, in order.
    changes : (k - 1, 3) array of float
        Where the radius changes: the segment, and the heights from its first corner between which it does.
    """

    corners: Array
    bend_radii: Array
    radii: Array
    changes: Array

    @cached_property
    def directions(self) -> Array:
        """(m - 1, 3) unit directions of the segments."""
        return normalized(np.diff(self.corners, axis=0))

    @cached_property
    def lengths(self) -> Array:
        """(m - 1,) lengths of the segments."""
        return norm(np.diff(self.corners, axis=0))

    @cached_property
    def _spans(self) -> Array:
        """(m - 1,) lengths of the segments to divide by, not 0."""
        return np.maximum(self.lengths, 1e-9 * self.radii.min())

    @cached_property
    def angles(self) -> Array:
        """(m - 2,) angles by which the corners turn."""
        before, after = self.directions[:-1], self.directions[1:]
        return np.arctan2(norm(cross(before, after)), dot(before, after))

    @cached_property
    def reaches(self) -> Array:
        """(m - 2,) lengths that bends take from the segments on both sides of their corner."""
        return np.where(self.angles > LEAST_ANGLE, self.bend_radii * np.tan(self.angles / 2), 0.0)

    @cached_property
    def centers(self) -> Array:
        """(m - 2, 3) centers of the bends."""
        before, after = self.directions[:-1], self.directions[1:]
        sine = np.maximum(np.sin(self.angles), LEAST_ANGLE)
        return self.corners[1:-1] + (self.bend_radii / sine)[:, None] * (after - before)

    @cached_property
    def outward(self) -> Array:
        """(m - 2, 3) unit directions from the centers of bends to their starts."""
        before, after = self.directions[:-1], self.directions[1:]
        return normalized(dot(before, after)[:, None] * before - after)

    @cached_property
    def limits(self) -> Array:
        """(m - 1, 2) heights from the first corner of each segment at which its straight starts and ends."""
        before, after = np.append(0.0, self.reaches), np.append(self.reaches, 0.0)
        return np.stack([before, self.lengths - after], axis=1)

    @cached_property
    def stations(self) -> Array:
        """(2 m - 2,) lengths along the axis at which its pieces start, and at which it ends."""
        lengths = np.zeros(2 * len(self.lengths) - 1)
        lengths[::2] = np.diff(self.limits, axis=1)[:, 0]
        lengths[1::2] = self.bend_radii * self.angles
        return np.append(0.0, np.cumsum(lengths))

    def station(self, feet: Feet) -> Array:
        """Return the length along the axis (n,) of feet."""
        straight = feet.piece % 2 == 0
        some = np.append(self.bend_radii, 0.0)
        along = np.where(straight, feet.along - self.limits[feet.piece // 2, 0], feet.along * some[feet.piece // 2])
        return self.stations[feet.piece] + along

    def at(self, stations: ArrayLike) -> tuple[Array, Array]:
        """Return points (n, 3) of the axis and its directions at lengths along it; it goes on straight at the ends."""
        lengths = np.asarray(stations, float)
        piece = np.clip(np.searchsorted(self.stations, lengths, side="right") - 1, 0, len(self.stations) - 2)
        after = lengths - self.stations[piece]
        j = piece // 2
        along = self.directions[j]
        points = self.corners[j] + (self.limits[j, 0] + after)[:, None] * along
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

    def _nearest_piece(self, points: Array) -> Indices:
        """Return the piece (n,) of the nearest of samples of the axis."""
        tree, piece = self._samples
        out: Indices = piece[tree.query(points)[1]]
        return out

    @cached_property
    def _samples(self) -> tuple[cKDTree, Indices]:
        """Points along the axis in a tree, and their pieces."""
        step = 0.5 * float(self.radii.min())
        counts = np.clip(np.ceil(np.diff(self.stations) / step), 1, 10_000).astype(int)
        piece = np.repeat(np.arange(len(counts)), counts)
        within = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[piece]
        return cKDTree(self.at(self.stations[piece] + within * np.diff(self.stations)[piece])[0]), piece

    def feet(self, points: Array, near: Indices | None = None) -> Feet:
        """Return the nearest points of the axis, straight on at its ends; `near` are pieces (n,) next to theirs."""
        piece = self._nearest_piece(points) if near is None else near
        along = self._along(points, piece)
        last = 2 * len(self.lengths) - 2
        for _ in range(3):  # a sample of a neighboring piece may be nearer than one of its own
            low, high = self._range(piece)
            move = np.where(along > high, 1, np.where(along < low, -1, 0))
            wanted = np.clip(piece + move, 0, last)
            moved = np.flatnonzero(wanted != piece)
            if not len(moved):
                break
            other = self._along(points[moved], wanted[moved])
            piece = piece.copy()
            piece[moved], along[moved] = wanted[moved], other
        low, high = self._range(piece)
        along = np.where(piece == 0, np.minimum(along, high), np.where(piece == last, np.maximum(along, low), along))
        inside = (piece > 0) & (piece < last)
        along = np.where(inside, np.clip(along, low, high), along)
        return Feet(piece, along, self._foot(piece, along))

    def radius_at(self, feet: Feet) -> tuple[Array, Array]:
        """Return the radius (n,) of the pipe at feet, and its slope along the axis."""
        lower, upper, share, length = self._blend(feet)
        step = self.radii[upper] - self.radii[lower]
        slope = np.where((share > 0) & (share < 1), step / np.where(length > 0, length, 1.0), 0.0)
        return self.radii[lower] + share * step, slope

    def distance(self, points: ArrayLike, feet: Feet | None = None) -> Array:
        """Return the signed distances (n,) of points (n, 3) from the surface, positive outside."""
        at = np.asarray(points, float)
        feet = self.feet(at) if feet is None else feet
        radius, slope = self.radius_at(feet)
        return (norm(at - feet.foot) - radius) / np.hypot(1.0, slope)

    def gradient(self, points: ArrayLike) -> Array:
        """Return the unit outward directions (n, 3) in which the distance grows."""
        at = np.asarray(points, float)
        feet = self.feet(at)
        slope = self.radius_at(feet)[1][:, None]
        return normalized(normalized(at - feet.foot) - slope * self.directions[feet.piece // 2])

    def derivatives(self, points: ArrayLike, feet: Feet | None = None) -> Array:
        """Return the derivatives (n, p) of the distances by the parameters, for `stepped`.

        A move of the axis at a foot, across the axis, changes the distance against the direction of the point; the
        foot may slide along the axis without effect.
        """
        at = np.asarray(points, float)
        feet = self.feet(at) if feet is None else feet
        m, n = len(self.corners), len(at)
        radius, slope = self.radius_at(feet)
        flat, away = 1 / np.hypot(1.0, slope), norm(at - feet.foot)
        out = (normalized(at - feet.foot)) * flat[:, None]
        by_corner, by_bend = np.zeros((n, m, 3)), np.zeros((n, max(m - 2, 0)))
        self._fill_straights(feet, out, by_corner, slope, away)
        self._fill_bends(feet, out, by_corner, by_bend)
        lower, upper, share, length = self._blend(feet)
        steeper = (away - radius) * slope * flat**3 / np.where(slope, length, 1.0)
        by_radius, rows = np.zeros((n, len(self.radii))), np.arange(n)
        np.add.at(by_radius, (rows, lower), steeper - (1 - share) * flat)
        np.add.at(by_radius, (rows, upper), -steeper - share * flat)
        ends = [by_corner[:, k] @ self._across(k).T for k in (0, -1)]
        inner = by_corner[:, 1:-1].reshape(n, -1)
        return np.hstack([ends[0], inner, ends[1], by_bend, by_radius])

    def stepped(self, step: ArrayLike) -> Chain:
        """Return the chain with its parameters moved: ends across the axis, corners, bend radii, radii.

        Bends stay wide enough for the pipe, and short enough for the segments.
        """
        moves = np.asarray(step, float)
        m, b = len(self.corners), len(self.bend_radii)
        corners = self.corners.copy()
        corners[0] += moves[:2] @ self._across(0)
        corners[1:-1] += moves[2 : 2 + 3 * (m - 2)].reshape(-1, 3)
        corners[-1] += moves[3 * m - 4 : 3 * m - 2] @ self._across(-1)
        bends = self.bend_radii + moves[3 * m - 2 : 3 * m - 2 + b]
        radii = self.radii + moves[3 * m - 2 + b :]
        return Chain(corners, bends, np.maximum(radii, 0.5 * self.radii), self.changes).fitting()

    def fitting(self) -> Chain:
        """Return the chain with bends at least as wide as the pipe, and that share the segments between them."""
        least = TIGHTEST * self.radii[np.searchsorted(self.changes[:, 0], np.arange(1, len(self.corners) - 1) - 0.5)]
        bends = np.maximum(self.bend_radii, least)
        reaches = np.where(self.angles > LEAST_ANGLE, bends * np.tan(self.angles / 2), 0.0)
        before, after = np.append(0.0, reaches), np.append(reaches, 0.0)  # at both ends of each segment
        room_after, room_before = (np.maximum(self.lengths / 2, self.lengths - x) for x in (before, after))
        room = np.minimum(room_after[:-1], room_before[1:]) / np.maximum(reaches, 1e-300)
        return Chain(self.corners, bends * np.minimum(room, 1.0), self.radii, self.changes)

    def _across(self, end: int) -> Array:
        """Return two directions (2, 3) across the first or the last segment."""
        return np.stack(tangents(self.directions[end]))

    def _range(self, piece: Indices) -> tuple[Array, Array]:
        """Return the least and greatest height, or angle, on pieces."""
        straight, j = piece % 2 == 0, piece // 2
        angles = np.append(self.angles, 0.0)
        return np.where(straight, self.limits[j, 0], 0.0), np.where(straight, self.limits[j, 1], angles[j])

    def _along(self, points: Array, piece: Indices) -> Array:
        """Return the heights of points on straights, and the angles in bends, from -pi + half the bend's on."""
        j = piece // 2
        out = dot(points - self.corners[j], self.directions[j])
        bend = np.flatnonzero(piece % 2)
        i = j[bend]
        arm, half = points[bend] - self.centers[i], self.angles[i] / 2
        turn = np.arctan2(dot(arm, self.directions[i]), dot(arm, self.outward[i]))
        out[bend] = np.mod(turn - half + np.pi, 2 * np.pi) - np.pi + half
        return out

    def _foot(self, piece: Indices, along: Array) -> Array:
        """Return the points (n, 3) of the axis at heights and angles of pieces."""
        j = piece // 2
        out = self.corners[j] + along[:, None] * self.directions[j]
        bend = np.flatnonzero(piece % 2)
        i, turn = j[bend], along[bend, None]
        arm = np.cos(turn) * self.outward[i] + np.sin(turn) * self.directions[i]
        out[bend] = self.centers[i] + self.bend_radii[i, None] * arm
        return out

    def _blend(self, feet: Feet) -> tuple[Indices, Indices, Array, Array]:
        """Return the radii between which feet are, the share of the second, and the length of the change."""
        j = feet.piece // 2
        height = np.where(feet.piece % 2, np.inf, feet.along)
        lower = np.searchsorted(self.changes[:, 0], j).astype(np.int64)
        upper, share, length = lower.copy(), np.zeros(len(j)), np.zeros(len(j))
        for k, (segment, start, end) in enumerate(self.changes):
            here = (j == segment) & (height > start)
            upper[here] = k + 1
            share[here] = np.clip((height[here] - start) / max(end - start, 1e-300), 0.0, 1.0)
            lower[here & (height >= end)] = k + 1
            length[here] = end - start
        return lower, upper, share, length

    def _fill_straights(self, feet: Feet, out: Array, by_corner: Array, slope: Array, away: Array) -> None:
        """Fill the derivatives by the two corners of the segments of feet; where radii change heights count too."""
        at = np.flatnonzero(feet.piece % 2 == 0)
        j = feet.piece[at] // 2
        share = ((feet.along[at] + slope[at] * away[at]) / self._spans[j])[:, None]
        fall = (slope[at] / np.hypot(1.0, slope[at]))[:, None]
        by_corner[at, j] = -(1 - share) * out[at] + fall * self.directions[j]
        by_corner[at, j + 1] = -share * out[at]

    def _fill_bends(self, feet: Feet, out: Array, by_corner: Array, by_bend: Array) -> None:
        """Fill the derivatives by the three corners, and the radii, of the bends of feet.

        A point of a bend is its corner, plus bend radius times A along the first and B along the second segment.
        """
        at = np.flatnonzero(feet.piece % 2)
        i = feet.piece[at] // 2
        turn, angle, radius = feet.along[at], self.angles[i], self.bend_radii[i]
        before, after, away = self.directions[i], self.directions[i + 1], out[at]
        sin, cos = np.sin(angle), np.cos(angle)
        first = (np.cos(turn) * cos - 1) / sin + np.sin(turn)
        second = (1 - np.cos(turn)) / sin
        by_angle = ((cos - np.cos(turn)) * dot(away, before) - (1 - np.cos(turn)) * cos * dot(away, after)) / sin**2
        on_before = (radius * first)[:, None] * away - (radius * by_angle / sin)[:, None] * after
        on_after = (radius * second)[:, None] * away - (radius * by_angle / sin)[:, None] * before
        on_before = (on_before - dot(on_before, before)[:, None] * before) / self._spans[i, None]
        on_after = (on_after - dot(on_after, after)[:, None] * after) / self._spans[i + 1, None]
        by_corner[at, i] = on_before
        by_corner[at, i + 1] = -away - on_before + on_after
        by_corner[at, i + 2] = -on_after
        by_bend[at, i] = -(first * dot(away, before) + second * dot(away, after))


def chain_of(corners: ArrayLike, bend_radii: ArrayLike, radius: float) -> Chain:
    """Return a chain of one radius."""
    points = checks.frozen(np.asarray(corners, float))
    return Chain(points, np.asarray(bend_radii, float), np.array([radius]), np.zeros((0, 3)))
