"""Simplex mesh of a voxel solid with a given number of vertices, thickened where the mesh would intersect itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.tangles import tangled_vertices
from simplexmesh.motion.start.polygonize import isosurface, subdivided
from simplexmesh.motion.start.remesh import decimated, relaxed
from simplexmesh.motion.start.topology import thickened

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SUBDIVIDE_FROM = 200_000
"""Vertices from which a start is subdivided from a coarser one: collapsing a million edges takes most of a minute."""

FEWEST = 20
"""Vertices of the smallest component that is kept."""

THICKENINGS = 8
"""Maximum number: the motion corrects excess thickness, but does not untangle a mesh that starts tangled."""


def cell_size(area: float, vertices: int) -> float:
    """Return the cell size at which marching cubes give twice `vertices` triangles."""
    return float(np.sqrt(3 * area / (2 * vertices)))  # a surface meets 1.5 area / cell^2 cells, two triangles in each


def edge_length(area: float, vertices: int) -> float:
    """Return the side of the regular hexagons that tile an area with `vertices` corners."""
    return float(np.sqrt(4 * area / (3 * np.sqrt(3) * vertices)))


def surface_area(solid: NDArray[np.bool_], spacing: Array) -> float:
    """Estimate the surface area of a voxel solid as two thirds of the area of its boundary faces."""
    total = 0.0
    for axis in range(3):
        front, back = [slice(None)] * 3, [slice(None)] * 3
        front[axis], back[axis] = slice(1, None), slice(None, -1)
        faces = np.count_nonzero(solid[tuple(front)] != solid[tuple(back)])
        total += float(faces * np.prod(spacing) / spacing[axis])
    return total * 2 / 3


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
    positions, faces = isosurface(field, solid, _min_triangles(vertices))
    if np.linalg.det(T_world_cell[:3, :3]) < 0:
        faces = faces[:, ::-1]
    return _dual_mesh(positions @ T_world_cell[:3, :3].T + T_world_cell[:3, 3], faces, vertices)


def _min_triangles(vertices: int) -> int:
    """Return the minimum number of triangles of the isosurface, 15 % more than wanted; 0 for very large meshes."""
    return int(1.15 * vertices) if vertices < SUBDIVIDE_FROM else 0


def _dual_mesh(positions: Array, faces: Indices, vertices: int) -> SimplexMesh:
    """Return the simplex mesh with `vertices` vertices from a closed triangulation: decimated, relaxed, dualized."""
    if not len(faces):
        raise TopologyError("the grid holds no surface to start from")
    levels = 0
    while vertices >= SUBDIVIDE_FROM and len(faces) * 4**levels < vertices:
        levels += 1
    positions, faces = decimated(positions, faces, vertices // 4**levels)
    for _ in range(levels):
        positions, faces = subdivided(positions, faces)
    return dual(relaxed(positions, faces))
