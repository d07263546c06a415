"""Kernels of decimation: T1 on the edge that costs least, again and again, as edges of the dual triangulation collapse.

Each face stands for a corner of the dual triangulation, with a point and a quadric, each vertex for a triangle, each
vertex on a rim for an edge of the border. T1 makes one corner of two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from simplexmesh.mesh._kernels_edit import (
    DONE,
    VERTICES,
    Darts,
    adjacent,
    follow,
    refuse_remove,
    remove,
    turn,
)
from simplexmesh.mesh._kernels_heap import Heap, new_heap, put
from simplexmesh.mesh._kernels_quadrics import TERMS, cross, optimum

Array = NDArray[np.float64]
Indices = NDArray[np.int32]


class Corners(NamedTuple):
    """What is known of the faces, as corners of the dual triangulation, and of the components."""

    points: Array  # (f, 3)
    quadrics: Array  # (f, 10)
    rim: NDArray[np.bool_]  # (f,) whether it is on a rim
    into: Indices  # (f,) the face that each merged one became part of, itself while it is there
    component: Indices  # (n,) of each vertex
    left: NDArray[np.int64]  # the number of vertices left of each component


class Weights(NamedTuple):
    """What counts how much, and what is refused."""

    stay: float  # a new corner keeps to the middle of the two, in parts of the trace of its quadric
    spread: float  # the squared length of the edge in the dual, the same: faces are even where the surface is flat
    sizes: float  # how uneven sizes of faces become
    turn: float  # least cosine of the turn of a dual triangle
    bend: float  # least cosine between the normals of neighboring dual triangles
    shape: float  # least quality of a dual triangle, 1 when it is regular
    least: int  # least number of vertices of a face
    most: int  # largest number of vertices of a face
    piece: int  # least number of vertices of a component
    necks: bool  # whether three faces may make a ring around more than a vertex


@njit(cache=True, error_model="numpy")
def collapse_cost(d: Darts, c: Corners, dart: int, w: Weights, q: Array, p: Array) -> float:
    """Return the cost of T1 on an edge and put the new corner into `p`; infinite beside a hole. `q` is room."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if d.face_hole[left] or d.face_hole[right]:
        return np.inf
    for k in range(TERMS):
        q[k] = c.quadrics[left, k] + c.quadrics[right, k]
    a, b = c.points[left], c.points[right]
    at = 0.5
    if c.rim[left] != c.rim[right]:
        at = 1.0 if c.rim[right] else 0.0
    squared = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2
    x, y, z = a[0] + at * (b[0] - a[0]), a[1] + at * (b[1] - a[1]), a[2] + at * (b[2] - a[2])
    cost = optimum(q, x, y, z, w.stay, np.sqrt(squared), p)
    cost += w.spread * (q[0] + q[1] + q[2]) * squared
    one, other = d.face_size[left] - 6, d.face_size[right] - 6
    uneven = (one + other + 2) ** 2 - one**2 - other**2
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[turn(end)]
        if not d.face_hole[opposite]:
            uneven += (d.face_size[opposite] - 7) ** 2 - (d.face_size[opposite] - 6) ** 2
    return cost * (1 + w.sizes * max(uneven, 0))


@njit(cache=True, error_model="numpy")
def shape(a: Array, b: Array, c: Array, area: float) -> float:
    """Return the quality of a triangle of twice this area: 1 when it is regular, 0 when it is flat."""
    total = 0.0
    for k in range(3):
        total += (a[k] - b[k]) ** 2 + (b[k] - c[k]) ** 2 + (c[k] - a[k]) ** 2
    return 2 * np.sqrt(3.0) * area / total if total > 0 else 0.0


@njit(cache=True, error_model="numpy")
def worsens(old: Array, new: Array, one: Array, other: Array, w: Weights, n: Array) -> bool:
    """Return whether a triangle turns too far, or gets too thin, when a corner moves; `n` is room."""
    before, after = cross(old, one, other, n[0]), cross(new, one, other, n[1])
    dot = n[0, 0] * n[1, 0] + n[0, 1] * n[1, 1] + n[0, 2] * n[1, 2]
    if not dot > w.turn * before * after:
        return True
    quality = shape(new, one, other, after)
    return quality < w.shape and quality < shape(old, one, other, before)


@njit(cache=True, error_model="numpy")
def creased(d: Darts, c: Corners, walk: int, p: Array, w: Weights, n: Array) -> bool:
    """Return whether the triangle of a dart's vertex, its corner at `p`, folds back on the one opposite."""
    across = d.twin[turn(turn(walk))]
    one, other, third = d.face[turn(walk)], d.face[turn(turn(walk))], d.face[turn(across)]
    if d.face_hole[one] or d.face_hole[other] or d.face_hole[third]:
        return False
    size = cross(p, c.points[one], c.points[other], n[0]) * cross(c.points[third], c.points[other], c.points[one], n[1])
    return n[0, 0] * n[1, 0] + n[0, 1] * n[1, 1] + n[0, 2] * n[1, 2] < w.bend * size


@njit(cache=True, error_model="numpy")
def folds(d: Darts, c: Corners, dart: int, p: Array, w: Weights, n: Array) -> bool:
    """Return whether a triangle around the edge of a dart turns or thins too much when both corners go to `p`."""
    back = d.twin[dart]
    for start in (np.int64(dart), np.int64(back)):
        old = c.points[d.face[start]]
        walk = follow(d.twin, start)
        while walk != start:
            if walk // 3 != dart // 3 and walk // 3 != back // 3:
                if creased(d, c, walk, p, w, n):
                    return True
                one, other = d.face[turn(walk)], d.face[turn(turn(walk))]
                if not d.face_hole[one] and not d.face_hole[other]:
                    if worsens(old, p, c.points[one], c.points[other], w, n):
                        return True
                elif not (d.face_hole[one] and d.face_hole[other]):
                    there = c.points[other] if d.face_hole[one] else c.points[one]
                    dot = 0.0
                    for k in range(3):
                        dot += (there[k] - old[k]) * (there[k] - p[k])
                    if not dot > 0:
                        return True
            walk = follow(d.twin, walk)
    return False


@njit(cache=True)
def refused(d: Darts, c: Corners, dart: int, w: Weights) -> bool:
    """Return whether T1 is illegal on an edge, or makes a face too small or too large, or a component too small."""
    back = d.twin[dart]
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[turn(end)]
        if not d.face_hole[opposite] and d.face_size[opposite] <= w.least:
            return True
    merged = d.face_size[d.face[dart]] + d.face_size[d.face[back]] - 4
    if merged < w.least or merged > w.most or c.left[c.component[dart // 3]] - 2 < w.piece:
        return True
    return refuse_remove(d, dart)[0] != DONE or (not w.necks and chokes(d, dart))


@njit(cache=True)
def chokes(d: Darts, dart: int) -> bool:
    """Return whether T1 on an edge makes a ring of three faces around more than a vertex: a thin neck."""
    back = d.twin[dart]
    near, far = d.face[turn(dart)], d.face[turn(back)]
    walk = follow(d.twin, dart)
    while walk != dart:
        one = d.face[d.twin[walk]]
        step = follow(d.twin, back)
        while step != back and one != near and one != far and not d.face_hole[one]:
            other = d.face[d.twin[step]]
            if other != near and other != far and not d.face_hole[other] and adjacent(d, one, other):
                return True
            step = follow(d.twin, step)
        walk = follow(d.twin, walk)
    return False


@njit(cache=True)
def look(d: Darts, c: Corners, heap: Heap, face: int, w: Weights, q: Array, p: Array) -> None:
    """Put the edges around a face where their costs say."""
    start = d.face_dart[face]
    walk = start
    while True:
        back = d.twin[walk]
        put(heap, max(walk, back), np.inf)
        put(heap, min(walk, back), collapse_cost(d, c, min(walk, back), w, q, p))
        walk = follow(d.twin, walk)
        if walk == start:
            return


@njit(cache=True)
def take_out(d: Darts, heap: Heap, dart: int) -> None:
    """Take the edges around an edge that is to be removed, and itself, out of the queue."""
    for end in (np.int64(dart), np.int64(d.twin[dart])):
        for k in range(3):
            one = 3 * (end // 3) + k
            put(heap, one, np.inf)
            put(heap, d.twin[one], np.inf)


@njit(cache=True)
def collapse(d: Darts, c: Corners, dart: int, q: Array, p: Array) -> int:
    """T1 on an edge, the new corner in `p` and its quadric in `q`; return the face that is left."""
    left, right = d.face[dart], d.face[d.twin[dart]]
    c.left[c.component[dart // 3]] -= 2
    remove(d, dart)
    kept = left if d.face_dart[left] >= 0 else right
    c.into[left + right - kept] = kept
    for k in range(TERMS):
        c.quadrics[kept, k] = q[k]
    for k in range(3):
        c.points[kept, k] = p[k]
    c.rim[kept] = c.rim[left] or c.rim[right]
    return kept


@njit(cache=True)
def collapse_cheapest(d: Darts, c: Corners, w: Weights, count: int) -> int:
    """T1 on the cheapest edge up to `count` times; return how many were.

    An edge that may not be removed waits until a face beside it is merged, or until the queue is empty.
    """
    heap = new_heap(d.twin.size)
    q, p, n = np.empty(TERMS), np.empty(3), np.empty((2, 3))
    done, last = 0, -1
    while done < count:
        if heap.size[0] == 0:
            if done == last:
                return done
            last = done
            for dart in range(3 * d.used[VERTICES]):
                if d.alive[dart // 3] and dart < d.twin[dart]:
                    put(heap, dart, collapse_cost(d, c, dart, w, q, p))
            if heap.size[0] == 0:
                return done
        dart = heap.item[0]
        put(heap, dart, np.inf)
        if refused(d, c, dart, w):
            continue
        collapse_cost(d, c, dart, w, q, p)
        if folds(d, c, dart, p, w, n):
            continue
        take_out(d, heap, dart)
        kept = collapse(d, c, dart, q, p)
        look(d, c, heap, kept, w, q, p)
        done += 1
    return done
