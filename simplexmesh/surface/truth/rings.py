"""Rings: a point and its neighbors on a known surface, in the patterns of the literature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.truth.closed import Cylinder, Sphere
from simplexmesh.surface.truth.exact import Exact
from simplexmesh.surface.truth.graphs import Graph

Array = NDArray[np.float64]

SCHEMES = ("R", "Rda", "Rdd", "Rdds", "U")
"""The thesis's: regular; one neighbor rotated by a fifth of a step; one at 1.2 times the distance; nearly half of them
at half the distance; four fifths of them on one side."""

KINDS = ("regular", "vertex", "angles")


@dataclass(frozen=True, eq=False, repr=False)
class Ring:
    """A point P of a surface and its neighbors, counter-clockwise seen from outside, with exact values at P.

    Attributes
    ----------
    center : (3,) array of float
    neighbors : (m, 3) array of float
    exact : Exact
        Exact values at P.

    Examples
    --------
    >>> ring = article_ring(0.5)
    >>> ring
    Ring(6 neighbors)
    >>> ring.exact.mean.tolist(), ring.around.closed.tolist()
    ([0.5], [True])
    """

    center: Array
    neighbors: Array
    exact: Exact

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", _check.frozen(self.center, np.float64))
        object.__setattr__(self, "neighbors", _check.frozen(self.neighbors, np.float64))

    def __repr__(self) -> str:
        return f"Ring({len(self.neighbors)} neighbors)"

    @cached_property
    def points(self) -> Array:
        """(m + 1, 3) array of float: P first."""
        return np.concatenate([self.center[None], self.neighbors])

    @property
    def around(self) -> Neighborhoods:
        """One row: P and its neighbors in order, among `points`."""
        return stacked([self])[1]

    @property
    def samples(self) -> Samples:
        """The points, as input of an estimator."""
        return stacked([self])[0]


def stacked(rings: Sequence[Ring]) -> tuple[Samples, Neighborhoods]:
    """Combine rings into one set of points, with one neighborhood each, for one call of an estimator.

    The faces are the fans from each P to its neighbors in order.

    Examples
    --------
    >>> samples, around = stacked([article_ring(0.5), article_ring(0.1, "angles")])
    >>> len(samples.points), around
    (14, Neighborhoods(2 centers, 12 neighbors))
    """
    counts = np.array([len(ring.neighbors) for ring in rings])
    first = np.concatenate([[0], np.cumsum(counts + 1)])
    points = np.concatenate([ring.points for ring in rings])
    members = np.setdiff1d(np.arange(len(points)), first[:-1])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    around = Neighborhoods(first[:-1], offsets, members, np.ones(len(rings), bool))
    fans = [np.stack([np.zeros(m, int), *(1 + (np.arange(m) + k) % m for k in (0, 1))], axis=1) for m in counts]
    return Samples(points, np.concatenate([fan + start for fan, start in zip(fans, first, strict=False)])), around


def gs03_ring(distance: float, *, perturbed: bool = False, radius: float = 2.0) -> Ring:
    """Return six points of a cylinder around the z axis at a distance from P = (radius, 0, 0).

    Goldfeather and Interrante's ring as printed in the thesis (4.1-4.3): heights r, r/2, -r/2, -r; if perturbed, the
    neighbor at y > 0, z = -r/2 is at z = -4/5 r, where estimators that are correct on regular rings have wrong limits.

    Examples
    --------
    >>> ring = gs03_ring(0.5, perturbed=True)
    >>> np.linalg.norm(ring.neighbors - ring.center, axis=1).round(12).tolist()
    [0.5, 0.5, 0.5, 0.5, 0.5, 0.5]
    """
    low = -0.8 if perturbed else -0.5
    heights = distance * np.array([1, 0.5, -0.5, -1, low, 0.5])
    sides = np.array([0, -1, -1, 0, 1, 1])
    return _on_cylinder(heights, sides, distance, radius)


def symmetric_ring(distance: float, count: int = 6, *, surface: str = "cylinder", radius: float = 2.0) -> Ring:
    """Return points at a distance from P whose heights divide the diameter along z evenly: a symmetric, uneven ring.

    Parameters
    ----------
    distance : float
        Euclidean distance from P = (radius, 0, 0).
    count : int
        Number of neighbors, even: count / 2 + 1 heights, one neighbor at the ends, two between.
    surface : {"cylinder", "sphere"}
        Around the z axis, or the origin.
    """
    half = _check.integer("count", count, 4) // 2
    if count % 2:
        raise ValueError(f"count must be even, not {count}")
    down = 1 - 2 * np.arange(half + 1) / half
    heights = np.concatenate([down, down[-2:0:-1]])
    sides = np.concatenate([[0], -np.ones(half - 1), [0], np.ones(half - 1)])
    if _check.choice("surface", surface, ("cylinder", "sphere")) == "cylinder":
        return _on_cylinder(distance * heights, sides, distance, radius)
    high, x = _circle(distance, radius)
    z = high * heights
    y = sides * np.sqrt(np.maximum(high**2 - z**2, 0))
    return _on_sphere(np.stack([np.full(count, x), y, z], axis=1), radius)


def article_ring(distance: float, kind: str = "regular", *, radius: float = 2.0) -> Ring:
    """Return six points of a sphere around P = (radius, 0, 0), as in the article of 2012 (eqs 31-38, corrected).

    Parameters
    ----------
    distance : float
        Euclidean distance from P.
    kind : {"regular", "vertex", "angles"}
        Regular; one neighbor moved along its meridian to 1.6 times its latitude; heights along z a third apart.
    """
    high, x = _circle(distance, radius)
    angles = np.pi / 3 * np.arange(6) + np.pi / 2
    points = np.stack([np.full(6, x), high * np.cos(angles), high * np.sin(angles)], axis=1)
    if _check.choice("kind", kind, KINDS) == "angles":
        return symmetric_ring(distance, 6, surface="sphere", radius=radius)
    if kind == "vertex":
        longitude = np.arctan2(points[5, 1], points[5, 0])
        points[5] = Sphere(radius).at(longitude, 1.6 * np.arcsin(points[5, 2] / radius))[0][0]
    return _on_sphere(points, radius)


def scheme_ring(
    surface: Graph,
    scheme: str,
    count: int,
    distance: float,
    *,
    at: tuple[float, float] = (0.0, 0.0),
    start: float = 0.0,
) -> Ring:
    """Return a ring of one of the thesis's five schemes, defined in the plane and lifted to a graph.

    Parameters
    ----------
    surface : Graph
    scheme : {"R", "Rda", "Rdd", "Rdds", "U"}
        See `SCHEMES`.
    count : int
        Number of neighbors; 6 and 12 in the thesis.
    distance : float
        Distance from P in the plane.
    at : (2,) tuple of float
        Position of P in the plane.
    start : float
        Azimuth of the first neighbor in radians; the thesis gives none, and 0 reproduces its results.

    Examples
    --------
    >>> from simplexmesh.surface.truth.graphs import graph
    >>> ring = scheme_ring(graph("cubic"), "Rdds", 6, 0.1)
    >>> np.hypot(*ring.neighbors[:, :2].T).round(12).tolist()
    [0.1, 0.1, 0.1, 0.1, 0.05, 0.05]
    """
    azimuth, away = pattern(scheme, count)
    x = at[0] + distance * away * np.cos(azimuth + start)
    y = at[1] + distance * away * np.sin(azimuth + start)
    return Ring(surface.points(*at)[0], surface.points(x, y), surface.exact(*at))


def pattern(scheme: str, count: int) -> tuple[Array, Array]:
    """Return azimuths, radians, and relative distances of a scheme's neighbors, (count,) arrays of float each."""
    _check.choice("scheme", scheme, SCHEMES)
    _check.integer("count", count, 4)
    step, odd = 2 * np.pi / count, count // 2 + 1
    azimuth = np.asarray(step * np.arange(count), np.float64)
    away = np.ones(count)
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


def star(
    surface: Graph,
    count: int = 6,
    distance: float = 0.1,
    *,
    rings: int = 1,
    at: tuple[float, float] = (0.0, 0.0),
    center_lifted: float = 0.0,
    center_moved: float = 0.0,
    neighbor_lifted: float = 0.0,
    neighbor_moved: float = 0.0,
    neighbor_turned: float = 0.0,
) -> Ring:
    """Return Gatzke and Grimm's star (2006), with independent perturbations.

    Parameters
    ----------
    surface : Graph
    count : int
        Number of neighbors in the first ring; each further ring has twice as many. They are ordered ring by ring, so
        that with several rings `around` is not a cycle.
    distance : float
        Distance of the first ring in the plane; ring i is at i times that.
    rings : int
        Number of rings.
    at : (2,) tuple of float
        Position of the star's center in the plane.
    center_lifted, neighbor_lifted : float
        Offset of P, or of the first neighbor, from the surface along its normal.
    center_moved : float
        Displacement of P on the surface, in the plane along x; the neighbors stay.
    neighbor_moved : float
        Additional distance of the first neighbor.
    neighbor_turned : float
        Rotation of the first neighbor around P, radians.
    """
    azimuths, distances = [], []
    for ring in range(1, _check.integer("rings", rings, 1) + 1):
        many = _check.integer("count", count, 3) * 2 ** (ring - 1)
        azimuths.append(2 * np.pi * np.arange(many) / many)
        distances.append(np.full(many, ring * distance))
    azimuth, away = np.concatenate(azimuths), np.concatenate(distances)
    azimuth[0] += neighbor_turned
    away[0] += neighbor_moved
    x, y = at[0] + away * np.cos(azimuth), at[1] + away * np.sin(azimuth)
    points = surface.points(x, y)
    points[0] += neighbor_lifted * surface.exact(x[0], y[0]).normals[0]
    exact = surface.exact(at[0] + center_moved, at[1])
    center = surface.points(at[0] + center_moved, at[1])[0] + center_lifted * exact.normals[0]
    return Ring(center, points, exact)


def _circle(distance: float, radius: float) -> tuple[float, float]:
    """Return the radius, and the center on the x axis, of the circle of a sphere at a distance from (radius, 0, 0)."""
    _check.number("distance", distance, 0.0, radius, open_low=True)
    return distance / radius * np.sqrt(radius**2 - distance**2 / 4), radius - distance**2 / (2 * radius)


def _on_cylinder(heights: Array, sides: ArrayLike, distance: float, radius: float) -> Ring:
    """Return the ring of a cylinder at these heights and signs of y, at a distance from (radius, 0, 0)."""
    _check.number("distance", distance, 0.0, radius, open_low=True)
    x = (heights**2 + 2 * radius**2 - distance**2) / (2 * radius)
    y = np.asarray(sides) * np.sqrt(np.maximum((distance**2 - heights**2) * (1 - (radius - x) / (2 * radius)), 0))
    center, exact = Cylinder(radius).at(0.0, 0.0)
    return Ring(center[0], np.stack([x, y, heights], axis=1), exact)


def _on_sphere(points: Array, radius: float) -> Ring:
    center, exact = Sphere(radius).at(0.0, 0.0)
    return Ring(center[0], points, exact)
