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
def breaks_contour(d: Darts, kind: int, dart: int, other: int) -> bool:
    """Return whether T1 or T7 of the edge of a dart, or T2 between two, would break a contour of the mesh.

    T1 may shorten a contour, not remove an edge or an end of it, nor join two vertices of it beside it.
    """
    marks, back = d.contour, np.int64(d.twin[dart])
    if kind == INSERT:
        return marks[dart] != 0 and abs(marks[dart]) == abs(marks[other])
    if marks[dart] != 0:
        return True
    for end in (np.int64(dart), back):
        at = 3 * (end // 3)
        on = marks[at] != 0 or marks[at + 1] != 0 or marks[at + 2] != 0
        ends = marks[at] + marks[at + 1] + marks[at + 2] != 0  # one that passes enters and leaves
        if on and (ends or kind != REMOVE):
            return True
        if on or kind != REMOVE:
            continue
        one, two = 3 * (d.twin[at + (end + 1) % 3] // 3), 3 * (d.twin[at + (end + 2) % 3] // 3)
        for i in range(one, one + 3):
            for j in range(two, two + 3):
                if marks[i] != 0 and abs(marks[i]) == abs(marks[j]):
                    return True
    return False
