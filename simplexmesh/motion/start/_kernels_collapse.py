"""Decimation of closed triangulations by collapsing shortest edges.

Half-edges are numbered as in `_kernels_remesh`. Reference in `tests/motion/start/reference.py`.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh.motion.start._kernels_remesh import _area_normal, _cosine, _next, _previous
from simplexmesh.numerics._kernels_heap import new_heap, put

REMOVED = -1


@njit(cache=True, error_model="numpy")
def _put_edge(vertices, corners, mates, heap, h):  # type: ignore[no-untyped-def]
    """Enter an edge in the priority queue by its squared length, under the smaller of its two half-edges."""
    p, q = vertices[corners[h]], vertices[corners[_next(h)]]
    put(heap, min(h, mates[h]), (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)


@njit(cache=True, error_model="numpy")
def _keeps_topology(corners, mates, h, seen):  # type: ignore[no-untyped-def]
    """Return whether an edge satisfies the link condition and is on no tetrahedron; `seen` (v,) is scratch."""
    k, neighbors = h, 0
    while True:
        seen[corners[_next(k)]] = h
        neighbors += 1
        k = mates[_previous(k)]
        if k == h:
            break
    g, common = mates[h], 0
    k = g
    while True:
        common += seen[corners[_next(k)]] == h
        neighbors += 1
        k = mates[_previous(k)]
        if k == g:
            break
    k = h
    while True:
        seen[corners[_next(k)]] = -1
        k = mates[_previous(k)]
        if k == h:
            return common == 2 and neighbors > 6


@njit(cache=True, error_model="numpy")
def _keeps_orientation(vertices, corners, mates, h, x, y, z, turn):  # type: ignore[no-untyped-def]
    """Return whether moving the start of h turns no triangle with area that stays around it too far."""
    moved = (x, y, z)
    k = mates[_previous(h)]
    last = mates[h]
    while _next(last) != k:
        p, q, r = vertices[corners[k]], vertices[corners[_next(k)]], vertices[corners[_previous(k)]]
        was = _area_normal(p, q, r)
        if was != (0.0, 0.0, 0.0) and _cosine(was, _area_normal(moved, q, r)) < turn:
            return False
        k = mates[_previous(k)]
    return True


@njit(cache=True, error_model="numpy")
def _remove_triangle(corners, mates, heap, h):  # type: ignore[no-untyped-def]
    """Remove the triangle of a half-edge, pair the mates of its other two sides, and return one of them."""
    one, other = mates[_next(h)], mates[_previous(h)]
    put(heap, min(one, _next(h)), np.inf)
    put(heap, min(other, _previous(h)), np.inf)
    mates[one], mates[other] = other, one
    t = 3 * (h // 3)
    corners[t : t + 3] = REMOVED
    return other


@njit(cache=True, error_model="numpy")
def _collapse(vertices, corners, mates, heap, h):  # type: ignore[no-untyped-def]
    """Collapse an edge to its midpoint; the end with the smaller number is kept."""
    g = mates[h]
    a, b = corners[h], corners[g]
    stays, goes = min(a, b), max(a, b)
    for i in range(3):
        vertices[stays, i] = 0.5 * (vertices[a, i] + vertices[b, i])
    first = h if a == goes else g
    k = first
    while True:
        corners[k] = stays
        k = mates[_previous(k)]
        if k == first:
            break
    put(heap, min(h, g), np.inf)
    start = _remove_triangle(corners, mates, heap, h)
    _remove_triangle(corners, mates, heap, g)
    k = start if corners[start] == stays else mates[start]
    first = k
    while True:
        _put_edge(vertices, corners, mates, heap, k)
        k = mates[_previous(k)]
        if k == first:
            break


@njit(cache=True, error_model="numpy")
def collapse_shortest(vertices, corners, mates, triangles, turn):  # type: ignore[no-untyped-def]
    """Collapse the shortest edge to its midpoint, in place, until `triangles` are left; return how many are left.

    Edges that may not go now are tried again after one of their ends has moved. Removed triangles have corners
    `REMOVED`.
    """
    heap = new_heap(len(mates))
    for h in range(len(mates)):
        if h < mates[h] and corners[h] != REMOVED:
            _put_edge(vertices, corners, mates, heap, h)
    seen = np.full(len(vertices), -1)
    left = np.count_nonzero(corners != REMOVED) // 3
    while left > max(triangles, 4) and heap.size[0]:
        h = heap.item[0]
        put(heap, h, np.inf)
        g = mates[h]
        p, q = vertices[corners[h]], vertices[corners[g]]
        x, y, z = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]), 0.5 * (p[2] + q[2])
        if not _keeps_topology(corners, mates, h, seen):
            continue
        if not _keeps_orientation(vertices, corners, mates, h, x, y, z, turn):
            continue
        if not _keeps_orientation(vertices, corners, mates, g, x, y, z, turn):
            continue
        _collapse(vertices, corners, mates, heap, h)
        left -= 2
    return left
