"""Faces unfolded in their own planes: where vertices on creases are held, means of neighbors may lie beyond them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_array

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import cross, dot, normalized
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.face_geometry import face_normals
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.topology.face_regions import dilated

LEAST = 0.3
"""Area of a triangle, in means of those of its kind, above which it is let be."""

PER_VERTEX = 3.0
"""Area of the triangle of the neighbors of a vertex, in those between sides and centers of regular hexagons."""

HELD = 0.03
"""Weight of squared moves, in roots of mean areas."""


def untangled_by_rings(
    mesh: SimplexMesh, free: Mask, laid: Callable[[SimplexMesh], SimplexMesh] = lambda mesh: mesh, *, even: bool = True
) -> SimplexMesh:
    """Return a mesh unfolded within one to three edges of its tangles, and then `laid`, where that leaves fewer."""
    tangled = tangled_vertices(mesh)
    for rings in (1, 2, 3):
        if not tangled.any():
            break
        other = laid(unfolded(mesh, dilated(tangled, mesh.neighbors, rings) & free, even=even))
        still = tangled_vertices(other)
        if still.sum() < tangled.sum():
            mesh, tangled = other, still
    return mesh


def unfolded(mesh: SimplexMesh, free: Mask, *, even: bool = True) -> SimplexMesh:
    """Return a mesh with some vertices (n,) moved little, so that their faces, and their neighbors, turn one way.

    Triangles between sides and centers of faces, and those of the neighbors of free vertices, get areas of at least a
    share of the mean, of each face alone if they are not `even`, seen along the normals that the faces have now.
    """
    c, rows = mesh.connectivity, np.flatnonzero(free)
    if not len(rows):
        return mesh
    faces = np.unique(c.vertex_faces[rows]).astype(np.int64)
    corners, of = _triangles(c, faces, mesh.neighbors[rows].astype(np.int64))
    across = face_normals(mesh.vertices, c.face_vertices, c.face_offsets)
    normals = np.concatenate([across[faces][of], normalized(across[c.vertex_faces[rows]].sum(axis=1))])
    places = mesh.vertices.copy()

    sides = [corner - corners[0] for corner in corners[1:]]  # of triangles, as sums of vertices
    first, second = (side @ places for side in sides)
    whole = np.abs(dot(cross(first, second), normals))
    if even:
        whole[: len(of)], whole[len(of) :] = whole[: len(of)].mean(), whole[len(of) :].mean()
    else:
        of_face = np.bincount(of, whole[: len(of)]) / np.bincount(of)
        around = of_face[np.searchsorted(faces, c.vertex_faces[rows])].mean(axis=1)
        whole = np.concatenate([of_face[of], PER_VERTEX * around])
    length = float(np.sqrt(whole.mean()))

    moved = [length * side[:, rows].tocsr() for side in sides]
    back = [side.T.tocsr() for side in moved]

    def cost(moves: Array) -> tuple[float, Array]:
        one, two = (side + by @ moves.reshape(-1, 3) for side, by in zip((first, second), moved, strict=True))
        short = np.maximum(LEAST - dot(cross(one, two), normals) / whole, 0.0)
        some = np.flatnonzero(short)
        pull = (-2 * short[some] / whole[some])[:, None] * normals[some]
        by_first, by_second = np.zeros_like(one), np.zeros_like(two)
        by_first[some], by_second[some] = cross(two[some], pull), cross(pull, one[some])
        slope = back[0] @ by_first + back[1] @ by_second
        return (short**2).sum() + HELD * (moves**2).sum(), slope.ravel() + 2 * HELD * moves

    found = minimize(cost, np.zeros(3 * len(rows)), jac=True, method="CG", options={"maxiter": 200})
    places[rows] += length * found.x.reshape(-1, 3)
    return mesh.moved(places)


def _triangles(c: Connectivity, faces: Indices, near: Indices) -> tuple[list[csr_array], Indices]:
    """Return the corners of triangles (t,), as three matrices (t, n) of shares of vertices, and the faces of the first.

    First those between the center and the sides of some faces, then those of neighbors (m, 3) of vertices.
    """
    sizes = c.face_sizes[faces].astype(np.int64)
    of = np.repeat(np.arange(len(faces)), sizes)
    start = np.cumsum(sizes) - sizes
    turn = np.arange(len(of)) - start[of]
    first = c.face_vertices[c.face_offsets[faces][of] + turn]
    second = c.face_vertices[c.face_offsets[faces][of] + (turn + 1) % sizes[of]]
    own = np.arange(len(of))
    inside = np.repeat(own, sizes[of])
    turn = np.arange(len(inside)) - np.repeat(np.cumsum(sizes[of]) - sizes[of], sizes[of])
    center = inside, first[start[of][inside] + turn], 1 / sizes[of][inside]
    rest, ones = len(of) + np.arange(len(near)), np.ones(len(of))
    out = []
    for k, (rows, columns, shares) in enumerate([center, (own, first, ones), (own, second, ones)]):
        at = np.concatenate([rows, rest]), np.concatenate([columns, near[:, k]])
        entries = np.concatenate([shares, np.ones(len(near))])
        out.append(csr_array((entries, at), shape=(len(of) + len(near), c.n_vertices)))
    return out, of
