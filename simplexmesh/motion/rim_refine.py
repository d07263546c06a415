"""Refinement of rims: long edges on holes are divided together with the adjacent face."""

from __future__ import annotations

import numpy as np

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh

LONG = 1.4
"""Length of a long edge, relative to the mean of the edges that are not on a rim."""

SMALLEST, LONGER = 6, 2.0
"""Faces with fewer vertices are divided at longer edges only, as their parts are hard to even out."""


def divided_rims(mesh: SimplexMesh, most: int) -> Edited:
    """Return the mesh with the longest edges of its rims divided, at most `most`, by T2 across the adjacent face.

    An edge is long from 1.4 times the mean length of interior edges, or 2 times next to a face of fewer than six
    vertices. Refinement of faces alone leaves rims coarse: a face beside a hole keeps one edge there when divided.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> tube = sm.cylinder(9, 30)
    >>> out = divided_rims(tube.moved(tube.vertices * [8, 8, 1]), 100).mesh
    >>> sorted(out.connectivity.face_sizes[out.connectivity.face_is_hole].tolist())
    [18, 18]
    """
    c = mesh.connectivity
    ends = mesh.vertices[c.edge_vertices]
    length = norm(ends[:, 0] - ends[:, 1])
    on_hole = c.face_is_hole[c.edge_faces].any(axis=1)
    none = np.arange(mesh.n_vertices, dtype=np.int32), np.arange(len(c.face_sizes), dtype=np.int32)
    if not on_hole.any() or most < 1:
        return Edited(mesh, *(_check.frozen(numbers) for numbers in none))
    face, twin = c.face.reshape(-1), c.twin.reshape(-1)
    long = np.flatnonzero(on_hole & (length > LONG * float(length[~on_hole].mean())))
    long = long[np.argsort(-length[long], kind="stable")]
    darts = c.edge_darts[long, 0].astype(np.int64)
    darts = np.where(c.face_is_hole[face[darts]], twin[darts], darts)
    longer = length[long] > LONGER * float(length[~on_hole].mean())
    darts = darts[(c.face_sizes[face[darts]] >= SMALLEST) | longer][:most]
    place = np.empty(len(face), np.int64)
    place[c.face_darts] = np.arange(len(face))
    first, size = c.face_offsets[face[darts]], c.face_sizes[face[darts]]
    across = c.face_darts[first + (place[darts] - first + size // 2) % size]
    edit = EditableMesh(mesh)
    edit.insert_edges(darts, across)
    return edit.result()
