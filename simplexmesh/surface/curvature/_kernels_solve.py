"""What the estimators' kernels share: small least squares by rotations, principal axes, samples of normal curvature."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_njit import njit

FLAT = 1e-24
"""A neighbor whose projection is shorter than this share of its distance, squared, has no azimuth."""

DEPENDENT = 1e-6
"""A column that keeps less than this share of its length beside the others adds nothing of its own."""


@njit(cache=True, error_model="numpy")
def absorb(table, n):
    """Rotate the row `table[n]`, n coefficients and a right side, into the triangle above it (Givens)."""
    for j in range(n):
        below = table[n, j]
        if below == 0.0:
            continue
        above = table[j, j]
        length = math.sqrt(above * above + below * below)
        c, s = above / length, below / length
        table[j, j] = length
        for k in range(j + 1, n + 1):
            p, q = table[j, k], table[n, k]
            table[j, k] = c * p + s * q
            table[n, k] = c * q - s * p


@njit(cache=True, error_model="numpy")
def independence(table, j):
    """Return the share of its length that column j keeps beside the columns before it."""
    total = 0.0
    for i in range(j + 1):
        total += table[i, j] * table[i, j]
    return abs(table[j, j]) / math.sqrt(total) if total > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def solve(table, n, unknowns):
    """Solve the triangle for its first unknowns, the others being zero; they are left in `table[n]`."""
    for j in range(unknowns - 1, -1, -1):
        value = table[j, n]
        for k in range(j + 1, unknowns):
            value -= table[j, k] * table[n, k]
        table[n, j] = value / table[j, j]


@njit(inline="always")
def principal(a, b, c):
    """Return mean, swing, cosine, sine: a x^2 + 2 b x y + c y^2 on unit vectors is mean +- swing, greatest there."""
    half = 0.5 * (a - c)
    turn = 0.5 * math.atan2(b, half)
    return 0.5 * (a + c), math.sqrt(half * half + b * b), math.cos(turn), math.sin(turn)
