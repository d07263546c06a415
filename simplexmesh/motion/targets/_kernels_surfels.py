"""Robust quadratic fits to the points around a place, at one scale or at many.

A surfel is a row of numbers: 0-2 a point on the fit, 3-5 its unit normal, 6-11 the second-order form Q as
(xx, yy, zz, xy, xz, yz), so that ``normal . d - d' Q d / 2`` is the height of ``point + d`` above the fit. A report is
a row too: OFFSET of the fit along its normal from the place asked about, its VARIANCE, the NOISE of the points along the
normal, their number COUNT, and LEAN, the tangential distance of their center over the radius (large at a border).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from simplexmesh.motion.targets._kernels_tree import within

OFFSET, VARIANCE, NOISE, COUNT, LEAN = range(5)
MOST = 2048  # points of one fit; beyond that every second, third... is taken
RATIO = math.sqrt(2.0)  # from one scale to the next
FLOOR = 0.04  # part of a known error's variance that no direction escapes


@njit(cache=True, error_model="numpy")
def smallest_axis(c, axis):
    """Fill `axis` with the unit eigenvector of the smallest eigenvalue of the symmetric (3, 3) matrix `c`."""
    values, vectors = np.linalg.eigh(c)
    for a in range(3):
        axis[a] = vectors[a, 0]
    return values[0], values[1], values[2]


@njit(cache=True, error_model="numpy")
def solve(m, size, rhs, first):
    """Solve in place by Cholesky: `m` (6, 6) becomes its factor, `rhs` the solution, `first` = inverse of m, column 0.

    Returns False where the matrix is not safely positive.
    """
    for j in range(size):
        d = m[j, j]
        scale = d
        for k in range(j):
            d -= m[j, k] * m[j, k]
        if not d > 1e-9 * scale or scale <= 0.0:
            return False
        d = math.sqrt(d)
        m[j, j] = d
        for i in range(j + 1, size):
            s = m[i, j]
            for k in range(j):
                s -= m[i, k] * m[j, k]
            m[i, j] = s / d
    for i in range(size):
        first[i] = 1.0 if i == 0 else 0.0
        for k in range(i):
            rhs[i] -= m[i, k] * rhs[k]
            first[i] -= m[i, k] * first[k]
        rhs[i] /= m[i, i]
        first[i] /= m[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            rhs[i] -= m[k, i] * rhs[k]
            first[i] -= m[k, i] * first[k]
        rhs[i] /= m[i, i]
        first[i] /= m[i, i]
    return True


@njit(cache=True, error_model="numpy")
def _median(values, count):
    """Return the median of ``values[:count]``, which is reordered."""
    left, right, middle = 0, count - 1, count // 2
    while left < right:
        pivot = values[(left + right) // 2]
        i, j = left, right
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            break
    return values[middle]


@njit(cache=True, error_model="numpy")
def plane_normal(points, members, count, x, y, z, radius, normal):
    """Fill `normal` with that of the plane of the members, weighted towards the place."""
    w0 = mx = my = mz = 0.0
    limit = 1.0 / (radius * radius)
    for m in range(count):
        p = members[m]
        dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
        w = max(1.0 - (dx * dx + dy * dy + dz * dz) * limit, 0.02)
        w0 += w
        mx += w * dx
        my += w * dy
        mz += w * dz
    mx, my, mz = mx / w0, my / w0, mz / w0
    c = np.zeros((3, 3))
    for m in range(count):
        p = members[m]
        dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
        w = max(1.0 - (dx * dx + dy * dy + dz * dz) * limit, 0.02)
        dx, dy, dz = dx - mx, dy - my, dz - mz
        c[0, 0] += w * dx * dx
        c[1, 1] += w * dy * dy
        c[2, 2] += w * dz * dz
        c[0, 1] += w * dx * dy
        c[0, 2] += w * dx * dz
        c[1, 2] += w * dy * dz
    c[1, 0], c[2, 0], c[2, 1] = c[0, 1], c[0, 2], c[1, 2]
    total = c[0, 0] + c[1, 1] + c[2, 2]
    if total > 0.0:
        c /= total
    smallest_axis(c, normal)


@njit(cache=True, error_model="numpy")
def fit(points, spread, members, count, radius, robust, surfel, report, heights):
    """Fit a quadric to the members around `surfel` (its point and normal are the start), in place; False if none fits.

    `spread` (n, 3) or (0, 3): one standard deviation of each point's error, which lies along one known direction;
    members are then weighted by the inverse variance along the normal. Weights fall as 1 - t^2 with the tangential
    distance t in radii; `robust` passes use Tukey's weights besides. The frame follows the fit from pass to pass.
    """
    m = np.zeros((6, 6))
    rhs = np.zeros(6)
    first = np.zeros(6)
    row = np.zeros(6)
    u = np.zeros(3)
    v = np.zeros(3)
    known = len(spread) > 0
    tangents(surfel[3], surfel[4], surfel[5], u, v)
    start0, start1, start2 = surfel[0], surfel[1], surfel[2]
    scale = math.inf
    size = 6
    inverse = 1.0 / radius
    a0 = a1 = a2 = a3 = a4 = a5 = 0.0
    for turn in range(robust + 1):
        cx, cy, cz, nx, ny, nz = surfel[0], surfel[1], surfel[2], surfel[3], surfel[4], surfel[5]
        m[:] = 0.0
        rhs[:] = 0.0
        used = 0
        weight_sum = weight_squares = lean_u = lean_v = 0.0
        for i in range(count):
            p = members[i]
            dx, dy, dz = points[p, 0] - cx, points[p, 1] - cy, points[p, 2] - cz
            s = (dx * u[0] + dy * u[1] + dz * u[2]) * inverse
            t = (dx * v[0] + dy * v[1] + dz * v[2]) * inverse
            w = 1.0 - s * s - t * t
            if w <= 0.0:
                continue
            h = (dx * nx + dy * ny + dz * nz) * inverse
            if turn > 0:
                # the old fit, in the new frame, is what a first-order change of frame leaves: its second order
                r = (h - 0.5 * (a3 * s * s + 2.0 * a4 * s * t + a5 * t * t)) / scale
                r = 1.0 - r * r
                if r <= 0.0:
                    continue
                w *= r * r
            elif abs(h) > 1.0:
                continue
            if known:
                e = (spread[p, 0] * nx + spread[p, 1] * ny + spread[p, 2] * nz) * inverse
                whole = (spread[p, 0] ** 2 + spread[p, 1] ** 2 + spread[p, 2] ** 2) * inverse * inverse
                w *= whole / (e * e + FLOOR * whole)
            used += 1
            weight_sum += w
            weight_squares += w * w
            lean_u += w * s
            lean_v += w * t
            row[0], row[1], row[2], row[3], row[4], row[5] = 1.0, s, t, 0.5 * s * s, s * t, 0.5 * t * t
            for j in range(6):
                wj = w * row[j]
                rhs[j] += wj * h
                for k in range(j + 1):
                    m[j, k] += wj * row[k]
        size = 6 if used >= 9 else 3
        if used < 3:
            return False
        m00, m11, m22 = m[0, 0], m[1, 1], m[2, 2]
        m10, m20, m21 = m[1, 0], m[2, 0], m[2, 1]
        r0, r1, r2 = rhs[0], rhs[1], rhs[2]
        if size == 3 or not solve(m, 6, rhs, first):
            size = 3
            m[0, 0], m[1, 1], m[2, 2], m[1, 0], m[2, 0], m[2, 1] = m00, m11, m22, m10, m20, m21
            rhs[0], rhs[1], rhs[2] = r0, r1, r2
            if not solve(m, 3, rhs, first):
                return False
            rhs[3] = rhs[4] = rhs[5] = 0.0
            first[3] = first[4] = first[5] = 0.0
        a0, a1, a2, a3, a4, a5 = rhs[0], rhs[1], rhs[2], rhs[3], rhs[4], rhs[5]
        if not (abs(a0) < 1.5 and abs(a1) < 2.0 and abs(a2) < 2.0):
            return False
        # residuals: their size, and the variance of the height at the center they cause
        n = 0
        squares = gain = weights = 0.0
        for i in range(count):
            p = members[i]
            dx, dy, dz = points[p, 0] - cx, points[p, 1] - cy, points[p, 2] - cz
            s = (dx * u[0] + dy * u[1] + dz * u[2]) * inverse
            t = (dx * v[0] + dy * v[1] + dz * v[2]) * inverse
            w = 1.0 - s * s - t * t
            if w <= 0.0:
                continue
            h = (dx * nx + dy * ny + dz * nz) * inverse
            r = h - a0 - a1 * s - a2 * t - 0.5 * a3 * s * s - a4 * s * t - 0.5 * a5 * t * t
            if turn == 0:
                if abs(h) <= 1.0:
                    heights[n] = abs(r)
                    n += 1
                continue
            q = r / scale
            q = 1.0 - q * q
            if q <= 0.0:
                continue
            squares += q * q * r * r
            weights += q * q
            w *= q * q
            if known:
                e = (spread[p, 0] * nx + spread[p, 1] * ny + spread[p, 2] * nz) * inverse
                whole = (spread[p, 0] ** 2 + spread[p, 1] ** 2 + spread[p, 2] ** 2) * inverse * inverse
                w *= whole / (e * e + FLOOR * whole)
                g = w * (
                    first[0]
                    + first[1] * s
                    + first[2] * t
                    + 0.5 * first[3] * s * s
                    + first[4] * s * t
                    + 0.5 * first[5] * t * t
                )
                gain += g * g * (e * e + FLOOR * whole)
            else:
                g = w * (
                    first[0]
                    + first[1] * s
                    + first[2] * t
                    + 0.5 * first[3] * s * s
                    + first[4] * s * t
                    + 0.5 * first[5] * t * t
                )
                gain += g * g
            n += 1
        free = max(n - size, 1) / max(n, 1)
        if turn == 0:
            sigma = 1.4826 * _median(heights, n) / free
            scale = 4.685 * max(sigma, 1e-6)
        else:
            sigma = math.sqrt(1.25 * squares / max(weights, 1e-300) / free)  # Tukey's weights cut 20 % of a Gaussian
            scale = 4.685 * max(sigma, 1e-6)
        # the frame follows the fit
        length = 1.0 / math.sqrt(1.0 + a1 * a1 + a2 * a2)
        for k in range(3):
            surfel[k] += radius * a0 * surfel[3 + k]
        for k in range(3):
            surfel[3 + k] = (surfel[3 + k] - a1 * u[k] - a2 * v[k]) * length
        turn_frame(surfel, u, v)
        report[NOISE] = sigma * radius
        report[VARIANCE] = gain * radius * radius if known else gain * sigma * sigma * radius * radius
        report[COUNT] = n
        report[LEAN] = math.sqrt(lean_u * lean_u + lean_v * lean_v) / weight_sum
    report[OFFSET] = (
        (surfel[0] - start0) * surfel[3] + (surfel[1] - start1) * surfel[4] + (surfel[2] - start2) * surfel[5]
    )
    a3, a4, a5 = a3 * inverse * length, a4 * inverse * length, a5 * inverse * length
    place = 6
    for j in range(3):
        surfel[place + j] = a3 * u[j] * u[j] + 2.0 * a4 * u[j] * v[j] + a5 * v[j] * v[j]
    surfel[9] = a3 * u[0] * u[1] + a4 * (u[0] * v[1] + u[1] * v[0]) + a5 * v[0] * v[1]
    surfel[10] = a3 * u[0] * u[2] + a4 * (u[0] * v[2] + u[2] * v[0]) + a5 * v[0] * v[2]
    surfel[11] = a3 * u[1] * u[2] + a4 * (u[1] * v[2] + u[2] * v[1]) + a5 * v[1] * v[2]
    return True


@njit(cache=True, error_model="numpy")
def tangents(nx, ny, nz, u, v):
    """Fill two unit vectors that make a right-handed frame with the unit normal (Duff and others, 2017)."""
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    u[0], u[1], u[2] = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
    v[0], v[1], v[2] = b, sign + ny * ny * a, -ny


@njit(cache=True, error_model="numpy")
def turn_frame(surfel, u, v):
    """Turn the tangents `u`, `v` the least that makes them perpendicular to the surfel's normal."""
    nx, ny, nz = surfel[3], surfel[4], surfel[5]
    d = u[0] * nx + u[1] * ny + u[2] * nz
    u[0] -= d * nx
    u[1] -= d * ny
    u[2] -= d * nz
    length = 1.0 / math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    u[0] *= length
    u[1] *= length
    u[2] *= length
    v[0], v[1], v[2] = ny * u[2] - nz * u[1], nz * u[0] - nx * u[2], nx * u[1] - ny * u[0]


@njit(cache=True, error_model="numpy")
def gather(points, normals, starts, ends, boxes, place, facing, radius, members, stack):
    """Fill `members` with the points within `radius` of `place` that face the same way; return how many."""
    x, y, z = place[0], place[1], place[2]
    count = within(points, starts, ends, boxes, x, y, z, radius, 1, members, stack)
    if count > len(members):
        stride = (count + len(members) - 1) // len(members)
        within(points, starts, ends, boxes, x, y, z, radius, stride, members, stack)
        count = (count + stride - 1) // stride
    if len(normals) == 0:
        return count
    kept = 0
    for i in range(count):
        p = members[i]
        if normals[p, 0] * facing[0] + normals[p, 1] * facing[1] + normals[p, 2] * facing[2] > 0.0:
            members[kept] = p
            kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def begin(points, normals, members, count, radius, facing, surfel):
    """Point `surfel`'s normal along that of the plane of the members, the way `facing` does where that is known."""
    plane_normal(points, members, count, surfel[0], surfel[1], surfel[2], radius, surfel[3:6])
    if len(normals) > 0:
        if surfel[3] * facing[0] + surfel[4] * facing[1] + surfel[5] * facing[2] < 0.0:
            surfel[3], surfel[4], surfel[5] = -surfel[3], -surfel[4], -surfel[5]


@njit(cache=True, error_model="numpy", parallel=True)
def fit_scales(points, normals, spread, starts, ends, boxes, centers, bases, largest, table):
    """Fill `table` (m, levels, 5) with the reports of fits around ``points[centers]`` at radii ``base RATIO^level``.

    NaN where there is no fit: too few points, a radius above `largest`, too curved for a height field, or clearly
    another surface than the scale before (6 standard deviations).
    """
    for c in prange(len(centers)):
        stack = np.empty(96, np.int64)
        members = np.empty(MOST, np.int64)
        heights = np.empty(MOST)
        surfel = np.zeros(12)
        before = np.zeros(12)
        report = np.zeros(5)
        place = points[centers[c]]
        facing = normals[centers[c]] if len(normals) > 0 else place
        surfel[:3] = place
        begun = False
        failures = 0
        last_variance = math.inf
        noise = 0.0
        table[c] = math.nan
        for level in range(table.shape[1]):
            radius = bases[c] * RATIO**level
            if radius > largest:
                break
            reach = min(math.sqrt(radius * radius + 12.0 * noise * noise), 1.5 * radius)
            count = gather(
                points, normals, starts, ends, boxes, surfel[:3] if begun else place, facing, reach, members, stack
            )
            if count >= MOST - 1 and level > 0:
                break
            before[:] = surfel
            if not begun:
                if count < 6:
                    continue
                begin(points, normals, members, count, radius, facing, surfel)
            if not fit(points, spread, members, count, radius, 2, surfel, report, heights):
                surfel[:] = before
                continue
            resolved = radius > 3.0 * report[NOISE]
            if begun and resolved:
                doubt = max(last_variance - report[VARIANCE], 0.25 * last_variance)
                if report[OFFSET] ** 2 > 36.0 * doubt and report[OFFSET] ** 2 > 1e-12 * radius * radius:
                    failures += 1
                    if failures > 1:
                        break
            bend = abs(surfel[6]) + abs(surfel[7]) + abs(surfel[8])
            if bend * radius > 1.5:
                break
            table[c, level] = report
            noise = report[NOISE]
            if resolved:
                if not begun:
                    table[c, level, OFFSET] = math.nan
                begun = True
                last_variance = report[VARIANCE]
            else:
                table[c, level, OFFSET] = math.nan
                surfel[:] = before
                if not begun:
                    surfel[:3] = place


@njit(cache=True, error_model="numpy", parallel=True)
def fit_all(points, normals, spread, starts, ends, boxes, centers, radii, isotropic, surfels, reports):
    """Fill `surfels` (m, 12) and `reports` (m, 5), one fit around each of ``points[centers]`` at its radius; NaN if none.

    A smaller fit, half the radius, comes first; where the two clearly disagree the smaller one stays. `isotropic`
    errors of standard deviation s bend the mean height of a surface inwards by s^2 (k1 + k2) / 2: taken back.
    """
    for c in prange(len(centers)):
        stack = np.empty(96, np.int64)
        members = np.empty(MOST, np.int64)
        heights = np.empty(MOST)
        surfel = np.zeros(12)
        before = np.zeros(12)
        report = np.zeros(5)
        report_before = np.zeros(5)
        place = points[centers[c]]
        facing = normals[centers[c]] if len(normals) > 0 else place
        radius = radii[c]
        surfels[c] = math.nan
        reports[c] = math.nan
        count = gather(points, normals, starts, ends, boxes, place, facing, 1.2 * radius, members, stack)
        if count < 3:
            continue
        surfel[:3] = place
        begin(points, normals, members, count, radius, facing, surfel)
        before[:] = surfel
        if not fit(points, spread, members, count, radius, 2, surfel, report, heights):
            continue
        # once more around the point found: the first place was off the surface by its own error
        reach = min(math.sqrt(radius * radius + 12.0 * report[NOISE] ** 2), 1.5 * radius)
        count = gather(points, normals, starts, ends, boxes, surfel[:3], facing, reach, members, stack)
        before[:] = surfel
        report_before[:] = report
        if not fit(points, spread, members, count, radius, 2, surfel, report, heights):
            surfel[:] = before
            report[:] = report_before
        report[OFFSET] = (
            (place[0] - surfel[0]) * surfel[3] + (place[1] - surfel[1]) * surfel[4] + (place[2] - surfel[2]) * surfel[5]
        )
        if isotropic:
            shift = 0.5 * report[NOISE] ** 2 * (surfel[6] + surfel[7] + surfel[8])
            shift = max(-0.5 * report[NOISE], min(0.5 * report[NOISE], shift))
            for k in range(3):
                surfel[k] -= shift * surfel[3 + k]
        surfels[c] = surfel
        reports[c] = report
