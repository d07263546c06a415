"""The bounding box of an object in a voxel grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]


def box_around(inside: NDArray[np.bool_]) -> tuple[Index, Index] | None:
    """Return the bounding box of the true samples: its first index, and the index after its last.

    Parameters
    ----------
    inside : (nx, ny, nz) array of bool
        Mask of the object.

    Returns
    -------
    first, end : (3,) arrays of int
        `inside[box_slices(first, end, inside.shape)]` holds all true samples. None if there are none.

    Examples
    --------
    >>> inside = np.zeros((5, 6, 7), bool)
    >>> inside[1:3, 4, 2:7] = True
    >>> first, end = box_around(inside)
    >>> first.tolist(), end.tolist()
    ([1, 4, 2], [3, 5, 7])
    """
    rows = [np.flatnonzero(inside.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
    if not len(rows[0]):
        return None
    return np.array([row[0] for row in rows]), np.array([row[-1] + 1 for row in rows])


def box_slices(first: Index, end: Index, shape: tuple[int, ...], *, margin: int = 0) -> tuple[slice, ...]:
    """Return the slices of a box widened by `margin` samples on every side, clipped to the grid.

    Examples
    --------
    >>> box_slices(np.array([1, 4, 2]), np.array([3, 5, 7]), (5, 6, 7), margin=1)
    (slice(0, 4, None), slice(3, 6, None), slice(1, 7, None))
    """
    ends = zip(first.tolist(), end.tolist(), shape, strict=True)
    return tuple(slice(max(0, a - margin), min(n, b + margin)) for a, b, n in ends)
