"""Half-edges of closed triangulations: steps around a vertex, flips, and what a flip or a collapse must keep.

Half-edge `3 * t + j` runs from corner j of triangle t to the next; `mates` has its opposite, `corners` its start.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh.numerics._kernels_vectors import row

MIN_COSINE = 0.5
"""Of the angle by which a flip or a move may turn a triangle."""


@njit(cache=True, error_model="numpy", _nrt=False)
def following(h):
    return h - 2 if h % 3 == 2 else h + 1


@njit(cache=True, error_model="numpy", _nrt=False)
def previous(h):
    return h + 2 if h % 3 == 0 else h - 1


@njit(cache=True, error_model="numpy", fastmath=FAST, _nrt=False)
def area_normal(p, q, r):
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True, error_model="numpy", fastmath=FAST, _nrt=False)
def cosine(a, b):
    norm = np.sqrt((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]))
    return (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / norm if norm > 0 else -1.0


@njit(cache=True, error_model="numpy", fastmath=FAST, _nrt=False)
def quality(p, q, r):
    """Return twice the area over the sum of squared sides: 0.289 if equilateral, 0 if degenerate."""
    n = area_normal(p, q, r)
    sides = 0.0
    for i in range(3):
        sides += (p[i] - q[i]) ** 2 + (q[i] - r[i]) ** 2 + (r[i] - p[i]) ** 2
    return np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / sides if sides > 0 else 0.0


@njit(cache=True, error_model="numpy", _nrt=False)
def is_adjacent(corners, mates, h, other):
    """Return whether the start vertex of half-edge h has an edge to `other`."""
    k = h
    while True:
        if corners[following(k)] == other:
            return True
        k = mates[previous(k)]
        if k == h:
            return False


@njit(cache=True, error_model="numpy", fastmath=FAST, _nrt=False)
def flip_is_valid(vertices, a, b, c, d):
    """Return whether flipping edge ab to cd in the quadrangle a d b c neither folds nor flattens a triangle."""
    p, q, r, s = row(vertices, a), row(vertices, b), row(vertices, c), row(vertices, d)
    one, two = area_normal(p, q, r), area_normal(q, p, s)
    if cosine(one, two) < MIN_COSINE:
        return False
    mean = one[0] + two[0], one[1] + two[1], one[2] + two[2]
    if cosine(area_normal(p, s, r), mean) < MIN_COSINE or cosine(area_normal(s, q, r), mean) < MIN_COSINE:
        return False
    was = min(quality(p, q, r), quality(q, p, s))
    return min(quality(p, s, r), quality(s, q, r)) > 0.25 * was


@njit(cache=True, error_model="numpy", _nrt=False)
def flip(corners, mates, h):
    g = mates[h]
    bc, ca, ad, db = following(h), previous(h), following(g), previous(g)
    a, b, c, d = corners[h], corners[bc], corners[ca], corners[db]
    outer = mates[ad], mates[ca], mates[db], mates[bc]
    t, u = 3 * (h // 3), 3 * (g // 3)
    corners[t], corners[t + 1], corners[t + 2] = a, d, c
    corners[u], corners[u + 1], corners[u + 2] = d, b, c
    mates[t], mates[t + 2], mates[u], mates[u + 1] = outer
    mates[outer[0]], mates[outer[1]], mates[outer[2]], mates[outer[3]] = t, t + 2, u, u + 1
    mates[t + 1], mates[u + 2] = u + 2, t + 1


@njit(cache=True, error_model="numpy", _nrt=False)
def keeps_topology(corners, mates, h, seen):
    """Return whether an edge satisfies the link condition and is on no tetrahedron; `seen` (v,) is scratch."""
    k, neighbors = h, 0
    while True:
        seen[corners[following(k)]] = h
        neighbors += 1
        k = mates[previous(k)]
        if k == h:
            break
    g, common = mates[h], 0
    k = g
    while True:
        common += seen[corners[following(k)]] == h
        neighbors += 1
        k = mates[previous(k)]
        if k == g:
            break
    k = h
    while True:
        seen[corners[following(k)]] = -1
        k = mates[previous(k)]
        if k == h:
            return common == 2 and neighbors > 6


@njit(cache=True, error_model="numpy", _nrt=False)
def keeps_orientation(vertices, corners, mates, h, x, y, z, turn):
    """Return whether moving the start of h turns no triangle with area that stays around it too far."""
    moved = (x, y, z)
    k = mates[previous(h)]
    last = mates[h]
    while following(last) != k:
        p, q, r = row(vertices, corners[k]), row(vertices, corners[following(k)]), row(vertices, corners[previous(k)])
        was = area_normal(p, q, r)
        if was != (0.0, 0.0, 0.0) and cosine(was, area_normal(moved, q, r)) < turn:
            return False
        k = mates[previous(k)]
    return True
