"""Refinement of the boundary: long edges on holes are divided together with the adjacent face."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh

LONG, LONGER = 1.4, 2.0
"""Lengths of edges to divide, relative to the mean of the interior ones; the second beside faces of fewer than six
vertices, whose parts are hard to even out."""


def divided_boundary(mesh: SimplexMesh, most: int) -> Edited:
    """Return the mesh with the longest edges on holes divided, at most `most`, by T2 across the adjacent face.

    Refinement of faces alone leaves the boundary coarse: a face beside a hole keeps one edge there when divided.
    """
    c = mesh.connectivity
    ends = mesh.vertices[c.edge_vertices]
    length = norm(ends[:, 0] - ends[:, 1])
    on_hole = c.face_is_hole[c.edge_faces].any(axis=1)
    if not on_hole.any() or most < 1:
        same = np.arange(mesh.n_vertices, dtype=np.int32), np.arange(len(c.face_sizes), dtype=np.int32)
        return Edited(mesh, *(checks.frozen(numbers) for numbers in same))
    face, twin = c.face.reshape(-1), c.twin.reshape(-1)
    relative = length / length[~on_hole].mean()
    long = np.flatnonzero(on_hole & (relative > LONG))
    long = long[np.argsort(-length[long], kind="stable")]
    darts = c.edge_darts[long, 0].astype(np.int64)
    darts = np.where(c.face_is_hole[face[darts]], twin[darts], darts)
    darts = darts[(c.face_sizes[face[darts]] >= 6) | (relative[long] > LONGER)][:most]
    place = np.empty(len(face), np.int64)
    place[c.face_darts] = np.arange(len(face))
    first, size = c.face_offsets[face[darts]], c.face_sizes[face[darts]]
    across = c.face_darts[first + (place[darts] - first + size // 2) % size]
    edit = EditableMesh(mesh)
    edit.insert_edges(darts, across)
    return edit.result()
