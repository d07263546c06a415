"""A mesh whose vertices are moved without folds: towards places wanted, or to where fewer faces fold or cross."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_fans as fans
from simplexmesh.mesh import _kernels_guard as kernels
from simplexmesh.mesh import _kernels_untangle, face_geometry
from simplexmesh.mesh._kernels_fitting import Faces
from simplexmesh.mesh.self_intersection import grid_cells
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

REACH, AROUND, CELL = 0.5, 0.15, 3.0
"""A vertex moves up to `REACH` mean edges at a time, faces are near within `AROUND`, cells of the grid have `CELL`."""

CLEAR = 1e-9
"""What is no distance, in edges."""

FACING = 0.0
"""While vertices move, only faces that are not adjacent and whose normals have a product below are watched."""

AMONG = 0.05
"""Least cosine between a fan triangle and the normals of its vertices."""

ANYHOW = -2.0
"""A cosine that nothing is below."""

TRIES, PASSES, TIMES = 5, 6, 2


class Guard:
    """What must not get worse when the vertices of a mesh move.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh; only its connectivity is kept.
    faces : Faces
        Its faces.
    along : (f, 3) array of float
        Unit vectors that the faces should point along, zero where nothing is known.
    free : (n,) array of bool
        Which vertices may move.
    """

    def __init__(self, mesh: SimplexMesh, faces: Faces, along: Array, free: NDArray[np.bool_]) -> None:
        self._c, self._faces, self._along, self._free = mesh.connectivity, faces, along, free
        one, other = self._c.edge_faces.T.astype(np.int64)
        self._adjacent = np.concatenate([one * len(along) + other, other * len(along) + one])

    def advanced(self, mesh: SimplexMesh, target: Array, along: float) -> Array:
        """Return the vertices, moved towards a target (n, 3) as far as nothing gets worse."""
        g, edge = self._guarded(mesh, FACING)
        kernels.advance(g, target, REACH * edge, TRIES, kernels.Bounds(AMONG, along))
        return np.array(g.points[: len(target)])

    def untangled(self, mesh: SimplexMesh, among: float, along: float) -> Array:
        """Return the vertices, those put elsewhere around which faces fold or cross."""
        for _ in range(TIMES):
            g, _ = self._guarded(mesh, 1.0 + AMONG)
            left = _kernels_untangle.untangle(g, PASSES, kernels.Bounds(among, along))
            mesh = mesh.moved(g.points[: mesh.n_vertices])
            if not left:
                break
        return mesh.vertices

    def _guarded(self, mesh: SimplexMesh, facing: float) -> tuple[fans.Guarded, float]:
        """Return what the kernels work on, and the mean length of edges."""
        c, v, f = self._c, mesh.vertices, self._faces
        a, b = v[c.edge_vertices.T]
        edge = float(np.linalg.norm(a - b, axis=1).mean())
        normals = face_geometry.face_normals(v, f.vertices, f.offsets)
        corners = v[f.vertices]
        low = np.minimum.reduceat(corners, f.offsets[:-1], axis=0) - AROUND * edge
        high = np.maximum.reduceat(corners, f.offsets[:-1], axis=0) + AROUND * edge
        solid = np.flatnonzero(~f.hole)
        cell = max(CELL * edge, np.finfo(float).tiny)
        offsets, near = _near(low[solid], high[solid], normals[solid], facing, cell)
        left_out = np.zeros(0, np.int64) if facing > 1 else self._adjacent
        near, offsets = _without(near, offsets, solid, len(f.hole), left_out)
        points = np.concatenate([v, face_geometry.face_centroids(v, f.vertices, f.offsets)])
        g = fans.Guarded(
            points,
            np.array(mesh.normals),
            self._along,
            np.ascontiguousarray(c.neighbors, np.int32),
            np.ascontiguousarray(c.vertex_faces, np.int32),
            f,
            offsets,
            near,
            np.zeros(len(near)),
            np.zeros(len(f.hole)),
            CLEAR * edge,
            np.zeros(len(f.hole), bool),
            self._free,
        )
        fans.mark_crossed(g)
        return g, edge


def _near(low: Array, high: Array, along: Array, facing: float, cell: float) -> tuple[NDArray[np.int64], Indices]:
    """Return the boxes near each box; see `near_boxes`."""
    origin = low.min(axis=0)
    cell, shape = grid_cells(high.max(axis=0) - origin, cell, len(low))
    return _kernels_untangle.near_boxes(low, high, along, facing, origin, cell, shape)


def _without(
    near: Indices, offsets: NDArray[np.int64], solid: NDArray[np.int64], n_faces: int, left_out: NDArray[np.int64]
) -> tuple[Indices, NDArray[np.int64]]:
    """Return the lists of near faces, told by which of the solid ones they are, without pairs given as one number."""
    owner, other = np.repeat(solid, np.diff(offsets)), solid[near]
    kept = ~np.isin(owner * n_faces + other, left_out)
    counts = np.bincount(owner[kept], minlength=n_faces)
    return other[kept].astype(np.int32), np.concatenate([[0], np.cumsum(counts)])
