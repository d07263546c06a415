"""Kernels of quadrics: squared distances to planes, summed, and the points where they are least.

A row of ten numbers is the quadratic p -> p'Ap + 2b'p + c: xx, yy, zz, xy, xz, yz of A, then b, then c. Each face of a
simplex mesh has a point, a corner of the dual triangulation, and the sum of the planes of the triangles around it.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

TERMS = 10


@njit(cache=True, error_model="numpy")
def cross(a: Array, b: Array, c: Array, out: Array) -> float:
    """Put the cross product of b - a and c - a into `out`, and return its length."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    out[0] = uy * vz - uz * vy
    out[1] = uz * vx - ux * vz
    out[2] = ux * vy - uy * vx
    return np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)


@njit(cache=True, error_model="numpy")
def add_plane(q: Array, weight: float, n: Array, p: Array) -> None:
    """Add a weighted plane of unit normal `n` through `p`."""
    d = -(n[0] * p[0] + n[1] * p[1] + n[2] * p[2])
    q[0] += weight * n[0] * n[0]
    q[1] += weight * n[1] * n[1]
    q[2] += weight * n[2] * n[2]
    q[3] += weight * n[0] * n[1]
    q[4] += weight * n[0] * n[2]
    q[5] += weight * n[1] * n[2]
    for k in range(3):
        q[6 + k] += weight * d * n[k]
    q[9] += weight * d * d


@njit(cache=True, error_model="numpy")
def optimum(q: Array, x: float, y: float, z: float, stay: float, reach: float, out: Array) -> float:
    """Put the point where a quadric is least into `out`, held near a point, and return the value there, at least 0.

    The squared distance to the point counts `stay` times the trace; a move farther than `reach` is cut short.
    """
    gx = q[0] * x + q[3] * y + q[4] * z + q[6]
    gy = q[3] * x + q[1] * y + q[5] * z + q[7]
    gz = q[4] * x + q[5] * y + q[2] * z + q[8]
    here = gx * x + gy * y + gz * z + q[6] * x + q[7] * y + q[8] * z + q[9]
    out[0], out[1], out[2] = x, y, z
    trace = q[0] + q[1] + q[2]
    if not trace > 0:
        return max(here, 0.0)
    a, b, c = q[0] + stay * trace, q[1] + stay * trace, q[2] + stay * trace
    xx, yy, zz = b * c - q[5] ** 2, a * c - q[4] ** 2, a * b - q[3] ** 2
    xy, xz, yz = q[4] * q[5] - q[3] * c, q[3] * q[5] - q[4] * b, q[3] * q[4] - q[5] * a
    det = a * xx + q[3] * xy + q[4] * xz
    ux = -(xx * gx + xy * gy + xz * gz) / det
    uy = -(xy * gx + yy * gy + yz * gz) / det
    uz = -(xz * gx + yz * gy + zz * gz) / det
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    if length > reach:
        ux, uy, uz = ux * reach / length, uy * reach / length, uz * reach / length
    out[0], out[1], out[2] = x + ux, y + uy, z + uz
    form = q[0] * ux * ux + q[1] * uy * uy + q[2] * uz * uz + 2 * (q[3] * ux * uy + q[4] * ux * uz + q[5] * uy * uz)
    return max(here + 2 * (gx * ux + gy * uy + gz * uz) + form, 0.0)


@njit(cache=True)
def holes_around(face: Indices, hole: NDArray[np.bool_], vertex: int) -> int:
    """Return how many of the three faces around a vertex are holes."""
    return hole[face[3 * vertex]] + hole[face[3 * vertex + 1]] + hole[face[3 * vertex + 2]]


@njit(cache=True, error_model="numpy")
def face_points(
    face: Indices, hole: NDArray[np.bool_], vertices: Array, rounds: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Return a point (f, 3) of each face, and which faces are on a rim; zero for holes.

    The means of the points of the three faces around vertices are near these; on a rim, of the two, which lie on it.
    Each round moves the points by the mean of what is missing, starting from the mean of a face's vertices.
    """
    f = hole.size
    points = np.zeros((f, 3))
    rim = np.zeros(f, np.bool_)
    for i in range(vertices.shape[0]):
        if holes_around(face, hole, i) == 1:
            for j in range(3):
                rim[face[3 * i + j]] |= not hole[face[3 * i + j]]
    missing = np.empty((f, 3))
    count = np.empty(f)
    mean = np.zeros(3)
    for turn in range(rounds + 1):
        missing[:] = 0.0
        count[:] = 0.0
        for i in range(vertices.shape[0]):
            holes = holes_around(face, hole, i)
            if holes > 1:
                continue
            mean[:] = 0.0
            if turn > 0:
                for j in range(3):
                    mean += points[face[3 * i + j]] / (3 - holes)
            for j in range(3):
                one = face[3 * i + j]
                if not hole[one] and (holes == 1 or not rim[one]):
                    for k in range(3):
                        missing[one, k] += vertices[i, k] - mean[k]
                    count[one] += 1
        for one in range(f):
            if count[one] > 0:
                points[one] += missing[one] / count[one]
    return points, rim


@njit(cache=True, error_model="numpy")
def face_quadrics(
    face: Indices, twin: Indices, hole: NDArray[np.bool_], vertices: Array, points: Array, on_rim: float
) -> Array:
    """Return the quadric (f, 10) of each face: the planes of the dual triangles around it, by area, and of its rim.

    Each plane goes through the vertex that the triangle is of. That of a vertex on a rim stands upright on the surface
    along the rim, by `on_rim` times the squared length.
    """
    out = np.zeros((hole.size, TERMS))
    n, m = np.empty(3), np.empty(3)
    for i in range(vertices.shape[0]):
        holes = holes_around(face, hole, i)
        if holes == 0:
            size = cross(points[face[3 * i]], points[face[3 * i + 1]], points[face[3 * i + 2]], n)
            if size > 0:
                n /= size
                for j in range(3):
                    add_plane(out[face[3 * i + j]], size / 2, n, vertices[i])
        elif holes == 1:
            size = cross(vertices[twin[3 * i] // 3], vertices[twin[3 * i + 1] // 3], vertices[twin[3 * i + 2] // 3], m)
            j = 0 if hole[face[3 * i]] else (1 if hole[face[3 * i + 1]] else 2)
            one, other = face[3 * i + (j + 1) % 3], face[3 * i + (j + 2) % 3]
            along = points[other] - points[one]
            length = (along * along).sum()
            n[0] = along[1] * m[2] - along[2] * m[1]
            n[1] = along[2] * m[0] - along[0] * m[2]
            n[2] = along[0] * m[1] - along[1] * m[0]
            size = np.sqrt((n * n).sum())
            if size > 0:
                n /= size
                add_plane(out[one], on_rim * length, n, vertices[i])
                add_plane(out[other], on_rim * length, n, vertices[i])
    return out
