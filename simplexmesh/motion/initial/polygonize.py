"""From a field on a grid, and the solid it stands for, to triangles of the same topology."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh.motion.initial.topology import euler, pinched

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

_LEAST = 0.05
_INSIDE, _OUTSIDE = 0.3, 0.45
_SPARE = (1.1, 1.5, 2.2)


def isosurface(field: NDArray[Any], solid: Mask, triangles: int = 0) -> tuple[Array, Indices]:
    """Return the surface of a solid, smooth where the field agrees with the solid.

    Parameters
    ----------
    field : (nx, ny, nz) array of float
        Positive inside. Where its sign contradicts `solid` the solid is right.
    solid : (nx, ny, nz) array of bool
        Empty at its border.
    triangles : int
        At least so many are wanted: with fewer, the field is interpolated on a finer grid.

    Returns
    -------
    vertices : (v, 3) array of float
        In cells: sample (i, j, k) is at (i, j, k).
    faces : (t, 3) array of int
        Closed, counter-clockwise seen from outside, of the topology of `solid`.

    References
    ----------
    T. Lewiner, H. Lopes, A. Vieira, G. Tavares, Efficient implementation of marching cubes' cases with topological
    guarantees, 2003.
    """
    box = tuple(slice(max(0, rows.min() - 2), rows.max() + 3) for rows in np.nonzero(solid)) if solid.any() else ()
    corner = np.array([side.start for side in box]) if box else np.zeros(3)
    field, solid = field[box], solid[box]
    agreeing = _agreeing(field, solid)
    vertices, faces = _marched(agreeing)
    if not 0 < len(faces) < triangles:
        return vertices + corner, faces
    shape = np.array(field.shape)
    for spare in _SPARE:
        fine = np.ceil((shape - 1) * np.sqrt(spare * triangles / len(faces))).astype(int) + 1
        finer = _marched(ndimage.zoom(agreeing, fine / shape, order=1))
        if _euler(finer[1]) != 2 * euler(solid):
            break
        if len(finer[1]) >= triangles:
            return finer[0] * ((shape - 1) / (fine - 1)) + corner, finer[1]
    while len(faces) < triangles:
        vertices, faces = halved(vertices, faces)
    return vertices + corner, faces


def halved(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a triangulation with each triangle cut in four at the middles of its sides.

    Examples
    --------
    >>> vertices, faces = halved(np.eye(3), np.array([[0, 1, 2]]))
    >>> len(vertices), len(faces)
    (6, 4)
    """
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    key, side = np.unique(low * len(vertices) + high, return_inverse=True)
    middle = (vertices[key // len(vertices)] + vertices[key % len(vertices)]) / 2
    m = len(vertices) + side.reshape(-1, 3)
    corner = [np.stack([faces[:, j], m[:, j], m[:, j - 1]], axis=1) for j in range(3)]
    return np.concatenate([vertices, middle]), np.concatenate([*corner, m])


def _agreeing(field: NDArray[Any], solid: Mask) -> NDArray[np.float32]:
    """Return the field with the sign that the solid says, in units of its usual size near the surface.

    Where cells of the solid touch only along an edge or at a corner, outside values are made the larger ones, so that
    marching cubes parts those cells, as a 6-connected solid wants it.
    """
    out = np.asarray(field, dtype=np.float32)
    crossing = solid[1:] != solid[:-1]
    scale = float(np.median(np.abs(out[1:] - out[:-1])[crossing])) / 2 if crossing.any() else 1.0
    out = np.clip(out / (scale if scale > 0 else 1.0), -3, 3)
    out = np.where(solid, np.maximum(out, _LEAST), np.minimum(out, -_LEAST))
    doubtful = pinched(solid)
    return np.where(doubtful, np.minimum(out, np.where(solid, _INSIDE, -_OUTSIDE)), out).astype(np.float32)


def _euler(faces: Indices) -> int:
    return len(np.unique(faces)) - len(faces) // 2


def _marched(field: NDArray[np.float32]) -> tuple[Array, Indices]:
    from skimage.measure import marching_cubes

    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="ascent", allow_degenerate=True)
    return vertices.astype(float), faces.astype(np.int64)
