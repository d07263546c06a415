"""Decimation within a tolerance: coarsening repeated with smaller regions wherever the tolerance was exceeded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.coarsening import Coarsened, coarsened
from simplexmesh.mesh.comparison import Original
from simplexmesh.mesh.correction import correct
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.fitting import tangled_vertices
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.vertex_bound import minimum_vertices

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MAX_DEVIATION, SHRINK = 0.35, 0.85
"""Largest rms deviation of a region from a plane, in tolerances; factor on the extent of regions that exceed it."""

ATTEMPTS, SHRINK_AROUND, FREEZE = 30, 12, 20
"""After `SHRINK_AROUND` attempts neighboring regions shrink too; after `FREEZE`, regions beyond it are not merged."""


def decimated_within(mesh: SimplexMesh, tolerance: float) -> tuple[SimplexMesh, Edited, tuple[float, float]] | None:
    """Return a mesh with few vertices within a tolerance of the given one, everywhere and in both directions.

    It has no invalid vertices if the given mesh has none. Also returns the maps, and the rms and the largest distance
    of the samples; None when no edge can be removed or all attempts fail. See `Original.compare` for the test.
    """
    original, minimum = Original(mesh), minimum_vertices(mesh.connectivity)
    valid = not tangled_vertices(mesh).any()
    max_extent = np.full(len(mesh.connectivity.face_sizes), np.inf)
    for attempt in range(ATTEMPTS):
        now = coarsened(mesh, minimum, original.samples, MAX_DEVIATION * tolerance, max_extent)
        if now.fit.mesh.n_vertices == mesh.n_vertices:
            break
        failed = correct(now.fit, original, now.part_of, tolerance).faces
        coarse = now.fit.mesh
        if valid:
            failed[coarse.connectivity.vertex_faces[tangled_vertices(coarse)]] = True
        if not failed.any():
            return coarse, now.out, original.distances(coarse)
        max_extent = _shrunk(max_extent, now, failed, attempt)
    return None


def _shrunk(max_extent: Array, now: Coarsened, failed: Flags, attempt: int) -> Array:
    """Return the largest region extents (f,) for the next attempt: smaller in failed faces (g,), 0 to fix a face."""
    around, vertex_faces = failed.copy(), now.fit.mesh.connectivity.vertex_faces
    if attempt >= SHRINK_AROUND:
        around[vertex_faces[failed[vertex_faces].any(axis=1)]] = True
    single = np.bincount(now.part_of, minlength=len(failed)) == 1
    frozen = failed & (single | (attempt >= FREEZE))
    smaller = np.where(frozen[now.part_of], 0.0, SHRINK * np.minimum(max_extent, now.extent))
    return np.where(around[now.part_of], smaller, max_extent)
