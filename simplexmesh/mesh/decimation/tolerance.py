"""Decimation within a tolerance: coarsening repeated with smaller regions wherever the tolerance was exceeded."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, identity, vstack

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.decimation.coarsening import Coarsened, coarsened
from simplexmesh.mesh.decimation.comparison import Comparison, Corrections, Original
from simplexmesh.mesh.decimation.vertex_bound import minimum_vertices
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan

MAX_DEVIATION, SHRINK = 0.35, 0.85
"""Largest rms deviation of a region from a plane, in tolerances; factor on the extent of regions that exceed it."""

ATTEMPTS, SHRINK_AROUND, FREEZE = 30, 12, 20
"""After `SHRINK_AROUND` attempts neighboring regions shrink too; after `FREEZE`, regions beyond it are not merged."""

ROUNDS, MAX_FRACTION, TARGET = 3, 0.4, 0.95
"""Correction rounds, done while at most `MAX_FRACTION` of the faces are beyond the tolerance, and the distance that
they aim for, as a fraction of it."""


def coarsened_within(mesh: SimplexMesh, original: Original, tolerance: float) -> Coarsened | None:
    """Return a mesh within a tolerance, tangled only if the given one is; None when no edge can be removed."""
    minimum = minimum_vertices(mesh.connectivity)
    valid = not tangled_vertices(mesh).any()
    max_extent = np.full(len(mesh.connectivity.face_sizes), np.inf)
    for attempt in range(ATTEMPTS):
        now = coarsened(mesh, minimum, original.samples, MAX_DEVIATION * tolerance, max_extent)
        if now.fit.mesh.n_vertices == mesh.n_vertices:
            break
        failed = corrected(now, original, tolerance).faces
        coarse = now.fit.mesh
        if valid:
            failed[coarse.connectivity.vertex_faces[tangled_vertices(coarse)]] = True
        if not failed.any():
            return now
        max_extent = _shrunk(max_extent, now, failed, attempt)
    return None


def _shrunk(max_extent: Array, now: Coarsened, failed: Mask, attempt: int) -> Array:
    """Return the largest region extents (f,) for the next attempt: smaller in failed faces (g,), 0 to fix a face."""
    around, vertex_faces = failed.copy(), now.fit.mesh.connectivity.vertex_faces
    if attempt >= SHRINK_AROUND:
        around[vertex_faces[failed[vertex_faces].any(axis=1)]] = True
    single = np.bincount(now.part_of, minlength=len(failed)) == 1
    frozen = failed & (single | (attempt >= FREEZE))
    smaller = np.where(frozen[now.part_of], 0.0, SHRINK * np.minimum(max_extent, now.extent))
    return np.where(around[now.part_of], smaller, max_extent)


def corrected(now: Coarsened, original: Original, distance: float) -> Comparison:
    """Move the vertices of a fit where it is beyond a tolerance, keep the best round, and return its comparison."""
    fit, part_of = now.fit, now.part_of
    best, kept = original.compare(fit.mesh, part_of, distance), fit.mesh
    last = best
    for _ in range(ROUNDS):
        if not 0 < last.faces.sum() <= MAX_FRACTION * len(last.faces):
            break
        steps = vertex_displacements(last.corrections, fit.mesh, (1 - TARGET) * distance)
        fit.advance(fit.mesh.vertices + steps, loosely=True)
        last = original.compare(fit.mesh, part_of, distance)
        if last.faces.sum() < best.faces.sum():
            best, kept = last, fit.mesh
    fit.mesh = kept
    return best


def vertex_displacements(corrections: Corrections, mesh: SimplexMesh, extra: float) -> Array:
    """Return the mean of the least vertex displacements (n, 3) that realize those of fan points, longer by `extra`."""
    c = mesh.connectivity
    _, triangles = fan(mesh.vertices, c)
    corners = triangles[corrections.triangles]
    rows = corrections.weights.ravel(), corners.ravel(), np.arange(0, corners.size + 1, 3)
    places = csr_matrix(rows, (len(corners), mesh.n_vertices + mesh.n_faces))
    weights = places @ points_of(c)[np.concatenate([np.ones(mesh.n_vertices, bool), ~c.face_is_hole])]
    squares = weights.multiply(weights)
    tiny = np.finfo(float).tiny
    scale = 1 / np.maximum(np.asarray(squares.sum(axis=1)), tiny)
    wanted = corrections.displacements * (1 + extra / np.maximum(norm(corrections.displacements), tiny))[:, None]
    return np.asarray((weights.T @ (scale * wanted)) / np.maximum(squares.T @ scale, 1))


def points_of(c: Connectivity) -> csr_matrix:
    """Return the weights (n + f, n) of the vertices in the vertices and in the face centroids, holes included."""
    means = csr_matrix((np.repeat(1 / c.face_sizes, c.face_sizes), c.face_vertices, c.face_offsets))
    return vstack([identity(c.n_vertices), means], format="csr")
