"""Small dense matrices, one per vertex, in place: Cholesky solution and Jacobi eigenvectors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_njit import njit

DEPENDENT = 1e-10
"""A pivot below this share of its diagonal entry means a column that depends linearly on those before it."""


@njit(cache=True, error_model="numpy")
def solve(matrix, right, n):
    """Solve the symmetric positive definite system given by its lower half; return False where it is singular."""
    for j in range(n):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        if not pivot > DEPENDENT * matrix[j, j]:
            return False
        root = math.sqrt(pivot)
        matrix[j, j] = root
        for i in range(j + 1, n):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = value / root
        value = right[j]
        for k in range(j):
            value -= matrix[j, k] * right[k]
        right[j] = value / root
    for j in range(n - 1, -1, -1):
        value = right[j]
        for k in range(j + 1, n):
            value -= matrix[k, j] * right[k]
        right[j] = value / matrix[j, j]
    return True


@njit(cache=True, error_model="numpy")
def diagonalize(matrix, axes, n):
    """Diagonalize a symmetric matrix, given in full, by Jacobi rotations; eigenvectors are the columns of `axes`."""
    for i in range(n):
        for j in range(n):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        largest = 0.0
        for p in range(n - 1):
            for q in range(p + 1, n):
                off = matrix[p, q]
                if abs(off) <= 1e-17 * math.sqrt(abs(matrix[p, p] * matrix[q, q])) or off == 0.0:
                    continue
                largest = max(largest, abs(off))
                theta = 0.5 * (matrix[q, q] - matrix[p, p]) / off
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                matrix[p, p] -= t * off
                matrix[q, q] += t * off
                matrix[p, q] = matrix[q, p] = 0.0
                for k in range(n):
                    if k not in (p, q):
                        a, b = matrix[k, p], matrix[k, q]
                        matrix[k, p] = matrix[p, k] = c * a - s * b
                        matrix[k, q] = matrix[q, k] = s * a + c * b
                    a, b = axes[k, p], axes[k, q]
                    axes[k, p], axes[k, q] = c * a - s * b, s * a + c * b
        if largest == 0.0:
            break
