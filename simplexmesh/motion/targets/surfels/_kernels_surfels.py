"""Surfels: robust quadratic fits around many places, at one or many scales; see `_kernels_fit` for their rows."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.motion.targets.surfels._kernels_fit import MAX_POINTS, NO_FIT, Goodness, fit, new_local
from simplexmesh.numerics._kernels_local_fits import fit_plane
from simplexmesh.numerics._kernels_tree import within
from simplexmesh.numerics._kernels_vectors import assign, row

MIN_COSINE = 0.3  # between the normals of points on one surface
RATIO = math.sqrt(2.0)  # of successive scales
MIN_ROUNDNESS = 0.2  # minimum second moment across a row of points relative to that along it


@njit(cache=True, error_model="numpy")
def _gather(cloud, local, surfel, at, radius):
    """List the points within `radius` of the surfel that face the same way as point `at`; return their number."""
    place, found = (surfel[0], surfel[1], surfel[2]), local.members
    count = within(cloud, place, radius, 1, found)
    if count > len(found):
        stride = (count + len(found) - 1) // len(found)
        within(cloud, place, radius, stride, found)
        count = (count + stride - 1) // stride
    if len(cloud.normals) == 0:
        return count
    kept = 0
    for i in range(count):
        if _cosine(cloud, found[i], row(cloud.normals, at)) > MIN_COSINE:
            found[kept] = found[i]
            kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def _cosine(cloud, p, direction):
    return cloud.normals[p, 0] * direction[0] + cloud.normals[p, 1] * direction[1] + cloud.normals[p, 2] * direction[2]


@njit(cache=True, error_model="numpy")
def _start(cloud, local, count, at, radius, surfel):
    """Make the surfel a plane through point `at`, fitted to the members, oriented if the points have normals."""
    for a in range(3):
        surfel[a] = cloud.points[at, a]
    surfel[6:] = 0.0
    fit_plane(cloud.points, local.members[:count], row(cloud.points, at), radius, surfel[3:6])
    if len(cloud.normals) > 0 and _cosine(cloud, at, (surfel[3], surfel[4], surfel[5])) < 0.0:
        for a in range(3, 6):
            surfel[a] = -surfel[a]


@njit(cache=True, error_model="numpy")
def _reach(radius, noise):
    """Return how far the points may be that are within `radius` along the surface."""
    return min(math.sqrt(radius * radius + 12.0 * noise * noise), 1.5 * radius)


@njit(cache=True, error_model="numpy")
def _fit_growing(cloud, local, at, base, largest, reports):
    """Fill `reports` (levels, 6), as `fit_scales` does, of fits around point `at`."""
    reports[:] = math.nan
    surfel, before = np.zeros(12), np.zeros(12)
    surfel[0], surfel[1], surfel[2] = row(cloud.points, at)
    settled, failures, last_variance, noise = False, 0, math.inf, 0.0
    for level in range(len(reports)):
        radius = base * RATIO**level
        if radius > largest:
            break
        count = _gather(cloud, local, surfel, at, _reach(radius, noise))
        if count >= MAX_POINTS - 1 and level > 0:
            break
        assign(before, surfel)
        if not settled:
            if count < 6:
                continue
            _start(cloud, local, count, at, radius, surfel)
        report = fit(cloud, local, count, radius, 2.5 * noise if settled else 0.0, surfel)
        if not report.used > 0.0:
            assign(surfel, before)
            continue
        resolved = radius > 3.0 * report.noise
        if settled and resolved:
            doubt = max(last_variance - report.variance, 0.25 * last_variance)
            if report.offset**2 > max(36.0 * doubt, 1e-12 * radius * radius):
                failures += 1
                if failures > 1:
                    break
        if report.curvature * radius > 1.5:
            break
        for k in range(6):
            reports[level, k] = report[k]
        noise = report.noise
        if not (settled and resolved):
            reports[level, 0] = math.nan  # there is no earlier fit to compare with
        if resolved:
            settled, last_variance = True, report.variance
        else:
            assign(surfel, before)


@by_rows(20)
def fit_scales(begin, end, cloud, centers, bases, largest, reports):
    """Fill `reports` (m, levels, 6) of fits around points `centers` at radii ``base RATIO^level``; NaN for none."""
    for c in range(begin, end):
        _fit_growing(cloud, new_local(), centers[c], bases[c], largest, reports[c])


@njit(cache=True, error_model="numpy")
def _fit_place(cloud, local, at, radius, surfel):
    """Fit around point `at` at one radius, after a smaller fit, kept if the two differ by 5 standard deviations."""
    surfel[0], surfel[1], surfel[2] = row(cloud.points, at)
    count = _gather(cloud, local, surfel, at, radius)
    if count < 3:
        return NO_FIT
    small = radius / RATIO
    _start(cloud, local, count, at, small, surfel)
    first = fit(cloud, local, count, small, 0.0, surfel)
    if not first.used > 0.0:
        small = radius
        _start(cloud, local, count, at, radius, surfel)
        first = fit(cloud, local, count, radius, 0.0, surfel)
        if not first.used > 0.0:
            return NO_FIT
    count = _gather(cloud, local, surfel, at, _reach(radius, first.noise))
    before = surfel.copy()
    report = fit(cloud, local, count, radius, 2.0 * first.noise, surfel)
    jump = 5.0 * math.sqrt(first.variance) + 1e-3 * radius
    sure = small < radius and first.used >= 12.0
    if not report.used > 0.0 or (sure and abs(report.offset) > jump):
        assign(surfel, before)
        return first
    noise, variance = report.noise, report.variance
    if noise > first.noise:  # misfit of the wider fit to noiseless points is no noise
        variance *= 1.0 if len(cloud.spread) > 0 else (first.noise / noise) ** 2
        noise = first.noise
    return Goodness(report.offset, variance, noise, report.used, report.eccentricity, report.curvature)


@by_rows(200)
def widen(begin, end, tree, centers, largest, radii):
    """Widen `radii` (m,), up to `largest`, until the points there, as of one scan row, are not collinear."""
    for q in range(begin, end):
        members, normal = np.empty(MAX_POINTS, np.int64), np.zeros(3)
        place, radius = row(tree.points, centers[q]), radii[q]
        while radius <= largest[q]:
            count = within(tree, place, radius, 1, members)
            if count >= MAX_POINTS:
                break
            if count >= 3:
                _, (a, b, c) = fit_plane(tree.points, members[:count], place, radius, normal)
                if b - a > MIN_ROUNDNESS * c:
                    radii[q] = radius if radius == radii[q] else 1.25 * radius  # room for the smaller fit before it
                    break
            radius *= RATIO


@by_rows(20)
def fit_all(begin, end, cloud, centers, radii, isotropic, surfels, reports):
    """Fill `surfels` (m, 12) and `reports` (m, 6) of points `centers` at `radii`, reduced where that bends too much."""
    for c in range(begin, end):
        radii[c] = _fit_shrinking(cloud, new_local(), centers[c], radii[c], isotropic, surfels[c], reports[c])


@njit(cache=True, error_model="numpy")
def _fit_shrinking(cloud, local, at, largest, isotropic, out, reported):
    """Fill a surfel (12,) and a report (6,) as `fit_all` does; return the radius used, at most `largest`."""
    out[:] = reported[:] = math.nan
    surfel = np.zeros(12)
    for shrunk in range(5):
        radius = largest / RATIO**shrunk
        report = _fit_place(cloud, local, at, radius, surfel)
        if not report.used > 0.0:
            break
        for k in range(6):
            reported[k] = report[k]
        reported[0] = 0.0
        for a in range(3):
            reported[0] += (cloud.points[at, a] - surfel[a]) * surfel[3 + a]
        shift = 0.5 * report.noise**2 * (surfel[6] + surfel[7] + surfel[8])  # inwards, of the mean of isotropic errors
        shift = max(-0.5 * report.noise, min(0.5 * report.noise, shift)) if isotropic else 0.0
        for a in range(3):
            surfel[a] -= shift * surfel[3 + a]
        assign(out, surfel)
        if report.curvature * radius < 1.6 or radius < 5.0 * report.noise:
            return radius
    return largest
