"""The bounding box of an object in a voxel grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]


def box_around(inside: NDArray[np.bool_]) -> tuple[Index, Index] | None:
    """Return the box of the true samples, first (3,) and end (3,), one after the last; None if there are none."""
    rows = [np.flatnonzero(inside.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
    if not len(rows[0]):
        return None
    return np.array([row[0] for row in rows]), np.array([row[-1] + 1 for row in rows])


def box_slices(first: Index, end: Index, shape: tuple[int, ...], *, margin: int = 0) -> tuple[slice, ...]:
    """Return the slices of a box widened by `margin` samples on every side, clipped to the grid."""
    ends = zip(first.tolist(), end.tolist(), shape, strict=True)
    return tuple(slice(max(0, a - margin), min(n, b + margin)) for a, b, n in ends)
