"""Kernels of decimation: greedy edge removal (T1) in order of cost, which merges the regions of two faces.

The centroids of regions are the corners of the dual triangulation; its triangles are the vertices of the mesh.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array
from simplexmesh.mesh.decimation._kernels_regions import (
    CENTROID,
    ROW_SIZE,
    Corners,
    Weights,
    energy,
    exceeds_limits,
    merge,
)
from simplexmesh.mesh.operators._kernels_contours import breaks_contour
from simplexmesh.mesh.operators._kernels_edit import (
    DONE,
    REMOVE,
    VERTICES,
    Darts,
    adjacent,
    next_dart,
    refuse_remove,
    remove,
    rotate,
)
from simplexmesh.numerics._kernels_heap import Heap, new_heap, put
from simplexmesh.numerics._kernels_vectors import Vector, cross_product, dot, minus, norm, row


@njit(cache=True, error_model="numpy")
def collapse_cost(d: Darts, c: Corners, dart: int, w: Weights, m: Array) -> float:
    """Return the cost of T1 on an edge, infinite beside a hole, and write the merged region to `m`."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if d.face_hole[left] or d.face_hole[right]:
        return np.inf
    merge(c.regions[left], c.regions[right], m)
    cost = energy(m, w) - c.energy[left] - c.energy[right]
    one, other = d.face_size[left] - 6, d.face_size[right] - 6
    increase = (one + other + 2) ** 2 - one**2 - other**2
    for end in (np.int64(dart), np.int64(back)):
        opposite = d.face[rotate(end)]
        if not d.face_hole[opposite]:
            increase += (d.face_size[opposite] - 7) ** 2 - (d.face_size[opposite] - 6) ** 2
    return max(cost, 0.0) * (1 + w.imbalance * max(increase, 0))


@njit(cache=True, error_model="numpy")
def triangle_normal(a: Vector, b: Vector, c: Vector) -> Vector:
    """Return the normal of a triangle, as long as twice its area."""
    return cross_product(minus(b, a), minus(c, a))


@njit(cache=True, error_model="numpy")
def triangle_quality(a: Vector, b: Vector, c: Vector) -> float:
    """Return the quality of a triangle, 1 if regular and 0 if degenerate."""
    ab, bc, ca = minus(b, a), minus(c, b), minus(a, c)
    total = dot(ab, ab) + dot(bc, bc) + dot(ca, ca)
    return 2 * np.sqrt(3.0) * norm(cross_product(ab, bc)) / total if total > 0 else 0.0


@njit(cache=True, error_model="numpy")
def turns(before: Vector, after: Vector, cosine: float) -> bool:
    """Return whether the cosine between two normals is not above a bound."""
    return not dot(before, after) > cosine * norm(before) * norm(after)


@njit(cache=True, error_model="numpy")
def move_degrades(old: Vector, new: Vector, one: Vector, other: Vector, w: Weights) -> bool:
    """Return whether a move of a corner rotates a triangle too far or makes it too thin."""
    if turns(triangle_normal(old, one, other), triangle_normal(new, one, other), w.turn):
        return True
    quality = triangle_quality(new, one, other)
    return quality < w.quality and quality < triangle_quality(old, one, other)


@njit(cache=True, error_model="numpy")
def folds_back(d: Darts, c: Corners, walk: int, p: Vector, w: Weights) -> bool:
    """Return whether the triangle of a dart's vertex, with its corner moved to `p`, folds onto the opposite one."""
    across = d.twin[rotate(rotate(walk))]
    one, other, third = d.face[rotate(walk)], d.face[rotate(rotate(walk))], d.face[rotate(across)]
    if d.face_hole[one] or d.face_hole[other] or d.face_hole[third]:
        return False
    a, b = row(c.points, one), row(c.points, other)
    here, there = triangle_normal(p, a, b), triangle_normal(row(c.points, third), b, a)
    return dot(here, there) < w.bend * norm(here) * norm(there)


@njit(cache=True, error_model="numpy")
def collapse_degrades(d: Darts, c: Corners, dart: int, p: Vector, w: Weights) -> bool:
    """Return whether moving both corners beside an edge to `p` rotates or thins a triangle around it too much."""
    back = d.twin[dart]
    for start in (np.int64(dart), np.int64(back)):
        old = row(c.points, d.face[start])
        walk = next_dart(d.twin, start)
        while walk != start:
            if walk // 3 != dart // 3 and walk // 3 != back // 3:
                if folds_back(d, c, walk, p, w):
                    return True
                one, other = d.face[rotate(walk)], d.face[rotate(rotate(walk))]
                a, b = row(c.points, one), row(c.points, other)
                if not d.face_hole[one] and not d.face_hole[other]:
                    if move_degrades(old, p, a, b, w):
                        return True
                elif not (d.face_hole[one] and d.face_hole[other]):
                    there = b if d.face_hole[one] else a
                    if not dot(minus(there, old), minus(there, p)) > 0:
                        return True
            walk = next_dart(d.twin, walk)
    return False


@njit(cache=True)
def is_excluded(d: Darts, c: Corners, dart: int, w: Weights) -> bool:
    """Return whether T1 on an edge is illegal, breaks a contour, changes a fixed face, or violates a limit."""
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
    if d.contour.size > 0 and breaks_contour(d, REMOVE, dart, dart):
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
    c.energy[kept] = energy(m, w)
    for k in range(ROW_SIZE):
        c.regions[kept, k] = m[k]
    for k in range(3):
        c.points[kept, k] = m[CENTROID + k]
    return kept


@njit(cache=True)
def collapse_cheapest(d: Darts, c: Corners, w: Weights, count: int) -> int:
    """Apply T1 to the cheapest edge up to `count` times; return the number of edges removed."""
    heap, m = new_heap(d.twin.size), np.empty(ROW_SIZE)
    done, last = 0, -1
    while done < count:
        if heap.size[0] == 0:  # queue the edges that could not be removed before
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
        if collapse_degrades(d, c, dart, (m[CENTROID], m[CENTROID + 1], m[CENTROID + 2]), w):
            continue
        dequeue(d, heap, dart)
        update_costs(d, c, heap, collapse(d, c, dart, w, m), w, m)
        done += 1
    return done
