"""How fine the grid must be for a number of vertices, and the mesh of that number from its triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.errors import TopologyError
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.initial.polygonize import halved
from simplexmesh.motion.initial.remesh import decimated, relaxed

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TRIANGLES_PER_CELL = 3.0
SPARE = 2.0
MANY = 200_000


def cell_for(area: float, vertices: int, spare: float = SPARE) -> float:
    """Return the side of the cells whose marching cubes give `spare` times as many triangles as wanted vertices.

    A surface of area A meets about 1.5 A / h^2 cells of side h, and each gives two triangles (measured: 3.00 A / h^2
    on a sphere).
    """
    return float(np.sqrt(TRIANGLES_PER_CELL * area / (spare * vertices)))


def edge_for(area: float, vertices: int) -> float:
    """Return the side of the regular hexagons that tile an area with so many corners."""
    return float(np.sqrt(4 * area / (3 * np.sqrt(3) * vertices)))


def area_of(solid: NDArray[np.bool_], spacing: Array) -> float:
    """Return about the area of the surface of a solid on a grid: two thirds of the faces of its cells."""
    total = 0.0
    for axis in range(3):
        front, back = [slice(None)] * 3, [slice(None)] * 3
        front[axis], back[axis] = slice(1, None), slice(None, -1)
        crossed = np.count_nonzero(solid[tuple(front)] != solid[tuple(back)])
        total += float(crossed * np.prod(spacing) / spacing[axis])
    return total * 2 / 3


def triangles_for(vertices: int) -> int:
    """Return how many triangles the isosurface should have at least: some to collapse, unless there are very many."""
    return int(1.15 * vertices) if vertices < MANY else 0


def meshed(positions: Array, faces: Indices, vertices: int, *, rounds: int = 6) -> SimplexMesh:
    """Return the simplex mesh of so many vertices from a closed triangulation: collapsed, relaxed, dual.

    From 200,000 vertices on the triangulation is collapsed to a quarter (a sixteenth, ...) of the triangles where it
    has less than wanted, then cut in four: collapsing a million takes most of a minute.

    Raises
    ------
    TopologyError
        No triangle is left.
    """
    if not len(faces):
        raise TopologyError("the grid holds no surface to start from")
    cuts = 0
    while vertices >= MANY and len(faces) * 4**cuts < vertices:
        cuts += 1
    positions, faces = decimated(positions, faces, vertices // 4**cuts)
    for _ in range(cuts):
        positions, faces = halved(positions, faces)
    positions, faces = relaxed(positions, faces, rounds=rounds)
    return dual((positions, faces))
