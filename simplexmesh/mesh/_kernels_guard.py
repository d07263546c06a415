"""Kernels that move vertices one by one, only as far as no face folds or crosses another more than before.

A face is a fan about its centroid. Its penalty measures by how much the cosines of the angles between its triangles'
normals and those of their vertices, and the target normal of the face, are below given bounds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_fans import MovingMesh, crossings, touches_crossed
from simplexmesh.mesh._kernels_vectors import cross_product, difference, dot

Array = NDArray[np.float64]

INVERSION_PENALTY = 1.0
"""Penalty of an inverted triangle, in addition to that of its cosine."""

TOLERANCE = 1e-9
NO_LIMIT = 2**31


class Bounds(NamedTuple):
    """Lower bounds on cosines, below which penalties start."""

    mutual: float  # between a fan triangle and the sum of its two vertex normals, and between a vertex and its faces
    target: float  # between a fan triangle and the target normal of its face


@njit(cache=True, error_model="numpy")
def move_vertex(g: MovingMesh, i: int, x: float, y: float, z: float) -> None:
    """Move vertex `i` and update the centroids of its faces and the normals of its neighbors, which depend on it."""
    n = g.normals.shape[0]
    dx, dy, dz = x - g.points[i, 0], y - g.points[i, 1], z - g.points[i, 2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    for j in range(3):
        f = g.vertex_faces[i, j]
        g.travel[f] += length
        size = g.faces.offsets[f + 1] - g.faces.offsets[f]
        g.points[n + f, 0] += dx / size
        g.points[n + f, 1] += dy / size
        g.points[n + f, 2] += dz / size
    g.points[i, 0], g.points[i, 1], g.points[i, 2] = x, y, z
    for j in range(3):
        v = g.neighbors[i, j]
        a, b, c = g.neighbors[v, 0], g.neighbors[v, 1], g.neighbors[v, 2]
        t = cross_product(difference(g.points, b, a), difference(g.points, c, a))
        size = np.sqrt(dot(t, t))
        size = size if size > 0 else 1.0
        g.normals[v, 0], g.normals[v, 1], g.normals[v, 2] = t[0] / size, t[1] / size, t[2] / size


@njit(cache=True)
def penalty(cosine: float, bound: float) -> float:
    """Return by how much a cosine is below a bound, plus a constant if it is negative."""
    if cosine >= bound:
        return 0.0
    return bound - cosine + (INVERSION_PENALTY if cosine < 0 else 0.0)


@njit(cache=True, error_model="numpy")
def fan_penalty(g: MovingMesh, f: int, b: Bounds, vectors: Array, row: int) -> float:
    """Return the penalty of a fan, 0 for a hole, and write twice its vector area to a row of `vectors`.

    Square roots are avoided for the majority of triangles, which have no penalty.
    """
    total = x = y = z = 0.0
    center = g.normals.shape[0] + f
    u = g.target_normals[f, 0], g.target_normals[f, 1], g.target_normals[f, 2]
    known = dot(u, u) > 0
    for c in range(g.faces.offsets[f], g.faces.offsets[f] if g.faces.hole[f] else g.faces.offsets[f + 1]):
        p, q = g.faces.vertices[c], g.faces.ahead[c]
        t = cross_product(difference(g.points, q, p), difference(g.points, center, p))
        x, y, z = x + t[0], y + t[1], z + t[2]
        size = dot(t, t)
        n = g.normals[p, 0] + g.normals[q, 0], g.normals[p, 1] + g.normals[q, 1], g.normals[p, 2] + g.normals[q, 2]
        squared, mutual, target = dot(n, n), dot(n, t), dot(u, t)
        if not (mutual > 0 and mutual * mutual >= b.mutual**2 * size * squared and size > 0):
            total += penalty(mutual / np.sqrt(size * squared) if size * squared > 0 else -1.0, b.mutual)
        if known and size > 0 and (target < 0 or target * target < b.target * abs(b.target) * size):
            total += max(b.target - target / np.sqrt(size), 0.0)
    vectors[row, 0], vectors[row, 1], vectors[row, 2] = x, y, z
    return total


@njit(cache=True, error_model="numpy")
def normal_penalty(g: MovingMesh, i: int, vectors: Array, one: int, two: int, three: int, b: Bounds) -> float:
    """Return the penalty of a vertex normal against the vector areas of its three faces, given by rows of `vectors`."""
    x = vectors[one, 0] + vectors[two, 0] + vectors[three, 0]
    y = vectors[one, 1] + vectors[two, 1] + vectors[three, 1]
    z = vectors[one, 2] + vectors[two, 2] + vectors[three, 2]
    squared, along = x * x + y * y + z * z, x * g.normals[i, 0] + y * g.normals[i, 1] + z * g.normals[i, 2]
    return penalty(along / np.sqrt(squared) if squared > 0 else -1.0, b.mutual)


@njit(cache=True, error_model="numpy")
def local_penalty(g: MovingMesh, i: int, b: Bounds, vectors: Array, most: float) -> float:
    """Return the penalty of all fans that a move of vertex `i` changes, and of its and its neighbors' normals.

    Summation stops above `most`; `vectors` (6, 3) is a workspace.
    """
    total = 0.0
    for j in range(3):
        total += fan_penalty(g, g.vertex_faces[i, j], b, vectors, j)
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
                total += fan_penalty(g, f, b, vectors, 3 + j)
        total += normal_penalty(g, v, vectors, here[0], here[1], 3 + j, b)
    return total + normal_penalty(g, i, vectors, 0, 1, 2, b)


@njit(cache=True, error_model="numpy")
def advance(g: MovingMesh, target: Array, max_step: float, max_tries: int, b: Bounds) -> None:
    """Move each free vertex towards its target by at most `max_step`, halving the step until nothing gets worse.

    The penalty before a move is computed only if there is one after it.
    """
    vectors = np.empty((6, 3))
    for i in range(target.shape[0]):
        x, y, z = g.points[i, 0], g.points[i, 1], g.points[i, 2]
        dx, dy, dz = target[i, 0] - x, target[i, 1] - y, target[i, 2] - z
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        if not g.free[i] or not length > 0:
            continue
        before = -1.0
        crossing = crossings(g, i, NO_LIMIT) if touches_crossed(g, i) else 0
        fraction, moved = min(1.0, max_step / length), False
        for _ in range(max_tries):
            move_vertex(g, i, x + fraction * dx, y + fraction * dy, z + fraction * dz)
            after = local_penalty(g, i, b, vectors, np.inf if before < 0 else before)
            if after > TOLERANCE and before < 0:
                move_vertex(g, i, x, y, z)
                before = local_penalty(g, i, b, vectors, np.inf) + TOLERANCE
                move_vertex(g, i, x + fraction * dx, y + fraction * dy, z + fraction * dz)
            moved = after <= max(before, TOLERANCE) and crossings(g, i, crossing) <= crossing
            if moved:
                break
            fraction /= 2
        if not moved:
            move_vertex(g, i, x, y, z)
