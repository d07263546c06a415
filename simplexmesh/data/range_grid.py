"""Triangulation and normals of range scans, from their acquisition grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _vec

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

VIEW = (0.0, 0.0, 1.0)
LONGEST = 5.0
STEEPEST = np.deg2rad(85.0)


def grid_faces(points: Array, grid: Indices) -> Indices:
    """Return the triangles between neighboring cells of a range grid.

    Four measured cells give two triangles, split along the shorter diagonal; three give one. Triangles across depth
    discontinuities are dropped: those with an edge longer than 5 times the median edge, or whose normal is more than
    85 degrees from the viewing direction (after Curless and Levoy 1996, section 3).

    Parameters
    ----------
    points : (n, 3) array of float
        Measured along z, with the sensor on the positive side, as in Stanford range scans.
    grid : (rows, columns) array of int
        Index of the point measured in each cell, -1 for none.

    Returns
    -------
    (f, 3) array of int
        Counter-clockwise seen from the sensor.
    """
    a, b, c, d = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel(), grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    # -1 in `grid` indexes the last point here; the masks below discard these
    across = _vec.norm(points[a] - points[c]) <= _vec.norm(points[b] - points[d])
    full = (a >= 0) & (b >= 0) & (c >= 0) & (d >= 0)
    groups = [
        (full & across, [(a, b, c), (a, c, d)]),
        (full & ~across, [(a, b, d), (b, c, d)]),
        (~full & (a < 0), [(b, c, d)]),
        (~full & (b < 0), [(a, c, d)]),
        (~full & (c < 0), [(a, b, d)]),
        (~full & (d < 0), [(a, b, c)]),
    ]
    faces = np.concatenate([np.stack(corner, axis=1)[mask] for mask, corners in groups for corner in corners])
    faces = faces[(faces >= 0).all(axis=1)]
    vectors = _face_vectors(points, faces)
    if (vectors @ VIEW).sum() < 0:
        faces, vectors = faces[:, ::-1], -vectors
    corners = points[faces]
    edges = _vec.norm(corners - np.roll(corners, 1, axis=1))
    long = edges.max(axis=1) > LONGEST * np.median(edges) if len(edges) else np.zeros(0, dtype=bool)
    steep = vectors @ VIEW <= np.cos(STEEPEST) * _vec.norm(vectors)
    return np.ascontiguousarray(faces[~long & ~steep])


def grid_normals(points: Array, grid: Indices) -> Array:
    """Return unit vertex normals of a range grid, towards the sensor.

    They are area-weighted means over the adjacent triangles (see `grid_faces`); points without triangles get the
    viewing direction.

    Parameters
    ----------
    points : (n, 3) array of float
        As for `grid_faces`.
    grid : (rows, columns) array of int
        Index of the point measured in each cell, -1 for none.

    Returns
    -------
    (n, 3) array of float

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
    >>> grid_normals(points, np.array([[0, 1], [2, 3]]))[0]
    array([0., 0., 1.])
    """
    faces = grid_faces(points, grid)
    vectors = _face_vectors(points, faces)
    normals = np.zeros_like(points)
    for j in range(3):
        np.add.at(normals, faces[:, j], vectors)
    normals[~normals.any(axis=1)] = VIEW
    return _vec.normalized(normals)


def _face_vectors(points: Array, faces: Indices) -> Array:
    a, b, c = (points[faces[:, j]] for j in range(3))
    return _vec.cross(b - a, c - a)
