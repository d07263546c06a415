"""Small dense matrices, one per vertex, in place: Cholesky and Givens factors, Jacobi eigenvectors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit

DEPENDENT = 1e-6
"""A column that keeps less than this share of its length orthogonal to the others depends on them."""

SINGULAR = np.full(6, 1e-10)
"""Pivots below these shares of their diagonal entries mean a singular system."""

jit = njit(cache=True, error_model="numpy", fastmath=FAST)


@jit
def factored(matrix, right, terms, singular):
    """Factor A = L L' (lower half, reciprocal diagonal), b = L^-1 b, in place; return how many pivots are regular."""
    for row in range(terms):
        for column in range(row):
            total = matrix[row, column]
            for k in range(column):
                total -= matrix[row, k] * matrix[column, k]
            matrix[row, column] = total * matrix[column, column]
        square = rest = matrix[row, row]
        total = right[row]
        for k in range(row):
            rest -= matrix[row, k] * matrix[row, k]
            total -= matrix[row, k] * right[k]
        if not rest > singular[row] * square:
            return row
        matrix[row, row] = 1.0 / math.sqrt(rest)
        right[row] = total * matrix[row, row]
    return terms


@jit
def solved(matrix, y, terms, out):
    """Fill the coefficients L'^-1 y of the leading terms; fewer terms give the fit of a lower degree."""
    for row in range(terms):
        out[row] = y[row]
    for row in range(terms - 1, -1, -1):
        out[row] *= matrix[row, row]
        for k in range(row):
            out[k] -= matrix[row, k] * out[row]


@jit
def solve(matrix, right, n):
    """Solve a symmetric positive definite system of up to six unknowns; return False where it is singular."""
    if factored(matrix, right, n, SINGULAR) < n:
        return False
    solved(matrix, right, n, right)
    return True


@jit
def influence(matrix, terms, first, second, sign, out):
    """Fill w = L^-1 g for the functional g = e_first + sign e_second: its value is w'y, its variance w'w sigma^2."""
    for row in range(terms):
        total = 0.0
        if row == first:
            total = 1.0
        if row == second:
            total += sign
        for k in range(first, row):
            total -= matrix[row, k] * out[k]
        out[row] = total * matrix[row, row] if row >= first else 0.0


@njit(cache=True, error_model="numpy")
def add_row(factor, n):
    """Rotate the row `factor[n]`, n coefficients and a right-hand side, into the triangle above it (Givens)."""
    for j in range(n):
        below = factor[n, j]
        if below == 0.0:
            continue
        above = factor[j, j]
        length = math.sqrt(above * above + below * below)
        c, s = above / length, below / length
        factor[j, j] = length
        for k in range(j + 1, n + 1):
            p, q = factor[j, k], factor[n, k]
            factor[j, k] = c * p + s * q
            factor[n, k] = c * q - s * p


@njit(cache=True, error_model="numpy")
def independence(factor, j):
    """Return the share of its length that column j has orthogonal to the columns before it."""
    total = 0.0
    for i in range(j + 1):
        total += factor[i, j] * factor[i, j]
    return abs(factor[j, j]) / math.sqrt(total) if total > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def substituted(factor, n, unknowns):
    """Substitute back for the first unknowns into `factor[n]`, the others being zero."""
    for j in range(unknowns - 1, -1, -1):
        value = factor[j, n]
        for k in range(j + 1, unknowns):
            value -= factor[j, k] * factor[n, k]
        factor[n, j] = value / factor[j, j]


@njit(inline="always")
def principal(a, b, c):
    """Return mean, amplitude and direction of the maximum of a x^2 + 2 b x y + c y^2 on the unit circle."""
    half = 0.5 * (a - c)
    turn = 0.5 * math.atan2(b, half)
    return 0.5 * (a + c), math.sqrt(half * half + b * b), math.cos(turn), math.sin(turn)


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
