"""Kernels that move vertices one by one, only as far as no face folds or crosses another one more than before.

A face is a fan about its centroid. What is wrong with it is told by the cosines of the angles between its triangles and
the normals of their vertices, and what the face should point along.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_fans import Guarded, crossings, touches_crossed
from simplexmesh.mesh._kernels_vectors import crossed_with, difference, dot

Array = NDArray[np.float64]

WRONG = 1.0
"""What a triangle counts that points the wrong way, besides how far it does."""

EQUAL = 1e-9
MANY = 2**31


class Bounds(NamedTuple):
    """The cosines that should not be fallen below."""

    among: float  # of a fan triangle and the normals of its two vertices, and of a vertex and its faces
    along: float  # of a fan triangle and what its face should point along


@njit(cache=True, error_model="numpy")
def put_vertex(g: Guarded, i: int, x: float, y: float, z: float) -> None:
    """Put a vertex somewhere, and bring centroids and normals up to date; the normals are those of its neighbors."""
    n = g.normals.shape[0]
    dx, dy, dz = x - g.points[i, 0], y - g.points[i, 1], z - g.points[i, 2]
    way = np.sqrt(dx * dx + dy * dy + dz * dz)
    for j in range(3):
        f = g.vertex_faces[i, j]
        g.way[f] += way
        size = g.faces.offsets[f + 1] - g.faces.offsets[f]
        g.points[n + f, 0] += dx / size
        g.points[n + f, 1] += dy / size
        g.points[n + f, 2] += dz / size
    g.points[i, 0], g.points[i, 1], g.points[i, 2] = x, y, z
    for j in range(3):
        v = g.neighbors[i, j]
        a, b, c = g.neighbors[v, 0], g.neighbors[v, 1], g.neighbors[v, 2]
        t = crossed_with(difference(g.points, b, a), difference(g.points, c, a))
        size = np.sqrt(dot(t, t))
        size = size if size > 0 else 1.0
        g.normals[v, 0], g.normals[v, 1], g.normals[v, 2] = t[0] / size, t[1] / size, t[2] / size


@njit(cache=True)
def fault(cosine: float, bound: float) -> float:
    """Return how far a cosine is below a bound, and more when it is below 0."""
    if cosine >= bound:
        return 0.0
    return bound - cosine + (WRONG if cosine < 0 else 0.0)


@njit(cache=True, error_model="numpy")
def fan_faults(g: Guarded, f: int, b: Bounds, vectors: Array, row: int) -> float:
    """Return what is wrong with a fan, none for a hole, and put its vector area, doubled, into a row of `vectors`.

    No root is taken for the many triangles with nothing wrong.
    """
    total = x = y = z = 0.0
    middle = g.normals.shape[0] + f
    u = g.along[f, 0], g.along[f, 1], g.along[f, 2]
    known = dot(u, u) > 0
    for c in range(g.faces.offsets[f], g.faces.offsets[f] if g.faces.hole[f] else g.faces.offsets[f + 1]):
        p, q = g.faces.vertices[c], g.faces.ahead[c]
        t = crossed_with(difference(g.points, q, p), difference(g.points, middle, p))
        x, y, z = x + t[0], y + t[1], z + t[2]
        size = dot(t, t)
        n = g.normals[p, 0] + g.normals[q, 0], g.normals[p, 1] + g.normals[q, 1], g.normals[p, 2] + g.normals[q, 2]
        squared, among, along = dot(n, n), dot(n, t), dot(u, t)
        if not (among > 0 and among * among >= b.among**2 * size * squared and size > 0):
            total += fault(among / np.sqrt(size * squared) if size * squared > 0 else -1.0, b.among)
        if known and size > 0 and (along < 0 or along * along < b.along * abs(b.along) * size):
            total += max(b.along - along / np.sqrt(size), 0.0)
    vectors[row, 0], vectors[row, 1], vectors[row, 2] = x, y, z
    return total


@njit(cache=True, error_model="numpy")
def against(g: Guarded, i: int, vectors: Array, one: int, two: int, three: int, b: Bounds) -> float:
    """Return what is wrong with the normal of a vertex, by the vector areas of its three faces."""
    x = vectors[one, 0] + vectors[two, 0] + vectors[three, 0]
    y = vectors[one, 1] + vectors[two, 1] + vectors[three, 1]
    z = vectors[one, 2] + vectors[two, 2] + vectors[three, 2]
    squared, along = x * x + y * y + z * z, x * g.normals[i, 0] + y * g.normals[i, 1] + z * g.normals[i, 2]
    return fault(along / np.sqrt(squared) if squared > 0 else -1.0, b.among)


@njit(cache=True, error_model="numpy")
def faults(g: Guarded, i: int, b: Bounds, vectors: Array, most: float) -> float:
    """Return what is wrong with all fans that a move of a vertex changes, and with it and its neighbors.

    Adding up ends above `most`; `vectors` (6, 3) is room.
    """
    total = 0.0
    for j in range(3):
        total += fan_faults(g, g.vertex_faces[i, j], b, vectors, j)
    for j in range(3):
        if total > most:
            return total
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
                total += fan_faults(g, f, b, vectors, 3 + j)
        total += against(g, v, vectors, here[0], here[1], 3 + j, b)
    return total + against(g, i, vectors, 0, 1, 2, b)


@njit(cache=True, error_model="numpy")
def advance(g: Guarded, target: Array, reach: float, tries: int, b: Bounds) -> int:
    """Move each free vertex towards its target, by `reach` at most, or half or less of that without new faults.

    Returns how many stayed where they were. What was wrong before counts only where something is after.
    """
    vectors, held = np.empty((6, 3)), 0
    for i in range(target.shape[0]):
        x, y, z = g.points[i, 0], g.points[i, 1], g.points[i, 2]
        dx, dy, dz = target[i, 0] - x, target[i, 1] - y, target[i, 2] - z
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        if not g.free[i] or not length > 0:
            continue
        before = -1.0
        crossing = crossings(g, i, MANY) if touches_crossed(g, i) else 0
        part, found = min(1.0, reach / length), False
        for _ in range(tries):
            put_vertex(g, i, x + part * dx, y + part * dy, z + part * dz)
            after = faults(g, i, b, vectors, np.inf if before < 0 else before)
            if after > EQUAL and before < 0:
                put_vertex(g, i, x, y, z)
                before = faults(g, i, b, vectors, np.inf) + EQUAL
                put_vertex(g, i, x + part * dx, y + part * dy, z + part * dz)
            found = after <= max(before, EQUAL) and crossings(g, i, crossing) <= crossing
            if found:
                break
            part /= 2
        if not found:
            held += 1
            put_vertex(g, i, x, y, z)
    return held
