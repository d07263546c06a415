"""Triangulations of known surfaces, with vertices exactly on them and the exact values there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.bench.truth import closed, grids
from simplexmesh.bench.truth.exact import Exact
from simplexmesh.bench.truth.graphs import Graph
from simplexmesh.data.triangles import TriangleMesh

Seed = np.random.Generator | int | None

JITTER = 0.35
"""Largest displacement of vertices in irregular meshes, in steps of the grid; a few triangles are inverted. One-ring
schemes do not converge on such meshes, as on those other programs were measured on."""


@dataclass(frozen=True, eq=False, repr=False)
class Discretized:
    """A triangulated surface with exact values at the vertices."""

    vertices: Array
    faces: Indices
    exact: Exact

    @property
    def mesh(self) -> TriangleMesh:
        """The triangle mesh."""
        return TriangleMesh(self.vertices, self.faces)

    @cached_property
    def inner(self) -> Mask:
        """(n,) array of bool: whether each vertex is not on a border."""
        return ~grids.on_border(self.faces, len(self.vertices))


def split_square(surface: Graph, squares: int) -> Discretized:
    """Return a graph over a grid of squares, all split along the same diagonal (Charton 2014, eq. 4.4)."""
    n = checks.integer("squares", squares, 1)
    column, row = (2 / n * part.ravel() - 1 for part in np.meshgrid(np.arange(n + 1), np.arange(n + 1)))
    return Discretized(surface.points(column, row), grids.sheet(n, n), surface.exact(column, row))


def sawtooth(surface: Graph, rows: int) -> Discretized:
    """Return a graph over rows of nearly equilateral triangles, odd ones half a step inward (Charton 2014, eq. 4.5)."""
    n = checks.integer("rows", rows, 1)
    step = 2 / n
    even, odd = step * np.arange(n + 1) - 1, step * (np.arange(n) + 0.5) - 1
    x = np.concatenate([odd if j % 2 else even for j in range(n + 1)])
    y = np.concatenate([np.full(n if j % 2 else n + 1, step * j - 1) for j in range(n + 1)])
    return Discretized(surface.points(x, y), grids.sawtooth(n), surface.exact(x, y))


def uv_sphere(meridians: int, bands: int, radius: float = 2.0) -> Discretized:
    """Return a sphere of meridians and bands between parallels, with two poles."""
    m, b = checks.integer("meridians", meridians, 3), checks.integer("bands", bands, 2)
    i, j = _grid(m, b)
    points, exact = closed.sphere(*_globe(m, b, i[m:], j[m:]), radius)
    return Discretized(points, grids.globe(m, b), exact)


def uv_cylinder(meridians: int, bands: int, radius: float = 2.0, height: float = 4.0) -> Discretized:
    """Return the side of a cylinder, open at both ends."""
    m, b = checks.integer("meridians", meridians, 3), checks.integer("bands", bands, 1)
    i, j = _grid(m, b + 1)
    points, exact = closed.cylinder(2 * np.pi * i / m, height * j / b, radius)
    return Discretized(points, grids.tube(m, b), exact)


def torus(
    around: int = 100,
    tube: int = 50,
    *,
    radius: float = 1.0,
    tube_radius: float = 0.35,
    irregular: bool = False,
    rng: Seed = 0,
) -> Discretized:
    """Return a torus of quads around the axis and the tube, split along one diagonal.

    If irregular, vertices are moved on the surface by up to `JITTER` steps of the grid in both parameters, and quads
    split at random.
    """
    m, b = checks.integer("around", around, 3), checks.integer("tube", tube, 3)
    i, j, flipped = _jittered(*_grid(m, b), m * b, rng) if irregular else (*_grid(m, b), None)
    points, exact = closed.torus(2 * np.pi * i / m, 2 * np.pi * j / b, radius, tube_radius)
    return Discretized(points, grids.tube(m, b, flipped) % (m * b), exact)


def ellipsoid(
    meridians: int = 100,
    bands: int = 100,
    *,
    axes: tuple[float, float, float] = (1.0, 0.7, 0.5),
    irregular: bool = False,
    rng: Seed = 0,
) -> Discretized:
    """Return an ellipsoid of meridians and bands; irregular as for `torus`, except for the poles."""
    m, b = checks.integer("meridians", meridians, 3), checks.integer("bands", bands, 3)
    i, j = (part[m:] for part in _grid(m, b))
    i, j, flipped = _jittered(i, j, m * (b - 2), rng) if irregular else (i, j, None)
    points, exact = closed.ellipsoid(*_globe(m, b, i, j), axes)
    return Discretized(points, grids.globe(m, b, flipped), exact)


def _grid(columns: int, rows: int) -> tuple[Array, Array]:
    """Return the column and the row of each point of a grid, row by row."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    return i.ravel().astype(float), j.ravel().astype(float)


def _jittered(i: Array, j: Array, count: int, rng: Seed) -> tuple[Array, Array, Mask]:
    """Return moved columns and rows, and which of so many quads are split along the other diagonal."""
    generator = checks.generator("rng", rng)
    i, j = (part + generator.uniform(-JITTER, JITTER, part.shape) for part in (i, j))
    return i, j, generator.random(count) < 0.5


def _globe(meridians: int, bands: int, i: Array, j: Array) -> tuple[Array, Array]:
    """Return longitudes and latitudes of columns and rows counted from the upper pole, with both poles."""
    latitude = np.pi / 2 - np.pi * j / bands
    u = np.concatenate([[0], 2 * np.pi * i / meridians, [0]])
    return u, np.concatenate([[np.pi / 2], latitude, [-np.pi / 2]])


def cut(made: Discretized, kept: Mask) -> Discretized:
    """Return the faces whose vertices are all kept, (n,) array of bool: an open mesh with a jagged border."""
    keep = checks.array("kept", kept, (len(made.vertices),), bool)
    faces = made.faces[keep[made.faces].all(axis=1)]
    if not len(faces):
        raise ValueError("kept must leave at least one face")
    used, numbered = np.unique(faces, return_inverse=True)
    return Discretized(made.vertices[used], numbered.reshape(-1, 3), made.exact[used])
