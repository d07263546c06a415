"""ExtendedSineFitting: the normal for which normal curvatures around a vertex have no part that turns once."""
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
"""Tilt of the normal that tells how the fit depends on it."""

LONGEST = 0.7
"""A step may tilt the normal by atan of this."""

SLOW = 0.3
"""A step that leaves more than this share of the residual shows that the slope is not what it was."""


@njit(cache=True, error_model="numpy")
def fit(arms, count, nx, ny, nz, table, right):
    """Fit k = a cos 2 t + b sin 2 t + c + d cos t + e sin t into `right`; return whether the directions tell (3.41).

    `arms` are the neighbors seen from the center, each over the square of its length; t runs from the first of
    `tangents`, and k is the curvature of the circle through both that the normal is normal to (2.39).
    """
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    table[:] = 0.0
    right[:] = 0.0
    seen = 0
    for m in range(count):
        x, y, z = arms[m, 0], arms[m, 1], arms[m, 2]
        u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
        flat = u * u + v * v
        if flat <= FLAT * (x * x + y * y + z * z):
            continue
        seen += 1
        length = math.sqrt(flat)
        u, v = u / length, v / length
        c, s, k = u * u - v * v, 2.0 * u * v, -2.0 * (nx * x + ny * y + nz * z)
        table[0, 0] += c * c
        table[1, 0] += c * s
        table[1, 1] += s * s
        table[2, 0] += c
        table[2, 1] += s
        table[3, 0] += c * u
        table[3, 1] += s * u
        table[3, 2] += u
        table[3, 3] += u * u
        table[4, 0] += c * v
        table[4, 1] += s * v
        table[4, 2] += v
        table[4, 3] += u * v
        table[4, 4] += v * v
        right[0] += k * c
        right[1] += k * s
        right[2] += k
        right[3] += k * u
        right[4] += k * v
    table[2, 2] = seen
    return seen >= 5 and solve(table, right, 5)


@njit(cache=True, error_model="numpy")
def reach_out(points, i, members, start, stop, arms):
    """Fill the neighbors seen from point i, over their squared lengths; return how many, and their mean distance."""
    count, total = 0, 0.0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        square = x * x + y * y + z * z
        if square > 0.0:
            arms[count, 0], arms[count, 1], arms[count, 2] = x / square, y / square, z / square
            count += 1
            total += math.sqrt(square)
    return count, total / max(count, 1)


@njit(cache=True, error_model="numpy")
def residual(arms, count, normal, base, table, right, out):
    """Fill d T + e (N x T) in the first two axes of `base`; return sqrt(d^2 + e^2), or -1 where there is no fit."""
    if not fit(arms, count, normal[0], normal[1], normal[2], table, right):
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
def rebase(base):
    """Fill two tangents in front of the normal in the last row."""
    ux, uy, uz, vx, vy, vz = tangents(base[2, 0], base[2, 1], base[2, 2])
    base[0, 0], base[0, 1], base[0, 2] = ux, uy, uz
    base[1, 0], base[1, 1], base[1, 2] = vx, vy, vz


@njit(cache=True, error_model="numpy")
def _slope(arms, count, base, now, then, trial, table, right, slope):
    """Fill how the residual `now` changes with small tilts along both tangents; return whether it can be told."""
    for axis in range(2):
        tilted(base, PROBE * (1 - axis), PROBE * axis, trial)
        if residual(arms, count, trial, base, table, right, then) < 0.0:
            return False
        slope[0, axis], slope[1, axis] = (then[0] - now[0]) / PROBE, (then[1] - now[1]) / PROBE
    return True


@njit(cache=True, error_model="numpy")
def _step(slope, now):
    """Return the tilt that takes the residual away if it is as linear as it looks, no longer than `LONGEST`."""
    det = slope[0, 0] * slope[1, 1] - slope[0, 1] * slope[1, 0]
    s = (slope[0, 1] * now[1] - slope[1, 1] * now[0]) / det
    t = (slope[1, 0] * now[0] - slope[0, 0] * now[1]) / det
    length = math.sqrt(s * s + t * t)
    return (s * LONGEST / length, t * LONGEST / length) if length > LONGEST else (s, t)


@njit(cache=True, error_model="numpy")
def by_newton(arms, count, distance, normal, tolerance, iterations, table, right):
    """Turn the normal until the residual is gone; return fits made, negative where it stayed.

    The slope is measured at the start and kept up to date by what the steps show (Broyden 1965); where they show
    little, it is measured anew.
    """
    base, slope, trial = np.zeros((3, 3)), np.zeros((2, 2)), np.zeros(3)
    now, then = np.zeros(2), np.zeros(2)
    base[2] = normal
    rebase(base)
    size = residual(arms, count, normal, base, table, right, now)
    fits, s, t, fresh = 1, 0.0, 0.0, False
    for _ in range(iterations):
        if size < 0.0:
            return -fits
        if 0.5 * distance * size <= tolerance:
            return fits
        if not fresh:
            base[2] = normal
            rebase(base)
            residual(arms, count, normal, base, table, right, now)
            fits += 3
            s, t, fresh = 0.0, 0.0, True
            if not _slope(arms, count, base, now, then, trial, table, right, slope):
                return -fits
        ds, dt = _step(slope, now)
        square = ds * ds + dt * dt
        if not 0.0 < square < 1.0:
            return -fits
        s, t, before = s + ds, t + dt, size
        tilted(base, s, t, normal)
        size = residual(arms, count, normal, base, table, right, then)
        fits, fresh = fits + 1, size <= SLOW * before
        for row in range(2):
            missed = (then[row] - now[row] - slope[row, 0] * ds - slope[row, 1] * dt) / square
            slope[row, 0] += missed * ds
            slope[row, 1] += missed * dt
        now[:] = then
    return -fits


@njit(cache=True, error_model="numpy")
def _leaning(normal, rx, ry, rz, angle, out):
    """Fill the normal turned by an angle away from the tangent (rx, ry, rz)."""
    c, s = math.cos(angle), math.sin(angle)
    out[0], out[1], out[2] = c * normal[0] - s * rx, c * normal[1] - s * ry, c * normal[2] - s * rz


@njit(cache=True, error_model="numpy")
def by_ternary_search(arms, count, distance, normal, tolerance, iterations, table, right):
    """Tilt the normal to where less is over-estimated, by the angle that leaves least; return fits as `by_newton`."""
    trial, fits = np.zeros(3), 0
    for _ in range(iterations):
        fits += 1
        if not fit(arms, count, normal[0], normal[1], normal[2], table, right):
            return -fits
        a, b, c, d, e = right[0], right[1], right[2], right[3], right[4]
        size = math.sqrt(d * d + e * e)
        if 0.5 * distance * size <= tolerance:
            return fits
        x, y = d / size, e / size
        even = a * (x * x - y * y) + 2.0 * b * x * y + c
        left, right_side = even - size, even + size  # curvatures at azimuth atan2(e, d), and opposite to it
        square = 2.0 * max(abs(left), abs(right_side)) ** 2
        high = math.atan((left - right_side) / (math.sqrt(square - left**2) + math.sqrt(square - right_side**2)))
        low = 0.0
        ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
        rx, ry, rz = x * ux + y * vx, x * uy + y * vy, x * uz + y * vz
        while abs(high - low) > 1e-12:
            one, other = low + (high - low) / 3, low + 2 * (high - low) / 3
            _leaning(normal, rx, ry, rz, one, trial)
            told = fit(arms, count, trial[0], trial[1], trial[2], table, right)
            first = right[3] ** 2 + right[4] ** 2 if told else math.inf
            _leaning(normal, rx, ry, rz, other, trial)
            told = fit(arms, count, trial[0], trial[1], trial[2], table, right)
            second = right[3] ** 2 + right[4] ** 2 if told else math.inf
            fits += 2
            if first <= second:
                high = other
            else:
                low = one
        _leaning(normal, rx, ry, rz, 0.5 * (low + high), trial)
        normal[:] = trial / math.sqrt(trial[0] ** 2 + trial[1] ** 2 + trial[2] ** 2)
    return -fits


@Both
def extended_sine(
    centers, offsets, members, points, start_normals, newton, tolerance, iterations, normals, fits, reasons
):
    """Fill the corrected normal per row, and how many fits it took; fewer than none where it did not settle."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        if stop - start < 5:
            reasons[row] = FEW
            continue
        arms, table, right, normal = np.zeros((stop - start, 3)), np.zeros((5, 5)), np.zeros(5), np.zeros(3)
        count, distance = reach_out(points, centers[row], members, start, stop, arms)
        normal[:] = start_normals[row]
        reasons[row] = DEGENERATE
        if count < 5 or not normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2 > 0.5:
            continue
        if newton:
            fits[row] = by_newton(arms, count, distance, normal, tolerance, iterations, table, right)
        else:
            fits[row] = by_ternary_search(arms, count, distance, normal, tolerance, iterations, table, right)
        along = 0.0
        for axis in range(3):
            along += normal[axis] * start_normals[row, axis]
        if fits[row] > 0 and along > 0.0:
            normals[row] = normal
            reasons[row] = FOUND
