"""The mesh of a solid on a grid, without faces that cross: the solid is thickened where it is too thin for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.initial.budget import MANY, meshed, triangles_for
from simplexmesh.motion.initial.polygonize import isosurface
from simplexmesh.motion.initial.topology import thickened
from simplexmesh.motion.untangle import tangled_vertices

Array = NDArray[np.float64]

THICKENINGS = 8
"""How often at most."""

THICK = 0.3
"""The field where cells are added, in parts of its largest value."""


def sound_mesh(
    field: NDArray[np.float32], solid: NDArray[np.bool_], T_world_cell: Array, vertices: int
) -> tuple[SimplexMesh, NDArray[np.bool_]]:
    """Return the mesh of the solid, and the solid, thickened where it is so thin that the mesh would cross itself.

    The motion draws to the data what is too thick, but what is tangled at the start stays so.

    Parameters
    ----------
    field : (nx, ny, nz) array of float
        Positive inside.
    solid : (nx, ny, nz) array of bool
        Empty at its border, without cavities.
    T_world_cell : (4, 4) array of float
        Where the grid is.
    vertices : int
        How many the mesh is to have.

    Examples
    --------
    >>> x, y, z = np.mgrid[-6:7, -6:7, -6:7]
    >>> field = (4.5 - np.sqrt(x**2 + y**2 + z**2)).astype(np.float32)
    >>> mesh, solid = sound_mesh(field, field > 0, np.eye(4), 200)
    >>> mesh.n_vertices, bool((solid == (field > 0)).all())
    (200, True)
    """
    best = mesh = _mesh_of(field, solid, T_world_cell, vertices)
    taken, fewest, rounds = solid, solid.size, THICKENINGS if vertices < MANY else 0
    for rings in range(2, 2 + rounds):
        tangled = mesh.vertices[tangled_vertices(mesh)]
        if len(tangled) < fewest:
            best, taken, fewest = mesh, solid, len(tangled)
        if not len(tangled):
            break
        places = np.rint((tangled - T_world_cell[:3, 3]) @ np.linalg.inv(T_world_cell[:3, :3]).T).astype(np.int64)
        solid = thickened(solid, places, rings)
        field = np.where(solid & (field <= 0), THICK * field.max(), field)
        mesh = _mesh_of(field, solid, T_world_cell, vertices)
    return best, taken


def _mesh_of(field: NDArray[np.float32], solid: NDArray[np.bool_], T_world_cell: Array, vertices: int) -> SimplexMesh:
    positions, faces = isosurface(field, solid, triangles_for(vertices))
    if np.linalg.det(T_world_cell[:3, :3]) < 0:
        faces = faces[:, ::-1]
    return meshed(positions @ T_world_cell[:3, :3].T + T_world_cell[:3, 3], faces, vertices)
