"""Triangulations of known surfaces, with vertices exactly on them and the exact values there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface.truth import grids
from simplexmesh.surface.truth.closed import Cone, Cylinder, Ellipsoid, Sphere, Torus
from simplexmesh.surface.truth.exact import Exact
from simplexmesh.surface.truth.graphs import Graph

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

JITTER = 0.35
"""Largest displacement of vertices in irregular meshes, in steps of the grid; a few triangles are inverted. One-ring
schemes do not converge on such meshes, as on those other programs were measured on."""


@dataclass(frozen=True, eq=False, repr=False)
class Discretized:
    """A triangulated surface with exact values.

    Attributes
    ----------
    vertices : (n, 3) array of float
    faces : (f, 3) array of int
        Counter-clockwise seen from outside.
    exact : Exact
        Normals and curvatures at the vertices; undefined where `smooth` is False.
    inner : (n,) array of bool
        Whether each vertex is not on a border.
    smooth : (n,) array of bool
        Whether the surface has a normal and curvatures: not at the apex of a cone nor on sharp rims.

    Examples
    --------
    >>> ball = uv_sphere(8, 8)
    >>> ball
    Discretized(58 vertices, 112 faces)
    >>> ball.mesh.vertex_normals.shape
    (58, 3)
    """

    vertices: Array
    faces: Indices
    exact: Exact
    inner: Mask
    smooth: Mask

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float64), ("faces", np.int64), ("inner", bool), ("smooth", bool)):
            object.__setattr__(self, name, _check.frozen(getattr(self, name), kind))

    def __repr__(self) -> str:
        return f"Discretized({len(self.vertices):,} vertices, {len(self.faces):,} faces)"

    @property
    def mesh(self) -> TriangleMesh:
        """The triangle mesh."""
        return TriangleMesh(self.vertices, self.faces)

    @property
    def scored(self) -> Mask:
        """(n,) array of bool: whether estimates are compared with exact values, inner and smooth."""
        return self.inner & self.smooth


def _with_inner(vertices: Array, faces: Indices, exact: Exact, smooth: Mask | None = None) -> Discretized:
    inner = ~grids.on_border(faces, len(vertices))
    return Discretized(vertices, faces, exact, inner, np.ones(len(vertices), bool) if smooth is None else smooth)


def split_square(surface: Graph, squares: int) -> Discretized:
    """Return a graph over a grid of squares, all split along the same diagonal (Charton 2014, eq. 4.4).

    Parameters
    ----------
    surface : Graph
    squares : int
        Number along each side; vertices are 2 / squares apart in the plane. Inner vertices have six neighbors, with
        angles 45, 45, 90, 45, 45, 90 degrees.

    Examples
    --------
    >>> from simplexmesh.surface.truth.graphs import graph
    >>> split_square(graph("hyperboloid"), 32)
    Discretized(1,089 vertices, 2,048 faces)
    """
    n = _check.integer("squares", squares, 1)
    column, row = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
    return _on_graph(surface, 2 / n * column.ravel() - 1, 2 / n * row.ravel() - 1, grids.sheet(n, n))


def sawtooth(surface: Graph, rows: int) -> Discretized:
    """Return a graph over rows of nearly equilateral triangles (Charton 2014, eq. 4.5).

    Even rows have rows + 1 vertices, odd ones `rows`, half a step inward.
    """
    n = _check.integer("rows", rows, 1)
    step = 2 / n
    even, odd = step * np.arange(n + 1) - 1, step * (np.arange(n) + 0.5) - 1
    x = np.concatenate([odd if j % 2 else even for j in range(n + 1)])
    y = np.concatenate([np.full(n if j % 2 else n + 1, step * j - 1) for j in range(n + 1)])
    return _on_graph(surface, x, y, grids.sawtooth(n))


def _on_graph(surface: Graph, x: ArrayLike, y: ArrayLike, faces: Indices) -> Discretized:
    return _with_inner(surface.points(x, y), faces, surface.exact(x, y))


def uv_sphere(meridians: int, bands: int, radius: float = 2.0) -> Discretized:
    """Return a sphere of meridians and bands between parallels, with two poles."""
    m, b = _check.integer("meridians", meridians, 3), _check.integer("bands", bands, 2)
    longitude = np.tile(2 * np.pi * np.arange(m) / m, b - 1)
    latitude = np.repeat(np.pi / 2 - np.pi * np.arange(1, b) / b, m)
    u, v = np.concatenate([[0], longitude, [0]]), np.concatenate([[np.pi / 2], latitude, [-np.pi / 2]])
    points, exact = Sphere(radius).at(u, v)
    return _with_inner(points, grids.globe(m, b), exact)


def uv_cylinder(meridians: int, bands: int, radius: float = 2.0, height: float = 4.0) -> Discretized:
    """Return the side of a cylinder, open at both ends."""
    m, b = _check.integer("meridians", meridians, 3), _check.integer("bands", bands, 1)
    u, z = np.tile(2 * np.pi * np.arange(m) / m, b + 1), np.repeat(height * np.arange(b + 1) / b, m)
    points, exact = Cylinder(radius).at(u, z)
    return _with_inner(points, grids.tube(m, b), exact)


def capped_cylinder(sectors: int = 10, bands: int = 10, radius: float = 100.0, height: float = 100.0) -> Discretized:
    """Return a cylinder with two caps, each a fan; the article's has ten sectors and bands.

    The centers of the caps have exact values; the rims are not smooth.
    """
    side = uv_cylinder(sectors, bands, radius, height)
    n = len(side.vertices)
    vertices = np.concatenate([side.vertices, [[0, 0, 0], [0, 0, height]]])
    faces = np.concatenate(
        [side.faces, grids.fan(np.arange(sectors)[::-1], n), grids.fan(np.arange(n - sectors, n), n + 1)]
    )
    exact = _concatenated(side.exact, Exact(*_planar([[0, 0, -1.0], [0, 0, 1.0]])))
    smooth = np.ones(n + 2, bool)
    smooth[:sectors] = smooth[n - sectors : n] = False
    return _with_inner(vertices, faces, exact, smooth)


def cone(sectors: int = 10, bands: int = 10, radius: float = 100.0, height: float = 100.0) -> Discretized:
    """Return a cone with its base, a fan; the article's has ten sectors and bands."""
    m, b = _check.integer("sectors", sectors, 3), _check.integer("bands", bands, 1)
    u, t = np.tile(2 * np.pi * np.arange(m) / m, b), np.repeat(np.arange(b) / b, m)
    points, exact = Cone(radius, height).at(u, t)
    n = m * b
    vertices = np.concatenate([points, [[0, 0, height], [0, 0, 0]]])
    last = np.arange(n - m, n)
    faces = np.concatenate([grids.tube(m, b - 1), grids.fan(last, n), grids.fan(np.arange(m)[::-1], n + 1)])
    exact = _concatenated(exact, Exact(*_planar([[0, 0, 1.0], [0, 0, -1.0]])))
    smooth = np.ones(n + 2, bool)
    smooth[:m] = smooth[n] = False
    return _with_inner(vertices, faces, exact, smooth)


def icosphere(frequency: int = 16, radius: float = 100.0) -> Discretized:
    """Return a projected icosahedron, edges divided by `frequency`: 10 frequency^2 + 2 vertices, 12 of valence 5."""
    directions, faces = grids.icosahedral(_check.integer("frequency", frequency, 1))
    u, v = np.arctan2(directions[:, 1], directions[:, 0]), np.arcsin(np.clip(directions[:, 2], -1, 1))
    points, exact = Sphere(radius).at(u, v)
    return _with_inner(points, faces, exact)


def torus(
    around: int = 100,
    tube: int = 50,
    *,
    radius: float = 1.0,
    tube_radius: float = 0.35,
    irregular: bool = False,
    rng: np.random.Generator | int | None = 0,
) -> Discretized:
    """Return a torus of split quads.

    Parameters
    ----------
    around, tube : int
        Vertices around the axis and around the tube.
    radius, tube_radius : float
        Major and minor radius.
    irregular : bool
        Move vertices on the surface by up to `JITTER` steps of the grid in both parameters, and split quads at random:
        on such meshes one-ring schemes do not converge.
    rng : numpy.random.Generator or int, optional
        For irregular meshes.

    Examples
    --------
    >>> torus(24, 12, irregular=True)
    Discretized(288 vertices, 576 faces)
    """
    m, b = _check.integer("around", around, 3), _check.integer("tube", tube, 3)
    i, j = (part.ravel().astype(float) for part in np.meshgrid(np.arange(m), np.arange(b)))
    flipped = None
    if irregular:
        generator = _check.generator("rng", rng)
        i, j = (part + generator.uniform(-JITTER, JITTER, part.shape) for part in (i, j))
        flipped = generator.random(m * b) < 0.5
    points, exact = Torus(radius, tube_radius).at(2 * np.pi * i / m, 2 * np.pi * j / b)
    return _with_inner(points, grids.torus(m, b, flipped), exact)


def ellipsoid(
    meridians: int = 100,
    bands: int = 100,
    *,
    axes: tuple[float, float, float] = (1.0, 0.7, 0.5),
    irregular: bool = False,
    rng: np.random.Generator | int | None = 0,
) -> Discretized:
    """Return an ellipsoid of meridians and bands; irregular as for `torus`, except for the poles."""
    m, b = _check.integer("meridians", meridians, 3), _check.integer("bands", bands, 3)
    i, j = (part.ravel().astype(float) for part in np.meshgrid(np.arange(m), np.arange(1, b)))
    flipped = None
    if irregular:
        generator = _check.generator("rng", rng)
        i, j = (part + generator.uniform(-JITTER, JITTER, part.shape) for part in (i, j))
        flipped = generator.random(m * (b - 2)) < 0.5
    u = np.concatenate([[0], 2 * np.pi * i / m, [0]])
    v = np.concatenate([[np.pi / 2], np.pi / 2 - np.pi * j / b, [-np.pi / 2]])
    points, exact = Ellipsoid(axes).at(u, v)
    return _with_inner(points, grids.globe(m, b, flipped), exact)


def cut(made: Discretized, kept: NDArray[np.bool_]) -> Discretized:
    """Return the faces whose vertices are all kept: an open mesh with a jagged border.

    Parameters
    ----------
    made : Discretized
    kept : (n,) array of bool

    Examples
    --------
    >>> ring = torus(24, 12)
    >>> half = cut(ring, ring.vertices[:, 0] > 0.01)
    >>> half, int((~half.inner).sum())
    (Discretized(132 vertices, 240 faces), 24)
    """
    keep = _check.array("kept", kept, (len(made.vertices),), bool)
    faces = made.faces[keep[made.faces].all(axis=1)]
    if not len(faces):
        raise ValueError("kept must leave at least one face")
    used, numbered = np.unique(faces, return_inverse=True)
    return _with_inner(made.vertices[used], numbered.reshape(-1, 3), made.exact[used], made.smooth[used])


def _concatenated(a: Exact, b: Exact) -> Exact:
    return Exact(*(np.concatenate([getattr(a, name), getattr(b, name)]) for name in ("normals", "k1", "k2", "d1")))


def _planar(normals: list[list[float]]) -> tuple[Array, Array, Array, Array]:
    n = len(normals)
    return np.array(normals), np.zeros(n), np.zeros(n), np.tile([1.0, 0.0, 0.0], (n, 1))
