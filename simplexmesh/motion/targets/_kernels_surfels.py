"""Surfels: robust quadratic fits around many places, at one or many scales; see `_kernels_fit` for their rows."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_algebra import plane_normal
from simplexmesh.motion.targets._kernels_fit import COUNT, CURVATURE, NOISE, OFFSET, VARIANCE, fit
from simplexmesh.motion.targets._kernels_tree import within

MAX_POINTS = 2048  # per fit; larger neighborhoods are subsampled
MIN_COSINE = 0.3  # between the normals of points on one surface
RATIO = math.sqrt(2.0)  # of successive scales
MIN_ROUNDNESS = 0.2  # minimum second moment across a row of points relative to that along it


@njit(cache=True, error_model="numpy")
def gather(points, normals, starts, ends, boxes, place, facing, radius, members, stack):
    """Fill `members` with the points within `radius` of `place` that face the same way; return their number."""
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
        if normals[p, 0] * facing[0] + normals[p, 1] * facing[1] + normals[p, 2] * facing[2] > MIN_COSINE:
            members[kept] = p
            kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def initialize_normal(points, normals, members, count, radius, facing, surfel):
    """Set the surfel's normal from a plane fit to the members, oriented along `facing` if the points have normals."""
    plane_normal(points, members, count, surfel[0], surfel[1], surfel[2], radius, surfel[3:6])
    if len(normals) > 0 and surfel[3] * facing[0] + surfel[4] * facing[1] + surfel[5] * facing[2] < 0.0:
        surfel[3], surfel[4], surfel[5] = -surfel[3], -surfel[4], -surfel[5]


@njit(cache=True, error_model="numpy", parallel=True)
def fit_scales(points, normals, spread, starts, ends, boxes, centers, bases, largest, table):
    """Fill `table` (m, levels, 6) with the reports of fits around ``points[centers]`` at radii ``base RATIO^level``.

    NaN where there is no fit: too few points, a radius above `largest`, a curvature too large for a height field, or a
    jump from the previous scale of more than 6 standard deviations.
    """
    for c in prange(len(centers)):
        stack = np.empty(96, np.int64)
        members = np.empty(MAX_POINTS, np.int64)
        work = np.empty((6, MAX_POINTS))
        surfel = np.zeros(12)
        before = np.zeros(12)
        report = np.zeros(6)
        place = points[centers[c]]
        facing = normals[centers[c]] if len(normals) > 0 else place
        surfel[:3] = place
        initialized = False
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
                points,
                normals,
                starts,
                ends,
                boxes,
                surfel[:3] if initialized else place,
                facing,
                reach,
                members,
                stack,
            )
            if count >= MAX_POINTS - 1 and level > 0:
                break
            before[:] = surfel
            if not initialized:
                if count < 6:
                    continue
                initialize_normal(points, normals, members, count, radius, facing, surfel)
            iterations, prior = (1, 2.5 * noise) if initialized else (2, 0.0)
            if not fit(points, spread, members, count, radius, iterations, prior, surfel, report, work):
                surfel[:] = before
                continue
            resolved = radius > 3.0 * report[NOISE]
            if initialized and resolved:
                doubt = max(last_variance - report[VARIANCE], 0.25 * last_variance)
                if report[OFFSET] ** 2 > 36.0 * doubt and report[OFFSET] ** 2 > 1e-12 * radius * radius:
                    failures += 1
                    if failures > 1:
                        break
            if report[CURVATURE] * radius > 1.5:
                break
            table[c, level] = report
            noise = report[NOISE]
            if resolved:
                if not initialized:
                    table[c, level, OFFSET] = math.nan
                initialized = True
                last_variance = report[VARIANCE]
            else:
                table[c, level, OFFSET] = math.nan
                surfel[:] = before
                if not initialized:
                    surfel[:3] = place


@njit(cache=True, error_model="numpy")
def _fit_place(data, place, facing, radius, members, work, stack, surfel, before, report, first):
    """Fit around a place at one radius, after a smaller fit that locates the surface; return False if none fits.

    If the two differ by more than 5 standard deviations, the smaller one is kept.
    """
    points, normals, spread, starts, ends, boxes = data
    count = gather(points, normals, starts, ends, boxes, place, facing, radius, members, stack)
    if count < 3:
        return False
    surfel[:3] = place
    surfel[6:] = 0.0
    small = radius / RATIO
    initialize_normal(points, normals, members, count, small, facing, surfel)
    if not fit(points, spread, members, count, small, 2, 0.0, surfel, report, work):
        small = radius
        surfel[:3] = place
        initialize_normal(points, normals, members, count, radius, facing, surfel)
        if not fit(points, spread, members, count, radius, 2, 0.0, surfel, report, work):
            return False
    reach = min(math.sqrt(radius * radius + 12.0 * report[NOISE] ** 2), 1.5 * radius)
    count = gather(points, normals, starts, ends, boxes, surfel[:3], facing, reach, members, stack)
    before[:] = surfel
    first[:] = report
    fine = fit(points, spread, members, count, radius, 1, 2.0 * report[NOISE], surfel, report, work)
    jump = 5.0 * math.sqrt(first[VARIANCE]) + 1e-3 * radius
    sure = small < radius and first[COUNT] >= 12.0
    if not fine or (sure and abs(report[OFFSET]) > jump):
        surfel[:] = before
        report[:] = first
    if report[NOISE] > first[NOISE]:  # misfit of the wider fit to noiseless points is no noise
        if len(spread) == 0:
            report[VARIANCE] *= (first[NOISE] / report[NOISE]) ** 2
        report[NOISE] = first[NOISE]
    return True


@njit(cache=True, error_model="numpy", parallel=True)
def widen(points, starts, ends, boxes, centers, largest, radii):
    """Widen `radii` (m,) until the points around ``points[centers]`` are not collinear, up to `largest` (m,).

    In row-by-row scans the nearest points may all be in one row, which does not determine the surface. Points are not
    collinear if the eigenvalues a <= b <= c of their covariance satisfy b - a > `MIN_ROUNDNESS` c.
    """
    for q in prange(len(centers)):
        stack = np.empty(96, np.int64)
        members = np.empty(MAX_POINTS, np.int64)
        axis = np.zeros(3)
        x, y, z = points[centers[q], 0], points[centers[q], 1], points[centers[q], 2]
        radius = radii[q]
        while radius <= largest[q]:
            count = within(points, starts, ends, boxes, x, y, z, radius, 1, members, stack)
            if count >= MAX_POINTS:
                break
            a = b = c = 0.0
            if count >= 3:
                a, b, c = plane_normal(points, members, count, x, y, z, radius, axis)
            if b - a > MIN_ROUNDNESS * c:
                radii[q] = radius if radius == radii[q] else 1.25 * radius  # room for the smaller fit that comes first
                break
            radius *= RATIO


@njit(cache=True, error_model="numpy", parallel=True)
def fit_all(points, normals, spread, starts, ends, boxes, centers, radii, isotropic, surfels, reports):
    """Fill `surfels` (m, 12) and `reports` (m, 6) with fits around ``points[centers]`` at given radii; NaN if none.

    `radii` are reduced where the surface is too curved. `isotropic` errors of standard deviation s shift the mean
    height of a surface inwards by s^2 (k1 + k2) / 2, which is corrected.
    """
    data = (points, normals, spread, starts, ends, boxes)
    for c in prange(len(centers)):
        stack = np.empty(96, np.int64)
        members = np.empty(MAX_POINTS, np.int64)
        work = np.empty((6, MAX_POINTS))
        surfel, before = np.zeros(12), np.zeros(12)
        report, first = np.zeros(6), np.zeros(6)
        place = points[centers[c]]
        facing = normals[centers[c]] if len(normals) > 0 else place
        surfels[c] = math.nan
        reports[c] = math.nan
        for shrunk in range(5):
            radius = radii[c] / RATIO**shrunk
            if not _fit_place(data, place, facing, radius, members, work, stack, surfel, before, report, first):
                break
            report[OFFSET] = (
                (place[0] - surfel[0]) * surfel[3]
                + (place[1] - surfel[1]) * surfel[4]
                + (place[2] - surfel[2]) * surfel[5]
            )
            if isotropic:
                shift = 0.5 * report[NOISE] ** 2 * (surfel[6] + surfel[7] + surfel[8])
                shift = max(-0.5 * report[NOISE], min(0.5 * report[NOISE], shift))
                for k in range(3):
                    surfel[k] -= shift * surfel[3 + k]
            surfels[c] = surfel
            reports[c] = report
            if report[CURVATURE] * radius < 1.6 or radius < 5.0 * report[NOISE]:
                radii[c] = radius
                break
