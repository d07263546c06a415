"""Triangulation and normals of range scans, from their acquisition grid."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import vectors
from simplexmesh._base.arrays import Array, Indices

VIEW = (0.0, 0.0, 1.0)
LONGEST = 5.0
STEEPEST = np.deg2rad(85.0)


def grid_faces(points: Array, grid: Indices) -> Indices:
    """Return the triangles (f, 3) between neighboring cells of a range grid, ccw seen from the sensor at +z.

    `grid` (rows, columns) holds the point measured in each cell, -1 for none. Triangles across steps in depth, long or
    seen at a grazing angle, are left out (Curless and Levoy 1996, section 3).
    """
    corners = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    known = sum((corner >= 0).view(np.int8) for corner in corners)
    a, b, c, d = (corner[known >= 3] for corner in corners)
    # -1 in `grid` indexes the last point here; the masks below discard these
    across = vectors.norm(points[a] - points[c]) <= vectors.norm(points[b] - points[d])
    full = np.minimum(np.minimum(a, b), np.minimum(c, d)) >= 0
    groups = [
        (full & across, [(a, b, c), (a, c, d)]),
        (full & ~across, [(a, b, d), (b, c, d)]),
        (a < 0, [(b, c, d)]),
        (b < 0, [(a, c, d)]),
        (c < 0, [(a, b, d)]),
        (d < 0, [(a, b, c)]),
    ]
    faces = np.concatenate([np.stack(corner, axis=1)[mask] for mask, corners in groups for corner in corners])
    steps = vectors.triangle_vectors(points, faces)
    if (steps @ VIEW).sum() < 0:
        faces, steps = faces[:, ::-1], -steps
    a, b, c = points[faces.T]
    edges = vectors.norm(np.stack([a - c, b - a, c - b]))
    long = edges.max(axis=0) > LONGEST * np.median(edges) if len(edges) else np.zeros(0, dtype=bool)
    steep = steps @ VIEW <= np.cos(STEEPEST) * vectors.norm(steps)
    return np.ascontiguousarray(faces[~long & ~steep])


def grid_normals(points: Array, grid: Indices) -> Array:
    """Return unit vertex normals (n, 3) of a range grid, towards the sensor; see `grid_faces`."""
    faces = grid_faces(points, grid)
    normals = vectors.vertex_normals(points, faces)
    normals[~normals.any(axis=1)] = VIEW
    return normals
