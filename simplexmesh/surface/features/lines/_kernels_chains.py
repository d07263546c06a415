"""Lines that chosen edges form, from node to node. Arrays in, arrays out; no checks."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def chains(ends, offsets, around, chosen, degrees):
    """Return (offsets, edges, vertices): edges of each line in order, with the vertex before each, and all last ones.

    Lines between nodes, vertices where other than two edges meet, come first, then closed ones. `around` (CSR) are the
    edges at each vertex. `vertices` has one more row for each line than `edges`.
    """
    free = chosen.copy()
    count = 0
    for e in range(len(chosen)):
        count += chosen[e]
    firsts, edges, vertices = np.zeros(count + 1, np.int64), np.empty(count, np.int64), np.empty(2 * count, np.int64)
    lines = place = 0
    for closed in range(2):
        for seed in range(2 * len(ends)):
            start, first = ends[seed // 2, seed % 2], seed // 2
            if not free[first] or (closed == 0 and degrees[start] == 2):
                continue
            vertex, edge = start, first
            while edge >= 0:
                free[edge] = False
                edges[place], vertices[place + lines] = edge, vertex
                place += 1
                vertex = ends[edge, 0] + ends[edge, 1] - vertex
                edge = -1
                if degrees[vertex] == 2:
                    for k in range(offsets[vertex], offsets[vertex + 1]):
                        if free[around[k]]:
                            edge = around[k]
            vertices[place + lines] = vertex
            lines += 1
            firsts[lines] = place
    return firsts[: lines + 1].copy(), edges, vertices[: place + lines].copy()
