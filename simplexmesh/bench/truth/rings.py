"""Rings: a point and its neighbors on a known surface, in the patterns of the literature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.bench.truth.exact import Exact
from simplexmesh.bench.truth.graphs import Graph
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.sampled_surface import SampledSurface

SCHEMES = ("R", "Rda", "Rdd", "Rdds", "U")
"""The thesis's: regular; one neighbor rotated by a fifth of a step; one at 1.2 times the distance; nearly half of them
at half the distance; four fifths of them on one side."""


@dataclass(frozen=True, eq=False, repr=False)
class Ring:
    """A point P (3,) of a surface, its neighbors (m, 3), counter-clockwise seen from outside, and the exact values."""

    center: Array
    neighbors: Array
    exact: Exact

    @property
    def points(self) -> Array:
        """(m + 1, 3) array of float: P first."""
        return np.concatenate([self.center[None], self.neighbors])

    @property
    def samples(self) -> SampledSurface:
        """The points, as input of an estimator."""
        return stacked([self])[0]

    @property
    def around(self) -> Neighborhoods:
        """One row: P and its neighbors in order, among `points`."""
        return stacked([self])[1]


def stacked(rings: Sequence[Ring]) -> tuple[SampledSurface, Neighborhoods]:
    """Return rings as one set of points, with fans of faces, and a neighborhood each, for one call of an estimator."""
    counts = np.array([len(ring.neighbors) for ring in rings])
    first = np.concatenate([[0], np.cumsum(counts + 1)])
    points = np.concatenate([ring.points for ring in rings])
    members = np.setdiff1d(np.arange(len(points)), first[:-1])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    around = Neighborhoods(first[:-1], offsets, members, np.ones(len(rings), bool))
    fans = [np.stack([np.zeros(m, int), *(1 + (np.arange(m) + k) % m for k in (0, 1))], axis=1) for m in counts]
    return SampledSurface(
        points, np.concatenate([fan + start for fan, start in zip(fans, first, strict=False)])
    ), around


def scheme_ring(
    surface: Graph,
    scheme: str,
    count: int,
    distance: float,
    *,
    at: tuple[float, float] = (0.0, 0.0),
    start: float = 0.0,
) -> Ring:
    """Return a ring around the point over `at`, of one of the thesis's schemes in the plane, lifted to a graph."""
    azimuth, away = pattern(scheme, count)
    x, y = (at[k] + distance * away * part(azimuth + start) for k, part in enumerate((np.cos, np.sin)))
    return Ring(surface.points(*at)[0], surface.points(x, y), surface.exact(*at))


def pattern(scheme: str, count: int) -> tuple[Array, Array]:
    """Return azimuths, radians, and relative distances of a scheme's neighbors, (count,) arrays of float each."""
    checks.choice("scheme", scheme, SCHEMES)
    checks.integer("count", count, 4)
    step, odd = 2 * np.pi / count, count // 2 + 1
    azimuth, away = np.asarray(step * np.arange(count), np.float64), np.ones(count)
    if scheme == "Rda":
        azimuth[odd] -= 0.2 * step
    elif scheme == "Rdd":
        away[odd] = 1.2
    elif scheme == "Rdds":
        away[odd:] = 0.5
    elif scheme == "U":
        many = round(0.8 * (count - 1))
        few = count - 1 - many
        near, far = np.arange(1, many + 1) / (many + 1), 1 + np.arange(1, few + 1) / (few + 1)
        azimuth = np.pi * np.concatenate([[0], near, far])
    return azimuth, away
