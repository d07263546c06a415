"""Kernels that move vertices one by one, only as far as no face folds or crosses another more than before.

The penalty of a face is how far the cosines between the normals of its fan, and those of its vertices and its target,
are below bounds; untangling searches for positions with smaller penalties.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array
from simplexmesh.mesh.decimation._kernels_fans import MovingMesh, crossings, touches_crossed
from simplexmesh.numerics._kernels_vectors import Vector, cross_product, difference, dot, minus, norm, plus, row

CROSSING_PENALTY = 0.5
"""Penalty of a pair of crossing triangles; that of an inverted triangle is 1, in addition to that of its cosine."""

N_CANDIDATES, LARGE_STEP, SMALL_STEP = 14, 0.3, 0.1
"""Positions tried when untangling, and the steps between them, in edge lengths."""

TOLERANCE = 1e-9
NO_LIMIT = 2**31


class Bounds(NamedTuple):
    """Lower bounds on cosines, below which penalties start."""

    mutual: float  # between a fan triangle and the sum of its two vertex normals, and between a vertex and its faces
    target: float  # between a fan triangle and the target normal of its face


@njit(cache=True, error_model="numpy")
def move_vertex(g: MovingMesh, i: int, p: Vector) -> None:
    """Move vertex `i` and update the centroids of its faces and the normals of its neighbors, which depend on it."""
    n, step = g.normals.shape[0], minus(p, row(g.points, i))
    for j in range(3):
        f = g.vertex_faces[i, j]
        size = g.faces.offsets[f + 1] - g.faces.offsets[f]
        for k in range(3):
            g.points[n + f, k] += step[k] / size
    for k in range(3):
        g.points[i, k] = p[k]
    for j in range(3):
        v = g.neighbors[i, j]
        a, b, c = g.neighbors[v, 0], g.neighbors[v, 1], g.neighbors[v, 2]
        t = cross_product(difference(g.points, b, a), difference(g.points, c, a))
        size = norm(t)
        for k in range(3):
            g.normals[v, k] = t[k] / size if size > 0 else t[k]


@njit(cache=True)
def penalty(cosine: float, bound: float) -> float:
    """Return by how much a cosine is below a bound, plus 1 if it is negative."""
    if cosine >= bound:
        return 0.0
    return bound - cosine + (1.0 if cosine < 0 else 0.0)


@njit(cache=True, error_model="numpy")
def fan_penalty(g: MovingMesh, f: int, b: Bounds) -> tuple[float, Vector]:
    """Return the penalty of a fan and twice its vector area; 0 for a hole."""
    total, area = 0.0, (0.0, 0.0, 0.0)
    center, u = g.normals.shape[0] + f, row(g.target_normals, f)
    known = dot(u, u) > 0
    for c in range(g.faces.offsets[f], g.faces.offsets[f] if g.faces.hole[f] else g.faces.offsets[f + 1]):
        p, q = g.faces.vertices[c], g.faces.ahead[c]
        t = cross_product(difference(g.points, q, p), difference(g.points, center, p))
        n = plus(row(g.normals, p), row(g.normals, q), 1.0)
        area = plus(area, t, 1.0)
        size, squared, mutual, target = dot(t, t), dot(n, n), dot(n, t), dot(u, t)
        # most triangles have no penalty: no square root for them
        if not (mutual > 0 and mutual * mutual >= b.mutual**2 * size * squared and size > 0):
            total += penalty(mutual / np.sqrt(size * squared) if size * squared > 0 else -1.0, b.mutual)
        if known and size > 0 and (target < 0 or target * target < b.target * abs(b.target) * size):
            total += max(b.target - target / np.sqrt(size), 0.0)
    return total, area


@njit(cache=True, error_model="numpy")
def normal_penalty(g: MovingMesh, i: int, area: Vector, b: Bounds) -> float:
    """Return the penalty of a vertex normal against the sum of the vector areas of its faces."""
    size = norm(area)
    return penalty(dot(area, row(g.normals, i)) / size if size > 0 else -1.0, b.mutual)


@njit(cache=True, error_model="numpy")
def local_penalty(g: MovingMesh, i: int, b: Bounds, most: float) -> float:
    """Return the penalty of all that a move of vertex `i` changes, fans and normals, summed until above `most`."""
    one, two, three = g.vertex_faces[i, 0], g.vertex_faces[i, 1], g.vertex_faces[i, 2]
    first, one_area = fan_penalty(g, one, b)
    second, two_area = fan_penalty(g, two, b)
    third, three_area = fan_penalty(g, three, b)
    total = first + second + third
    for j in range(3):
        if total > most:
            return total
        v, around = g.neighbors[i, j], (0.0, 0.0, 0.0)
        for k in range(3):
            f, more = g.vertex_faces[v, k], 0.0
            if f == one:
                area = one_area
            elif f == two:
                area = two_area
            elif f == three:
                area = three_area
            else:
                more, area = fan_penalty(g, f, b)
            total, around = total + more, plus(around, area, 1.0)
        total += normal_penalty(g, v, around, b)
    return total + normal_penalty(g, i, plus(plus(one_area, two_area, 1.0), three_area, 1.0), b)


@njit(cache=True, error_model="numpy")
def advance(g: MovingMesh, target: Array, max_step: float, max_tries: int, b: Bounds) -> None:
    """Move each free vertex towards its target by at most `max_step`, halving the step until nothing gets worse."""
    for i in range(target.shape[0]):
        start = row(g.points, i)
        step = minus(row(target, i), start)
        length = norm(step)
        if not g.free[i] or not length > 0:
            continue
        before = -1.0  # computed only if there is a penalty after a move
        crossing = crossings(g, i, NO_LIMIT) if touches_crossed(g, i) else 0
        fraction, moved = min(1.0, max_step / length), False
        for _ in range(max_tries):
            move_vertex(g, i, plus(start, step, fraction))
            after = local_penalty(g, i, b, np.inf if before < 0 else before)
            if after > TOLERANCE and before < 0:
                move_vertex(g, i, start)
                before = local_penalty(g, i, b, np.inf) + TOLERANCE
                move_vertex(g, i, plus(start, step, fraction))
            moved = after <= max(before, TOLERANCE) and crossings(g, i, crossing) <= crossing
            if moved:
                break
            fraction /= 2
        if not moved:
            move_vertex(g, i, start)


@njit(cache=True, error_model="numpy")
def candidate(g: MovingMesh, i: int, which: int, start: Vector, best: Vector, size: float) -> Vector:
    """Return a candidate position: the neighbors' mean, halfway to it, or a step along an axis from `best`."""
    if which < 2:
        total = plus(row(g.points, g.neighbors[i, 0]), row(g.points, g.neighbors[i, 1]), 1.0)
        total = plus(total, row(g.points, g.neighbors[i, 2]), 1.0)
        return plus(start, plus(total, start, -3.0), 1 / 3 if which == 0 else 1 / 6)
    axis, step = (which - 2) // 2 % 3, size * (LARGE_STEP if which < 8 else SMALL_STEP)
    way = (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
    return plus(best, way, step if which % 2 == 0 else -step)


@njit(cache=True, error_model="numpy")
def untangle_vertex(g: MovingMesh, i: int, before: float, b: Bounds) -> float:
    """Move a vertex to the candidate of least penalty and return that."""
    start = best = row(g.points, i)
    squared = 0.0
    for j in range(3):
        edge = difference(g.points, g.neighbors[i, j], i)
        squared += dot(edge, edge) / 3
    least = before
    for which in range(N_CANDIDATES):
        there = candidate(g, i, which, start, best, np.sqrt(squared))
        move_vertex(g, i, there)
        total = local_penalty(g, i, b, least)
        if total < least - TOLERANCE:
            total += CROSSING_PENALTY * crossings(g, i, int((least - total) / CROSSING_PENALTY))
        if total < least - TOLERANCE:
            least, best = total, there
    move_vertex(g, i, best)
    return least


@njit(cache=True)
def untangle(g: MovingMesh, passes: int, b: Bounds) -> None:
    """Move free vertices with a penalty to where it is smaller, in passes; after the first, only around moved ones."""
    active = g.free.copy()
    for _ in range(passes):
        following = np.zeros(active.size, np.bool_)
        for i in np.flatnonzero(active):
            before = local_penalty(g, i, b, np.inf)
            if touches_crossed(g, i):
                before += CROSSING_PENALTY * crossings(g, i, NO_LIMIT)
            if before > 0 and untangle_vertex(g, i, before, b) < before:
                following[i] = True
                for j in range(3):
                    following[g.neighbors[i, j]] |= g.free[g.neighbors[i, j]]
        active = following
