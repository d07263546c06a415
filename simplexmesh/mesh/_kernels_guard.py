"""Kernels that move vertices one by one, only as far as no face folds or crosses another one more than before.

A face is a fan about its centroid. What is wrong with it is told by the cosines of the angles between its triangles and
the normals of their vertices, and what the face should point along.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from simplexmesh.mesh._kernels_crossing import round_once, triangles_cross
from simplexmesh.mesh._kernels_fitting import Faces
from simplexmesh.mesh._kernels_regions import cross

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

WRONG = 1.0
"""What a triangle counts that points the wrong way, besides how far it does."""

CROSSING = 0.5
"""What a pair of triangles that cross counts."""

EQUAL = 1e-9
PLACES = 14
LARGE_STEP, SMALL_STEP = 0.3, 0.1


class Guarded(NamedTuple):
    """A mesh whose vertices move."""

    points: Array  # (n + f, 3) vertices, then the centroids of the faces
    normals: Array  # (n, 3) of the vertices
    along: Array  # (f, 3) unit vectors that the faces should point along, zero where nothing is known
    neighbors: Indices  # (n, 3)
    vertex_faces: Indices  # (n, 3)
    faces: Faces
    offsets: NDArray[np.int64]  # (f + 1,)
    near: Indices  # the faces that each face may cross, itself among them
    crossed: NDArray[np.bool_]  # (f,) whether a face crosses one of them
    free: NDArray[np.bool_]  # (n,) whether a vertex may move


class Bounds(NamedTuple):
    """The cosines that should not be fallen below."""

    among: float  # of a fan triangle and the normals of its two vertices, and of a vertex and its faces
    along: float  # of a fan triangle and what its face should point along


class Room(NamedTuple):
    """Room for what a kernel works out."""

    vectors: Array  # (6, 3) vector areas, doubled, of the faces at a vertex and of those across its edges
    vector: Array  # (3,)
    one: NDArray[np.int64]  # (3,) corners of a triangle
    other: NDArray[np.int64]  # (3,)


@njit(cache=True)
def new_room() -> Room:
    """Return room."""
    return Room(np.empty((6, 3)), np.empty(3), np.empty(3, np.int64), np.empty(3, np.int64))


@njit(cache=True, error_model="numpy")
def put_vertex(g: Guarded, i: int, x: float, y: float, z: float) -> None:
    """Put a vertex somewhere, and bring centroids and normals up to date; the normals are those of its neighbors."""
    n = g.normals.shape[0]
    there = (x, y, z)
    for j in range(3):
        f = g.vertex_faces[i, j]
        size = g.faces.offsets[f + 1] - g.faces.offsets[f]
        for k in range(3):
            g.points[n + f, k] += (there[k] - g.points[i, k]) / size
    for k in range(3):
        g.points[i, k] = there[k]
    for j in range(3):
        v = g.neighbors[i, j]
        a, b, c = g.neighbors[v, 0], g.neighbors[v, 1], g.neighbors[v, 2]
        size = cross(g.points[a], g.points[b], g.points[c], g.normals[v])
        for k in range(3):
            g.normals[v, k] /= size if size > 0 else 1.0


@njit(cache=True)
def fault(cosine: float, bound: float) -> float:
    """Return how far a cosine is below a bound, and more when it is below 0."""
    if cosine >= bound:
        return 0.0
    return bound - cosine + (WRONG if cosine < 0 else 0.0)


@njit(cache=True, error_model="numpy")
def fan_faults(g: Guarded, f: int, b: Bounds, t: Array, vector: Array) -> float:
    """Return what is wrong with a fan, none for a hole, and put its vector area, doubled, into `vector`; `t` is room.

    No root is taken for the many triangles with nothing wrong.
    """
    vector[0] = vector[1] = vector[2] = 0.0
    total = 0.0
    if g.faces.hole[f]:
        return total
    middle = g.points[g.normals.shape[0] + f]
    ux, uy, uz = g.along[f, 0], g.along[f, 1], g.along[f, 2]
    known = ux * ux + uy * uy + uz * uz > 0
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        p, q = g.faces.vertices[c], g.faces.ahead[c]
        cross(g.points[p], g.points[q], middle, t)
        squared = size = among = 0.0
        for k in range(3):
            both = g.normals[p, k] + g.normals[q, k]
            squared += both * both
            among += both * t[k]
            size += t[k] * t[k]
            vector[k] += t[k]
        if not (among > 0 and among * among >= b.among**2 * size * squared and size > 0):
            total += fault(among / np.sqrt(size * squared) if size * squared > 0 else -1.0, b.among)
        along = ux * t[0] + uy * t[1] + uz * t[2]
        if known and size > 0 and (along < 0 or along * along < b.along * abs(b.along) * size):
            total += max(b.along - along / np.sqrt(size), 0.0)
    return total


@njit(cache=True, error_model="numpy")
def against(g: Guarded, i: int, vectors: Array, one: int, two: int, three: int, b: Bounds) -> float:
    """Return what is wrong with the normal of a vertex, by the vector areas of its three faces."""
    squared = dot = 0.0
    for k in range(3):
        total = vectors[one, k] + vectors[two, k] + vectors[three, k]
        squared += total * total
        dot += total * g.normals[i, k]
    return fault(dot / np.sqrt(squared) if squared > 0 else -1.0, b.among)


@njit(cache=True, error_model="numpy")
def faults(g: Guarded, i: int, b: Bounds, r: Room) -> float:
    """Return what is wrong with all fans that a move of a vertex changes, and with it and its neighbors."""
    total = 0.0
    for j in range(3):
        total += fan_faults(g, g.vertex_faces[i, j], b, r.vector, r.vectors[j])
    for j in range(3):
        v = g.neighbors[i, j]
        here = (-1, -1)
        for k in range(3):
            f = g.vertex_faces[v, k]
            at = -1
            for m in range(3):
                at = m if g.vertex_faces[i, m] == f else at
            if at >= 0:
                here = (here[1], at)
            else:
                total += fan_faults(g, f, b, r.vector, r.vectors[3 + j])
        total += against(g, v, r.vectors, here[0], here[1], 3 + j, b)
    return total + against(g, i, r.vectors, 0, 1, 2, b)


@njit(cache=True)
def fan_box(g: Guarded, f: int, low: Array, high: Array) -> None:
    """Put the lowest and the highest corner of the box around a fan into `low` and `high`."""
    for k in range(3):
        low[k], high[k] = np.inf, -np.inf
        for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
            low[k] = min(low[k], g.points[g.faces.vertices[c], k])
            high[k] = max(high[k], g.points[g.faces.vertices[c], k])


@njit(cache=True)
def outside(points: Array, t: NDArray[np.int64], low: Array, high: Array) -> bool:
    """Return whether the box around a triangle is apart from another box."""
    for k in range(3):
        x, y, z = points[t[0], k], points[t[1], k], points[t[2], k]
        if min(x, y, z) > high[k] or max(x, y, z) < low[k]:
            return True
    return False


@njit(cache=True)
def fans_crossing(g: Guarded, f: int, other: int, low: Array, high: Array, r: Room) -> int:
    """Return how many pairs of triangles of two fans cross, or of one fan; the first one has a box."""
    n, found = g.normals.shape[0], 0
    fan = g.faces.offsets[f], g.faces.offsets[f + 1]
    if f == other and round_once(g.points, g.faces.vertices, g.faces.ahead, fan[0], fan[1], n + f, r.vectors[2:5]):
        return 0
    for e in range(g.faces.offsets[other], g.faces.offsets[other + 1]):
        r.other[0], r.other[1], r.other[2] = g.faces.vertices[e], g.faces.ahead[e], n + other
        if outside(g.points, r.other, low, high):
            continue
        for k in range(3):
            x, y, z = g.points[r.other[0], k], g.points[r.other[1], k], g.points[r.other[2], k]
            r.vectors[4, k], r.vectors[5, k] = min(x, y, z), max(x, y, z)
        for c in range(g.faces.offsets[f], e if f == other else g.faces.offsets[f + 1]):
            r.one[0], r.one[1], r.one[2] = g.faces.vertices[c], g.faces.ahead[c], n + f
            if not outside(g.points, r.one, r.vectors[4], r.vectors[5]) and triangles_cross(g.points, r.one, r.other):
                found += 1
    return found


@njit(cache=True)
def pairs_crossing(g: Guarded, f: int, other: int, r: Room) -> int:
    """Return how many pairs of triangles of two fans cross, most of a large one left out by the box of a small one."""
    sizes = g.faces.offsets[f + 1] - g.faces.offsets[f], g.faces.offsets[other + 1] - g.faces.offsets[other]
    if sizes[0] <= sizes[1]:
        return fans_crossing(g, f, other, r.vectors[0], r.vectors[1], r)
    fan_box(g, other, r.vectors[2], r.vectors[3])
    return fans_crossing(g, other, f, r.vectors[2], r.vectors[3], r)


@njit(cache=True)
def crossings(g: Guarded, i: int, r: Room) -> int:
    """Return how many pairs of triangles cross where one is on a face of a vertex and the other on a face near it."""
    found = 0
    for j in range(3):
        f = g.vertex_faces[i, j]
        fan_box(g, f, r.vectors[0], r.vectors[1])
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            twice = False
            for m in range(3):
                twice |= g.vertex_faces[i, m] == other and other < f
            if not twice:
                found += pairs_crossing(g, f, other, r)
    return found


@njit(cache=True)
def mark_crossed(g: Guarded) -> None:
    """Find the faces that cross a face near them."""
    r = new_room()
    for f in range(g.crossed.size):
        fan_box(g, f, r.vectors[0], r.vectors[1])
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            if other >= f and pairs_crossing(g, f, other, r) > 0:
                g.crossed[f] = g.crossed[other] = True


@njit(cache=True)
def touches_crossed(g: Guarded, i: int) -> bool:
    """Return whether a face of a vertex crosses another one."""
    return g.crossed[g.vertex_faces[i, 0]] or g.crossed[g.vertex_faces[i, 1]] or g.crossed[g.vertex_faces[i, 2]]


@njit(cache=True, error_model="numpy")
def advance(g: Guarded, target: Array, reach: float, tries: int, b: Bounds) -> int:
    """Move each free vertex towards its target, by `reach` at most, or half or less of that without new faults.

    Returns how many stayed where they were.
    """
    r = new_room()
    held = 0
    for i in range(target.shape[0]):
        x, y, z = g.points[i, 0], g.points[i, 1], g.points[i, 2]
        dx, dy, dz = target[i, 0] - x, target[i, 1] - y, target[i, 2] - z
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        if not g.free[i] or not length > 0:
            continue
        before = faults(g, i, b, r) + EQUAL
        crossing = crossings(g, i, r) if touches_crossed(g, i) else 0
        part, found = min(1.0, reach / length), False
        for _ in range(tries):
            put_vertex(g, i, x + part * dx, y + part * dy, z + part * dz)
            found = faults(g, i, b, r) <= before and crossings(g, i, r) <= crossing
            if found:
                break
            part /= 2
        if not found:
            held += 1
            put_vertex(g, i, x, y, z)
    return held
