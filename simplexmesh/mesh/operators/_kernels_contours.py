"""Kernels of contours in edits: which edits would break one.

Callers ask only where the mesh has contours: within the conditions of each operator, the question costs a third of it.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh.mesh.operators._kernels_edit import INSERT, REMOVE, Darts


@njit(cache=True)
def is_on_contour(d: Darts, vertex: int) -> bool:
    """Return whether a vertex is on a contour, if the mesh has any."""
    at = 3 * vertex
    return d.contour.size > 0 and (d.contour[at] != 0 or d.contour[at + 1] != 0 or d.contour[at + 2] != 0)


@njit(cache=True)
def are_on_one_contour(d: Darts, dart: int, other: int) -> bool:
    """Return whether two darts are on the same contour, in whatever direction."""
    return d.contour[dart] != 0 and abs(d.contour[dart]) == abs(d.contour[other])


@njit(cache=True)
def breaks_contour(d: Darts, kind: int, dart: int, other: int) -> bool:
    """Return whether T1 or T7 of the edge of a dart, or T2 between two, would break a contour of the mesh.

    T1 may shorten a contour, not remove an edge or an end of it, nor join two vertices of it beside it.
    """
    marks, back = d.contour, np.int64(d.twin[dart])
    if kind == INSERT:
        return are_on_one_contour(d, dart, other)
    if kind != REMOVE:
        return is_on_contour(d, dart // 3) or is_on_contour(d, back // 3)
    if marks[dart] != 0:
        return True
    for end in (np.int64(dart), back):
        at = 3 * (end // 3)
        if marks[at] + marks[at + 1] + marks[at + 2] != 0:  # a contour that passes enters and leaves
            return True
        one, two = d.twin[at + (end + 1) % 3] // 3, d.twin[at + (end + 2) % 3] // 3
        for i in range(0 if is_on_contour(d, end // 3) else 9):
            if are_on_one_contour(d, 3 * one + i // 3, 3 * two + i % 3):
                return True
    return False
