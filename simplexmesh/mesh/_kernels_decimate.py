"""Kernels of decimation: T1 on the edge that costs least, again and again, as faces take over ever more of the surface.

Each face stands for a region of the surface given, whose centroid is a corner of the dual triangulation; each vertex
stands for a triangle of that, each vertex on a rim for an edge of its border. T1 makes one region of two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
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
from simplexmesh.mesh._kernels_regions import MIDDLE, TERMS, cross, energy, merge, strays

Array = NDArray[np.float64]
Indices = NDArray[np.int32]


class Corners(NamedTuple):
    """What is known of the faces, as corners of the dual triangulation, and of the components."""

    points: Array  # (f, 3) centroids of the regions
    regions: Array  # (f, 23)
    energy: Array  # (f,) of the regions
    reach: Array  # (f,) how far a region may reach, rms; a face with 0 stays as it is, and so do its vertices
    into: Indices  # (f,) the face that each merged one became part of, itself while it is there
    component: Indices  # (n,) of each vertex
    left: NDArray[np.int64]  # the number of vertices left of each component


class Weights(NamedTuple):
    """What counts how much, and what is refused."""

    normals: float  # how far normals are from the mean of a region, see `energy`
    spread: float  # how far a region reaches: faces are compact, and even where the surface is flat
    rim: float  # how far a rim is from a line
    sizes: float  # how uneven sizes of faces become
    turn: float  # least cosine of the turn of a dual triangle
    bend: float  # least cosine between the normals of neighboring dual triangles
    shape: float  # least quality of a dual triangle, 1 when it is regular
    least: int  # least number of vertices of a face
    most: int  # largest number of vertices of a face
    piece: int  # least number of vertices of a component
    necks: bool  # whether three faces may make a ring around more than a vertex
    flat: float  # how far from flat a region may be, rms, and a part of a rim from a line


@njit(cache=True, error_model="numpy")
def collapse_cost(d: Darts, c: Corners, dart: int, w: Weights, m: Array) -> float:
    """Return the cost of T1 on an edge and put the new region into `m`; infinite beside a hole."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if d.face_hole[left] or d.face_hole[right]:
        return np.inf
    merge(c.regions[left], c.regions[right], m)
    cost = energy(m, w.normals, w.spread, w.rim) - c.energy[left] - c.energy[right]
    one, other = d.face_size[left] - 6, d.face_size[right] - 6
    uneven = (one + other + 2) ** 2 - one**2 - other**2
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[turn(end)]
        if not d.face_hole[opposite]:
            uneven += (d.face_size[opposite] - 7) ** 2 - (d.face_size[opposite] - 6) ** 2
    return max(cost, 0.0) * (1 + w.sizes * max(uneven, 0))


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
    """Return whether T1 is illegal on an edge, changes a face that must stay, or makes something too small or large."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if c.reach[left] == 0 or c.reach[right] == 0:
        return True
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[turn(end)]
        if not d.face_hole[opposite] and (d.face_size[opposite] <= w.least or c.reach[opposite] == 0):
            return True
    merged = d.face_size[left] + d.face_size[right] - 4
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
def look(d: Darts, c: Corners, heap: Heap, face: int, w: Weights, m: Array) -> None:
    """Put the edges around a face where their costs say."""
    start = d.face_dart[face]
    walk = start
    while True:
        back = d.twin[walk]
        put(heap, max(walk, back), np.inf)
        put(heap, min(walk, back), collapse_cost(d, c, min(walk, back), w, m))
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
def collapse(d: Darts, c: Corners, dart: int, w: Weights, m: Array) -> int:
    """T1 on an edge, the new region in `m`; return the face that is left."""
    left, right = d.face[dart], d.face[d.twin[dart]]
    c.left[c.component[dart // 3]] -= 2
    remove(d, dart)
    kept = left if d.face_dart[left] >= 0 else right
    c.into[left + right - kept] = kept
    c.reach[kept] = min(c.reach[left], c.reach[right])
    c.energy[kept] = energy(m, w.normals, w.spread, w.rim)
    for k in range(TERMS):
        c.regions[kept, k] = m[k]
    for k in range(3):
        c.points[kept, k] = m[MIDDLE + k]
    return kept


@njit(cache=True)
def collapse_cheapest(d: Darts, c: Corners, w: Weights, count: int) -> int:
    """T1 on the cheapest edge up to `count` times; return how many were.

    An edge that may not be removed waits until a face beside it is merged, or until the queue is empty.
    """
    heap = new_heap(d.twin.size)
    m, n = np.empty(TERMS), np.empty((2, 3))
    done, last = 0, -1
    while done < count:
        if heap.size[0] == 0:
            if done == last:
                return done
            last = done
            for dart in range(3 * d.used[VERTICES]):
                if d.alive[dart // 3] and dart < d.twin[dart]:
                    put(heap, dart, collapse_cost(d, c, dart, w, m))
            if heap.size[0] == 0:
                return done
        dart = heap.item[0]
        put(heap, dart, np.inf)
        if refused(d, c, dart, w):
            continue
        merge(c.regions[d.face[dart]], c.regions[d.face[d.twin[dart]]], m)
        if strays(m, w.flat, min(c.reach[d.face[dart]], c.reach[d.face[d.twin[dart]]])):
            continue
        if folds(d, c, dart, m[MIDDLE : MIDDLE + 3], w, n):
            continue
        take_out(d, heap, dart)
        look(d, c, heap, collapse(d, c, dart, w, m), w, m)
        done += 1
    return done
