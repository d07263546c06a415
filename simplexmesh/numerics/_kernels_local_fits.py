"""Local planes and quadrics through the neighbors of points. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_matrices import diagonalize, solve
from simplexmesh.numerics._kernels_vectors import difference, dot, minus, row

FLAT = 1e-12
"""Of the squared length of points on a line: less is no width."""


@njit(cache=True, error_model="numpy")
def fit_plane(points, members, place, radius, normal):
    """Fill the unit normal of a plane fit; return the members' mean about a place and their moments, ascending."""
    falling = 1.0 / (radius * radius)
    total = x = y = z = 0.0
    for p in members:
        d = minus(row(points, p), place)
        w = max(1.0 - dot(d, d) * falling, 0.02)
        total, x, y, z = total + w, x + w * d[0], y + w * d[1], z + w * d[2]
    middle = x / total, y / total, z / total
    moments, axes = np.zeros((3, 3)), np.zeros((3, 3))
    for p in members:
        d = minus(row(points, p), place)
        w = max(1.0 - dot(d, d) * falling, 0.02) / total
        x, y, z = minus(d, middle)
        moments[0, 0] += w * x * x
        moments[0, 1] += w * x * y
        moments[0, 2] += w * x * z
        moments[1, 1] += w * y * y
        moments[1, 2] += w * y * z
        moments[2, 2] += w * z * z
    moments[1, 0], moments[2, 0], moments[2, 1] = moments[0, 1], moments[0, 2], moments[1, 2]
    diagonalize(moments, axes, 3)
    least = most = 0
    for a in range(1, 3):
        least = a if moments[a, a] < moments[least, least] else least
        most = a if moments[a, a] >= moments[most, most] else most
    for a in range(3):
        normal[a] = axes[a, least]
    between = 3 - least - most
    return middle, (max(0.0, moments[least, least]), moments[between, between], moments[most, most])


@by_rows(500)
def fit_planes(begin, end, points, near, normals, variance, projected):
    """Fill normals of either sign, mean squared distances, and projected points, of planes through `near` (n, k)."""
    for i in range(begin, end):
        place = row(points, near[i, 0])
        middle, moments = fit_plane(points, near[i], place, math.inf, normals[i])
        offset = dot(middle, row(normals, i))
        variance[i] = moments[0]
        for a in range(3):
            projected[i, a] = place[a] + offset * normals[i, a]


@by_rows(500)
def fill_moments(begin, end, points, near, moments, normals):
    """Fill the mean squares (n, 3) along the principal axes of `near` (n, k), ascending, and the first axes (n, 3)."""
    for i in range(begin, end):
        _, found = fit_plane(points, near[i], row(points, near[i, 0]), math.inf, normals[i])
        moments[i, 0], moments[i, 1], moments[i, 2] = found


@by_rows(500)
def fit_sides(begin, end, points, near, normals, cosine, fitted):
    """Fill normals of planes through those of `near` (n, k) that face as a point does; its own if they tell none."""
    for i in range(begin, end):
        own = row(normals, near[i, 0])
        members = near[i][np.array([dot(own, row(normals, j)) > cosine for j in near[i]])]
        fitted[i] = normals[near[i, 0]]
        if len(members) < 4:
            continue
        normal = np.empty(3)
        _, moments = fit_plane(points, members, row(points, near[i, 0]), math.inf, normal)
        if moments[1] > FLAT * moments[2]:
            fitted[i] = normal if dot(own, normal) > 0 else -normal


@njit(cache=True, error_model="numpy")
def _fit_quadric(points, near, normal, projected, quadric_normal):
    """Fill what `fit_quadrics` fills for one point, the first of its neighbors `near` (k,)."""
    A, x, basis = np.zeros((6, 6)), np.zeros(6), np.ones(6)
    u0, u1, u2, v0, v1, v2 = tangents(normal[0], normal[1], normal[2])
    reach = 1e-300
    for k in near:
        d = difference(points, k, near[0])
        reach = max(reach, math.sqrt(dot(d, d)))
    for k in near:
        d = difference(points, k, near[0])
        u, v = dot(d, (u0, u1, u2)) / reach, dot(d, (v0, v1, v2)) / reach
        basis[1], basis[2], basis[3], basis[4], basis[5] = u, v, u * u, u * v, v * v
        for a in range(6):
            x[a] += basis[a] * dot(d, normal) / reach
            for b in range(a + 1):
                A[a, b] += basis[a] * basis[b]
    if not solve(A, x, 6):
        x[:] = 0.0
    slope = math.sqrt(1 + x[1] ** 2 + x[2] ** 2)
    for a in range(3):
        projected[a] = points[near[0], a] + x[0] * reach * normal[a]
    quadric_normal[0] = (normal[0] - x[1] * u0 - x[2] * v0) / slope
    quadric_normal[1] = (normal[1] - x[1] * u1 - x[2] * v1) / slope
    quadric_normal[2] = (normal[2] - x[1] * u2 - x[2] * v2) / slope


@by_rows(500)
def fit_quadrics(begin, end, points, near, normals, projected, quadric_normals):
    """Fill points projected to quadrics over planes, and the normals there; both are copied where a fit is singular."""
    for i in range(begin, end):
        _fit_quadric(points, near[i], normals[i], projected[i], quadric_normals[i])
