"""The smooth surface of a labeled region, without the staircase of its voxels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import normalized
from simplexmesh.data.convert import as_volume
from simplexmesh.data.volume import Volume
from simplexmesh.motion.targets import _kernels_labels
from simplexmesh.motion.targets.points import SurfelTarget
from simplexmesh.motion.targets.surfels import fitted_surfels

Array = NDArray[np.float64]


class LabelSurface(SurfelTarget):
    """The boundary of a labeled region, smooth and in place.

    Where the boundary crosses the line between a voxel inside and its neighbor outside is known to half a voxel: the
    midpoint is a sample of the surface whose error is uniform, of known size, and along a known axis. Quadratic pieces
    of surface fitted to these samples, each weighted by what its error does along the normal, over a neighborhood as
    wide as the shape allows, leave neither steps nor the shrinking of filters.

    Parameters
    ----------
    volume : Volume or whatever one can be made of
        An array, a PyVista or VTK image, a path.
    label : int or None
        The region's; None for everything that is not zero. Beyond the volume there is none of it.

    Raises
    ------
    ValueError
        No sample has that label.

    Examples
    --------
    >>> x, y, z = np.mgrid[-10:11, -10:11, -10:11]
    >>> ball = Volume((x * x + y * y + z * z < 8.2**2).astype(np.uint8), origin=(-10, -10, -10))
    >>> target = LabelSurface(ball, 1)
    >>> gap = target.gap(np.array([[8.0, 0, 0]]), np.array([[1.0, 0, 0]]), reach=3.0)
    >>> bool(abs(gap[0] - 0.2) < 0.2)
    True
    """

    def __init__(self, volume: Any, label: int | None = None) -> None:
        self.volume = as_volume(volume)
        self.label = label
        places, spread, normals = _crossings(self.volume, label)
        center = places.mean(axis=0)
        self._set(fitted_surfels(places - center, normals, spread), center)


def _crossings(volume: Volume, label: int | None) -> tuple[Array, Array, Array]:
    """Return the midpoints of crossings, one standard deviation of their error, and outward directions, all (n, 3)."""
    mask, low = _cropped(volume, label)
    counts = np.zeros(mask.shape[0], np.int64)
    _kernels_labels.count_crossings(mask, counts)
    n = int(counts.sum())
    starts = np.cumsum(counts) - counts
    places, gradients, axes = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n, np.int64)
    _kernels_labels.fill_crossings(mask, starts, places, axes, gradients)
    T = volume.T_world_index[:3, :3]
    return volume.to_world(places + low), T.T[axes] / np.sqrt(12.0), normalized(gradients @ np.linalg.inv(T))


def _cropped(volume: Volume, label: int | None) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Return the region's mask in a box two samples wider than it, and the index of the box's first sample."""
    values = volume.values
    inside = values != 0 if label is None else values == label
    within = [np.flatnonzero(inside.any(axis=tuple({0, 1, 2} - {a}))) for a in range(3)]
    if not len(within[0]):
        present = f"; present are {volume.labels()}" if volume.is_labels else ""
        what = (
            "a sample that is not zero must be"
            if label is None
            else f"label must be present in the volume, {label!r} is"
        )
        raise ValueError(f"{what} not{present}" if label is not None else "volume must have a sample that is not zero")
    box = tuple(slice(w[0], w[-1] + 1) for w in within)
    low = np.array([w[0] for w in within]) - 2
    return np.ascontiguousarray(np.pad(inside[box], 2).view(np.uint8)), low
