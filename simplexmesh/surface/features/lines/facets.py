"""Triangles with what is measured of each one, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, norm

SIMPLIFIED = 0.68
"""Mean quality of triangles: that of scans is more, also with noise of a third of an edge, of simplified ones less."""

EVEN = 0.6
"""Mean quality of triangles of the shapes that scanners make, those of programs have less."""

UNEVEN = 0.3
"""Spread of the longest sides of triangles: scans and surfaces through grids have half of it, simplified ones more."""

FEW = 0.01
"""Share of triangles that are slivers where a grid makes them: surfaces of programs that are as even have none."""

KNOWN = 0.25
"""In radians, the deviation of normals in the mean over the surface: those of small triangles with noise have more."""

FLAT, MOST = 1 / 3, 0.25
"""Of the mean bend, and of the area: parts have more beside edges that bend by less, coarse smooth bodies have not."""


class Facets(NamedTuple):
    """Triangles, matched across their edges."""

    vertices: Array
    """(n, 3), about the origin."""

    faces: Indices
    """(t, 3)."""

    mates: Indices
    """(3t,): the half-edge opposite to `3 t + j`, from corner j to corner j + 1; -1 on a border."""

    sides: Array
    """(t, 3): lengths."""

    areas: Array
    """(t,)."""

    normals: Array
    """(t, 3): unit normals, 0 of triangles without area."""

    centers: Array
    """(t, 3)."""

    scales: Array
    """(t,): the edge of equilateral triangles as large as those around a triangle in the mean."""

    variances: Array
    """(t,): of the components of a normal along the surface, from the noise of the corners."""

    noise: Array
    """(t,): the standard deviation of the corners along the normal."""

    simplified: bool
    """Whether triangles are as large as the shape lets them be, so that neighbors tell little of their normals."""

    uniform: bool
    """Whether there are slivers of a grid, as of marching cubes: all triangles are about as long."""

    @property
    def qualities(self) -> Array:
        """(t,): 1 if equilateral, 0 if without area."""
        return 4 * np.sqrt(3) * self.areas / np.maximum((self.sides**2).sum(axis=1), 1e-300)

    @property
    def longest(self) -> Array:
        """(t,): the longest sides."""
        return np.maximum(np.maximum(self.sides[:, 0], self.sides[:, 1]), self.sides[:, 2])

    @property
    def spread(self) -> float:
        """The standard deviation of the longest sides over the area, in their mean."""
        longest = self.longest
        mean = self.areas @ longest / max(self.areas.sum(), 1e-300)
        return float(np.sqrt(self.areas @ (longest - mean) ** 2 / max(self.areas.sum(), 1e-300)) / max(mean, 1e-300))

    @property
    def tilts(self) -> Array:
        """(t,): deviation of the components of a normal along the surface, for one of 1 of the corners."""
        return np.sqrt((self.sides**2).sum(axis=1) / np.maximum(8 * self.areas**2, 1e-200))

    @property
    def creased(self) -> bool:
        """Whether few edges have most of the bends, as those of parts have."""
        inner = np.flatnonzero(self.mates >= 0)
        bends = norm(self.normals[inner // 3] - self.normals[self.mates[inner] // 3])
        areas = self.areas[inner // 3]
        return bool(areas[bends <= FLAT * (areas @ bends) / areas.sum()].sum() > MOST * areas.sum())

    def seen(self, noise: Array, scales: Array) -> Facets:
        """Return them with what the noise of their vertices and the scales (t,) around them tell."""
        variances = noise**2 * self.tilts**2
        known = np.sqrt(variances) @ self.areas < KNOWN * self.areas.sum()
        quality, uneven = self.qualities.mean(), self.spread > UNEVEN
        simplified = bool(known and quality < SIMPLIFIED and uneven and self.creased)
        out = self._replace(scales=scales, variances=variances, noise=noise, simplified=simplified)
        slivers = np.quantile(self.qualities, FEW) < EVEN / 2
        return out._replace(uniform=bool(quality >= EVEN and not uneven and slivers))


def measured(vertices: Array, faces: Indices, mates: Indices) -> Facets:
    """Return the facets of triangles, with zeros for what triangles around them and the noise tell."""
    corners = vertices[faces]
    sides = norm(corners - corners[:, [2, 0, 1]])
    vectors = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = norm(vectors)
    normals = vectors / np.where(doubled > 0, doubled, 1.0)[:, None]
    unknown = np.zeros(len(faces))
    told = sides, doubled / 2, normals, corners.mean(axis=1), unknown, unknown, unknown
    return Facets(vertices, faces, mates, *told, simplified=False, uniform=False)
