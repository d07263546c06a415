"""ExtendedSineFitting: the normal for which the normal curvatures around a vertex have no first harmonic."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.normals._kernels_small import solve
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

FLAT = 1e-24
"""A neighbor whose projection is shorter than this share of its distance, squared, has no azimuth."""

PROBE = 1e-6
"""Tilt of the normal for finite differences."""

MAX_STEP = 0.7
"""Tangent of the largest tilt in one step."""

SLOW = 0.3
"""After a step that leaves more than this share of the first harmonic the Jacobian is measured anew."""


@njit(cache=True, error_model="numpy")
def fit(edges, count, nx, ny, nz, matrix, right):
    """Fit k = a cos 2 t + b sin 2 t + c + d cos t + e sin t into `right` (3.41); return False where it is singular.

    `edges` are the vectors to the neighbors over their squared lengths; t is the azimuth from the first of `tangents`,
    and k the curvature of the circle through center and neighbor that is tangent to the surface (2.39).
    """
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    matrix[:] = 0.0
    right[:] = 0.0
    seen = 0
    for m in range(count):
        x, y, z = edges[m, 0], edges[m, 1], edges[m, 2]
        u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
        flat = u * u + v * v
        if flat <= FLAT * (x * x + y * y + z * z):
            continue
        seen += 1
        length = math.sqrt(flat)
        u, v = u / length, v / length
        c, s, k = u * u - v * v, 2.0 * u * v, -2.0 * (nx * x + ny * y + nz * z)
        matrix[0, 0] += c * c
        matrix[1, 0] += c * s
        matrix[1, 1] += s * s
        matrix[2, 0] += c
        matrix[2, 1] += s
        matrix[3, 0] += c * u
        matrix[3, 1] += s * u
        matrix[3, 2] += u
        matrix[3, 3] += u * u
        matrix[4, 0] += c * v
        matrix[4, 1] += s * v
        matrix[4, 2] += v
        matrix[4, 3] += u * v
        matrix[4, 4] += v * v
        right[0] += k * c
        right[1] += k * s
        right[2] += k
        right[3] += k * u
        right[4] += k * v
    matrix[2, 2] = seen
    return seen >= 5 and solve(matrix, right, 5)


@njit(cache=True, error_model="numpy")
def inverted_edges(points, i, members, start, stop, edges):
    """Fill the vectors from point i to neighbors over their squared lengths; return how many, and the mean distance."""
    count, total = 0, 0.0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        square = x * x + y * y + z * z
        if square > 0.0:
            edges[count, 0], edges[count, 1], edges[count, 2] = x / square, y / square, z / square
            count += 1
            total += math.sqrt(square)
    return count, total / max(count, 1)


@njit(cache=True, error_model="numpy")
def first_harmonic(edges, count, normal, base, matrix, right, out):
    """Fill d T + e (N x T) in the first two rows of `base`; return sqrt(d^2 + e^2), or -1 where there is no fit."""
    if not fit(edges, count, normal[0], normal[1], normal[2], matrix, right):
        return -1.0
    d, e = right[3], right[4]
    ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
    x, y, z = d * ux + e * vx, d * uy + e * vy, d * uz + e * vz
    out[0] = x * base[0, 0] + y * base[0, 1] + z * base[0, 2]
    out[1] = x * base[1, 0] + y * base[1, 1] + z * base[1, 2]
    return math.sqrt(d * d + e * e)


@njit(cache=True, error_model="numpy")
def tilted(base, s, t, out):
    """Fill the unit vector along base_2 + s base_0 + t base_1."""
    for axis in range(3):
        out[axis] = base[2, axis] + s * base[0, axis] + t * base[1, axis]
    out /= math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])


@njit(cache=True, error_model="numpy")
def set_tangents(base):
    """Fill the first two rows with tangents of the normal in the last."""
    ux, uy, uz, vx, vy, vz = tangents(base[2, 0], base[2, 1], base[2, 2])
    base[0, 0], base[0, 1], base[0, 2] = ux, uy, uz
    base[1, 0], base[1, 1], base[1, 2] = vx, vy, vz


@njit(cache=True, error_model="numpy")
def _jacobian(edges, count, base, now, then, trial, matrix, right, jacobian):
    """Fill the Jacobian of the first harmonic `now` for tilts along both tangents; return False without a fit."""
    for axis in range(2):
        tilted(base, PROBE * (1 - axis), PROBE * axis, trial)
        if first_harmonic(edges, count, trial, base, matrix, right, then) < 0.0:
            return False
        jacobian[0, axis], jacobian[1, axis] = (then[0] - now[0]) / PROBE, (then[1] - now[1]) / PROBE
    return True


@njit(cache=True, error_model="numpy")
def _step(jacobian, now):
    """Return the Newton step, no longer than `MAX_STEP`."""
    det = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
    s = (jacobian[0, 1] * now[1] - jacobian[1, 1] * now[0]) / det
    t = (jacobian[1, 0] * now[0] - jacobian[0, 0] * now[1]) / det
    length = math.sqrt(s * s + t * t)
    return (s * MAX_STEP / length, t * MAX_STEP / length) if length > MAX_STEP else (s, t)


@njit(cache=True, error_model="numpy")
def by_newton(edges, count, distance, normal, tolerance, iterations, matrix, right):
    """Tilt the normal until the first harmonic vanishes; return the number of fits, negative without convergence.

    The Jacobian comes from finite differences and is updated after each step (Broyden 1965), or measured anew after
    steps that gain little.
    """
    base, jacobian, trial = np.zeros((3, 3)), np.zeros((2, 2)), np.zeros(3)
    now, then = np.zeros(2), np.zeros(2)
    base[2] = normal
    set_tangents(base)
    size = first_harmonic(edges, count, normal, base, matrix, right, now)
    fits, s, t, fresh = 1, 0.0, 0.0, False
    for _ in range(iterations):
        if size < 0.0:
            return -fits
        if 0.5 * distance * size <= tolerance:
            return fits
        if not fresh:
            base[2] = normal
            set_tangents(base)
            first_harmonic(edges, count, normal, base, matrix, right, now)
            fits += 3
            s, t, fresh = 0.0, 0.0, True
            if not _jacobian(edges, count, base, now, then, trial, matrix, right, jacobian):
                return -fits
        ds, dt = _step(jacobian, now)
        square = ds * ds + dt * dt
        if not 0.0 < square < 1.0:
            return -fits
        s, t, before = s + ds, t + dt, size
        tilted(base, s, t, normal)
        size = first_harmonic(edges, count, normal, base, matrix, right, then)
        fits, fresh = fits + 1, size <= SLOW * before
        for row in range(2):
            error = (then[row] - now[row] - jacobian[row, 0] * ds - jacobian[row, 1] * dt) / square
            jacobian[row, 0] += error * ds
            jacobian[row, 1] += error * dt
        now[:] = then
    return -fits


@njit(cache=True, error_model="numpy")
def _rotated(normal, rx, ry, rz, angle, out):
    """Fill the normal rotated by an angle away from the tangent (rx, ry, rz)."""
    c, s = math.cos(angle), math.sin(angle)
    out[0], out[1], out[2] = c * normal[0] - s * rx, c * normal[1] - s * ry, c * normal[2] - s * rz


@njit(cache=True, error_model="numpy")
def by_ternary_search(edges, count, distance, normal, tolerance, iterations, matrix, right):
    """Tilt the normal along (d, e) by the angle that minimizes d^2 + e^2, repeatedly; return fits as `by_newton`."""
    trial, fits = np.zeros(3), 0
    for _ in range(iterations):
        fits += 1
        if not fit(edges, count, normal[0], normal[1], normal[2], matrix, right):
            return -fits
        a, b, c, d, e = right[0], right[1], right[2], right[3], right[4]
        size = math.sqrt(d * d + e * e)
        if 0.5 * distance * size <= tolerance:
            return fits
        x, y = d / size, e / size
        mean = a * (x * x - y * y) + 2.0 * b * x * y + c
        left_k, right_k = mean - size, mean + size  # curvatures at azimuth atan2(e, d), and opposite to it
        square = 2.0 * max(abs(left_k), abs(right_k)) ** 2
        high = math.atan((left_k - right_k) / (math.sqrt(square - left_k**2) + math.sqrt(square - right_k**2)))
        low = 0.0
        ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
        rx, ry, rz = x * ux + y * vx, x * uy + y * vy, x * uz + y * vz
        while abs(high - low) > 1e-12:
            one, other = low + (high - low) / 3, low + 2 * (high - low) / 3
            _rotated(normal, rx, ry, rz, one, trial)
            solved = fit(edges, count, trial[0], trial[1], trial[2], matrix, right)
            first = right[3] ** 2 + right[4] ** 2 if solved else math.inf
            _rotated(normal, rx, ry, rz, other, trial)
            solved = fit(edges, count, trial[0], trial[1], trial[2], matrix, right)
            second = right[3] ** 2 + right[4] ** 2 if solved else math.inf
            fits += 2
            if first <= second:
                high = other
            else:
                low = one
        _rotated(normal, rx, ry, rz, 0.5 * (low + high), trial)
        normal[:] = trial / math.sqrt(trial[0] ** 2 + trial[1] ** 2 + trial[2] ** 2)
    return -fits


@Both
def extended_sine(
    centers, offsets, members, points, start_normals, newton, tolerance, iterations, normals, fits, reasons
):
    """Fill the corrected normal per row, and the number of fits, negative without convergence."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        if stop - start < 5:
            reasons[row] = FEW
            continue
        edges, matrix, right, normal = np.zeros((stop - start, 3)), np.zeros((5, 5)), np.zeros(5), np.zeros(3)
        count, distance = inverted_edges(points, centers[row], members, start, stop, edges)
        normal[:] = start_normals[row]
        reasons[row] = DEGENERATE
        if count < 5 or not normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2 > 0.5:
            continue
        if newton:
            fits[row] = by_newton(edges, count, distance, normal, tolerance, iterations, matrix, right)
        else:
            fits[row] = by_ternary_search(edges, count, distance, normal, tolerance, iterations, matrix, right)
        along = 0.0
        for axis in range(3):
            along += normal[axis] * start_normals[row, axis]
        if fits[row] > 0 and along > 0.0:
            normals[row] = normal
            reasons[row] = FOUND
