"""Marching cubes with prescribed topology: triangulate a field such that the surface has the topology of a solid.

T. Lewiner, H. Lopes, A. Vieira, G. Tavares, Efficient implementation of marching cubes' cases with topological
guarantees, 2003.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh.data.box import box_around, box_slices
from simplexmesh.motion.start.topology import euler, pinched

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

PINCHED_INSIDE, PINCHED_OUTSIDE = 0.3, 0.45
"""Values where cells touch at an edge or a corner: the larger outside lets marching cubes separate them."""


def isosurface(field: NDArray[Any], solid: Mask, triangles: int = 0) -> tuple[Array, Indices]:
    """Return the closed triangulated surface of a solid, in units of cells; sample (i, j, k) is at (i, j, k).

    The field is positive inside; where it contradicts the solid, the solid takes precedence. The border of the solid is
    outside. With fewer than `triangles` triangles the field is resampled to a finer grid.
    """
    box = box_around(solid)
    if box is None:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    around = box_slices(*box, solid.shape, margin=2)
    corner = np.array([side.start for side in around])
    field, solid = field[around], solid[around]
    consistent = _consistent(field, solid)
    vertices, faces = _marching_cubes(consistent)
    if not 0 < len(faces) < triangles:
        return vertices + corner, faces
    shape = np.array(field.shape)
    for spare in (1.1, 1.5, 2.2):
        fine = np.ceil((shape - 1) * np.sqrt(spare * triangles / len(faces))).astype(int) + 1
        finer = _marching_cubes(ndimage.zoom(consistent, fine / shape, order=1))
        if _euler(finer[1]) != 2 * euler(solid):
            break
        if len(finer[1]) >= triangles:
            return finer[0] * ((shape - 1) / (fine - 1)) + corner, finer[1]
    while len(faces) < triangles:
        vertices, faces = subdivided(vertices, faces)
    return vertices + corner, faces


def subdivided(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Return a triangulation with each triangle split into four at the midpoints of its sides."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    key, side = np.unique(low * len(vertices) + high, return_inverse=True)
    middle = (vertices[key // len(vertices)] + vertices[key % len(vertices)]) / 2
    m = len(vertices) + side.reshape(-1, 3)
    corner = [np.stack([faces[:, j], m[:, j], m[:, j - 1]], axis=1) for j in range(3)]
    return np.concatenate([vertices, middle]), np.concatenate([*corner, m])


def _consistent(field: NDArray[Any], solid: Mask) -> NDArray[np.float32]:
    """Return the field with the sign of the solid, in units of its median magnitude near the surface."""
    crossing = np.nonzero(solid[1:] != solid[:-1])
    jumps = np.abs(field[1:][crossing] - field[:-1][crossing])
    scale = float(np.median(jumps)) / 2 if len(jumps) else 1.0
    out = np.clip(field / np.float32(scale if scale > 0 else 1.0), -3, 3, dtype=np.float32)
    np.maximum(out, np.float32(0.05), out=out, where=solid)
    np.minimum(out, np.float32(-0.05), out=out, where=~solid)
    at = np.nonzero(pinched(solid))
    out[at] = np.minimum(out[at], np.where(solid[at], PINCHED_INSIDE, -PINCHED_OUTSIDE))
    return out


def _euler(faces: Indices) -> int:
    return len(np.unique(faces)) - len(faces) // 2


def _marching_cubes(field: NDArray[np.float32]) -> tuple[Array, Indices]:
    from skimage.measure import marching_cubes

    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="ascent", allow_degenerate=True)
    return vertices.astype(float), faces.astype(np.int64)
