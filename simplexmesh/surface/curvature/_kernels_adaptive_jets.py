"""Polynomial fits of a neighborhood: gathering, moments, Cholesky factors; inlined into the adaptive estimator."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_both import FAST
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents

HIGHEST = 6
"""The highest degree fitted."""

TERMS = 28
"""Coefficients of a polynomial of that degree."""

CAPACITY, ENOUGH = 352, 245
"""Most points gathered; balls of more than enough are shortened to hold about that many, for speed."""

STEEP = 0.64
"""Points whose height above the tangent plane exceeds 0.8 of their distance are left out; squared."""

MIN_SHARE = 0.5
"""Least squared ratio of a tangential coordinate to its chord, that of two points 90 degrees apart on a circle."""

QUADRIC_PASSES = 2
"""Quadrics fitted before the jet."""

ISOTROPIC = 1e-6
"""Difference of the principal second moments of points, relative to their sum, below which there are no axes."""

SINGULAR = np.repeat([1e-11, 1e-11, 1e-11, 3e-4, 2e-5, 1e-6, 3e-8], np.arange(1, 8))
"""Pivots below these shares of their diagonal entries: the points do not determine the coefficients of that degree.

Those of scattered points on one side of the center are at least ten times as large; on grids, with as many rows of
points as the degree or fewer, they are near zero."""

jit = njit(cache=True, error_model="numpy", fastmath=FAST)


@jit
def gathered(offsets, members, points, center, radius, stamps, stamp, found):
    """Fill `found` with the points connected to the center by edges in the ball, breadth first; return how many.

    Stops when `found` is full but for its last entry. Every point visited is written after those found, and kept by
    advancing the count if it is near, which takes no branch. Indices are unsigned: numba tests signed ones for
    negative values, which costs a sixth of the time here.
    """
    cx, cy, cz = points[center, 0], points[center, 1], points[center, 2]
    square = radius * radius
    stamps[center] = stamp
    found[0] = center
    count, k, most = 1, 0, found.shape[0] - 1
    while k < count:
        i = found[k]
        k += 1
        for m in range(offsets[i], offsets[i + 1]):
            j = members[m]
            if stamps[j] == stamp:
                continue
            stamps[j] = stamp
            x, y, z = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
            found[count] = j
            count += 1 if x * x + y * y + z * z <= square else 0
            if count == most:
                return count
    return count


@jit
def shortened(radius, count):
    """Return the radius within which about `ENOUGH` of the points of a ball lie."""
    return radius if count <= ENOUGH else radius * math.sqrt(ENOUGH / count)


@jit
def leaning(found, count, points, center, radius, nx, ny, nz):
    """Return the tangential distance of the points' mean from the center, in radii: 0.42 on a straight border."""
    x = y = z = 0.0
    for k in range(count):
        j = found[k]
        x += points[j, 0] - points[center, 0]
        y += points[j, 1] - points[center, 1]
        z += points[j, 2] - points[center, 2]
    height = nx * x + ny * y + nz * z
    return math.sqrt(max(x * x + y * y + z * z - height * height, 0.0)) / (count * radius)


@jit
def mean_direction(found, count, directions, center, oriented):
    """Return the unit mean of the points' directions that agree in side with the center's.

    Without orientation the others are reversed instead of left out.
    """
    sx = sy = sz = 0.0
    x, y, z = directions[center, 0], directions[center, 1], directions[center, 2]
    for k in range(count):
        j = found[k]
        sign = 1.0
        if x * directions[j, 0] + y * directions[j, 1] + z * directions[j, 2] < 0.0:
            if oriented:
                continue
            sign = -1.0
        sx += sign * directions[j, 0]
        sy += sign * directions[j, 1]
        sz += sign * directions[j, 2]
    length = math.sqrt(sx * sx + sy * sy + sz * sz)
    if length <= 1e-300:
        return 0.0, 0.0, 0.0
    return sx / length, sy / length, sz / length


@jit
def seen(found, count, points, directions, center, nx, ny, nz, oriented, radius, places):
    """Write the positions of the points to be fitted, relative to the center and in radii; return how many.

    Left out are points beyond the radius, points too steep above the plane, and points whose normal is reversed.
    """
    cx, cy, cz = points[center, 0], points[center, 1], points[center, 2]
    inverse = 1.0 / radius
    kept = 0
    for k in range(count):
        j = found[k]
        x, y, z = (points[j, 0] - cx) * inverse, (points[j, 1] - cy) * inverse, (points[j, 2] - cz) * inverse
        square = x * x + y * y + z * z
        height = nx * x + ny * y + nz * z
        along = nx * directions[j, 0] + ny * directions[j, 1] + nz * directions[j, 2]
        flat = (k == 0) | (height * height <= STEEP * square)
        places[0, kept], places[1, kept], places[2, kept] = x, y, z  # kept as in `gathered`
        kept += (square <= 1.0) & flat & ((along >= 0.0) | (not oriented))
    return kept


@jit
def framed(nx, ny, nz, frame):
    """Fill the rows u, v, n of the frame of a normal."""
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    frame[0, 0], frame[0, 1], frame[0, 2] = ux, uy, uz
    frame[1, 0], frame[1, 1], frame[1, 2] = vx, vy, vz
    frame[2, 0], frame[2, 1], frame[2, 2] = nx, ny, nz


@jit
def turned(frame, p, q, r, s, t):
    """Rotate a frame to the tangent plane of a graph of slopes p, q; the first axis stays in its vertical plane.

    Returns the second fundamental form in the new axes, from the second derivatives r, s, t in the old ones.
    """
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
    """Write the tangential coordinates and heights of positions in a frame."""
    for k in range(count):
        a, b, c = places[0, k], places[1, k], places[2, k]
        u[k] = a * frame[0, 0] + b * frame[0, 1] + c * frame[0, 2]
        v[k] = a * frame[1, 0] + b * frame[1, 1] + c * frame[1, 2]
        z[k] = a * frame[2, 0] + b * frame[2, 1] + c * frame[2, 2]


@jit
def aligned(u, v, count, frame):
    """Rotate coordinates and frame to the bisectors of the principal axes of the points, if these are elongated.

    Which terms such points determine, a row of them hardly any across, depends on the axes, and must not on the pose.
    It depends on the order of the axes too: points extend farther along the first, by fourth moments, inside out too.
    """
    a = b = c = 0.0
    for k in range(count):
        a += u[k] * u[k]
        b += u[k] * v[k]
        c += v[k] * v[k]
    if math.hypot(a - c, 2.0 * b) <= ISOTROPIC * (a + c):
        return
    turn = 0.5 * math.atan2(2.0 * b, a - c) + 0.25 * math.pi
    cosine, sine = math.cos(turn), math.sin(turn)
    a = c = 0.0
    for k in range(count):
        a += (cosine * u[k] + sine * v[k]) ** 4
        c += (cosine * v[k] - sine * u[k]) ** 4
    if c - a > ISOTROPIC * (a + c):
        cosine, sine = -sine, cosine
    for k in range(count):
        u[k], v[k] = cosine * u[k] + sine * v[k], cosine * v[k] - sine * u[k]
    for axis in range(3):
        x, y = frame[0, axis], frame[1, axis]
        frame[0, axis], frame[1, axis] = cosine * x + sine * y, cosine * y - sine * x


@jit
def chords(u, v, z, count, a, b, c):
    """Lengthen tangential coordinates to chords of a surface with the second fundamental form [[a, b], [b, c]].

    On a circle of curvature k the chord s to a point at height z above the tangent, u along it, is
    u / sqrt(1 - z k / 2), and z = k s^2 / 2: terms of higher degree nearly vanish, on spheres all of them.
    """
    turn = 0.5 * math.atan2(2.0 * b, a - c)
    cosine, sine = math.cos(turn), math.sin(turn)
    amplitude = math.sqrt(0.25 * (a - c) ** 2 + b * b)
    first, second = 0.25 * (a + c) + 0.5 * amplitude, 0.25 * (a + c) - 0.5 * amplitude
    for k in range(count):
        s, t = cosine * u[k] + sine * v[k], cosine * v[k] - sine * u[k]
        s /= math.sqrt(max(1.0 - first * z[k], MIN_SHARE))
        t /= math.sqrt(max(1.0 - second * z[k], MIN_SHARE))
        u[k], v[k] = cosine * s - sine * t, sine * s + cosine * t


@jit
def normal_equations(degree, u, v, z, count, columns, sums, matrix, right):
    """Fill A = X'X and b = X'z for all monomials up to the degree; return z'z. Every moment is summed once."""
    squares = 0.0
    for k in range(count):
        columns[0, 0, k] = 1.0
        squares += z[k] * z[k]
    term = 0
    for d in range(2 * degree + 1):
        now, before = d % 2, 1 - d % 2
        for i in range(d + 1):
            total = 0.0
            if d == 0:
                total = float(count)
            elif i < d:
                for k in range(count):
                    value = columns[before, i, k] * u[k]
                    columns[now, i, k] = value
                    total += value
            else:
                for k in range(count):
                    value = columns[before, i - 1, k] * v[k]
                    columns[now, i, k] = value
                    total += value
            sums[term] = total
            if d <= degree:
                total = 0.0
                for k in range(count):
                    total += columns[now, i, k] * z[k]
                right[term] = total
            term += 1
    row = 0
    for d in range(degree + 1):
        for i in range(d + 1):
            column = 0
            for e in range(d + 1):
                base = (d + e) * (d + e + 1) // 2 + i
                for j in range(e + 1):
                    if column <= row:
                        matrix[row, column] = sums[base + j]
                    column += 1
            row += 1
    return squares


@jit
def factored(matrix, right, terms, singular=SINGULAR):
    """Factor A = L L' and replace b by y = L^-1 b, in place; return how many leading terms are determined."""
    for row in range(terms):
        for column in range(row):
            total = matrix[row, column]
            for k in range(column):
                total -= matrix[row, k] * matrix[column, k]
            matrix[row, column] = total / matrix[column, column]
        whole = rest = matrix[row, row]
        total = right[row]
        for k in range(row):
            rest -= matrix[row, k] * matrix[row, k]
            total -= matrix[row, k] * right[k]
        if not rest > singular[row] * whole:
            return row
        matrix[row, row] = math.sqrt(rest)
        right[row] = total / matrix[row, row]
    return terms


@jit
def solved(matrix, y, terms, out):
    """Fill the coefficients L'^-1 y of the leading terms; fewer terms give the fit of a lower degree."""
    for row in range(terms - 1, -1, -1):
        total = y[row]
        for k in range(row + 1, terms):
            total -= matrix[k, row] * out[k]
        out[row] = total / matrix[row, row]


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
        out[row] = total / matrix[row, row] if row >= first else 0.0


@jit
def bending(x):
    """Return H and K of the graph z = x[0] + x[1] u + ... at the origin, for any slope (do Carmo 1976, 3-3).

    The outside is above, so a summit has H > 0.
    """
    p, q = x[1], x[2]
    r, s, t = 2.0 * x[3], x[4], 2.0 * x[5]
    g = 1.0 + p * p + q * q
    mean = -((1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t) / (2.0 * g * math.sqrt(g))
    return mean, (r * t - s * s) / (g * g)


@jit
def flattened(places, count, frame, u, v, z, columns, sums, matrix, y, x):
    """Rotate a frame to the tangent plane of a quadric fitted to positions, and use chords as coordinates.

    The fit is repeated in chords, as the first is biased by curvature. Returns whether a quadric is determined.
    """
    projected(places, count, frame, u, v, z)
    aligned(u, v, count, frame)
    for _pass in range(QUADRIC_PASSES):
        normal_equations(2, u, v, z, count, columns, sums, matrix, y)
        if factored(matrix, y, 6) < 6:
            return False
        solved(matrix, y, 6, x)
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
