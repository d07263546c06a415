"""Polynomials of high degree fitted to half-balls, in products of Legendre polynomials, which keep that stable."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface.curvature._kernels_adaptive_balls import collected, gathered, jit, seen, whole
from simplexmesh.surface.curvature._kernels_adaptive_blend import jet_curvatures
from simplexmesh.surface.curvature._kernels_adaptive_jets import bending, chords, factored, projected, solved

HIGHEST, TERMS = 10, 66
"""The highest degree fitted, and the coefficients of such a polynomial."""

CAPACITY = 300
"""Most points gathered."""

SINGULAR = np.full(TERMS, 1e-7)
"""Pivots below these shares of their diagonal entries: the points do not determine the coefficients."""

SHORTER, TRIES = 0.8, 12
"""A ball of more points is shortened by this factor, so often at most."""


@jit
def spanned(values, count):
    """Return the middle and half the extent of some coordinates."""
    low = high = 0.0  # the center's own
    for k in range(count):
        low, high = min(low, values[k]), max(high, values[k])
    return 0.5 * (low + high), max(0.5 * (high - low), 1e-300)


@jit
def rotated(u, v, count, frame):
    """Rotate coordinates and frame so that the first axis points to the mean of the points."""
    x = y = 0.0
    for k in range(count):
        x += u[k]
        y += v[k]
    length = math.hypot(x, y)
    cosine, sine = (x / length, y / length) if length > 0.0 else (1.0, 0.0)
    for k in range(count):
        u[k], v[k] = cosine * u[k] + sine * v[k], cosine * v[k] - sine * u[k]
    for axis in range(3):
        a, b = frame[0, axis], frame[1, axis]
        frame[0, axis], frame[1, axis] = cosine * a + sine * b, cosine * b - sine * a


@jit
def legendre(values, count, middle, half, degree, out):
    """Fill the Legendre polynomials of coordinates mapped to [-1, 1]: `out[i, k]` is P_i of value k.

    The rest of the last block is zero.
    """
    for k in range(count):
        out[0, k], out[1, k] = 1.0, (values[k] - middle) / half
    for k in range(count, whole(count)):
        out[0, k] = out[1, k] = 0.0
    for i in range(1, degree):
        a, b = (2.0 * i + 1.0) / (i + 1.0), i / (i + 1.0)
        for k in range(whole(count)):
            out[i + 1, k] = a * out[1, k] * out[i, k] - b * out[i - 1, k]


@jit
def derivatives(x, half, degree, out):
    """Fill `out[m, i]`, the m-th derivative, m up to 2, of P_i(x) by the coordinate whose unit is half an extent."""
    out[0, 0], out[1, 0], out[2, 0] = 1.0, 0.0, 0.0
    out[0, 1], out[1, 1], out[2, 1] = x, 1.0, 0.0
    for i in range(1, degree):
        a, b = (2.0 * i + 1.0) / (i + 1.0), i / (i + 1.0)
        for m in range(3):
            lower = m * out[m - 1, i] if m > 0 else 0.0
            out[m, i + 1] = a * (x * out[m, i] + lower) - b * out[m, i - 1]
    for i in range(degree + 1):
        out[1, i] /= half
        out[2, i] /= half * half


@jit
def normal_equations(terms, design, z, count, matrix, right):
    """Fill the lower half of A = X'X, and b = X'z."""
    for row in range(terms):
        for column in range(row + 1):
            total = 0.0
            for k in range(whole(count)):
                total += design[row, k] * design[column, k]
            matrix[row, column] = total
        total = 0.0
        for k in range(whole(count)):
            total += design[row, k] * z[k]
        right[row] = total


@jit
def substituted(matrix, terms, values):
    """Replace g by L^-1 g in place; the diagonal holds the reciprocals of that of L."""
    for row in range(terms):
        total = values[row]
        for k in range(row):
            total -= matrix[row, k] * values[k]
        values[row] = total * matrix[row, row]


@jit
def differentiated(u, v, z, count, degree, design, matrix, right, products, functionals):
    """Fit heights and fill L^-1 g of the derivatives p, q, r, s, t at the origin; return the terms determined.

    The derivatives of the fit with the leading terms are the products of these with `right`.
    """
    across, along = products[0], products[1]
    mx, hx = spanned(u, count)
    my, hy = spanned(v, count)
    legendre(u, count, mx, hx, degree, across)
    legendre(v, count, my, hy, degree, along)
    first, second = np.empty((3, HIGHEST + 1)), np.empty((3, HIGHEST + 1))
    derivatives(-mx / hx, hx, degree, first)
    derivatives(-my / hy, hy, degree, second)
    terms = 0
    for d in range(degree + 1):
        for j in range(d + 1):
            i = d - j
            for k in range(whole(count)):
                design[terms, k] = across[i, k] * along[j, k]
            functionals[0, terms] = first[1, i] * second[0, j]
            functionals[1, terms] = first[0, i] * second[1, j]
            functionals[2, terms] = first[2, i] * second[0, j]
            functionals[3, terms] = first[1, i] * second[1, j]
            functionals[4, terms] = first[0, i] * second[2, j]
            terms += 1
    normal_equations(terms, design, z, count, matrix, right)
    terms = factored(matrix, right, terms, SINGULAR)
    for g in range(5):
        substituted(matrix, terms, functionals[g])
    return terms


@jit
def summed(terms, functionals, right, x):
    """Fill the coefficients x[1] to x[5] of a quadric with the derivatives of the fit with the leading terms."""
    for g in range(5):
        total = 0.0
        for k in range(terms):
            total += functionals[g, k] * right[k]
        x[g + 1] = total
    x[3], x[5] = 0.5 * x[3], 0.5 * x[5]


@jit
def unstretched(k1, k2, d1, frame, x):
    """Replace the quadric in chords by that in tangential coordinates, which differ in second order at any slope.

    With z = p u + q v + ... the coordinates w are (1 - z A / 4) times the chords, A being the second derivatives of the
    quadric that these belong to. Without this H is off by about itself times the squared error of the normal.
    """
    c, s = 0.0, 0.0
    for axis in range(3):
        c += d1[axis] * frame[0, axis]
        s += d1[axis] * frame[1, axis]
    p, q = x[1], x[2]
    first, second = -k1 * (c * p + s * q), -k2 * (c * q - s * p)
    a, b = c * first - s * second, s * first + c * second
    x[3] += 0.25 * p * a
    x[4] += 0.25 * (p * b + q * a)
    x[5] += 0.25 * q * b


@jit
def amplification(terms, functionals):
    """Return the variance of H per variance of heights, of a fit of small slope."""
    total = 0.0
    for k in range(terms):
        total += (0.5 * (functionals[2, k] + functionals[4, k])) ** 2
    return total


@jit
def residual_sum(terms, design, z, count, coefficients, residuals):
    """Return the sum of the squared residuals."""
    for k in range(count):
        residuals[k] = z[k]
    for term in range(terms):
        for k in range(count):
            residuals[k] -= coefficients[term] * design[term, k]
    total = 0.0
    for k in range(count):
        total += residuals[k] * residuals[k]
    return total


@jit
def flattened(places, count, d1, normal, k1, k2, frame, heights):
    """Write coordinates in which a surface of these curvatures is nearly a quadric, and the frame they belong to.

    The heights of the rest of the last block are zero.
    """
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        frame[0, axis], frame[2, axis] = d1[axis], normal[axis]
        frame[1, axis] = normal[after] * d1[last] - normal[last] * d1[after]
    u, v, z = heights[0], heights[1], heights[2]
    projected(places, count, frame, u, v, z)
    chords(u, v, z, count, -k1, 0.0, -k2)
    rotated(u, v, count, frame)
    for k in range(count, whole(count)):
        z[k] = 0.0


@jit
def ordered(places, count, squares, out):
    """Write positions by their distance from the center."""
    for k in range(count):
        squares[k] = places[0, k] ** 2 + places[1, k] ** 2 + places[2, k] ** 2
    order = np.argsort(squares[:count])
    for k in range(count):
        for axis in range(3):
            out[axis, k] = places[axis, order[k]]


@jit
def ball(center, radius, offsets, members, points, directions, oriented, normal, stamps, stamp, found, work):
    """Write the positions of the points in a ball to `work[2]`, nearest first; return how many, radius and stamp."""
    count = CAPACITY
    for _try in range(TRIES):
        stamp += 1
        count = gathered(offsets, members, points, center, radius, stamps, stamp, found)
        if count < CAPACITY:
            break
        radius *= SHORTER
    nx, ny, nz = normal
    collected(found, count, points, directions, work[0])
    count = seen(work[0], count, nx, ny, nz, oriented, radius, work[1])
    ordered(work[1], count, work[3][0], work[2])
    return count, radius, stamp


@jit
def fitted(places, count, degree, d1, normal, k1, k2, radius, work, numbers, jet):
    """Fit a polynomial; write H of a degree less, H, squared residuals, H's variance per that of heights; a jet.

    All stay as they are where the points do not determine the fit.
    """
    heights, design, products, matrix, functionals, right, x, frame, coefficients = work[3:]
    flattened(places, count, d1, normal, k1 * radius, k2 * radius, frame, heights)
    u, v, z = heights[0], heights[1], heights[2]
    terms = differentiated(u, v, z, count, degree, design, matrix, right, products, functionals)
    if 2 * terms < (degree + 1) * (degree + 2):
        return
    summed(degree * (degree + 1) // 2, functionals, right, x)
    unstretched(k1 * radius, k2 * radius, d1, frame, x)
    numbers[0] = bending(x)[0] / radius
    summed(terms, functionals, right, x)
    unstretched(k1 * radius, k2 * radius, d1, frame, x)
    numbers[1] = bending(x)[0] / radius
    solved(matrix, right, terms, coefficients)
    numbers[2] = residual_sum(terms, design, z, count, coefficients, u) * radius**2
    numbers[3] = amplification(terms, functionals) / radius**4
    jet_curvatures(x, frame, jet)
    jet[0] /= radius
    jet[1] /= radius


@jit
def workspace():
    """Return the work arrays of a fit, in the order in which `fitted` names them, after three of positions."""
    width = whole(CAPACITY)
    design, products, matrix = np.empty((TERMS, width)), np.empty((2, HIGHEST + 1, width)), np.empty((TERMS, TERMS))
    small = np.empty((5, TERMS)), np.empty(TERMS), np.zeros(6), np.empty((3, 3)), np.empty(TERMS)
    positions = np.empty((6, width)), np.empty((3, width)), np.empty((3, width))
    return *positions, np.empty((3, width)), design, products, matrix, *small


def _high_degree_fits(
    centers, offsets, members, points, directions, oriented, radii, shape, d1, normals, fits, chunks, numbers, jets
):
    """Fit polynomials around centers: fit f has the degree `fits[f, 0]` and the nearest `fits[f, 1]` points.

    `shape`, `d1` and `normals` are what is known of the surface at the centers. `numbers[row, f]` and
    `jets[row, f]` are what `fitted` writes.
    """
    for chunk in prange(chunks):
        stamps, found, stamp = np.full(points.shape[0], -1, np.int32), np.empty(CAPACITY + 1, np.uint64), 0
        work = workspace()
        for row in range(chunk * centers.shape[0] // chunks, (chunk + 1) * centers.shape[0] // chunks):
            normal = normals[row, 0], normals[row, 1], normals[row, 2]
            around = offsets, members, points, directions, oriented
            count, radius, stamp = ball(centers[row], radii[row], *around, normal, stamps, stamp, found, work)
            for f in range(fits.shape[0]):
                if fits[f, 1] <= count:
                    known = d1[row], normals[row], shape[row, 0], shape[row, 1], radius
                    fitted(work[2], fits[f, 1], fits[f, 0], *known, work, numbers[row, f], jets[row, f])


high_degree_fits = Both(_high_degree_fits, pays_from=32)
