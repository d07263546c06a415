"""Whether triangles agree on which side is outward."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def clashing_edges(offsets, ahead, behind):
    """Return how many edges all their triangles, two or more, traverse in the same direction.

    Copies of a triangle count once. Takes the wedges of surface's one-rings.
    """
    n = offsets.shape[0] - 1
    owner = np.full(n, -1, np.int64)  # of the counts: how many triangles leave a center for a vertex, or come from it
    leaving, coming = np.zeros(n, np.int8), np.zeros(n, np.int8)
    apex_leaving, apex_coming = np.zeros(n, np.int64), np.zeros(n, np.int64)
    count = 0
    for i in range(n):
        for wedge in range(offsets[i], offsets[i + 1]):
            j, k = ahead[wedge], behind[wedge]
            if owner[j] != i:
                owner[j], leaving[j], coming[j] = i, 0, 0
            if owner[k] != i:
                owner[k], leaving[k], coming[k] = i, 0, 0
            if leaving[j] == 0:
                leaving[j], apex_leaving[j] = 1, k
            elif apex_leaving[j] != k:
                leaving[j] = 2
            if coming[k] == 0:
                coming[k], apex_coming[k] = 1, j
            elif apex_coming[k] != j:
                coming[k] = 2
        for wedge in range(offsets[i], offsets[i + 1]):
            for j in (ahead[wedge], behind[wedge]):
                if j > i and max(leaving[j], coming[j]) == 2 and min(leaving[j], coming[j]) == 0:
                    count += 1
                    leaving[j] = coming[j] = 0
    return count
