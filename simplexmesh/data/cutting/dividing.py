"""Subdivide triangles until no edge is longer than a given length."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.named_arrays import Data, joined
from simplexmesh._base.vectors import norm
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.numerics.blending import blended

EDGES_PER_DIAGONAL = 60
"""The default longest edge is the diagonal over this."""

MAX_FACES = 20_000_000
"""Lengths that would give more faces are refused."""


def divided(surface: Any, longest: float | None = None) -> TriangleMesh:
    """Return a surface whose edges are bisected repeatedly until none is longer than a given length.

    The shape is unchanged up to round-off; vertices keep their numbers, and new ones follow. CAD files have vertices
    only on the edges of a body: quantities measured at vertices, such as curvature, need some on its faces too.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        The surface; a simplex mesh is triangulated.
    longest : float, optional
        Maximum edge length, in the surface's unit of length. By default a 60th of the diagonal.

    Raises
    ------
    ValueError, TypeError
        The length is not positive, or so short that there would be more than 20 million faces or that the coordinates'
        floating-point precision cannot resolve it; or the input is not a surface.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sheet = sm.TriangleMesh([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0.0]], [[0, 1, 2], [0, 2, 3]])
    >>> fine = sm.divided(sheet, 0.3)
    >>> fine.n_vertices > 50, round(fine.area, 12), bool((fine.vertices[:4] == sheet.vertices).all())
    (True, 4.0, True)
    """
    mesh = as_triangles(surface, "surface")
    checks.size("surface", mesh.bounds)
    if longest is None and mesh.diagonal <= 0:
        return mesh
    if longest is None:
        longest = mesh.diagonal / EDGES_PER_DIAGONAL
    longest = checks.number("longest", longest, 0.0, open_low=True)
    resolved = 4 * float(np.spacing(np.abs(mesh.vertices).max()))  # a shorter edge may have no midpoint but its ends
    for least, why in (_shortest(mesh), f"for at most {MAX_FACES:,} faces"), (resolved, "at coordinates this large"):
        if longest < least:
            raise ValueError(f"longest must be at least {least:.3g} {why}, not {longest:g}")
    return bisected(mesh, longest)[0]


def bisected(mesh: TriangleMesh, longest: float) -> tuple[TriangleMesh, Indices]:
    """Return a surface divided until no edge is longer than a length, and the faces (f,) that its own are parts of."""
    vertices, faces, data = np.asarray(mesh.vertices), np.asarray(mesh.faces), mesh.data
    owners = np.arange(len(faces))
    while True:
        edges, sides = _edges(faces)
        long = norm(vertices[edges[:, 0]] - vertices[edges[:, 1]]) > longest
        if not long.any():
            return TriangleMesh(vertices, faces, data, mesh.unit), owners
        vertices, data, middle = _with_middles(vertices, data, edges, long)
        faces, rows = _split(vertices, faces, middle[sides])
        owners = owners[rows]


def halved_where_crowded(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Return a surface with a vertex in the middle of each edge of more than two triangles, and how many these are."""
    edges, sides = _edges(mesh.faces)
    crowded = np.bincount(sides.ravel()) > 2
    vertices, data, middle = _with_middles(mesh.vertices, mesh.data, edges, crowded)
    faces, _ = _split(vertices, mesh.faces, middle[sides])
    return TriangleMesh(vertices, faces, data, mesh.unit), int(np.count_nonzero(crowded))


def _with_middles(vertices: Array, data: Data, edges: Indices, chosen: Mask) -> tuple[Array, Data, Indices]:
    """Return vertices and data with the middles of some edges (e,) behind, and where these are, -1 for the others."""
    ends, middle = edges[chosen], np.full(len(edges), -1)
    middle[chosen] = len(vertices) + np.arange(len(ends))
    vertices = np.concatenate([vertices, 0.5 * (vertices[ends[:, 0]] + vertices[ends[:, 1]])])
    return vertices, joined([data, blended(data, ends, np.ones((len(ends), 2)))]), middle


def _shortest(mesh: TriangleMesh) -> float:
    """Return the length that gives MAX_FACES faces, estimated for equilateral triangles and for rows of slivers."""
    sides = norm((mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)]).reshape(-1, 3))
    in_rows = float(sides.reshape(-1, 3).max(axis=1).sum()) / MAX_FACES
    return max(float(np.sqrt(4 / np.sqrt(3) * mesh.area / MAX_FACES)), in_rows)


def _edges(faces: Indices) -> tuple[Indices, Indices]:
    """Return each edge once, (e, 2), and the edge opposite each corner of each face, (f, 3)."""
    ends = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2)
    keys = ends[:, 0] * (int(faces.max(initial=0)) + 1) + ends[:, 1]
    _, first, sides = np.unique(keys, return_index=True, return_inverse=True)
    return ends[first], sides.reshape(-1, 3)


def _split(vertices: Array, faces: Indices, middle: Indices) -> tuple[Indices, Indices]:
    """Return the faces split at the midpoints of their sides, and which each is part of.

    `middle` (f, 3) are these midpoints, -1 for a side that is not bisected.
    """
    cuts = (middle >= 0).sum(axis=1)
    out, of = [faces[cuts == 0]], [np.flatnonzero(cuts == 0)]
    for count in (1, 2, 3):
        rows = np.flatnonzero(cuts == count)
        odd = (middle[rows] >= 0) == (count == 1)  # rotate the only bisected side, or the only other one, to the front
        order = (odd.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces[rows], order, axis=1).T
        of_a, of_b, of_c = np.take_along_axis(middle[rows], order, axis=1).T
        if count == 1:
            parts = [(a, b, of_a), (a, of_a, c)]
        elif count == 2:
            shorter = norm(vertices[b] - vertices[of_b]) < norm(vertices[c] - vertices[of_c])
            parts = [
                (a, of_c, of_b),
                (of_c, b, np.where(shorter, of_b, c)),
                (np.where(shorter, b, of_c), c, of_b),
            ]
        else:
            parts = [(a, of_c, of_b), (of_c, b, of_a), (of_b, of_a, c), (of_a, of_b, of_c)]
        out += [np.stack(part, axis=1) for part in parts]
        of += [rows] * len(parts)
    return np.concatenate(out), np.concatenate(of)
