"""From a field on a grid, and the solid it stands for, to triangles of the same topology."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh.motion.initial.topology import euler

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_LEAST = 0.05


def isosurface(field: NDArray[Any], solid: NDArray[np.bool_], triangles: int = 0) -> tuple[Array, Indices]:
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
    """
    wanted = 2 * euler(solid)
    for sharp in (0.0, 0.5, 1.0):
        agreeing = _agreeing(field, solid, sharp)
        vertices, faces = _marched(agreeing)
        if _euler(faces) == wanted:
            break
    if 0 < len(faces) < triangles:
        shape = np.array(field.shape)
        fine = np.ceil((shape - 1) * np.sqrt(1.1 * triangles / len(faces))).astype(int) + 1
        vertices, faces = _marched(ndimage.zoom(agreeing, fine / shape, order=1))
        vertices *= (shape - 1) / (fine - 1)
    return vertices, faces


def _agreeing(field: NDArray[Any], solid: NDArray[np.bool_], sharp: float) -> NDArray[np.float32]:
    """Return the field with its sign set right, between itself (sharp 0) and the solid's own -1.5 and 1 (sharp 1).

    Outside values are the larger ones, so that marching cubes parts inside cells that only touch along an edge, as
    the 6-connected solid wants it.
    """
    out = np.asarray(field, dtype=np.float32)
    near = ndimage.binary_dilation(solid, iterations=2) & ~ndimage.binary_erosion(solid, iterations=2)
    scale = float(np.median(np.abs(out[near]))) if near.any() else 1.0
    out = np.clip(out / (scale if scale > 0 else 1.0), -3, 3)
    out = np.where(solid, np.maximum(out, _LEAST), np.minimum(out, -_LEAST))
    return (1 - sharp) * out + sharp * np.where(solid, np.float32(1), np.float32(-1.5))


def _euler(faces: Indices) -> int:
    return int(len(np.unique(faces))) - len(faces) // 2


def _marched(field: NDArray[np.float32]) -> tuple[Array, Indices]:
    from skimage.measure import marching_cubes

    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="ascent", allow_degenerate=True)
    return vertices.astype(float), faces.astype(np.int64)
