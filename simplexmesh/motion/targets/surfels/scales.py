"""Places and radii of the fits: the scale at which noise and bias are least, found from fits at growing scales.

At some pilot points, fits at growing radii give, per scale, the variance (from residuals) and the bias (from the change
to the next scale). Both are averaged over neighboring pilots, and the radius of the least mean squared error is chosen:
a smoothed variant of the intersection of confidence intervals (O. Lepski, On a problem of adaptive estimation in
Gaussian white noise, 1991; C. Loader, Local Regression and Likelihood, 1999).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.targets.surfels import _kernels_surfels as kernels
from simplexmesh.motion.targets.surfels._kernels_fit import Cloud, Report
from simplexmesh.numerics.kd_tree import kd_tree, nearest

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MAX_SURFELS = 60_000
PILOTS = 2_000
"""Fits at all scales take as long as 14 times as many surfels: this is a tenth to a half of the time to build them."""

NEIGHBORS = 12
"""Points within the smallest scale, and half the number of pilots averaged."""

LEVELS = 14
"""Scales tried: radii up to 90 times the smallest."""


def centers_and_radii(cloud: Cloud) -> tuple[Indices, Array]:
    """Return the points around which surfels are fitted, and the radii, interpolated from the pilots'."""
    points, n = cloud.points, len(cloud.points)
    pilots = np.unique(np.linspace(0, n - 1, PILOTS).astype(np.int64))
    chosen = _chosen_radii(cloud, pilots)
    centers = thinned(points, float(np.quantile(chosen, 0.1)) / 4)
    if len(centers) > MAX_SURFELS:
        centers = centers[np.linspace(0, len(centers) - 1, MAX_SURFELS).astype(np.int64)]
    near = kd_tree(points[pilots])
    _, index = nearest(near, points[centers], min(4, len(pilots)))
    radii = np.exp(np.log(chosen[near.order[index]]).mean(axis=1))
    return centers, np.maximum(radii, _base_radii(cloud, centers))


def _base_radii(cloud: Cloud, centers: Indices) -> Array:
    """Return the smallest radii: 1.25 times the distance of the 12th nearest point."""
    distance, _ = nearest(cloud, cloud.points[centers], min(NEIGHBORS, len(cloud.points)))
    base = 1.25 * distance[:, -1]
    return np.maximum(base, max(float(np.median(base)) * 1e-3, 1e-300))


def _chosen_radii(cloud: Cloud, pilots: Indices) -> Array:
    """Return, per pilot, the radius of least mean squared error."""
    near = kd_tree(cloud.points[pilots])
    around = near.order[nearest(near, cloud.points[pilots], min(2 * NEIGHBORS, len(pilots)))[1]]
    bases = np.median(_base_radii(cloud, pilots)[around], axis=1)
    largest = max(0.3 * float(np.linalg.norm(cloud.boxes[0, 3:] - cloud.boxes[0, :3])), bases.max())
    if not len(cloud.spread):  # points with known errors come from a grid, not from scan rows
        wide = bases.copy()
        kernels.widen(cloud, pilots, np.minimum(largest, 6 * bases), wide)
        bases = np.maximum(bases, np.median(wide[around], axis=1))
    table = np.zeros((len(pilots), LEVELS, len(Report._fields)))
    kernels.fit_scales(cloud, pilots, bases, largest, table)
    report = Report(*np.moveaxis(table, 2, 0))
    radius = bases[:, None] * kernels.RATIO ** np.arange(LEVELS)
    blurred = radius < 3.0 * report.noise
    error = report.variance + _squared_bias(report, radius, blurred, around)
    error[blurred | ~np.isfinite(error)] = np.inf
    found: NDArray[np.bool_] = np.asarray(np.isfinite(error).any(axis=1))
    best = np.where(found, np.argmin(error, axis=1), np.argmax(np.isfinite(report.variance), axis=1))
    logs = np.log(bases) + best * np.log(kernels.RATIO)
    usable = found[around]
    smooth = (np.where(usable, logs[around], 0.0).sum(axis=1)) / np.maximum(usable.sum(axis=1), 1)
    # blending reduces variance more than bias, so the best radius is larger than for a single fit
    return 1.1 * np.exp(np.where(usable.any(axis=1), smooth, logs))


def _squared_bias(report: Report, radius: Array, blurred: NDArray[np.bool_], around: Indices) -> Array:
    """Return the squared bias per pilot and scale, where unknown at least that of a cylinder of the same curvature."""
    variance, offset = np.asarray(report.variance), np.asarray(report.offset)
    # fourth-order bias grows fourfold per scale, so the change to the next scale is three times this one's
    doubt = np.maximum(variance[:, :-1] - variance[:, 1:], 0.25 * variance[:, :-1])
    excess = np.full_like(variance, np.nan)
    excess[:, :-1] = (offset[:, 1:] ** 2 - doubt) / 9
    bias = np.nan_to_num(_pooled(excess, blurred, around))
    bend = _pooled(np.asarray(report.curvature), blurred, around)
    return np.maximum(bias, (radius**4 * bend**3 / 213) ** 2)  # 213: of a fit with these weights


def _pooled(values: Array, blurred: NDArray[np.bool_], around: Indices) -> Array:
    """Return, per pilot and scale, the mean over neighboring pilots; NaN unless more than a quarter have a value."""
    known = np.isfinite(values) & ~blurred
    count = known[around].sum(axis=1)
    total = np.where(known, values, 0.0)[around].sum(axis=1)
    return np.where(4 * count > around.shape[1], total / np.maximum(count, 1), np.nan)


def thinned(points: Array, cell: float) -> Indices:
    """Return the indices of the points that are the first in their grid cell, in order."""
    if cell <= 0.0:
        return np.arange(len(points))
    at = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    shape = at.max(axis=0) + 1
    _, first = np.unique((at[:, 0] * shape[1] + at[:, 1]) * shape[2] + at[:, 2], return_index=True)
    return np.sort(first)
