"""A line in space, open or closed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm, normalized


class CreaseLine(NamedTuple):
    """A line in space: points (k, 3) in order, whether the last is joined to the first, and the mean angle there."""

    points: Array
    closed: bool
    angle: float

    @property
    def length(self) -> float:
        """The length."""
        return float(norm(np.diff(self.closing, axis=0)).sum())

    @property
    def closing(self) -> Array:
        """The points, of a closed line with the first repeated."""
        return np.concatenate([self.points, self.points[:1]]) if self.closed else self.points

    def samples(self, step: float) -> tuple[Array, Array]:
        """Return points (m, 3) at most a step apart, the ends among them, and their distances (m,) from the start."""
        line = self.closing
        far = np.append(0.0, np.cumsum(norm(np.diff(line, axis=0))))
        along = np.linspace(0.0, far[-1], max(2, int(np.ceil(far[-1] / step)) + 1))
        return at_distances(line, far, along), along


def stretches(lines: Sequence[CreaseLine], length: float) -> tuple[Array, Array, Indices]:
    """Return centers and directions (m, 3) of stretches of lines, each about that long, and their lines (m,)."""
    ends = [line.samples(length)[0] for line in lines]
    centers = np.concatenate([0.5 * (one[:-1] + one[1:]) for one in ends])
    along = normalized(np.concatenate([np.diff(one, axis=0) for one in ends]))
    return centers, along, np.repeat(np.arange(len(lines)), [len(one) - 1 for one in ends])


def at_distances(points: Array, far: Array, along: Array) -> Array:
    """Return the places (m, 3) at distances along a polyline (k, 3), whose points are `far` (k,) along it."""
    return np.column_stack([np.interp(along, far, points[:, j]) for j in range(3)])
