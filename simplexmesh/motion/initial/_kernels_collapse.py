"""Kernels that collapse the shortest edges of closed triangulations: arrays in, arrays out, no checks.

Half-edges are numbered as in `_kernels_remesh`. Twin in `tests/reference_initial.py`.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_heap import new_heap, put
from simplexmesh.motion.initial._kernels_remesh import _area_normal, _before, _cosine, _next

GONE = -1


@njit(cache=True, error_model="numpy")
def _put_edge(vertices, corners, mates, heap, h):  # type: ignore[no-untyped-def]
    """Put the edge of a half-edge in the queue at its squared length, under the smaller number of its two halves."""
    p, q = vertices[corners[h]], vertices[corners[_next(h)]]
    put(heap, min(h, mates[h]), (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)


@njit(cache=True, error_model="numpy")
def _links(corners, mates, h, seen):  # type: ignore[no-untyped-def]
    """Tell whether the ends of a half-edge have no common neighbors but the two opposite; `seen` (v,) is scratch.

    The edges of a tetrahedron, whose ends have three neighbors each, are none of those: two copies of a triangle would
    be left.
    """
    k, neighbors = h, 0
    while True:
        seen[corners[_next(k)]] = h
        neighbors += 1
        k = mates[_before(k)]
        if k == h:
            break
    g, common = mates[h], 0
    k = g
    while True:
        common += seen[corners[_next(k)]] == h
        neighbors += 1
        k = mates[_before(k)]
        if k == g:
            break
    k = h
    while True:
        seen[corners[_next(k)]] = -1
        k = mates[_before(k)]
        if k == h:
            return common == 2 and neighbors > 6


@njit(cache=True, error_model="numpy")
def _fair(vertices, corners, mates, h, x, y, z, turn):  # type: ignore[no-untyped-def]
    """Tell whether no triangle around the start of h, other than the two that go, turns too far when that moves.

    Triangles without area have nowhere to turn from.
    """
    moved = (x, y, z)
    k = mates[_before(h)]
    last = mates[h]
    while _next(last) != k:
        p, q, r = vertices[corners[k]], vertices[corners[_next(k)]], vertices[corners[_before(k)]]
        was = _area_normal(p, q, r)
        if was != (0.0, 0.0, 0.0) and _cosine(was, _area_normal(moved, q, r)) < turn:
            return False
        k = mates[_before(k)]
    return True


@njit(cache=True, error_model="numpy")
def _sewn(corners, mates, heap, h):  # type: ignore[no-untyped-def]
    """Take out the triangle of a half-edge, sew its other two sides together, and return one of the edge left."""
    one, other = mates[_next(h)], mates[_before(h)]
    put(heap, min(one, _next(h)), np.inf)
    put(heap, min(other, _before(h)), np.inf)
    mates[one], mates[other] = other, one
    t = 3 * (h // 3)
    corners[t : t + 3] = GONE
    return other


@njit(cache=True, error_model="numpy")
def _collapse(vertices, corners, mates, heap, h):  # type: ignore[no-untyped-def]
    """Move both ends of h to its middle, where the end of the smaller number stays."""
    g = mates[h]
    a, b = corners[h], corners[g]
    stays, goes = min(a, b), max(a, b)
    vertices[stays] = 0.5 * (vertices[a] + vertices[b])
    first = h if a == goes else g
    k = first
    while True:
        corners[k] = stays
        k = mates[_before(k)]
        if k == first:
            break
    put(heap, min(h, g), np.inf)
    start = _sewn(corners, mates, heap, h)
    _sewn(corners, mates, heap, g)
    k = start if corners[start] == stays else mates[start]
    first = k
    while True:
        _put_edge(vertices, corners, mates, heap, k)
        k = mates[_before(k)]
        if k == first:
            break


@njit(cache=True, error_model="numpy")
def collapse_shortest(vertices, corners, mates, triangles, turn):  # type: ignore[no-untyped-def]
    """Collapse the shortest edge to its middle, in place, until so many triangles are left; return how many are.

    An edge whose ends have a third neighbor in common stays, as do those of a tetrahedron, and one whose collapse would
    turn a triangle by more than the angle whose cosine is `turn`; it is looked at again when an end of it has moved.
    Triangles that went have corners `GONE`.
    """
    heap = new_heap(len(mates))
    for h in range(len(mates)):
        if h < mates[h] and corners[h] != GONE:
            _put_edge(vertices, corners, mates, heap, h)
    seen = np.full(len(vertices), -1)
    left = np.count_nonzero(corners != GONE) // 3
    while left > max(triangles, 4) and heap.size[0]:
        h = heap.item[0]
        put(heap, h, np.inf)
        g = mates[h]
        p, q = vertices[corners[h]], vertices[corners[g]]
        x, y, z = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])
        if not _links(corners, mates, h, seen):
            continue
        if not (
            _fair(vertices, corners, mates, h, x, y, z, turn) and _fair(vertices, corners, mates, g, x, y, z, turn)
        ):
            continue
        _collapse(vertices, corners, mates, heap, h)
        left -= 2
    return left
