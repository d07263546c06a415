"""Shared by the estimators' kernels: small least squares by Givens rotations, principal axes of a quadratic form."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_njit import njit

FLAT = 1e-24
"""A neighbor whose projection is shorter than this share of its distance, squared, has no azimuth."""

DEPENDENT = 1e-6
"""A column that keeps less than this share of its length orthogonal to the others depends on them."""


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
def solve(factor, n, unknowns):
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
