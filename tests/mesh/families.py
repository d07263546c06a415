"""Meshes by property, for tests that hold for all of a family."""

from __future__ import annotations

import numpy as np

from simplexmesh.mesh import shapes
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh

SPHERES = {f"{base}-{f}": shapes.sphere(f, base) for base in shapes.lattices.BASES for f in (1, 2, 5)}
GENUS_ONE = {"torus": shapes.torus(14, 6), "least torus": shapes.torus(5, 4)}
CLOSED = SPHERES | GENUS_ONE | {"ellipsoid": shapes.ellipsoid((3, 2, 1), 4, center=(5, -4, 3))}
OPEN = {
    "cylinder": shapes.cylinder(9, 4, axis=(1, 2, 3)),
    "least cylinder": shapes.cylinder(3, 1),
    "plane": shapes.plane(5, 4, center=(1, 1, 1)),
    "least plane": shapes.plane(2, 2),
}
ALL = CLOSED | OPEN
HOLES = {"cylinder": 2, "least cylinder": 2, "plane": 1, "least plane": 1}


def shaken(mesh: SimplexMesh, rng: np.random.Generator, amount: float = 0.2) -> SimplexMesh:
    """The mesh with random displacements of a fraction of the mean edge: no symmetry, no degeneracy."""
    a, b = mesh.vertices[mesh.connectivity.edge_vertices].transpose(1, 0, 2)
    edge = np.linalg.norm(a - b, axis=1).mean()
    return mesh.moved(mesh.vertices + amount * edge * rng.uniform(-1, 1, mesh.vertices.shape))


def renumbered(mesh: SimplexMesh, order: np.ndarray) -> SimplexMesh:
    """The mesh whose vertex `i` is the old vertex `order[i]`."""
    new = np.argsort(order)
    twin = mesh.connectivity.twin[order]
    twin = 3 * new[twin // 3] + twin % 3
    holes = 3 * new[mesh.connectivity.hole_darts // 3] + mesh.connectivity.hole_darts % 3
    return SimplexMesh(mesh.vertices[order], Connectivity(twin, holes))


def flipped(mesh: SimplexMesh) -> SimplexMesh:
    """The mesh with reversed orientation: the same vertices and holes, every triple of neighbors reversed."""
    topology = mesh.connectivity
    mirror = np.array([0, 2, 1])
    old = topology.twin[:, mirror]
    twin = 3 * (old // 3) + mirror[old % 3]
    back = topology.twin.ravel()[topology.hole_darts]  # walks the hole the other way round
    return SimplexMesh(mesh.vertices, Connectivity(twin, 3 * (back // 3) + mirror[back % 3]))


def together(*meshes: SimplexMesh) -> SimplexMesh:
    """Several meshes as components of one."""
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    twin = [mesh.connectivity.twin + 3 * start for mesh, start in zip(meshes, starts, strict=False)]
    holes = [mesh.connectivity.hole_darts + 3 * start for mesh, start in zip(meshes, starts, strict=False)]
    topology = Connectivity(np.concatenate(twin), np.concatenate(holes))
    return SimplexMesh(np.concatenate([mesh.vertices for mesh in meshes]), topology)
