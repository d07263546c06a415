"""Small linear algebra for fits: eigenvectors, normal equations, frames and second-order forms."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_njit import njit

MAX_SWEEPS = 10


@njit(cache=True, error_model="numpy")
def smallest_eigenvector(c, axis):
    """Fill `axis` with the unit eigenvector of the smallest eigenvalue of symmetric (3, 3) `c`; return all values."""
    values, vectors = np.linalg.eigh(c)
    for a in range(3):
        axis[a] = vectors[a, 0]
    return values[0], values[1], values[2]


@njit(cache=True, error_model="numpy")
def diagonalize(A, V):
    """Diagonalize a symmetric 3 x 3 matrix in place by Jacobi rotations; V becomes its eigenvectors."""
    V[:] = 0.0
    for i in range(3):
        V[i, i] = 1.0
    tiny = 1e-30 * (A[0, 0] + A[1, 1] + A[2, 2]) ** 2
    for _ in range(MAX_SWEEPS):
        if A[0, 1] ** 2 + A[0, 2] ** 2 + A[1, 2] ** 2 <= tiny:
            return
        for p in range(2):
            for q in range(p + 1, 3):
                if A[p, q] == 0.0:
                    continue
                theta = (A[q, q] - A[p, p]) / (2 * A[p, q])
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1))
                c = 1 / math.sqrt(t * t + 1)
                s = t * c
                r = 3 - p - q
                A[p, p] -= t * A[p, q]
                A[q, q] += t * A[p, q]
                A[p, q] = A[q, p] = 0.0
                one, other = A[p, r], A[q, r]
                A[p, r] = A[r, p] = c * one - s * other
                A[q, r] = A[r, q] = s * one + c * other
                for k in range(3):
                    one, other = V[k, p], V[k, q]
                    V[k, p] = c * one - s * other
                    V[k, q] = s * one + c * other


@njit(cache=True, error_model="numpy")
def principal_axes(points, origin, near, middle, A, V):
    """Fill `middle` with the mean of the points `near` relative to point `origin`, and find their principal axes.

    `A` becomes the diagonal matrix of second moments, `V` the axes. Returns the index of the least moment.
    """
    middle[:] = 0.0
    A[:] = 0.0
    for k in range(len(near)):
        for a in range(3):
            middle[a] += points[near[k], a] - points[origin, a]
    for a in range(3):
        middle[a] /= len(near)
    for k in range(len(near)):
        x = points[near[k], 0] - points[origin, 0] - middle[0]
        y = points[near[k], 1] - points[origin, 1] - middle[1]
        z = points[near[k], 2] - points[origin, 2] - middle[2]
        A[0, 0] += x * x
        A[0, 1] += x * y
        A[0, 2] += x * z
        A[1, 1] += y * y
        A[1, 2] += y * z
        A[2, 2] += z * z
    A[1, 0], A[2, 0], A[2, 1] = A[0, 1], A[0, 2], A[1, 2]
    diagonalize(A, V)
    least = 0
    for a in range(1, 3):
        if A[a, a] < A[least, least]:
            least = a
    return least


@njit(cache=True, error_model="numpy")
def solve(m, size, rhs, first):
    """Solve in place by Cholesky: `m` (6, 6) becomes its factor, `rhs` the solution, `first` column 0 of the inverse.

    Returns False if the matrix is not safely positive definite.
    """
    for j in range(size):
        d = m[j, j]
        scale = d
        for k in range(j):
            d -= m[j, k] * m[j, k]
        if not d > 1e-3 * scale or scale <= 0.0:
            return False
        d = math.sqrt(d)
        m[j, j] = d
        for i in range(j + 1, size):
            s = m[i, j]
            for k in range(j):
                s -= m[i, k] * m[j, k]
            m[i, j] = s / d
    for i in range(size):
        first[i] = 1.0 if i == 0 else 0.0
        for k in range(i):
            rhs[i] -= m[i, k] * rhs[k]
            first[i] -= m[i, k] * first[k]
        rhs[i] /= m[i, i]
        first[i] /= m[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            rhs[i] -= m[k, i] * rhs[k]
            first[i] -= m[k, i] * first[k]
        rhs[i] /= m[i, i]
        first[i] /= m[i, i]
    return True


@njit(cache=True, error_model="numpy")
def median(values, count):
    """Return the median of ``values[:count]``, which is reordered (quickselect)."""
    left, right, middle = 0, count - 1, count // 2
    while left < right:
        pivot = values[(left + right) // 2]
        i, j = left, right
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            break
    return values[middle]


@njit(cache=True, error_model="numpy")
def plane_normal(points, members, count, x, y, z, radius, normal):
    """Fill `normal` by a plane fit to the members, weighted by distance to the place; return the second moments."""
    w0 = mx = my = mz = 0.0
    limit = 1.0 / (radius * radius)
    for m in range(count):
        p = members[m]
        dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
        w = max(1.0 - (dx * dx + dy * dy + dz * dz) * limit, 0.02)
        w0 += w
        mx += w * dx
        my += w * dy
        mz += w * dz
    mx, my, mz = mx / w0, my / w0, mz / w0
    c = np.zeros((3, 3))
    for m in range(count):
        p = members[m]
        dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
        w = max(1.0 - (dx * dx + dy * dy + dz * dz) * limit, 0.02)
        dx, dy, dz = dx - mx, dy - my, dz - mz
        c[0, 0] += w * dx * dx
        c[1, 1] += w * dy * dy
        c[2, 2] += w * dz * dz
        c[0, 1] += w * dx * dy
        c[0, 2] += w * dx * dz
        c[1, 2] += w * dy * dz
    c[1, 0], c[2, 0], c[2, 1] = c[0, 1], c[0, 2], c[1, 2]
    total = c[0, 0] + c[1, 1] + c[2, 2]
    if total > 0.0:
        c /= total
    return smallest_eigenvector(c, normal)


@njit(cache=True, error_model="numpy")
def tangents(nx, ny, nz, u, v):
    """Fill two unit vectors that form a right-handed frame with the unit normal (Duff et al., 2017)."""
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    u[0], u[1], u[2] = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
    v[0], v[1], v[2] = b, sign + ny * ny * a, -ny


@njit(cache=True, error_model="numpy")
def align_tangents(surfel, u, v):
    """Rotate the tangents `u`, `v` minimally to be perpendicular to the surfel's normal."""
    nx, ny, nz = surfel[3], surfel[4], surfel[5]
    d = u[0] * nx + u[1] * ny + u[2] * nz
    u[0] -= d * nx
    u[1] -= d * ny
    u[2] -= d * nz
    length = 1.0 / math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    u[0] *= length
    u[1] *= length
    u[2] *= length
    v[0], v[1], v[2] = ny * u[2] - nz * u[1], nz * u[0] - nx * u[2], nx * u[1] - ny * u[0]


@njit(cache=True, error_model="numpy")
def bilinear_form(surfel, u, v):
    """Return u' Q v for the surfel's second-order form Q."""
    return (
        surfel[6] * u[0] * v[0]
        + surfel[7] * u[1] * v[1]
        + surfel[8] * u[2] * v[2]
        + surfel[9] * (u[0] * v[1] + u[1] * v[0])
        + surfel[10] * (u[0] * v[2] + u[2] * v[0])
        + surfel[11] * (u[1] * v[2] + u[2] * v[1])
    )


@njit(cache=True, error_model="numpy")
def set_form(surfel, u, v, uu, uv, vv):
    """Set the surfel's second-order form from its entries in the frame of the tangents `u`, `v`."""
    for j in range(3):
        surfel[6 + j] = uu * u[j] * u[j] + 2.0 * uv * u[j] * v[j] + vv * v[j] * v[j]
    surfel[9] = uu * u[0] * u[1] + uv * (u[0] * v[1] + u[1] * v[0]) + vv * v[0] * v[1]
    surfel[10] = uu * u[0] * u[2] + uv * (u[0] * v[2] + u[2] * v[0]) + vv * v[0] * v[2]
    surfel[11] = uu * u[1] * u[2] + uv * (u[1] * v[2] + u[2] * v[1]) + vv * v[1] * v[2]
