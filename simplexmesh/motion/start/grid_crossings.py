"""Points where the grid lines of a volume cross the outer surface of an object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.data.volume import Volume
from simplexmesh.orientation import _kernels_grid


def outer_crossings(volume: Volume, level: float) -> Array:
    """Return (m, 3) points where grid lines leave an object, above the level, to the outside."""
    first, values = _around(volume, level)
    return volume.to_world(_leaving(values) + first)


def crossings_of_largest(volume: Volume, level: float) -> tuple[Array, float]:
    """Return what `outer_crossings` does, of the largest part of the object, and the share of them on other parts."""
    first, values = _around(volume, level)
    points = _leaving(values)
    pieces, count = ndimage.label(values > 0)
    everywhere = len(points)
    if count > 1:
        sizes = np.bincount(pieces.ravel())
        sizes[0] = 0
        values[(values > 0) & (pieces != sizes.argmax())] = -np.inf
        points = _leaving(values)
    return volume.to_world(points + first), 1 - len(points) / max(everywhere, 1)


def _around(volume: Volume, level: float) -> tuple[Indices, NDArray[np.float32]]:
    """Return the samples around an object, positive inside and -inf beyond the volume, and the index of the first."""
    first, part = _cropped(volume.values, level)
    values = np.full(np.add(part.shape, 2), -np.inf, dtype=np.float32)
    contrast = min(abs(level - bound) for bound in volume.range)
    unit = 2.0 ** round(np.log2(contrast)) if contrast > 0 else 1.0
    most = float(np.finfo(np.float32).max)
    for slab, samples in zip(values[1:-1, 1:-1, 1:-1], part, strict=True):  # in float64, as the values may be large
        slab[...] = np.clip((samples.astype(np.float64) - level) / unit, -most, most)
    return first - 1, values


def _leaving(values: NDArray[np.float32]) -> Array:
    """Return the indices (m, 3) between samples where a grid line leaves what is positive to the outside."""
    inside, filled = values > 0, values > 0
    _kernels_grid.flood(filled)
    points = []
    for axis in range(3):
        low = np.moveaxis(values, axis, 0)
        solid, off = (np.moveaxis(each, axis, 0) for each in (inside, filled & ~inside))
        leaving = (solid[:-1] & off[1:]) | (off[:-1] & solid[1:])
        at = np.argwhere(leaving)
        a, b = low[:-1][leaving].astype(float), low[1:][leaving].astype(float)
        share = np.where(np.isinf(a) | np.isinf(b), 0.5, 0.0)
        known = share == 0.0
        share[known] = a[known] / (a[known] - b[known])
        points.append(np.insert(at[:, 1:].astype(float), axis, at[:, 0] + share, axis=1))
    return np.concatenate(points)


def _cropped(values: NDArray[Any], level: float) -> tuple[Indices, NDArray[Any]]:
    """Return the first index and the samples of the object's bounding box, with a margin of one sample."""
    box = box_around(values > level)
    if box is None:
        return np.zeros(3, dtype=np.int64), values[:1, :1, :1]
    part = box_slices(*box, values.shape, margin=1)
    return np.array([side.start for side in part]), values[part]
