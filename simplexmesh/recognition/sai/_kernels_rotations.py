"""Differences of signatures under many rotations, and local refinement. Arrays in, arrays out; no checks."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base.arrays import Array, Indices32, Mask

WIDTH = 64  # the 60 rotations of the icosahedron, padded to whole SIMD vectors
LONGEST_STEP = 0.1
"""Limit of a step of refinement, in radians: about the width of the mesh."""


class SphereMesh(NamedTuple):
    """The quasi-regular sphere, and the centers (f, 3) of its faces."""

    vertices: Array
    neighbors: Indices32
    faces: Indices32  # (n, 3) of each vertex
    centers: Array


class SignaturePair(NamedTuple):
    """The values of two signatures, and where they are visible; of the first also the mean over each face."""

    first: Array
    means: Array
    first_seen: Mask
    second: Array
    second_seen: Mask


@njit(cache=True, error_model="numpy", fastmath=FAST)
def search(maps, rotated, values, out):
    """Fill `out[j, g]` with the sum over l of (rotated[maps[j, l], g] - values[l])^2."""
    total = np.zeros(WIDTH, np.float32)
    for j in range(maps.shape[0]):
        total[:] = np.float32(0.0)
        for vertex in range(maps.shape[1]):
            i, value = maps[j, vertex], values[vertex]
            for g in range(WIDTH):
                d = rotated[i, g] - value
                total[g] += d * d
        out[j, :] = total[: out.shape[1]]


@njit(cache=True, error_model="numpy", fastmath=FAST)
def search_visible(maps, rotated, rotated_seen, values, seen, out, common):
    """Fill `out` as `search` does, over vertices visible in both signatures, and `common[j, g]` with their number."""
    total, count = np.zeros(WIDTH, np.float32), np.zeros(WIDTH, np.float32)
    for j in range(maps.shape[0]):
        total[:] = np.float32(0.0)
        count[:] = np.float32(0.0)
        for vertex in range(maps.shape[1]):
            if seen[vertex]:
                i, value = maps[j, vertex], values[vertex]
                for g in range(WIDTH):
                    d = rotated[i, g] - value
                    total[g] += rotated_seen[i, g] * d * d
                    count[g] += rotated_seen[i, g]
        out[j, :] = total[: out.shape[1]]
        common[j, :] = count[: out.shape[1]]


@njit(cache=True, error_model="numpy")
def _det(a, b, x, y, z):
    """Return the determinant of rows a, b of 3 numbers and (x, y, z)."""
    return (a[1] * b[2] - a[2] * b[1]) * x + (a[2] * b[0] - a[0] * b[2]) * y + (a[0] * b[1] - a[1] * b[0]) * z


@njit(cache=True, error_model="numpy")
def _containing_vertex(i, x, y, z, mesh):
    """Return the vertex whose dual cell holds a direction, by a walk from vertex `i`."""
    centers, faces = mesh.centers, mesh.faces
    for _ in range(400):  # round the largest sphere
        worst, toward = -1e-14, -1
        for j in range(3):
            d = _det(centers[faces[i, (j + 2) % 3]], centers[faces[i, j]], x, y, z)
            if d < worst:
                worst, toward = d, j
        if toward < 0:
            break
        i = mesh.neighbors[i, toward]
    return i


@njit(cache=True, error_model="numpy")
def _barycentric(i, x, y, z, mesh, weights):
    """Fill barycentric coordinates of a direction in the triangle of vertex `i` and two of its faces; return these."""
    best, at = -1e300, 0
    vertices, centers, faces = mesh.vertices, mesh.centers, mesh.faces
    for j in range(3):
        b, c = centers[faces[i, (j + 2) % 3]], centers[faces[i, j]]
        least = min(_det(vertices[i], b, x, y, z), _det(c, vertices[i], x, y, z))
        if least > best:
            best, at = least, j
    a, b, c = vertices[i], centers[faces[i, (at + 2) % 3]], centers[faces[i, at]]
    u, v, w = _det(b, c, x, y, z), _det(c, a, x, y, z), _det(a, b, x, y, z)
    total = u + v + w
    weights[0], weights[1], weights[2] = u / total, v / total, w / total
    return faces[i, (at + 2) % 3], faces[i, at]


@njit(cache=True, error_model="numpy")
def locate(directions, start, mesh, nearest, pair, weights):
    """Fill the vertex, the two faces and the barycentric coordinates of each direction, by walks from `start`."""
    for k in range(directions.shape[0]):
        x, y, z = directions[k]
        i = _containing_vertex(start[k], x, y, z, mesh)
        pair[k, 0], pair[k, 1] = _barycentric(i, x, y, z, mesh, weights[k])
        nearest[k] = i


@njit(cache=True, error_model="numpy")
def residuals(R, near, values, mesh, A, b):
    """Return sum and number of squares of first(R p) - second(p) where both are seen; fill normal equations."""
    A[:] = 0.0
    b[:] = 0.0
    total, count = 0.0, 0
    weights = np.zeros(3)
    first, means, at, centers = values.first, values.means, mesh.vertices, mesh.centers
    for k in range(at.shape[0]):
        if not values.second_seen[k]:
            continue
        x = R[0, 0] * at[k, 0] + R[0, 1] * at[k, 1] + R[0, 2] * at[k, 2]
        y = R[1, 0] * at[k, 0] + R[1, 1] * at[k, 1] + R[1, 2] * at[k, 2]
        z = R[2, 0] * at[k, 0] + R[2, 1] * at[k, 1] + R[2, 2] * at[k, 2]
        i = _containing_vertex(near[k], x, y, z, mesh)
        near[k] = i
        if not values.first_seen[i]:
            continue
        f, g = _barycentric(i, x, y, z, mesh, weights)
        p, q, r = at[i], centers[f], centers[g]
        value = weights[0] * first[i] + weights[1] * means[f] + weights[2] * means[g]
        difference = value - values.second[k]
        total += difference * difference
        count += 1
        # the interpolant is (u first + v mean + w mean) / (u + v + w) with u = det(q, r, x) and so on
        whole = _det(q, r, x, y, z) + _det(r, p, x, y, z) + _det(p, q, x, y, z)
        du, dv, dw = (first[i] - value) / whole, (means[f] - value) / whole, (means[g] - value) / whole
        gx = du * (q[1] * r[2] - q[2] * r[1]) + dv * (r[1] * p[2] - r[2] * p[1]) + dw * (p[1] * q[2] - p[2] * q[1])
        gy = du * (q[2] * r[0] - q[0] * r[2]) + dv * (r[2] * p[0] - r[0] * p[2]) + dw * (p[2] * q[0] - p[0] * q[2])
        gz = du * (q[0] * r[1] - q[1] * r[0]) + dv * (r[0] * p[1] - r[1] * p[0]) + dw * (p[0] * q[1] - p[1] * q[0])
        slope = (y * gz - z * gy, z * gx - x * gz, x * gy - y * gx)
        for row in range(3):
            b[row] += slope[row] * difference
            for column in range(3):
                A[row, column] += slope[row] * slope[column]
    return total, count


@njit(cache=True, error_model="numpy")
def rotate(x, y, z, R, out):
    """Fill `out` with the columns of R rotated by the rotation vector (x, y, z) (Rodrigues)."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = math.sin(angle) / angle if angle > 1e-12 else 1.0
    c = (1.0 - math.cos(angle)) / (angle * angle) if angle > 1e-12 else 0.5
    for k in range(R.shape[1]):
        p, q, r = R[0, k], R[1, k], R[2, k]
        dot = x * p + y * q + z * r
        square = angle * angle
        out[0, k] = p + s * (y * r - z * q) + c * (x * dot - p * square)
        out[1, k] = q + s * (z * p - x * r) + c * (y * dot - q * square)
        out[2, k] = r + s * (x * q - y * p) + c * (z * dot - r * square)


@njit(cache=True, error_model="numpy")
def refine(rotations, near, values, mesh, minimum_common, steps, distance, common):
    """Refine each rotation to a local minimum of the mean squared difference (Levenberg-Marquardt), in place.

    Steps are limited to `LONGEST_STEP`, and rejected if they leave fewer than `minimum_common` common vertices.
    """
    A, b, other_A, other_b, other = np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
    for h in range(rotations.shape[0]):
        R = rotations[h]
        total, count = residuals(R, near[h], values, mesh, A, b)
        mean = total / count if count >= minimum_common and count > 0 else np.inf
        damping = 1e-3
        for _ in range(steps):
            if not mean < np.inf:
                break
            damped = A + damping * (A[0, 0] + A[1, 1] + A[2, 2] + 1e-300) * np.eye(3)
            w = -np.linalg.solve(damped, b)
            length = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
            if length > LONGEST_STEP:
                w *= LONGEST_STEP / length
            rotate(w[0], w[1], w[2], R, other)
            total, count = residuals(other, near[h], values, mesh, other_A, other_b)
            if count >= minimum_common and count > 0 and total / count <= mean:
                gain = mean - total / count
                mean = total / count
                R[:], A[:], b[:] = other, other_A, other_b
                damping = max(0.2 * damping, 1e-9)
                if length < 1e-4 or gain <= 1e-7 * mean:
                    break
            else:
                damping *= 8.0
                if damping > 1e4 or length < 1e-4:
                    break
        _, count = residuals(R, near[h], values, mesh, A, b)
        distance[h], common[h] = mean, count
