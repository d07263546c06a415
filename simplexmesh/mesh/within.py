"""A mesh made as coarse as a tolerance allows: where it is too coarse, it is made again with smaller regions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.balancing import balanced
from simplexmesh.mesh.coarsening import Made, made
from simplexmesh.mesh.comparing import Original
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.fitting import tangled_vertices
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.vertex_bound import minimum_vertices

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FLAT, LESS = 0.35, 0.85
"""How far from flat regions may be, rms, in parts of the tolerance; those that are wrong reach `LESS` the next time."""

ATTEMPTS, WIDELY, AT_LAST = 30, 12, 20
"""After `WIDELY` attempts the regions around are made smaller, too; after `AT_LAST`, wrong ones stay as they were."""


def made_within(mesh: SimplexMesh, tolerance: float) -> tuple[SimplexMesh, Edited, tuple[float, float]] | None:
    """Return a mesh with few vertices that is within a tolerance, everywhere and either way; see `Original.compared`.

    Sound if the other one was; and what became of that, and the rms and the largest distance of its samples. None where
    nothing can be removed.
    """
    original, least = Original(mesh), minimum_vertices(mesh.connectivity)
    sound = not tangled_vertices(mesh).any()
    reach = np.full(len(mesh.connectivity.face_sizes), np.inf)
    for attempt in range(ATTEMPTS):
        now = made(mesh, least, original.samples, FLAT * tolerance, reach)
        if now.fit.mesh.n_vertices == mesh.n_vertices:
            break
        wrong = balanced(now.fit, original, now.part_of, tolerance).faces
        coarse = now.fit.mesh
        if sound:
            wrong[coarse.connectivity.vertex_faces[tangled_vertices(coarse)]] = True
        if not wrong.any():
            return coarse, now.out, original.distances(coarse)
        reach = _lessened(reach, now, wrong, attempt)
    return None


def _lessened(reach: Array, now: Made, wrong: Flags, attempt: int) -> Array:
    """Return how far regions may reach (f,): less than they did where faces (g,) are wrong; 0 where faces must stay."""
    around, vertex_faces = wrong.copy(), now.fit.mesh.connectivity.vertex_faces
    if attempt >= WIDELY:
        around[vertex_faces[wrong[vertex_faces].any(axis=1)]] = True
    alone = np.bincount(now.part_of, minlength=len(wrong)) == 1
    stays = wrong & (alone | (attempt >= AT_LAST))
    less = np.where(stays[now.part_of], 0.0, LESS * np.minimum(reach, now.reach))
    return np.where(around[now.part_of], less, reach)
