"""The target of labeled regions: their smooth boundary, without the staircase of the voxels."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import normalized
from simplexmesh.data.box import box_around, box_slices
from simplexmesh.data.conversion import as_volume
from simplexmesh.data.volume import Volume
from simplexmesh.motion.targets import _kernels_labels, _kernels_volume
from simplexmesh.motion.targets.isosurface import PACE, Isosurface
from simplexmesh.motion.targets.points import SurfelTarget
from simplexmesh.motion.targets.protocol import checked_arguments


class LabelSurface(SurfelTarget):
    """The boundary of a labeled region, smooth and unbiased.

    The boundary crosses the line between a voxel inside and its neighbor outside at an unknown place: the midpoint is a
    sample of the surface with a uniformly distributed error of known size, along a known axis. Quadratic surface pieces
    are fitted to these samples, each weighted by the variance of its error along the normal, over neighborhoods as
    large as the shape allows. This leaves neither steps nor the shrinkage of filters. Where these pieces, as beyond the
    rims of flat faces, end between eight samples of one kind and over a voxel from where the interpolant of the samples
    crosses, that counts instead.

    Parameters
    ----------
    volume : Volume or anything convertible
        An array, a PyVista or VTK image, a path.
    label : int or None
        The label of the region; None for all nonzero samples. The region does not extend beyond the volume.

    Raises
    ------
    ValueError, TypeError
        No sample has that label, or the volume holds intensities; the label is not a number.

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
        self.unit, self.label = self.volume.unit, label
        mask = _cropped(self.volume, label)
        self._interpolant = Isosurface(mask, 0.5)
        places, normals = _crossings(mask)
        super().__init__(places, normals, self.errors(places))

    def errors(self, points: Array) -> Array:
        """Return one standard deviation (n, 3) of the error of midpoints between voxels, along their grid line."""
        index = self.volume.to_index(points)
        axis = np.abs(index - np.round(index)).argmax(axis=1)
        return np.asarray(self.volume.T_world_index[:3, axis].T / np.sqrt(12.0))

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:  # noqa: D102 documented by the base
        vertices, normals, reach = checked_arguments(vertices, normals, reach)
        out = super().gap(vertices, normals, reach)
        _kernels_volume.replace_far_gaps(len(vertices), vertices, normals, self._interpolant._field, reach, PACE, out)
        return out


def _crossings(volume: Volume) -> tuple[Array, Array]:
    """Return the midpoints (n, 3) of crossings and outward normals (n, 3)."""
    mask = np.ascontiguousarray(volume.values)
    before, *within = (np.count_nonzero(np.diff(mask, axis=axis), axis=(1, 2)) for axis in range(3))
    counts = np.append(0, before) + sum(within)
    n, starts = int(counts.sum()), np.cumsum(counts) - counts
    places, gradients = np.zeros((n, 3)), np.zeros((n, 3))
    _kernels_labels.fill_crossings(len(mask), mask, starts, places, gradients)
    return volume.to_world(places), normalized(gradients @ np.linalg.inv(volume.T_world_index[:3, :3]))


def _cropped(volume: Volume, label: int | None) -> Volume:
    """Return the mask of the region, 0 and 1, with a margin of two samples."""
    inside = volume.values != 0 if label is None else volume.mask(label).values.view(bool)
    box = box_around(inside)
    if box is None:
        raise ValueError("volume must have a nonzero sample, it has none")
    mask = np.pad(inside[box_slices(*box, volume.shape)], 2)
    return Volume(mask, volume.spacing, volume.to_world(box[0] - 2), volume.direction)
