"""Simplex mesh of a voxel solid without self-intersections: the solid is thickened where it is too thin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.tangles import tangled_vertices
from simplexmesh.motion.start.budget import SUBDIVIDE_FROM, dual_mesh, min_triangles
from simplexmesh.motion.start.polygonize import isosurface
from simplexmesh.motion.start.topology import thickened

Array = NDArray[np.float64]

THICKENINGS = 8
"""Maximum number: the motion corrects excess thickness, but does not untangle a mesh that starts tangled."""


def solid_mesh(
    field: NDArray[np.float32], solid: NDArray[np.bool_], T_world_cell: Array, vertices: int
) -> tuple[SimplexMesh, NDArray[np.bool_]]:
    """Return the mesh of a solid, and the solid, thickened where the mesh would intersect itself."""
    best = mesh = _mesh_of(field, solid, T_world_cell, vertices)
    best_solid, fewest, rounds = solid, solid.size, THICKENINGS if vertices < SUBDIVIDE_FROM else 0
    for rings in range(2, 2 + rounds):
        tangled = mesh.vertices[tangled_vertices(mesh)]
        if len(tangled) < fewest:
            best, best_solid, fewest = mesh, solid, len(tangled)
        if not len(tangled):
            break
        places = np.rint((tangled - T_world_cell[:3, 3]) @ np.linalg.inv(T_world_cell[:3, :3]).T).astype(np.int64)
        solid = thickened(solid, places, rings)
        field = np.where(solid & (field <= 0), 0.3 * field.max(), field)
        mesh = _mesh_of(field, solid, T_world_cell, vertices)
    return best, best_solid


def _mesh_of(field: NDArray[np.float32], solid: NDArray[np.bool_], T_world_cell: Array, vertices: int) -> SimplexMesh:
    positions, faces = isosurface(field, solid, min_triangles(vertices))
    if np.linalg.det(T_world_cell[:3, :3]) < 0:
        faces = faces[:, ::-1]
    return dual_mesh(positions @ T_world_cell[:3, :3].T + T_world_cell[:3, 3], faces, vertices)
