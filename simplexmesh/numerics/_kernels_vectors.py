"""Kernels on 3-vectors as tuples of floats, which need no memory allocation."""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array

Vector = tuple[float, float, float]


@njit(cache=True)
def row(points: Array, i: int) -> Vector:
    """Return row `i` as a vector."""
    return points[i, 0], points[i, 1], points[i, 2]


@njit(cache=True)
def assign(out: Array, values: Array) -> None:
    """Copy the first ``len(out)`` values; for ``out[:] = values`` numba compiles two seconds of error messages."""
    for k in range(len(out)):
        out[k] = values[k]


@njit(cache=True)
def minus(a: Vector, b: Vector) -> Vector:
    """Return the difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True)
def plus(a: Vector, b: Vector, factor: float) -> Vector:
    """Return `a + factor * b`."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@njit(cache=True, error_model="numpy")
def difference(points: Array, i: int, j: int) -> Vector:
    """Return the vector from point `j` to point `i`."""
    return points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]


@njit(cache=True, error_model="numpy")
def dot(a: Vector, b: Vector) -> float:
    """Return the dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def cross_product(a: Vector, b: Vector) -> Vector:
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def norm(a: Vector) -> float:
    """Return the length of a vector."""
    return np.sqrt(dot(a, a))


@njit(cache=True, error_model="numpy")
def unit(a: Vector) -> Vector:
    """Return the unit vector along a vector; NaN for a zero vector."""
    size = norm(a)
    return a[0] / size, a[1] / size, a[2] / size
