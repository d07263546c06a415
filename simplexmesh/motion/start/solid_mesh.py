"""Simplex mesh of a voxel solid with a given number of vertices: marching cubes, decimated, relaxed and dualized.

Topology as prescribed: T. Lewiner, H. Lopes, A. Vieira, G. Tavares, Efficient implementation of marching cubes' cases
with topological guarantees, 2003. Relaxation: Botsch and Kobbelt 2004, section 4. The decimation of libigl lets
triangles turn over, so that 3 of 7 thin walls stay tangled, in twice the time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangles import _kernels_relaxation
from simplexmesh.mesh.triangles._kernels_half_edges import MIN_COSINE
from simplexmesh.motion.start import _kernels_remesh
from simplexmesh.motion.start.topology import euler, pinched, thickened

PINCHED_INSIDE, PINCHED_OUTSIDE = 0.3, 0.45
"""Values where cells touch at an edge or a corner: the larger outside lets marching cubes separate them."""

SUBDIVIDE_FROM = 200_000
"""Vertices from which a start is subdivided from a coarser one: collapsing a million edges takes most of a minute."""

FEWEST = 20
"""Vertices of the smallest component that is kept."""

THICKENINGS = 8
"""Maximum number: the motion corrects excess thickness, but does not untangle a mesh that starts tangled."""


def isosurface(field: NDArray[Any], solid: Mask, triangles: int = 0) -> tuple[Array, Indices]:
    """Return the closed surface of a solid in a field, in cells, on a finer grid if that has too few `triangles`."""
    box = box_around(solid)
    if box is None:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    around = box_slices(*box, solid.shape, margin=2)
    corner = np.array([side.start for side in around])
    field, solid = field[around], solid[around]
    consistent = _consistent(field, solid)
    vertices, faces = _marching_cubes(consistent)
    if not 0 < len(faces) < triangles:
        return vertices + corner, faces
    shape = np.array(field.shape)
    for spare in (1.1, 1.5, 2.2):
        fine = np.ceil((shape - 1) * np.sqrt(spare * triangles / len(faces))).astype(int) + 1
        finer = _marching_cubes(ndimage.zoom(consistent, fine / shape, order=1))
        if _euler(finer[1]) != 2 * euler(solid):
            break
        if len(finer[1]) >= triangles:
            return finer[0] * ((shape - 1) / (fine - 1)) + corner, finer[1]
    while len(faces) < triangles:
        vertices, faces = subdivided(vertices, faces)
    return vertices + corner, faces


def subdivided(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a triangulation with each triangle split into four at the midpoints of its sides."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    key, side = np.unique(low * len(vertices) + high, return_inverse=True)
    middle = (vertices[key // len(vertices)] + vertices[key % len(vertices)]) / 2
    m = len(vertices) + side.reshape(-1, 3)
    corner = [np.stack([faces[:, j], m[:, j], m[:, j - 1]], axis=1) for j in range(3)]
    return np.concatenate([vertices, middle]), np.concatenate([*corner, m])


def _consistent(field: NDArray[Any], solid: Mask) -> NDArray[np.float32]:
    """Return the field with the sign of the solid, in units of its median magnitude near the surface."""
    crossing = np.nonzero(solid[1:] != solid[:-1])
    jumps = np.abs(field[1:][crossing] - field[:-1][crossing])
    scale = float(np.median(jumps)) / 2 if len(jumps) else 1.0
    out = np.clip(field / np.float32(scale if scale > 0 else 1.0), -3, 3, dtype=np.float32)
    np.maximum(out, np.float32(0.05), out=out, where=solid)
    np.minimum(out, np.float32(-0.05), out=out, where=~solid)
    at = np.nonzero(pinched(solid))
    out[at] = np.minimum(out[at], np.where(solid[at], PINCHED_INSIDE, -PINCHED_OUTSIDE))
    return out


def _euler(faces: Indices) -> int:
    return len(np.unique(faces)) - len(faces) // 2


def _marching_cubes(field: NDArray[np.float32]) -> tuple[Array, Indices]:
    from skimage.measure import marching_cubes

    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="ascent", allow_degenerate=True)
    return vertices.astype(float), faces.astype(np.int64)


def decimated(vertices: Array, faces: Indices, triangles: int) -> tuple[Array, Indices]:
    """Return a closed triangulation decimated by collapses of shortest edges, those that turn triangles last."""
    if len(faces) <= triangles:
        return vertices, faces
    positions = np.array(vertices, dtype=float, order="C")
    mates = np.array(half_edge_mates(faces), dtype=np.int64).ravel()
    corners = np.array(faces, dtype=np.int64).ravel()
    for cosine in (MIN_COSINE, -np.inf):  # first without turning any triangle far, which keeps thin rods round
        if _kernels_remesh.collapse_shortest(positions, corners, mates, triangles, cosine) <= triangles:
            break
    used, left = np.unique(corners[corners != _kernels_remesh.REMOVED], return_inverse=True)
    return positions[used], left.reshape(-1, 3)


def relaxed(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a closed triangulation with edges flipped towards valence six, and vertices evenly spread tangentially."""
    positions = np.array(vertices, dtype=float, order="C")
    mates = np.array(half_edge_mates(faces), dtype=np.int64).ravel()
    corners = np.array(faces, dtype=np.int64).ravel()
    valence = np.bincount(corners, minlength=len(positions))
    for _ in range(6):
        _kernels_remesh.flip_round(positions, corners, mates, valence)
        first = np.full(len(positions), -1)
        first[corners] = np.arange(len(corners))
        for _ in range(2):
            _kernels_relaxation.relax_round(positions, corners, mates, first, 0.5)
    return positions, corners.reshape(-1, 3)


def cell_size(area: float, vertices: int) -> float:
    """Return the cell size at which marching cubes give twice `vertices` triangles."""
    return float(np.sqrt(3 * area / (2 * vertices)))  # a surface meets 1.5 area / cell^2 cells, two triangles in each


def edge_length(area: float, vertices: int) -> float:
    """Return the side of the regular hexagons that tile an area with `vertices` corners."""
    return float(np.sqrt(4 * area / (3 * np.sqrt(3) * vertices)))


def surface_area(solid: Mask, spacing: Array) -> float:
    """Estimate the surface area of a voxel solid as two thirds of the area of its boundary faces."""
    faces = [np.count_nonzero(np.diff(solid, axis=axis)) for axis in range(3)]
    return sum(float(count * np.prod(spacing) / spacing[axis]) for axis, count in enumerate(faces)) * 2 / 3


def solid_mesh(field: NDArray[np.float32], solid: Mask, T_world_cell: Array, vertices: int) -> tuple[SimplexMesh, Mask]:
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


def _mesh_of(field: NDArray[np.float32], solid: Mask, T_world_cell: Array, vertices: int) -> SimplexMesh:
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
    return dual(relaxed(positions, faces), outward=False)  # walls of cavities face them
