"""Collapses and flips of edges of closed triangulations, as `_kernels_half_edges` has them.

References in `tests/motion/start/reference.py`.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh.mesh.triangles._kernels_half_edges import (
    flip,
    flip_is_valid,
    following,
    is_adjacent,
    keeps_orientation,
    keeps_topology,
    previous,
)
from simplexmesh.numerics._kernels_heap import new_heap, put
from simplexmesh.numerics._kernels_vectors import row

REMOVED = -1

FEW = 100_000
"""Triangles from which edges are collapsed in their exact order, in half a second; a rough one to the end leaves more
uneven triangles, and boundaries that stop halfway."""


@njit(cache=True, error_model="numpy", _nrt=False)
def flip_round(vertices, corners, mates, valence):
    """Flip, in place, each edge whose flip brings the valences closer to six; return the number of flips."""
    flips = 0
    for h in range(len(mates)):
        g = mates[h]
        if g < h:
            continue
        a, b, c, d = corners[h], corners[g], corners[previous(h)], corners[previous(g)]
        va, vb, vc, vd = valence[a], valence[b], valence[c], valence[d]
        if va <= 4 or vb <= 4 or va + vb - vc - vd <= 2:
            continue
        if is_adjacent(corners, mates, previous(h), d) or not flip_is_valid(vertices, a, b, c, d):
            continue
        flip(corners, mates, h)
        valence[a] -= 1
        valence[b] -= 1
        valence[c] += 1
        valence[d] += 1
        flips += 1
    return flips


@njit(cache=True, error_model="numpy", _nrt=False)
def _squared_length(vertices, corners, h):
    p, q = row(vertices, corners[h]), row(vertices, corners[following(h)])
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@njit(cache=True, error_model="numpy", _nrt=False)
def _put_edge(vertices, corners, mates, heap, h):
    """Enter an edge in the priority queue by its squared length, under the smaller of its two half-edges."""
    put(heap, min(h, mates[h]), _squared_length(vertices, corners, h))


@njit(cache=True, error_model="numpy", _nrt=False)
def _remove_triangle(corners, mates, heap, h):
    """Remove the triangle of a half-edge, pair the mates of its other two sides, and return one of them."""
    one, other = mates[following(h)], mates[previous(h)]
    put(heap, min(one, following(h)), np.inf)
    put(heap, min(other, previous(h)), np.inf)
    mates[one], mates[other] = other, one
    t = 3 * (h // 3)
    corners[t] = corners[t + 1] = corners[t + 2] = REMOVED
    return other


@njit(cache=True, error_model="numpy", _nrt=False)
def _collapse(vertices, corners, mates, heap, h):
    """Collapse an edge to its midpoint; the smaller of its ends stays. Return a half-edge that starts there."""
    g = mates[h]
    a, b = corners[h], corners[g]
    stays, goes = min(a, b), max(a, b)
    for i in range(3):
        vertices[stays, i] = 0.5 * (vertices[a, i] + vertices[b, i])
    first = h if a == goes else g
    k = first
    while True:
        corners[k] = stays
        k = mates[previous(k)]
        if k == first:
            break
    put(heap, min(h, g), np.inf)
    start = _remove_triangle(corners, mates, heap, h)
    _remove_triangle(corners, mates, heap, g)
    return start if corners[start] == stays else mates[start]


@njit(cache=True, error_model="numpy", _nrt=False)
def _put_edges_around(vertices, corners, mates, heap, first):
    """Enter the edges of the vertex at which a half-edge starts."""
    k = first
    while True:
        _put_edge(vertices, corners, mates, heap, k)
        k = mates[previous(k)]
        if k == first:
            break


@njit(cache=True, error_model="numpy", _nrt=False)
def _may_collapse(vertices, corners, mates, seen, h, turn):
    """Return whether an edge may be collapsed to its midpoint."""
    if not keeps_topology(corners, mates, h, seen):
        return False
    g = mates[h]
    p, q = row(vertices, corners[h]), row(vertices, corners[g])
    x, y, z = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])
    return keeps_orientation(vertices, corners, mates, h, x, y, z, turn) and keeps_orientation(
        vertices, corners, mates, g, x, y, z, turn
    )


@njit(cache=True, error_model="numpy", _nrt=False)
def _collapse_in_sweeps(vertices, corners, mates, heap, seen, left, triangles, turn):
    """Collapse edges below a length that grows by a tenth with each sweep over all; return how many triangles stay."""
    limit, more = 0.0, True
    for h in range(len(mates)):
        if corners[h] != REMOVED:
            limit += 0.1 * _squared_length(vertices, corners, h) / len(mates)
    while left > triangles and more:
        more = False
        for h in range(len(mates)):
            if h > mates[h] or corners[h] == REMOVED:
                continue
            if _squared_length(vertices, corners, h) > limit:
                more = True
            elif _may_collapse(vertices, corners, mates, seen, h, turn):
                _collapse(vertices, corners, mates, heap, h)
                left -= 2
                more = True
                if left <= triangles:
                    break
        limit *= 1.21
    return left


@njit(cache=True, error_model="numpy")
def collapse_shortest(vertices, corners, mates, triangles, turn):
    """Collapse the shortest edge to its midpoint, in place, until `triangles` are left; return how many are left."""
    heap = new_heap(len(mates))
    seen = np.full(len(vertices), -1)
    left = np.count_nonzero(corners != REMOVED) // 3
    # while the queue is empty: one of a million edges costs more than twice as much as the collapses
    left = _collapse_in_sweeps(vertices, corners, mates, heap, seen, left, max(4 * triangles, FEW), turn)
    for h in range(len(mates)):
        if h < mates[h] and corners[h] != REMOVED:
            _put_edge(vertices, corners, mates, heap, h)
    while left > max(triangles, 4) and heap.size[0]:
        h = heap.item[0]
        put(heap, h, np.inf)
        if _may_collapse(vertices, corners, mates, seen, h, turn):
            around = _collapse(vertices, corners, mates, heap, h)
            _put_edges_around(vertices, corners, mates, heap, around)
            left -= 2
    return left
