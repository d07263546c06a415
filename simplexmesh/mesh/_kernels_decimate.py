"""Kernels of decimation: greedy edge removal (T1) in order of cost.

Each face represents a region of the original surface, whose centroid is a vertex of the dual triangulation, here called
a corner; each vertex is a triangle of it, each vertex on a rim a border edge. T1 merges two regions.
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
    next_dart,
    refuse_remove,
    remove,
    rotate,
)
from simplexmesh.mesh._kernels_heap import Heap, new_heap, put
from simplexmesh.mesh._kernels_regions import CENTROID, ROW_SIZE, cross, energy, exceeds_limits, merge

Array = NDArray[np.float64]
Indices = NDArray[np.int32]


class Corners(NamedTuple):
    """The faces as corners of the dual triangulation, and the sizes of the components."""

    points: Array  # (f, 3) centroids of the regions
    regions: Array  # (f, 23)
    energy: Array  # (f,) of the regions
    max_extent: Array  # (f,) largest rms extent of a region; a face with 0 is fixed, with its vertices
    merged_into: Indices  # (f,) the face into which each one was merged, itself if it was not
    component: Indices  # (n,) of each vertex
    n_left: NDArray[np.int64]  # number of vertices left in each component


class Weights(NamedTuple):
    """Weights of the cost, and limits beyond which edges are not removed."""

    normals: float  # weight of the deviation of normals, see `energy`
    extent: float  # weight of the squared extent of a region, for compact faces of even size where the surface is flat
    rim: float  # weight of the deviation of a rim from a line
    imbalance: float  # weight of the increase in the squared deviations of face sizes from 6
    turn: float  # smallest cosine of the rotation of a dual triangle
    bend: float  # smallest cosine between the normals of neighboring dual triangles
    quality: float  # smallest quality of a dual triangle, 1 for a regular one
    min_size: int  # smallest number of vertices of a face
    max_size: int  # largest number of vertices of a face
    min_component: int  # smallest number of vertices of a component
    necks: bool  # whether three faces may form a ring around more than a vertex
    max_deviation: float  # largest rms distance of a region from its plane, and of a rim from its line


@njit(cache=True, error_model="numpy")
def collapse_cost(d: Darts, c: Corners, dart: int, w: Weights, m: Array) -> float:
    """Return the cost of T1 on an edge, infinite beside a hole, and write the merged region to `m`."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if d.face_hole[left] or d.face_hole[right]:
        return np.inf
    merge(c.regions[left], c.regions[right], m)
    cost = energy(m, w.normals, w.extent, w.rim) - c.energy[left] - c.energy[right]
    one, other = d.face_size[left] - 6, d.face_size[right] - 6
    increase = (one + other + 2) ** 2 - one**2 - other**2
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[rotate(end)]
        if not d.face_hole[opposite]:
            increase += (d.face_size[opposite] - 7) ** 2 - (d.face_size[opposite] - 6) ** 2
    return max(cost, 0.0) * (1 + w.imbalance * max(increase, 0))


@njit(cache=True, error_model="numpy")
def triangle_quality(a: Array, b: Array, c: Array, area: float) -> float:
    """Return the quality of a triangle, 1 if regular and 0 if degenerate; `area` is twice its area."""
    total = 0.0
    for k in range(3):
        total += (a[k] - b[k]) ** 2 + (b[k] - c[k]) ** 2 + (c[k] - a[k]) ** 2
    return 2 * np.sqrt(3.0) * area / total if total > 0 else 0.0


@njit(cache=True, error_model="numpy")
def degrades(old: Array, new: Array, one: Array, other: Array, w: Weights, n: Array) -> bool:
    """Return whether a move of a corner rotates a triangle too far or makes it too thin; `n` (2, 3) is a workspace."""
    before, after = cross(old, one, other, n[0]), cross(new, one, other, n[1])
    dot = n[0, 0] * n[1, 0] + n[0, 1] * n[1, 1] + n[0, 2] * n[1, 2]
    if not dot > w.turn * before * after:
        return True
    quality = triangle_quality(new, one, other, after)
    return quality < w.quality and quality < triangle_quality(old, one, other, before)


@njit(cache=True, error_model="numpy")
def folds_back(d: Darts, c: Corners, walk: int, p: Array, w: Weights, n: Array) -> bool:
    """Return whether the triangle of a dart's vertex, with its corner moved to `p`, folds onto the opposite one."""
    across = d.twin[rotate(rotate(walk))]
    one, other, third = d.face[rotate(walk)], d.face[rotate(rotate(walk))], d.face[rotate(across)]
    if d.face_hole[one] or d.face_hole[other] or d.face_hole[third]:
        return False
    size = cross(p, c.points[one], c.points[other], n[0]) * cross(c.points[third], c.points[other], c.points[one], n[1])
    return n[0, 0] * n[1, 0] + n[0, 1] * n[1, 1] + n[0, 2] * n[1, 2] < w.bend * size


@njit(cache=True, error_model="numpy")
def collapse_degrades(d: Darts, c: Corners, dart: int, p: Array, w: Weights, n: Array) -> bool:
    """Return whether moving both corners beside an edge to `p` rotates or thins a triangle around it too much."""
    back = d.twin[dart]
    for start in (np.int64(dart), np.int64(back)):
        old = c.points[d.face[start]]
        walk = next_dart(d.twin, start)
        while walk != start:
            if walk // 3 != dart // 3 and walk // 3 != back // 3:
                if folds_back(d, c, walk, p, w, n):
                    return True
                one, other = d.face[rotate(walk)], d.face[rotate(rotate(walk))]
                if not d.face_hole[one] and not d.face_hole[other]:
                    if degrades(old, p, c.points[one], c.points[other], w, n):
                        return True
                elif not (d.face_hole[one] and d.face_hole[other]):
                    there = c.points[other] if d.face_hole[one] else c.points[one]
                    dot = 0.0
                    for k in range(3):
                        dot += (there[k] - old[k]) * (there[k] - p[k])
                    if not dot > 0:
                        return True
            walk = next_dart(d.twin, walk)
    return False


@njit(cache=True)
def is_excluded(d: Darts, c: Corners, dart: int, w: Weights) -> bool:
    """Return whether T1 on an edge is illegal, changes a fixed face, or violates a limit on sizes or necks."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if c.max_extent[left] == 0 or c.max_extent[right] == 0:
        return True
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[rotate(end)]
        if not d.face_hole[opposite] and (d.face_size[opposite] <= w.min_size or c.max_extent[opposite] == 0):
            return True
    merged = d.face_size[left] + d.face_size[right] - 4
    if merged < w.min_size or merged > w.max_size or c.n_left[c.component[dart // 3]] - 2 < w.min_component:
        return True
    return refuse_remove(d, dart)[0] != DONE or (not w.necks and makes_neck(d, dart))


@njit(cache=True)
def makes_neck(d: Darts, dart: int) -> bool:
    """Return whether T1 on an edge makes a neck: a ring of three faces around more than a vertex."""
    back = d.twin[dart]
    near, far = d.face[rotate(dart)], d.face[rotate(back)]
    walk = next_dart(d.twin, dart)
    while walk != dart:
        one = d.face[d.twin[walk]]
        step = next_dart(d.twin, back)
        while step != back and one != near and one != far and not d.face_hole[one]:
            other = d.face[d.twin[step]]
            if other != near and other != far and not d.face_hole[other] and adjacent(d, one, other):
                return True
            step = next_dart(d.twin, step)
        walk = next_dart(d.twin, walk)
    return False


@njit(cache=True)
def update_costs(d: Darts, c: Corners, heap: Heap, face: int, w: Weights, m: Array) -> None:
    """Update the costs of the edges around a face in the queue; `m` is a workspace for a region."""
    start = d.face_dart[face]
    walk = start
    while True:
        back = d.twin[walk]
        put(heap, max(walk, back), np.inf)
        put(heap, min(walk, back), collapse_cost(d, c, min(walk, back), w, m))
        walk = next_dart(d.twin, walk)
        if walk == start:
            return


@njit(cache=True)
def dequeue(d: Darts, heap: Heap, dart: int) -> None:
    """Remove an edge and the edges at its ends from the queue."""
    for end in (np.int64(dart), np.int64(d.twin[dart])):
        for k in range(3):
            one = 3 * (end // 3) + k
            put(heap, one, np.inf)
            put(heap, d.twin[one], np.inf)


@njit(cache=True)
def collapse(d: Darts, c: Corners, dart: int, w: Weights, m: Array) -> int:
    """Apply T1 to an edge, with the merged region in `m`; return the face that is kept."""
    left, right = d.face[dart], d.face[d.twin[dart]]
    c.n_left[c.component[dart // 3]] -= 2
    remove(d, dart)
    kept = left if d.face_dart[left] >= 0 else right
    c.merged_into[left + right - kept] = kept
    c.max_extent[kept] = min(c.max_extent[left], c.max_extent[right])
    c.energy[kept] = energy(m, w.normals, w.extent, w.rim)
    for k in range(ROW_SIZE):
        c.regions[kept, k] = m[k]
    for k in range(3):
        c.points[kept, k] = m[CENTROID + k]
    return kept


@njit(cache=True)
def collapse_cheapest(d: Darts, c: Corners, w: Weights, count: int) -> int:
    """Apply T1 to the cheapest edge up to `count` times; return the number of edges removed.

    An edge that may not be removed is queued again when a face beside it is merged, or when the queue is empty.
    """
    heap = new_heap(d.twin.size)
    m, n = np.empty(ROW_SIZE), np.empty((2, 3))
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
        if is_excluded(d, c, dart, w):
            continue
        left, right = d.face[dart], d.face[d.twin[dart]]
        merge(c.regions[left], c.regions[right], m)
        if exceeds_limits(m, w.max_deviation, min(c.max_extent[left], c.max_extent[right])):
            continue
        if collapse_degrades(d, c, dart, m[CENTROID : CENTROID + 3], w, n):
            continue
        dequeue(d, heap, dart)
        update_costs(d, c, heap, collapse(d, c, dart, w, m), w, m)
        done += 1
    return done
