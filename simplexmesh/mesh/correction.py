"""Corrective displacements that bring a least-squares fit within a tolerance of the surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity, vstack

from simplexmesh.mesh.comparison import Comparison, Corrections, Original
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.fitting import Fit
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan

Array = NDArray[np.float64]

ROUNDS, MAX_FRACTION, TARGET = 3, 0.4, 0.95
"""Correction rounds, done while at most `MAX_FRACTION` of the faces are beyond the tolerance, and the distance that
they aim for, as a fraction of it."""


def correct(fit: Fit, original: Original, part_of: NDArray[np.integer], distance: float) -> Comparison:
    """Displace the vertices of a fit where it is beyond a tolerance, and return the final comparison.

    For the farthest point of each triangle beyond it, on either surface, the smallest displacement of the fitted
    triangle's corners that brings it within is computed; corners move by the mean of these. The best round is kept.

    Parameters
    ----------
    fit : Fit
        The fit; its mesh is moved, without new folds or crossings.
    original : Original
        The surface.
    part_of : (f,) array of int
        The face of the fit into which each face of the surface was merged.
    distance : float
        The tolerance, in the unit of the mesh.
    """
    best, kept = original.compare(fit.mesh, part_of, distance), fit.mesh
    now = best
    for _ in range(ROUNDS):
        if not 0 < now.faces.sum() <= MAX_FRACTION * len(now.faces):
            break
        steps = vertex_displacements(now.corrections, fit.mesh, (1 - TARGET) * distance)
        fit.advance(fit.mesh.vertices + steps, loosely=True)
        now = original.compare(fit.mesh, part_of, distance)
        if now.faces.sum() < best.faces.sum():
            best, kept = now, fit.mesh
    fit.mesh = kept
    return best


def vertex_displacements(corrections: Corrections, mesh: SimplexMesh, extra: float) -> Array:
    """Return the mean of the least vertex displacements (n, 3) that realize those of fan points, longer by `extra`."""
    points, triangles = fan(mesh.vertices, mesh.connectivity)
    at = np.arange(len(corrections.triangles)).repeat(3), triangles[corrections.triangles].ravel()
    of_points = csr_matrix((corrections.weights.ravel(), at), (len(corrections.triangles), len(points)))
    weights = of_points @ vstack([identity(mesh.n_vertices), centroid_weights(mesh.connectivity)], format="csr")
    squares = weights.multiply(weights)
    tiny = np.finfo(float).tiny
    scale = 1 / np.maximum(np.asarray(squares.sum(axis=1)), tiny)
    length = np.linalg.norm(corrections.displacements, axis=1, keepdims=True)
    wanted = corrections.displacements * (1 + extra / np.maximum(length, tiny))
    return np.asarray((weights.T @ (scale * wanted)) / np.maximum(squares.T @ scale, 1))


def centroid_weights(connectivity: Connectivity) -> csr_matrix:
    """Return the weights (g, n) of the vertices in the face centroids, holes excluded."""
    c = connectivity
    sizes = c.face_sizes[~c.face_is_hole]
    vertices = c.face_vertices[np.repeat(~c.face_is_hole, c.face_sizes)]
    return csr_matrix(
        (np.repeat(1 / sizes, sizes), vertices, np.concatenate([[0], np.cumsum(sizes)])), (len(sizes), c.n_vertices)
    )
