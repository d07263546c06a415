"""Shapes to start from: sphere, ellipsoid, cylinder, plane and torus, all with outward normals."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import normalized
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BASES = ("tetrahedron", "octahedron", "icosahedron")
DEFAULT_VERTICES = 1280
MOST_VERTICES = 100_000_000


def _base(name: str) -> tuple[Array, Indices]:
    """Return the corners and the triangles of a regular polyhedron, counter-clockwise seen from outside."""
    corners: list[list[float]]
    if name == "tetrahedron":
        corners = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
        faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    elif name == "octahedron":
        corners = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
        faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    else:
        t = (1 + math.sqrt(5)) / 2
        corners = [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t]]
        corners += [[0, -1, -t], [0, 1, -t], [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]]
        faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2]]
        faces += [[10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5]]
        faces += [[2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]]
    return normalized(np.array(corners, float)), np.array(faces)


def _subdivided(corners: Array, faces: Indices, f: int) -> tuple[Array, Indices]:
    """Return a triangulation with each triangle divided in f^2, points shared along the edges."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(f + 1), np.arange(f + 1), indexing="ij"))
    i, j = i[i + j <= f], j[i + j <= f]
    weights = np.stack([f - i - j, i, j], axis=1)
    row = np.concatenate([[0], np.cumsum(np.arange(f + 1, 0, -1))])[:-1]
    at = row[i] + j
    up = at[i + j < f]
    right, above = row[i[i + j < f] + 1] + j[i + j < f], up + 1
    down = i + j < f - 1
    corner = right[(i + j)[i + j < f] < f - 1] + 1
    local = np.concatenate(
        [np.stack([up, right, above], axis=1), np.stack([row[i[down] + 1] + j[down], corner, at[down] + 1], axis=1)]
    )
    # A point is the same point in two triangles when the same corners have the same weights in it.
    codes = np.sort(np.where(weights > 0, faces[:, None, :] * (f + 1) + weights, 0), axis=2)
    base = len(corners) * (f + 1)
    keys = (codes[..., 0] * base + codes[..., 1]) * base + codes[..., 2]
    _, first, number = np.unique(keys.ravel(), return_index=True, return_inverse=True)
    points = np.einsum("pk,fkx->fpx", weights / f, corners[faces]).reshape(-1, 3)
    return points[first], number.reshape(len(faces), -1)[:, local].reshape(-1, 3)


def _frequency(frequency: int | None, vertices: int | None, per_square: int) -> int:
    """Return the frequency asked for, or the one whose sphere has about as many vertices as asked for."""
    if frequency is not None and vertices is not None:
        raise TypeError("give frequency or vertices, not both")
    if frequency is not None:
        return _check.integer("frequency", frequency, 1, math.isqrt(MOST_VERTICES // per_square))
    count = DEFAULT_VERTICES if vertices is None else _check.integer("vertices", vertices, 4, MOST_VERTICES)
    return max(1, round(math.sqrt(count / per_square)))


def sphere(
    frequency: int | None = None,
    base: str = "icosahedron",
    *,
    vertices: int | None = None,
    radius: float = 1.0,
    center: ArrayLike = (0.0, 0.0, 0.0),
) -> SimplexMesh:
    """Return a sphere: the dual of a regular polyhedron with each triangle divided in `frequency` squared.

    Parameters
    ----------
    frequency : int, optional
        f at least 1: the sphere has 4 f^2 vertices from the tetrahedron, 8 f^2 from the octahedron and 20 f^2 from
        the icosahedron, which is the most regular (12 pentagons, the rest hexagons).
    base : {"icosahedron", "octahedron", "tetrahedron"}
        The polyhedron.
    vertices : int, optional
        About how many vertices to have, instead of `frequency`; 1,280 when neither is given.
    radius : float
        All vertices are at this distance from the center.
    center : (3,) array of float
        The center.

    Returns
    -------
    SimplexMesh
        Closed, of genus 0.

    References
    ----------
    H. Delingette, thesis, 1994, section 2.4; the text prints 6 f^2 for the octahedron.

    Examples
    --------
    >>> sphere(3)
    SimplexMesh(180 vertices, 92 faces, genus 0, 0 holes)
    >>> sphere(vertices=3000, base="octahedron").n_vertices
    2888
    """
    corners, faces = _base(_check.choice("base", base, BASES))
    f = _frequency(frequency, vertices, len(faces))
    R = _check.number("radius", radius, 0.0, open_low=True)
    at = _check.array("center", center, (3,))
    points, triangles = _subdivided(corners, faces, f)
    mesh = dual((normalized(points), triangles))
    return mesh.moved(R * normalized(mesh.vertices) + at)
