"""Small systems solved in place, one for each vertex: least squares by Cholesky, eigenvectors by Jacobi."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_njit import njit

DEPENDENT = 1e-10
"""A column that keeps less than this share of its square beside the others adds nothing of its own."""


@njit(cache=True, error_model="numpy")
def solve(table, right, n):
    """Solve the symmetric positive system given by its lower half into `right`; return whether columns differ."""
    for j in range(n):
        pivot = table[j, j]
        for k in range(j):
            pivot -= table[j, k] * table[j, k]
        if not pivot > DEPENDENT * table[j, j]:
            return False
        root = math.sqrt(pivot)
        table[j, j] = root
        for i in range(j + 1, n):
            value = table[i, j]
            for k in range(j):
                value -= table[i, k] * table[j, k]
            table[i, j] = value / root
        value = right[j]
        for k in range(j):
            value -= table[j, k] * right[k]
        right[j] = value / root
    for j in range(n - 1, -1, -1):
        value = right[j]
        for k in range(j + 1, n):
            value -= table[k, j] * right[k]
        right[j] = value / table[j, j]
    return True


@njit(cache=True, error_model="numpy")
def diagonalize(table, axes, n):
    """Rotate a symmetric table (all of it given) until it is diagonal; the columns of `axes` are its eigenvectors."""
    for i in range(n):
        for j in range(n):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        largest = 0.0
        for p in range(n - 1):
            for q in range(p + 1, n):
                off = table[p, q]
                if abs(off) <= 1e-17 * math.sqrt(abs(table[p, p] * table[q, q])) or off == 0.0:
                    continue
                largest = max(largest, abs(off))
                theta = 0.5 * (table[q, q] - table[p, p]) / off
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                table[p, p] -= t * off
                table[q, q] += t * off
                table[p, q] = table[q, p] = 0.0
                for k in range(n):
                    if k not in (p, q):
                        a, b = table[k, p], table[k, q]
                        table[k, p] = table[p, k] = c * a - s * b
                        table[k, q] = table[q, k] = s * a + c * b
                    a, b = axes[k, p], axes[k, q]
                    axes[k, p], axes[k, q] = c * a - s * b, s * a + c * b
        if largest == 0.0:
            break
