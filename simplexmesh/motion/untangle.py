"""Folds and self-intersections undone where they are, the rest of the mesh left alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.errors import DivergedError
from simplexmesh.mesh.check import misoriented
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.self_intersection import self_intersections
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.state import Target


def tangled_vertices(mesh: SimplexMesh) -> NDArray[np.bool_]:
    """Return (n,) whether a vertex is turned against its faces, or on a face that is folded or meets another face.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> bool(tangled_vertices(sm.sphere(4)).any())
    False
    """
    crossing = np.zeros(len(mesh.connectivity.face_sizes), bool)
    crossing[self_intersections(mesh.vertices, mesh.connectivity).ravel()] = True
    return np.asarray(folded_vertices(mesh) | crossing[mesh.connectivity.vertex_faces].any(axis=1))


def folded_vertices(mesh: SimplexMesh) -> NDArray[np.bool_]:
    """Return (n,) whether a vertex is turned or on a folded face: most tangles begin so, and it is found much sooner.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> bool(folded_vertices(sm.sphere(4)).any())
    False
    """
    inverted, folded = misoriented(mesh.vertices, mesh.connectivity)
    return np.asarray(inverted | folded[mesh.connectivity.vertex_faces].any(axis=1))


def grown(marked: NDArray[np.bool_], connectivity: Connectivity, rings: int) -> NDArray[np.bool_]:
    """Return the marked vertices and all within so many edges of one."""
    for _ in range(rings):
        marked = np.asarray(marked | marked[connectivity.neighbors].any(axis=1))
    return marked


def untangled(
    mesh: SimplexMesh, target: Target, *, reach: float, start: SimplexMesh | None = None, rounds: int = 10
) -> tuple[SimplexMesh, int]:
    """Return the mesh with its folds and self-intersections smoothed away, and how many vertices are still tangled.

    Tangled vertices and their surroundings, wider in every round, first relax without data under orientation
    continuity, then return to the data under a mean-curvature constraint, stiffer in every round. All other vertices
    stay. What resists is taken back, in part and with its surroundings, to where it was at the start.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    reach : float
        How far the data is looked for.
    start : SimplexMesh, optional
        The same mesh before it moved, near the data and not tangled.
    rounds : int
        How often to try.

    Returns
    -------
    mesh : SimplexMesh
        The best found.
    remaining : int
        Number of its tangled vertices.
    """
    best, marked = mesh, tangled_vertices(mesh)
    fewest = int(marked.sum())
    for attempt in range(rounds):
        if not fewest:
            break
        free = grown(marked, mesh.connectivity, 2 + attempt).astype(float)
        try:
            mesh = _smoothed(mesh, target, free, reach, attempt)
        except DivergedError:  # a mesh too coarse for its topology has no smooth shape: the best so far stays
            break
        marked = tangled_vertices(mesh)
        if int(marked.sum()) < fewest:
            best, fewest = mesh, int(marked.sum())
    if fewest and start is not None:
        best, fewest = _taken_back(best, start, fewest)
    return best, fewest


def _smoothed(mesh: SimplexMesh, target: Target, free: NDArray[np.float64], reach: float, attempt: int) -> SimplexMesh:
    """Return the mesh with its free vertices relaxed without data, then back on it, stiffer with each attempt."""
    relaxing = DeformableModel(mesh, alpha=0.5 * free, damping=1.0, constraint="orientation")
    for _ in relaxing.run(5 + 5 * attempt):
        pass
    returning = DeformableModel(
        relaxing.mesh,
        target,
        alpha=0.4 * free,
        beta=0.2 / (1 + attempt) * free,
        damping=1.0,
        reach=reach,
        rigidity=3 + attempt,
        seeking=0.2 / (1 + attempt),
    )
    for _ in returning.run(20):
        pass
    return returning.mesh


def _taken_back(mesh: SimplexMesh, start: SimplexMesh, fewest: int) -> tuple[SimplexMesh, int]:
    """Return the mesh with its tangled parts drawn back to the start, more and wider each time, where that helps."""
    best = mesh
    for rings in range(2, 9):
        marked = tangled_vertices(mesh)
        share = grown(marked, mesh.connectivity, rings).astype(float)
        for _ in range(rings):
            share = 0.25 * (share + share[mesh.connectivity.neighbors].sum(axis=1))
        mesh = mesh.moved(mesh.vertices + share[:, None] * (start.vertices - mesh.vertices))
        left = int(tangled_vertices(mesh).sum())
        if left < fewest:
            best, fewest = mesh, left
        if not fewest:
            break
    return best, fewest
