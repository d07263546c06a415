"""Triangulation and normals of range scans, from their acquisition grid."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import vectors
from simplexmesh._base.arrays import Array, Indices

VIEW = (0.0, 0.0, 1.0)
LONGEST = 5.0


def grid_faces(points: Array, grid: Indices) -> Indices:
    """Return the triangles (f, 3) between neighboring cells of a range grid, ccw seen from the sensor at +z.

    `grid` (rows, columns) holds the point measured in each cell, -1 for none. Cells are cut along their shorter known
    diagonal; long triangles, which are across steps in depth, are left out (Curless and Levoy 1996, section 3).
    """
    corners = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    known = sum((corner >= 0).view(np.int8) for corner in corners)
    a, b, c, d = (corner[known >= 3] for corner in corners)
    shorter = vectors.norm(points[a] - points[c]) <= vectors.norm(points[b] - points[d])
    across = (np.minimum(a, c) >= 0) & (shorter | (np.minimum(b, d) < 0))
    halves = np.where(across, (a, b, c), (a, b, d)), np.where(across, (a, c, d), (b, c, d))
    faces = np.concatenate(halves, axis=1).T
    faces = faces[(faces >= 0).all(axis=1)]
    if (vectors.triangle_vectors(points, faces) @ VIEW).sum() < 0:
        faces = faces[:, ::-1]
    a, b, c = points[faces.T]
    edges = vectors.norm(np.stack([a - c, b - a, c - b]))
    long = edges.max(axis=0) > LONGEST * (np.median(edges) if edges.size else 0.0)
    return np.ascontiguousarray(faces[~long])


def grid_normals(points: Array, grid: Indices) -> Array:
    """Return unit vertex normals (n, 3) of a range grid, towards the sensor; see `grid_faces`."""
    normals = vectors.vertex_normals(points, grid_faces(points, grid))
    normals[~normals.any(axis=1)] = VIEW
    return normals
