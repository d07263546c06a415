"""The bounding box of an object in a voxel grid."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Indices, Mask


def box_around(inside: Mask) -> tuple[Indices, Indices] | None:
    """Return the box of the true samples, first (3,) and end (3,), one after the last; None if there are none."""
    rows = [np.flatnonzero(inside.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
    if not len(rows[0]):
        return None
    return np.array([row[0] for row in rows]), np.array([row[-1] + 1 for row in rows])


def box_slices(first: Indices, end: Indices, shape: tuple[int, ...], *, margin: int = 0) -> tuple[slice, ...]:
    """Return the slices of a box widened by `margin` samples on every side, clipped to the grid."""
    ends = zip(first.tolist(), end.tolist(), shape, strict=True)
    return tuple(slice(max(0, a - margin), min(n, b + margin)) for a, b, n in ends)
