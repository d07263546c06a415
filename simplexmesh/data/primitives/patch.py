"""The part of a primitive within ranges of its surface coordinates: samples, bounds, grids of triangles."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask

if TYPE_CHECKING:
    from simplexmesh.data.primitives.base import Primitive


TURN = 2 * np.pi

OPEN = np.pi / 8
"""Gaps between angles that are less wide are between points; without a wider one they are all around."""

STEPS = 32
"""Of a grid in a full turn, by default."""

MOST_STEPS = 2000
"""Of a grid along one coordinate."""


def span(values: Array, *, periodic: bool) -> Array:
    """Return the range (2,) of values; of angles the shortest arc that holds them, or a whole turn from -pi on."""
    if not periodic:
        return np.array([values.min(), values.max()])
    around = np.sort(np.mod(values, TURN))
    gaps = np.diff(np.append(around, around[0] + TURN))
    widest = int(gaps.argmax())
    if gaps[widest] < OPEN:
        return np.array([-np.pi, np.pi])
    start = np.mod(around[(widest + 1) % len(around)] + np.pi, TURN) - np.pi
    return np.array([start, start + TURN - gaps[widest]])


def inside(coordinates: Array, ends: Array, periods: tuple[bool, bool]) -> Mask:
    """Return which coordinates (n, 2) are within ranges."""
    out = np.ones(len(coordinates), bool)
    for k, periodic in enumerate(periods):
        after = coordinates[:, k] - ends[k, 0]
        after = np.mod(after, TURN) if periodic else after
        out &= (after >= 0) & (after <= ends[k, 1] - ends[k, 0])
    return out


def sampled(
    density: Callable[[Array], Array], ends: Array, count: int, rng: np.random.Generator, knots: Array
) -> Array:
    """Return coordinates (count, 2) within ranges at random by a density of area, by rejection."""
    v = _line(ends[1], 256, knots)
    most = 1.001 * density(np.column_stack([np.full_like(v, ends[0, 0]), v])).max()
    found = [np.zeros((0, 2))]
    while sum(map(len, found)) < count:
        tried = rng.uniform(ends[:, 0], ends[:, 1], (2 * count + 16, 2))
        found.append(tried[rng.uniform(0, most, len(tried)) < density(tried)])
    return np.concatenate(found)[:count]


def extremes(frame: Array, ends: Array, periods: tuple[bool, bool], knots: Array) -> Array:
    """Return coordinates (n, 2) among which are those of the least and greatest x, y and z within ranges.

    Along a circle about the axis a component is extreme where its direction across the axis points, or away from that;
    along a round profile, where the direction does in the half-plane through the axis.
    """
    out = []
    for k in range(3):
        across = np.arctan2(frame[1, k], frame[0, k])
        for u in (*ends[0], across, across + np.pi):
            up = np.arctan2(frame[2, k], np.cos(u) * frame[0, k] + np.sin(u) * frame[1, k])
            out += [(u, v) for v in (*ends[1], *knots, up, up - np.pi, up + np.pi)]
    coordinates = np.array(out)
    corners = np.array([(u, v) for u in ends[0] for v in ends[1]])
    return np.concatenate([corners, coordinates[inside(coordinates, ends, periods)]])


def grid(primitive: Primitive, edge: float | None) -> tuple[Array, Indices]:
    """Return vertices and triangles of the part within the extent, with edges of about a length.

    Columns that come around are one, and rows on the axis one vertex.
    """
    ends = primitive._ends()
    closed = [
        periodic and bool(np.diff(row) > TURN - 1e-9) for row, periodic in zip(ends, primitive.periods, strict=True)
    ]
    counts = _steps(primitive, ends, edge)
    u, v = np.linspace(ends[0, 0], ends[0, 1], counts[0] + 1), _line(ends[1], counts[1], primitive._knots)
    index = np.arange(len(u) * len(v)).reshape(len(u), len(v))
    points = primitive.at(np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2))
    if closed[0]:
        index[-1] = index[0]
    rounding = 1e-9 * np.ptp(points, axis=0).max()
    if closed[1] or np.abs(points[index[:, 0]] - points[index[:, -1]]).max() < rounding:
        index[:, -1] = index[:, 0]
    for k in (0, -1):
        if np.ptp(points[index[:, k]], axis=0).max() < rounding:
            index[:, k] = index[0, k]
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3).astype(np.int64)


def _line(ends: Array, steps: int, knots: Array) -> Array:
    """Return coordinates (n,) between ends, in even steps and where there are knots."""
    margin = 1e-9 * (ends[1] - ends[0])
    within = knots[(knots > ends[0] + margin) & (knots < ends[1] - margin)]
    even = np.linspace(ends[0], ends[1], steps + 1)
    far = np.abs(even[:, None] - within).min(axis=1, initial=np.inf) > 0.25 * (ends[1] - ends[0]) / steps
    far[[0, -1]] = True
    return np.sort(np.append(even[far], within))


def _steps(primitive: Primitive, ends: Array, edge: float | None) -> list[int]:
    """Return how many steps a grid takes along both coordinates, at least three about a full turn."""
    lengths = []
    for k in (0, 1):
        along = np.tile(ends.mean(axis=1), (65, 1))
        along[:, k] = np.linspace(ends[k, 0], ends[k, 1], 65)
        rows = [along] if k else [np.column_stack([along[:, 0], np.full(65, v)]) for v in (*ends[1], ends[1].mean())]
        lengths.append(max(float(np.linalg.norm(np.diff(primitive.at(row), axis=0), axis=1).sum()) for row in rows))
    turn = float(np.diff(ends[0])[0]) / TURN if primitive.periods[0] else 1.0
    size = edge if edge is not None else max(lengths[0] / max(turn, 1e-3), 1e-300) / STEPS
    wanted = [length / size for length in lengths]
    if edge is None and primitive.periods[1]:  # a tube, however thin
        wanted[1] = STEPS * float(np.diff(ends[1])[0]) / TURN
    least = [3 if periodic else 1 for periodic in primitive.periods]
    return [min(MOST_STEPS, max(low, round(steps))) for low, steps in zip(least, wanted, strict=True)]
