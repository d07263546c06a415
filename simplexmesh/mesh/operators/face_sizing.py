"""Face sizes: divide large faces and merge small ones, as in isotropic remeshing (thesis, section 5.5)."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh

LARGE, SMALL, MERGED = 1.7, 0.45, 1.3
"""In target areas: faces above `LARGE` are divided; those below `SMALL` are merged if the result is below `MERGED`."""


def resized_faces(mesh: SimplexMesh, target_areas: Array) -> Edited:
    """Divide faces too large for their target areas (f,) once (T2), merge too small ones (T1), and regularize (T7)."""
    c = mesh.connectivity
    size = mesh.face_areas / target_areas
    edit = EditableMesh(mesh)
    large = np.flatnonzero((size > LARGE) & (c.face_sizes >= 5) & ~c.face_is_hole)
    if len(large):
        divided = np.array([_narrowest_pair(mesh, face) for face in large.tolist()])
        edit.insert_edges(divided[:, 0], divided[:, 1])
    small = np.flatnonzero((size < SMALL) & ~c.face_is_hole).tolist()
    removed = [dart for face in small if (dart := _dart_to_smallest(mesh, face, size)) >= 0]
    if removed:
        edit.remove_edges(removed)
    edit.even_out()
    return edit.result()


def _narrowest_pair(mesh: SimplexMesh, face: int) -> tuple[int, int]:
    """Return the pair of opposite darts of a face whose midpoints are closest."""
    c = mesh.connectivity
    darts = c.face_darts[c.face_offsets[face] : c.face_offsets[face + 1]]
    corners = mesh.vertices[darts // 3]
    midpoints = 0.5 * (corners + np.roll(corners, -1, axis=0))
    half = len(darts) // 2
    start = int(np.linalg.norm(midpoints - np.roll(midpoints, -half, axis=0), axis=1).argmin())
    return int(darts[start]), int(darts[(start + half) % len(darts)])


def _dart_to_smallest(mesh: SimplexMesh, face: int, size: Array) -> int:
    """Return the dart of a face towards its smallest neighbor, -1 when merging them would make it too large."""
    c = mesh.connectivity
    darts = c.face_darts[c.face_offsets[face] : c.face_offsets[face + 1]]
    other = c.face.reshape(-1)[c.twin.reshape(-1)[darts]]
    both = np.where(c.face_is_hole[other], np.inf, size[other] + size[face])
    best = int(both.argmin())
    return int(darts[best]) if both[best] < MERGED else -1
