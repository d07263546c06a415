"""Maxima of a field on a mesh, their basins and the saddles at which basins merge (union-find)."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True)
def _root(parent, i):
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True)
def watersheds(offsets, members, values, order):
    """Return each vertex's maximum, or -1, and the saddle and the higher maximum, or -1, that each maximum meets."""
    n = offsets.shape[0] - 1
    basin = np.full(n, -1, np.int64)
    saddle = np.full(n, np.nan)
    into = np.full(n, -1, np.int64)
    parent = np.arange(n)
    low = np.full(n, np.nan)
    rank = np.full(n, n, np.int64)
    for place in range(order.shape[0]):
        rank[order[place]] = place
    for place in range(order.shape[0]):
        i = order[place]
        best = -1
        for m in range(offsets[i], offsets[i + 1]):
            j = members[m]
            if rank[j] < place and (best < 0 or rank[j] < rank[best]):
                best = j
        basin[i] = i if best < 0 else basin[best]
        if best >= 0:
            parent[i] = _root(parent, best)
        low[_root(parent, i)] = values[i]
        for m in range(offsets[i], offsets[i + 1]):
            j = members[m]
            if rank[j] >= place:
                continue
            one, other = _root(parent, i), _root(parent, j)
            if one == other:
                continue
            if rank[one] > rank[other]:
                one, other = other, one
            saddle[other] = values[i]
            into[other] = one
            parent[other] = one
            low[one] = values[i]
    for place in range(order.shape[0]):
        i = order[place]
        if basin[i] == i and into[i] < 0:
            saddle[i] = low[i]
    return basin, saddle, into
