"""Tangled vertices: those where a mesh folds, crosses itself or has no size, as `SimplexMesh.check` reports it."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Indices, Mask
from simplexmesh.mesh.check import degenerate, misoriented
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangles.self_intersection import self_intersections


def tangled_vertices(mesh: SimplexMesh) -> Mask:
    """Return a mask (n,) of the vertices inverted, degenerate, or on a face folded, flat or crossing another."""
    return tangled_with(mesh, self_intersections(mesh.vertices, mesh.connectivity))


def tangled_with(mesh: SimplexMesh, pairs: Indices) -> Mask:
    """Return the tangled vertices (n,), given the pairs (m, 2) of faces that cross."""
    c, found = mesh.connectivity, degenerate(mesh.vertices, mesh.connectivity)
    faces = np.zeros(len(c.face_sizes), bool)
    faces[found["flat_faces"]] = True
    faces[pairs.ravel()] = True
    out = folded_vertices(mesh) | faces[c.vertex_faces].any(axis=1)
    out[found["collinear"]] = out[c.edge_vertices[found["flat_edges"]].ravel()] = True
    return np.asarray(out)


def folded_vertices(mesh: SimplexMesh) -> Mask:
    """Return a mask (n,) of the vertices inverted or on folded faces: a fast test that finds most tangles."""
    inverted, folded = misoriented(mesh.vertices, mesh.connectivity)
    return np.asarray(inverted | folded[mesh.connectivity.vertex_faces].any(axis=1))
