"""Kernels of contours in edits: the marks of darts, and which edits would break a contour.

A mark is the number of the contour along a dart, from 1 on, negative against it, 0 off contours; without contours the
array of marks has no length.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Indices32


@njit(cache=True)
def is_on_contour(marks: Indices32, vertex: int) -> bool:
    """Return whether a vertex is on a contour."""
    at = 3 * vertex
    return marks.size > 0 and (marks[at] != 0 or marks[at + 1] != 0 or marks[at + 2] != 0)


@njit(cache=True)
def is_on_same_contour(marks: Indices32, dart: int, other: int) -> bool:
    """Return whether two darts are on one contour, in whatever direction."""
    return marks.size > 0 and marks[dart] != 0 and abs(marks[dart]) == abs(marks[other])


@njit(cache=True)
def breaks_contour(marks: Indices32, twin: Indices32, dart: int) -> bool:
    """Return whether T1 removes an edge or an end of a contour, or joins two vertices of one, instead of a vertex."""
    if marks.size == 0:
        return False
    if marks[dart] != 0:
        return True
    for end in (np.int64(dart), np.int64(twin[dart])):
        at = 3 * (end // 3)
        if marks[at] + marks[at + 1] + marks[at + 2] != 0:  # a contour that passes enters and leaves
            return True
        one, other = twin[at + (end + 1) % 3] // 3, twin[at + (end + 2) % 3] // 3
        for i in range(0 if is_on_contour(marks, end // 3) else 9):
            if is_on_same_contour(marks, 3 * one + i // 3, 3 * other + i % 3):
                return True
    return False
