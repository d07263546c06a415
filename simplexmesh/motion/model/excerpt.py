"""A part of a mesh as a mesh of its own, so that a motion of few vertices does not take the time of all."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Indices, Mask
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def excerpt(mesh: SimplexMesh, zone: Mask) -> tuple[SimplexMesh, Indices]:
    """Return a mesh of a zone (n,) and the far ends of edges out of it, which a ring closes, and its rows in `mesh`."""
    c = mesh.connectivity
    inside = np.flatnonzero(zone)
    near = c.neighbors[inside]
    vertex, slot = np.nonzero(~zone[near])
    k, count = len(inside), len(vertex)
    if count < 3 or "crease" in mesh.data or c.face_is_hole[c.vertex_faces[inside]].any():
        # with too few ends for a ring, or a target that tells the vertices of creases by their number
        return mesh, np.arange(c.n_vertices)
    number = np.zeros(c.n_vertices, np.int64)
    number[inside] = np.arange(k)
    neighbors, ring = number[near], k + np.arange(count)
    neighbors[vertex, slot] = ring
    closing = np.column_stack([vertex, np.roll(ring, 1), np.roll(ring, -1)])
    rows = np.concatenate([inside, near[vertex, slot]])
    connectivity = Connectivity.from_neighbors(np.concatenate([neighbors, closing]))
    return SimplexMesh(mesh.vertices[rows], connectivity, {name: row[rows] for name, row in mesh.data.items()}), rows
