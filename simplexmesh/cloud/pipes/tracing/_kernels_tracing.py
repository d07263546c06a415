"""Places on the axis of the pipe that they are on. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh.numerics._kernels_matrices import solve
from simplexmesh.numerics._kernels_vectors import dot, minus, plus, row

jit = njit(cache=True, error_model="numpy")

STEP = 0.5
"""Length of a step, in radii; all lengths below are in radii."""

SLAB = 0.8
"""Half the length of the part of the pipe in which the axis is fitted: a parabola follows the tightest bend so far."""

WINDOWS = (0.5, 0.3, 0.2, 0.15)
"""Deviations of the weights about the axis, from that within which it is foreseen to that of noisy normals."""

ASIDE = 0.8
"""Distance from the foreseen axis of points that may be on it, after they are moved inward."""

SLANT = 0.6
"""Cosine between normals and the axis that points may have: that of the parts of the tightest bend in a slab."""

ROUND = 0.15
"""Least eigenvalue of the normals' moments over their sum from which their arc, of 85 degrees, tells its radius."""

RING = 0.5
"""Distance from the axis within which points moved inward by a wrong radius are."""

RIDGE = (1e-6, 0.02, 0.1)
"""Share of the weights that holds place, slope and bend of the axis where few points tell them."""

CLOSE = 0.25
"""Deviation of their weights about it: strays, which any ring has by its area, are mostly farther off."""

FEWEST = 6
"""Points that may tell a parabola, at least, and their weight on a step."""


@jit
def fill_step(points, normals, place, frame, radius, step):
    """Fill the place and the direction (6,) of the axis at a foreseen place; return support, spread and excess.

    `frame` (3, 3) has the foreseen direction last. Support is the weight of the points on the step, 0 if they are too
    few, spread the least eigenvalue of their normals' moments over the sum, and excess that of the radius of the circle
    around, 0 if they do not tell. The axis is a parabola through the points moved inward.
    """
    local = np.zeros((len(points), 7))  # of each: along, aside twice, normal twice, from the axis twice
    count = gather(points, normals, place, frame, radius, local)
    if count < FEWEST:
        return 0.0, 0.0, 0.0
    bend, weights = np.zeros((2, 3)), np.zeros(count)
    for k in range(len(WINDOWS)):
        weigh(local, count, bend, WINDOWS[k], weights)
        fit_parabola(local, weights, bend)
    for a in range(3):
        step[a] = place[a] + radius * (bend[0, 0] * frame[0, a] + bend[1, 0] * frame[1, a])
        step[3 + a] = frame[2, a] + bend[0, 1] * frame[0, a] + bend[1, 1] * frame[1, a]
    support, x, y, xy = 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        if abs(local[i, 0]) < STEP:
            u, v, w = local[i, 3], local[i, 4], weights[i]
            support, x, y, xy = support + w, x + w * u * u, y + w * v * v, xy + w * u * v
    if support < FEWEST - 2:
        return 0.0, 0.0, 0.0
    return support, least_share(x, y, xy), excess(local, count, bend)


@jit
def gather(points, normals, place, frame, radius, local):
    """Fill what is needed of points (7 columns) that may be on the pipe, in radii; return how many they are."""
    u, v, d = row(frame, 0), row(frame, 1), row(frame, 2)
    origin, count = (place[0], place[1], place[2]), 0
    for i in range(len(points)):
        away, normal = minus(row(points, i), origin), row(normals, i)
        height, across = dot(away, d), dot(normal, d)
        sign = -1.0 if dot(normal, away) < height * across else 1.0
        moved = plus(away, normal, -sign * radius)
        along, x, y = dot(moved, d) / radius, dot(moved, u) / radius, dot(moved, v) / radius
        if abs(along) >= SLAB or abs(across) >= SLANT or x * x + y * y >= ASIDE * ASIDE:
            continue
        local[count, 0], local[count, 1], local[count, 2] = along, x, y
        local[count, 3], local[count, 4] = sign * dot(normal, u), sign * dot(normal, v)
        local[count, 5], local[count, 6] = dot(away, u) / radius, dot(away, v) / radius
        count += 1
    return count


@jit
def off_axis(local, i, bend):
    """Return where the axis is at the height of a point, across the foreseen one."""
    z = local[i, 0]
    return bend[0, 0] + z * (bend[0, 1] + z * bend[0, 2]), bend[1, 0] + z * (bend[1, 1] + z * bend[1, 2])


@jit
def weigh(local, count, bend, window, weights):
    """Fill the weights (count,) of points about the axis."""
    for i in range(count):
        x, y = off_axis(local, i, bend)
        square = (local[i, 1] - x) ** 2 + (local[i, 2] - y) ** 2
        weights[i] = math.exp(-square / (2 * window * window))


@jit
def fit_parabola(local, weights, bend):
    """Fill the coefficients (2, 3) of the two coordinates of the axis by its height."""
    matrix, powers, total = np.zeros((3, 3)), np.ones(3), 1e-9
    for k in range(2):
        matrix[:], total = 0.0, 1e-9
        bend[k, 0] = bend[k, 1] = bend[k, 2] = 0.0
        for i in range(len(weights)):
            powers[1], powers[2] = local[i, 0], local[i, 0] ** 2
            total += weights[i]
            for a in range(3):
                bend[k, a] += weights[i] * powers[a] * local[i, 1 + k]
                for b in range(a + 1):
                    matrix[a, b] += weights[i] * powers[a] * powers[b]
        for a in range(3):
            matrix[a, a] += RIDGE[a] * total
        solve(matrix, bend[k], 3)


@jit
def least_share(x, y, xy):
    """Return the least eigenvalue of moments in a plane over their sum."""
    return 0.5 - math.sqrt((x - y) ** 2 + 4 * xy * xy) / (2 * max(x + y, 1e-300))


@jit
def excess(local, count, bend):
    """Return by how much the circle through the points on a step is wider than 1; 0 if they do not tell."""
    matrix, right, terms, among = np.zeros((3, 3)), np.zeros(3), np.ones(3), 0
    x, y, xy = 0.0, 0.0, 0.0
    for i in range(count):
        a, b = off_axis(local, i, bend)
        if abs(local[i, 0]) >= STEP or (local[i, 1] - a) ** 2 + (local[i, 2] - b) ** 2 >= RING * RING:
            continue
        u, v = local[i, 3], local[i, 4]
        among, x, y, xy = among + 1, x + u * u, y + v * v, xy + u * v
        far = max(math.hypot(local[i, 5] - a, local[i, 6] - b), 1e-300)
        weight = math.exp(-((local[i, 1] - a) ** 2 + (local[i, 2] - b) ** 2) / (2 * CLOSE * CLOSE))
        terms[1], terms[2] = (local[i, 5] - a) / far, (local[i, 6] - b) / far
        for k in range(3):
            right[k] += weight * terms[k] * (far - 1.0)
            for j in range(k + 1):
                matrix[k, j] += weight * terms[k] * terms[j]
    if among < 10 or least_share(x, y, xy) < ROUND or not solve(matrix, right, 3):
        return 0.0
    return right[0]


@jit
def fill_supports(flat, normals, centers, radii, band, aligned, support):
    """Fill of circles (m,) in a plane how many points are on each, less than whole ones the farther off they are."""
    for k in range(len(centers)):
        for i in range(len(flat)):
            x, y = flat[i, 0] - centers[k, 0], flat[i, 1] - centers[k, 1]
            far = math.sqrt(x * x + y * y)
            off = (far - radii[k]) / band
            if off * off < 1 and abs(x * normals[i, 0] + y * normals[i, 1]) > aligned * far:
                support[k] += 1 - off * off
