"""A fit brought within a distance of the surface where least squares leave a little too much."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity, vstack

from simplexmesh.mesh.comparing import Compared, Original, Pulls
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.fitting import Fit
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan

Array = NDArray[np.float64]

TIMES, FEW, AIM = 3, 0.4, 0.95
"""How often vertices are pulled, as long as no more than `FEW` of the faces are too far, and towards which part of the
distance they are."""


def balanced(fit: Fit, original: Original, part_of: NDArray[np.integer], distance: float) -> Compared:
    """Move the vertices of a fit where it is too far from a surface, and return what still is.

    What is farthest on each triangle, of either surface, pulls at the corners of the one in the fit, by the least move
    that brings it near; corners go by the mean of what pulls at them. The best of all positions is kept.

    Parameters
    ----------
    fit : Fit
        The fit; its mesh is moved, without new folds or crossings.
    original : Original
        The surface.
    part_of : (f,) array of int
        The face of the fit that each face of the surface is part of.
    distance : float
        In the unit of the mesh.
    """
    best, kept = original.compared(fit.mesh, part_of, distance), fit.mesh
    now = best
    for _ in range(TIMES):
        if not 0 < now.faces.sum() <= FEW * len(now.faces):
            break
        steps = pulled(now.pulls, fit.mesh, (1 - AIM) * distance)
        fit.advance(fit.mesh.vertices + steps, loosely=True)
        now = original.compared(fit.mesh, part_of, distance)
        if now.faces.sum() < best.faces.sum():
            best, kept = now, fit.mesh
    fit.mesh = kept
    return best


def pulled(pulls: Pulls, mesh: SimplexMesh, more: float) -> Array:
    """Return how vertices should move (n, 3), so that points of fans are moved as they are pulled and a little more."""
    points, triangles = fan(mesh.vertices, mesh.connectivity)
    at = np.arange(len(pulls.triangles)).repeat(3), triangles[pulls.triangles].ravel()
    of_points = csr_matrix((pulls.weights.ravel(), at), (len(pulls.triangles), len(points)))
    share = of_points @ vstack([identity(mesh.n_vertices), centroid_shares(mesh.connectivity)], format="csr")
    squares = share.multiply(share)
    tiny = np.finfo(float).tiny
    least_move = 1 / np.maximum(np.asarray(squares.sum(axis=1)), tiny)
    ways = pulls.ways * (1 + more / np.maximum(np.linalg.norm(pulls.ways, axis=1, keepdims=True), tiny))
    return np.asarray((share.T @ (least_move * ways)) / np.maximum(squares.T @ least_move, 1))


def centroid_shares(connectivity: Connectivity) -> csr_matrix:
    """Return the weights (g, n) of the vertices in the centroids of the faces, holes left out."""
    c = connectivity
    sizes = c.face_sizes[~c.face_is_hole]
    vertices = c.face_vertices[np.repeat(~c.face_is_hole, c.face_sizes)]
    return csr_matrix(
        (np.repeat(1 / sizes, sizes), vertices, np.concatenate([[0], np.cumsum(sizes)])), (len(sizes), c.n_vertices)
    )
