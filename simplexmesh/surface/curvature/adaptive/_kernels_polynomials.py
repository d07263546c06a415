"""Polynomials fitted to a ball: coordinates over its tangent plane, moments, degrees."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_matrices import factored, solved
from simplexmesh.surface.curvature.adaptive._kernels_balls import jit, whole

HIGHEST, QUADRIC_TERMS, FIRST, SECOND = np.array([6, 6, 3, 5])
"""The highest degree fitted; coefficients of a quadric, and places of those of u^2 and v^2. Of an array, as numba
compiles a function again for each plain constant that it is called with."""

TERMS = 28
"""Coefficients of a polynomial of that degree."""

MIN_SHARE = 0.5
"""Least squared ratio of a tangential coordinate to its chord, that of two points 90 degrees apart on a circle."""

QUADRIC_PASSES = 2
"""Quadrics fitted before the jet."""

ISOTROPIC = 1e-6
"""Difference of the fourth moments of points along two axes, relative to their sum, below which neither is first."""

SINGULAR = np.repeat([1e-11, 1e-11, 1e-11, 3e-4, 2e-5, 1e-6, 3e-8], np.arange(1, 8))
"""Pivots below these shares of their diagonal entries: the points do not determine the coefficients of that degree.

Those of scattered points on one side of the center are at least ten times as large; on grids, with as many rows of
points as the degree or fewer, they are near zero."""


class Work(NamedTuple):
    """Work arrays of a thread."""

    found: NDArray[np.uint64]  # points in the ball
    around: Array  # (6, .) their positions and directions
    places: Array  # (3, .) positions of those fitted, in radii
    u: Array  # their coordinates
    v: Array
    z: Array  # and heights
    columns: Array  # monomials
    sums: Array  # their moments
    matrix: Array  # normal equations, then their factor L
    y: Array  # L^-1 b
    x: Array  # coefficients
    w: Array  # L^-1 of a functional
    frame: Array  # rows u, v, normal


@jit
def workspace(most):
    """Return work arrays for balls of so many points."""
    n = whole(most)
    matrix, frame = np.empty((TERMS, TERMS)), np.empty((3, 3))
    around, places, columns, sums = np.empty((6, n)), np.empty((3, n)), np.empty((TERMS, n)), np.empty(4 * TERMS)
    u, v, z, y, x, w = np.empty(n), np.empty(n), np.empty(n), np.empty(TERMS), np.empty(TERMS), np.empty(TERMS)
    return Work(np.empty(most + 1, np.uint64), around, places, u, v, z, columns, sums, matrix, y, x, w, frame)


@jit
def framed(nx, ny, nz, frame):
    """Fill the rows u, v, n of the frame of a normal."""
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    frame[0, 0], frame[0, 1], frame[0, 2] = ux, uy, uz
    frame[1, 0], frame[1, 1], frame[1, 2] = vx, vy, vz
    frame[2, 0], frame[2, 1], frame[2, 2] = nx, ny, nz


@jit
def turned(frame, p, q, r, s, t):
    """Rotate a frame to the tangent plane of a graph of slopes p, q; return the second fundamental form in it."""
    g = 1.0 + p * p + q * q
    root, length = math.sqrt(g), math.sqrt(1.0 + p * p)
    # the new second axis is n x u = (-p q, 1 + p^2, q) / (root length) in the old frame
    along, across = -p * q / (root * length), length / root
    for axis in range(3):
        u, v, n = frame[0, axis], frame[1, axis], frame[2, axis]
        frame[0, axis] = (u + p * n) / length
        frame[1, axis] = along * u + across * v + q / (root * length) * n
        frame[2, axis] = (n - p * u - q * v) / root
    a = r / (length * length * root)
    b = (r * along + s * across) / (length * root)
    c = (r * along * along + 2.0 * s * along * across + t * across * across) / root
    return a, b, c


@jit
def projected(places, count, frame, u, v, z):
    """Write the tangential coordinates and heights of positions in a frame, to the end of the last block."""
    for k in range(whole(count)):
        a, b, c = places[0, k], places[1, k], places[2, k]
        u[k] = a * frame[0, 0] + b * frame[0, 1] + c * frame[0, 2]
        v[k] = a * frame[1, 0] + b * frame[1, 1] + c * frame[1, 2]
        z[k] = a * frame[2, 0] + b * frame[2, 1] + c * frame[2, 2]


@jit
def aligned(u, v, count, frame):
    """Rotate coordinates and frame to the bisectors of the principal axes of the points, ordered by fourth moments.

    Which terms elongated points determine depends on the axes, and must not on the pose.
    """
    a = b = c = 0.0
    for k in range(whole(count)):
        a += u[k] * u[k]
        b += u[k] * v[k]
        c += v[k] * v[k]
    turn = 0.5 * math.atan2(2.0 * b, a - c) + 0.25 * math.pi
    cosine, sine = math.cos(turn), math.sin(turn)
    a = c = 0.0
    for k in range(whole(count)):
        a += (cosine * u[k] + sine * v[k]) ** 4
        c += (cosine * v[k] - sine * u[k]) ** 4
    if c - a > ISOTROPIC * (a + c):
        cosine, sine = -sine, cosine
    for k in range(whole(count)):
        u[k], v[k] = cosine * u[k] + sine * v[k], cosine * v[k] - sine * u[k]
    for axis in range(3):
        x, y = frame[0, axis], frame[1, axis]
        frame[0, axis], frame[1, axis] = cosine * x + sine * y, cosine * y - sine * x


@jit
def chords(u, v, z, count, a, b, c):
    """Lengthen tangential coordinates to chords of a surface with the second fundamental form [[a, b], [b, c]]."""
    # on a circle of curvature k the chord is s = u / sqrt(1 - z k / 2), and z = k s^2 / 2: higher terms nearly vanish
    turn = 0.5 * math.atan2(2.0 * b, a - c)
    cosine, sine = math.cos(turn), math.sin(turn)
    amplitude = math.sqrt(0.25 * (a - c) ** 2 + b * b)
    first, second = 0.25 * (a + c) + 0.5 * amplitude, 0.25 * (a + c) - 0.5 * amplitude
    for k in range(whole(count)):
        s, t = cosine * u[k] + sine * v[k], cosine * v[k] - sine * u[k]
        p, q = math.sqrt(max(1.0 - first * z[k], MIN_SHARE)), math.sqrt(max(1.0 - second * z[k], MIN_SHARE))
        inverse = 1.0 / (p * q)  # one division instead of two
        s *= q * inverse
        t *= p * inverse
        u[k], v[k] = cosine * s - sine * t, sine * s + cosine * t


@jit
def quadric_equations(u, v, z, count, matrix, right):
    """Fill the lower half of A = X'X, and b = X'z, for the monomials 1 u v uu uv vv: `normal_equations` in one loop."""
    u1 = v1 = u2 = uv = v2 = u3 = u2v = uv2 = v3 = u4 = u3v = u2v2 = uv3 = v4 = 0.0
    z1 = zu = zv = zu2 = zuv = zv2 = 0.0
    for k in range(whole(count)):
        a, b, c = u[k], v[k], z[k]
        aa, ab, bb = a * a, a * b, b * b
        u1 += a
        v1 += b
        u2 += aa
        uv += ab
        v2 += bb
        u3 += aa * a
        u2v += aa * b
        uv2 += a * bb
        v3 += bb * b
        u4 += aa * aa
        u3v += aa * ab
        u2v2 += aa * bb
        uv3 += ab * bb
        v4 += bb * bb
        z1 += c
        zu += c * a
        zv += c * b
        zu2 += c * aa
        zuv += c * ab
        zv2 += c * bb
    matrix[0, 0] = float(count)
    matrix[1, 0], matrix[1, 1] = u1, u2
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = v1, uv, v2
    matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[3, 3] = u2, u3, u2v, u4
    matrix[4, 0], matrix[4, 1], matrix[4, 2], matrix[4, 3], matrix[4, 4] = uv, u2v, uv2, u3v, u2v2
    matrix[5, 0], matrix[5, 1], matrix[5, 2], matrix[5, 3], matrix[5, 4], matrix[5, 5] = v2, uv2, v3, u2v2, uv3, v4
    right[0], right[1], right[2], right[3], right[4], right[5] = z1, zu, zv, zu2, zuv, zv2


@jit
def normal_equations(degree, count, work):
    """Fill the lower half of A = X'X, and b = X'z, for all monomials up to the degree; return z'z."""
    u, v, z, columns, sums, matrix, right = work.u, work.v, work.z, work.columns, work.sums, work.matrix, work.y
    n, squares, total = whole(count), 0.0, 0.0  # row d (d + 1) / 2 + i of `columns` gets u^(d - i) v^i
    for k in range(n):
        columns[0, k] = 1.0
        squares += z[k] * z[k]
        total += z[k]
    sums[0], right[0], term = float(count), total, 1
    for d in range(1, degree + 1):
        before = d * (d - 1) // 2
        for i in range(d + 1):
            row, factor = before + min(i, d - 1), u if i < d else v
            total = weighted = 0.0
            for k in range(n):
                value = columns[row, k] * factor[k]
                columns[term, k] = value
                total += value
                weighted += value * z[k]
            sums[term], right[term] = total, weighted
            term += 1
    first = degree * (degree + 1) // 2
    for e in range(1, degree + 1):
        start, low = (degree + e) * (degree + e + 1) // 2, e * (e + 1) // 2
        for i in range(degree + e + 1):
            p = min(i, degree)
            a, b = first + p, low + i - p
            total = 0.0
            for k in range(n):
                total += columns[a, k] * columns[b, k]
            sums[start + i] = total
    row = 0
    for d in range(degree + 1):
        for i in range(d + 1):
            column = 0
            for e in range(d + 1):
                base = (d + e) * (d + e + 1) // 2 + i
                for j in range(min(e, row - column) + 1):
                    matrix[row, column + j] = sums[base + j]
                column += e + 1
            row += 1
    return squares


@jit
def flattened(count, work):
    """Rotate the frame to the tangent plane of a quadric, in chords at last; return whether one is determined."""
    places, frame, u, v, z, matrix, y, x = work.places, work.frame, work.u, work.v, work.z, work.matrix, work.y, work.x
    projected(places, count, frame, u, v, z)
    aligned(u, v, count, frame)
    for _pass in range(QUADRIC_PASSES):
        quadric_equations(u, v, z, count, matrix, y)
        if factored(matrix, y, QUADRIC_TERMS, SINGULAR) < QUADRIC_TERMS:
            return False
        solved(matrix, y, QUADRIC_TERMS, x)
        a, b, c = turned(frame, x[1], x[2], 2.0 * x[3], x[4], 2.0 * x[5])
        projected(places, count, frame, u, v, z)
        chords(u, v, z, count, a, b, c)
    return True


@jit
def complete(terms):
    """Return the highest degree of which all coefficients are among so many terms."""
    degree = 0
    while (degree + 2) * (degree + 3) // 2 <= terms:
        degree += 1
    return degree


@jit
def affordable(count, most):
    """Return the highest degree, at most `most`, that `count` points overdetermine."""
    degree = most
    while degree > 2 and 0.65 * (degree + 1) * (degree + 2) + 4.0 > count:
        degree -= 1
    return degree
