"""Tubes around the axes of chains, in triangles."""

from __future__ import annotations

import itertools

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, normalized, tangents
from simplexmesh.cloud.pipes.chain import Chain

AROUND = 32
"""Vertices of a ring, by default."""

LEAST_AROUND = 6
"""Vertices of a ring whose edges are longer than the pipe is wide."""


def swept(chain: Chain, edge: float | None) -> tuple[Array, Indices]:
    """Return vertices and triangles of the surface of a chain, in rings across its axis that hardly twist."""
    turn = 2 * np.pi * float(chain.radii.max())
    size = turn / AROUND if edge is None else edge
    around = max(LEAST_AROUND, round(turn / size))
    stations = _stations(chain, size)
    points, along = chain.at(stations)
    radius = chain.feet(points).radius
    u = _untwisted(along)
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :, None]
    if chain.closed:
        twist = np.arctan2(dot(cross(u[-1], u[0]), along[0]), u[-1] @ u[0])
        angle = angle + twist * (stations / stations[-1])[:, None, None]
    out = np.cos(angle) * u[:, None] + np.sin(angle) * cross(along, u)[:, None]
    rings = points[:, None] + radius[:, None, None] * out
    for k in np.flatnonzero(chain.are_miters):
        at, half = int(np.abs(stations - chain.stations[2 * k + 1]).argmin()), chain.directions[k : k + 2].sum(axis=0)
        rings[at] -= np.outer((rings[at] - points[at]) @ half / (along[at] @ half), along[at])
    vertices = rings.reshape(-1, 3)
    index = np.arange(len(stations) * around).reshape(len(stations), around)
    if chain.closed:
        vertices, index[-1] = vertices[: index[-1, 0]], index[0]
    next_around = np.roll(index, -1, axis=1)
    a, b, c, d = index[:-1], next_around[:-1], next_around[1:], index[1:]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    return vertices, faces


def _stations(chain: Chain, size: float) -> Array:
    """Return where rings are: at ends of pieces, and between them by about a size where they cut none of miters."""
    changes = [chain.stations[2 * int(j)] + np.array([a, b]) - chain.limits[int(j), 0] for j, a, b in chain.changes]
    marks = np.unique(np.concatenate([chain.stations, *changes]))
    marks = marks[np.append(True, np.diff(marks) > 0.05 * size)]
    steps = [np.linspace(a, b, max(1, round((b - a) / size)), endpoint=False) for a, b in itertools.pairwise(marks)]
    out = np.append(np.concatenate(steps), chain.stations[-1])
    for k in np.flatnonzero(chain.are_miters):
        away = np.abs(out - chain.stations[2 * k + 1])
        away[[0, away.argmin(), -1]] = np.inf
        out = out[away > chain.radii.max() * np.tan(chain.angles[k] / 2)]
    return out


def _untwisted(along: Array) -> Array:
    """Return a direction across each of a sequence of directions, each the one before turned with the axis."""
    out = np.zeros_like(along)
    out[0] = tangents(along[0])[0]
    for k in range(1, len(along)):
        half = normalized(along[k - 1] + along[k])
        out[k] = normalized(out[k - 1] - 2 * (out[k - 1] @ half) * half)  # as well at right angles
    return out
