"""Differences of signatures under many rotations, and local refinement. Arrays in, arrays out; no checks."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_njit import njit

FAST = {"nsz", "arcp", "contract", "reassoc"}
WIDTH = 64  # the 60 rotations of the icosahedron, padded to whole SIMD vectors
MAXIMUM_WALK = 400


@njit(cache=True, error_model="numpy", fastmath=FAST)
def search(maps, rotated, values, out):
    """Fill `out[j, g]` with the sum over l of (rotated[maps[j, l], g] - values[l])^2.

    Row i of `rotated` holds the values that the 60 rotations bring to vertex i; the innermost loop runs along it.
    """
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
    """Fill `out` as `search` does, over vertices visible in both signatures, and `common[j, g]` with their number.

    `rotated_seen` is 1 where `rotated` is visible and 0 where it is hidden, `seen` likewise for `values`.
    """
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
def _containing_vertex(i, x, y, z, neighbors, faces, centers):
    """Return the vertex whose dual cell holds a direction, by a walk from vertex `i`."""
    for _ in range(MAXIMUM_WALK):
        worst, toward = -1e-14, -1
        for j in range(3):
            d = _det(centers[faces[i, (j + 2) % 3]], centers[faces[i, j]], x, y, z)
            if d < worst:
                worst, toward = d, j
        if toward < 0:
            break
        i = neighbors[i, toward]
    return i


@njit(cache=True, error_model="numpy")
def _barycentric(i, x, y, z, vertices, faces, centers, weights):
    """Fill barycentric coordinates of a direction in the triangle of vertex `i` and two of its faces; return these."""
    best, at = -1e300, 0
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
def locate(directions, start, vertices, neighbors, faces, centers, nearest, pair, weights):
    """Fill the vertex, the two faces and the barycentric coordinates of each direction."""
    for k in range(directions.shape[0]):
        x, y, z = directions[k]
        i = _containing_vertex(start[k], x, y, z, neighbors, faces, centers)
        pair[k, 0], pair[k, 1] = _barycentric(i, x, y, z, vertices, faces, centers, weights[k])
        nearest[k] = i


@njit(cache=True, error_model="numpy")
def residuals(R, at, near, first, middle, seen_first, second, seen, vertices, neighbors, faces, centers, A, b):
    """Return the sum of squares of first(R p) - second(p) over the vertices p visible in both, and their number.

    `A` (3, 3) and `b` (3,) get the normal equations for a small rotation after R, `near` the vertex whose cell holds
    each rotated vertex. `middle` holds the mean of `first` over each face.
    """
    A[:] = 0.0
    b[:] = 0.0
    total, count = 0.0, 0
    weights = np.zeros(3)
    for k in range(at.shape[0]):
        if not seen[k]:
            continue
        x = R[0, 0] * at[k, 0] + R[0, 1] * at[k, 1] + R[0, 2] * at[k, 2]
        y = R[1, 0] * at[k, 0] + R[1, 1] * at[k, 1] + R[1, 2] * at[k, 2]
        z = R[2, 0] * at[k, 0] + R[2, 1] * at[k, 1] + R[2, 2] * at[k, 2]
        i = _containing_vertex(near[k], x, y, z, neighbors, faces, centers)
        near[k] = i
        if not seen_first[i]:
            continue
        f, g = _barycentric(i, x, y, z, vertices, faces, centers, weights)
        p, q, r = vertices[i], centers[f], centers[g]
        value = weights[0] * first[i] + weights[1] * middle[f] + weights[2] * middle[g]
        difference = value - second[k]
        total += difference * difference
        count += 1
        # the interpolant is (u first + v middle + w middle) / (u + v + w) with u = det(q, r, x) and so on
        whole = _det(q, r, x, y, z) + _det(r, p, x, y, z) + _det(p, q, x, y, z)
        du, dv, dw = (first[i] - value) / whole, (middle[f] - value) / whole, (middle[g] - value) / whole
        gx = du * (q[1] * r[2] - q[2] * r[1]) + dv * (r[1] * p[2] - r[2] * p[1]) + dw * (p[1] * q[2] - p[2] * q[1])
        gy = du * (q[2] * r[0] - q[0] * r[2]) + dv * (r[2] * p[0] - r[0] * p[2]) + dw * (p[2] * q[0] - p[0] * q[2])
        gz = du * (q[0] * r[1] - q[1] * r[0]) + dv * (r[0] * p[1] - r[1] * p[0]) + dw * (p[0] * q[1] - p[1] * q[0])
        a0, a1, a2 = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx
        A[0, 0] += a0 * a0
        A[0, 1] += a0 * a1
        A[0, 2] += a0 * a2
        A[1, 1] += a1 * a1
        A[1, 2] += a1 * a2
        A[2, 2] += a2 * a2
        b[0] += a0 * difference
        b[1] += a1 * difference
        b[2] += a2 * difference
    A[1, 0], A[2, 0], A[2, 1] = A[0, 1], A[0, 2], A[1, 2]
    return total, count


@njit(cache=True, error_model="numpy")
def _rotate(x, y, z, R, out):
    """Fill `out` with R followed by the rotation of the rotation vector (x, y, z) (Rodrigues)."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = math.sin(angle) / angle if angle > 1e-12 else 1.0
    c = (1.0 - math.cos(angle)) / (angle * angle) if angle > 1e-12 else 0.5
    for k in range(3):
        p, q, r = R[0, k], R[1, k], R[2, k]
        dot = x * p + y * q + z * r
        square = angle * angle
        out[0, k] = p + s * (y * r - z * q) + c * (x * dot - p * square)
        out[1, k] = q + s * (z * p - x * r) + c * (y * dot - q * square)
        out[2, k] = r + s * (x * q - y * p) + c * (z * dot - r * square)


@njit(cache=True, error_model="numpy")
def refine(rotations, at, near, first, middle, seen_first, second, seen, vertices, neighbors, faces, centers,
           minimum_common, steps, longest_step, distance, common):  # fmt: skip
    """Refine each rotation to a local minimum of the mean squared difference (Levenberg-Marquardt), in place.

    Steps are limited to `longest_step` radians and rejected if they leave fewer than `minimum_common` common vertices.
    """
    A, b, other_A, other_b, other = np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3))
    for h in range(rotations.shape[0]):
        R = rotations[h]
        total, count = residuals(
            R, at, near[h], first, middle, seen_first, second, seen, vertices, neighbors, faces, centers, A, b
        )
        mean = total / count if count >= minimum_common and count > 0 else np.inf
        damping = 1e-3
        for _ in range(steps):
            if not mean < np.inf:
                break
            damped = A + damping * (A[0, 0] + A[1, 1] + A[2, 2] + 1e-300) * np.eye(3)
            w = -np.linalg.solve(damped, b)
            length = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
            if length > longest_step:
                w *= longest_step / length
            _rotate(w[0], w[1], w[2], R, other)
            total, count = residuals(
                other, at, near[h], first, middle, seen_first, second, seen, vertices, neighbors, faces, centers,
                other_A, other_b,
            )  # fmt: skip
            if count >= minimum_common and count > 0 and total / count <= mean:
                gain = mean - total / count
                mean = total / count
                R[:] = other
                A[:] = other_A
                b[:] = other_b
                damping = max(0.2 * damping, 1e-9)
                if length < 1e-4 or gain <= 1e-7 * mean:
                    break
            else:
                damping *= 8.0
                if damping > 1e4 or length < 1e-4:
                    break
        _, count = residuals(
            R, at, near[h], first, middle, seen_first, second, seen, vertices, neighbors, faces, centers, A, b
        )
        distance[h], common[h] = mean, count
