"""Surfels: points converted to small quadratic surface pieces, each fitted at the scale of least noise and bias.

At some pilot points, fits at growing radii give, per scale, the variance (from residuals) and the bias (from the change
since smaller scales). Both are averaged over neighboring pilots, and the radius of the least mean squared error is
chosen: a smoothed variant of the intersection of confidence intervals (O. Lepski, On a problem of adaptive estimation
in Gaussian white noise, 1991; C. Loader, Local Regression and Likelihood, 1999).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.motion.targets.surfels import _kernels_patches
from simplexmesh.motion.targets.surfels import _kernels_surfels as kernels
from simplexmesh.motion.targets.surfels._kernels_fit import Cloud, Goodness
from simplexmesh.numerics.kd_tree import Tree, kd_tree, nearest

MAX_SURFELS = 60_000

PILOTS, FEWEST_PILOTS, POINTS_A_PILOT = 2_000, 1_000, 4
"""Fits at all scales take as long as 14 times as many surfels: this is a tenth to a half of the time to build them.

With 400 and 8, rows of noisy points are fitted along one row only, and blurred edges are lost.
"""

NEIGHBORS = 12
"""Points within the smallest scale, and half the number of pilots averaged."""

SURE = 5.0
"""Radius, in standard deviations of the noise, above which variances are those of fits and not of their failures."""

LEVELS = 14
"""Scales tried: radii up to 90 times the smallest."""

MAX_SUPPORT_RATIO = 1.5
"""Limit of the ratio of the supports of neighboring surfels."""


def centers_and_radii(cloud: Cloud, share: float = 1.0) -> tuple[Indices, Array]:
    """Return the points around which surfels are fitted, and the radii, interpolated from the pilots'."""
    points, n = cloud.points, len(cloud.points)
    count = max(int(share * min(PILOTS, max(FEWEST_PILOTS, n / share // POINTS_A_PILOT))), 2 * NEIGHBORS)
    pilots = np.unique(np.linspace(0, n - 1, count).astype(np.int64))
    chosen = _chosen_radii(cloud, pilots)
    cell, near = float(np.quantile(chosen, 0.1)) / 4, kd_tree(points[pilots])
    centers = thinned(points, cell)
    index = near.order[nearest(near, points[centers], min(4, len(pilots)))[1]]
    apart = thinned(_without_noise(cloud, centers, pilots[index[:, 0]], chosen[index[:, 0]]), 0.6 * cell)
    apart = apart[np.linspace(0, len(apart) - 1, min(len(apart), MAX_SURFELS)).astype(np.int64)]
    centers, index = centers[apart], index[apart]
    radii = np.exp(np.log(chosen[index]).mean(axis=1))
    return centers, np.maximum(radii, _base_radii(cloud, centers))


def _without_noise(cloud: Cloud, centers: Indices, pilots: Indices, radii: Array) -> Array:
    """Return points (m, 3) on the planes of pilots: noise spreads them over layers of cells, and fits over one."""
    pilots, first, of = np.unique(pilots, return_index=True, return_inverse=True)
    table, report = _fits(cloud, pilots, radii[first])
    points, near = cloud.points[centers], table[of]
    offset = dot(points - near[:, :3], near[:, 3:6])
    noisy = np.abs(offset) < 2.0 * np.asarray(report.noise)[of]
    return points - np.where(noisy, offset, 0.0)[:, None] * np.nan_to_num(near[:, 3:6])


def _fits(cloud: Cloud, centers: Indices, radii: Array) -> tuple[Array, Goodness]:
    """Return the fits (m, 12) around points, and their report; `radii` (m,) are reduced as by `fit_all`."""
    table, reports = np.zeros((len(centers), 12)), np.zeros((len(centers), len(Goodness._fields)))
    kernels.fit_all(len(centers), cloud, centers, radii, not len(cloud.spread), table, reports)
    return table, Goodness(*reports.T)


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
        kernels.widen(len(pilots), cloud, pilots, np.minimum(largest, 6 * bases), wide)
        bases = np.maximum(bases, np.median(wide[around], axis=1))
    table = np.zeros((len(pilots), LEVELS, len(Goodness._fields)))
    kernels.fit_scales(len(pilots), cloud, pilots, bases, largest, table)
    report = Goodness(*np.moveaxis(table, 2, 0))
    radius = bases[:, None] * kernels.RATIO ** np.arange(LEVELS)
    blurred = radius < 3.0 * report.noise
    error = report.variance + _squared_bias(report, radius, blurred, around, independent=not len(cloud.spread))
    error[blurred | ~np.isfinite(error)] = np.inf
    found: Mask = np.asarray(np.isfinite(error).any(axis=1))
    best = np.where(found, np.argmin(error, axis=1), np.argmax(np.isfinite(report.variance), axis=1))
    logs = np.log(bases) + best * np.log(kernels.RATIO)
    usable = found[around]
    smooth = (np.where(usable, logs[around], 0.0).sum(axis=1)) / np.maximum(usable.sum(axis=1), 1)
    # blending reduces variance more than bias, so the best radius is larger than for a single fit
    return 1.1 * np.exp(np.where(usable.any(axis=1), smooth, logs))


def _squared_bias(report: Goodness, radius: Array, blurred: Mask, around: Indices, *, independent: bool) -> Array:
    """Return the squared bias per pilot and scale, at least that of a cylinder of the same curvature."""
    variance = np.asarray(report.variance)
    height = np.where(np.isfinite(variance), np.nan_to_num(report.offset).cumsum(axis=1), np.nan)
    bend = _pooled(np.asarray(report.curvature), blurred, around)
    least = (radius**4 * bend**3 / 213) ** 2  # 213: of a fit with these weights
    if not independent:
        # errors of a grid, alike among neighbors, would count as change since smaller scales: extrapolated instead, as
        # fourth-order bias grows fourfold per scale, so that the change to the next scale is three times this one's
        excess = np.full_like(variance, np.nan)
        excess[:, :-1] = _excess(np.asarray(report.offset)[:, 1:], variance[:, :-1], variance[:, 1:]) / 9
        return np.maximum(np.nan_to_num(_pooled(excess, blurred, around)), least)
    bias, sure = np.nan_to_num(least), np.where(radius > SURE * report.noise, height, np.nan)
    for steps in (1, 2):
        excess, before, after = np.full_like(variance, np.nan), slice(-steps), slice(steps, None)
        excess[:, after] = _excess(height[:, after] - sure[:, before], variance[:, before], variance[:, after])
        excess /= (1 - 0.25**steps) ** 2
        bias = np.maximum(bias, np.nan_to_num(_pooled(excess, blurred, around)))
    # all fits wider than a wave miss it by the same: bias is never less than at a smaller scale
    return np.where(np.isnan(bend), np.nan, np.maximum.accumulate(bias, axis=1))


def _excess(change: Array, before: Array, after: Array) -> Array:
    """Return how much the square of a change to a wider fit exceeds its variance, given those of both fits."""
    return np.asarray(change**2 - np.maximum(before - after, 0.25 * before))


def _pooled(values: Array, blurred: Mask, around: Indices) -> Array:
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


class Surfels(NamedTuple):
    """Surface elements with their adjacency; the first four fields are those of a `kd_tree.Tree`."""

    points: Array  # (m, 3)
    starts: Indices
    ends: Indices
    boxes: Array
    table: Array  # (m, 12) see `_kernels_fit`; the normal is zero if it is unknown: a mere point
    heads: Array  # (m, 9) what is read first per vertex: point, normal (NaN if unknown), radius of influence, and
    # squared distances: along the surface up to where there is data, of the nearest surfel outside of the patch
    neighbors: Indices32  # (m, 12) the nearest surfels, nearest first
    horizon: Array  # (m,) lower bound of the distance of all others
    patches: NDArray[np.float32]  # (m, 14, 8) each surfel with its nearest: see `_kernels_patches.pack_patches`
    noise: Array  # (m,) standard deviation of the points along the normal
    radius: Array  # (m,) of the neighborhood of each fit
    oriented: bool  # whether the normals are oriented away from the solid

    def spacing(self, share: float) -> float:
        """Return a quantile of `horizon`, which bounds how far a place on the surface is from a surfel; or 0."""
        finite = self.horizon[np.isfinite(self.horizon)]
        return float(np.quantile(finite, share)) if len(finite) else 0.0


class Fits(NamedTuple):
    """Fits to points, as surfels have them."""

    table: Array
    noise: Array
    radius: Array


def fitted_surfels(points: Array, normals: Array | None = None, spread: Array | None = None) -> Surfels:
    """Fit surfels to points (n, 3), with radii from the data; `spread` (n, 3) is the known error of each, one sigma."""
    return assembled(*fits(points, normals, spread), oriented=normals is not None)


def fits(points: Array, normals: Array | None = None, spread: Array | None = None, *, share: float = 1.0) -> Fits:
    """Return the fits of which surfels are made; of a share of the points of a cloud, as many pilots see the scale."""
    first = _first_occurrences(points)
    tree, none = kd_tree(points[first]), np.zeros((0, 3))
    facing = none if normals is None else np.ascontiguousarray(normals[first][tree.order], np.float64)
    errors = none if spread is None else np.ascontiguousarray(spread[first][tree.order], np.float64)
    cloud = Cloud(*tree[:4], facing, errors)
    centers, radii = centers_and_radii(cloud, share)
    cell = float(np.quantile(radii, 0.1)) / 5
    table, report = _fits(cloud, centers, radii)
    known = 0.0 if spread is None else norm(errors[centers])
    noise, trusted = np.asarray(report.noise), _trusted(report, radii, known)
    if spread is not None and normals is not None:  # without outliers, places too thin for a fit are kept as points
        lone = centers[~trusted]
        table[~trusted] = np.hstack([tree.points[lone], facing[lone], np.zeros((len(lone), 6))])
        noise[~trusted] = norm(errors[lone])
        trusted[:] = True
    good = np.flatnonzero(trusted)
    if len(good) < 4:  # too few points, or too scattered: the points themselves
        table = np.zeros((len(tree.points), 12))
        table[:, :3], table[:, 3:6] = tree.points, 0.0 if normals is None else facing
        return Fits(table, np.zeros(len(table)), np.zeros(len(table)))
    keep: Indices = good[thinned(table[good, :3], cell)]
    return Fits(_blended(table[keep], oriented=normals is not None), noise[keep], radii[keep])


def _first_occurrences(points: Array) -> Indices:
    """Return the index of one point of each group of equal ones, in order; by a scalar sort, which is fast."""
    along = (points - points[0]) @ np.array([0.5772156649, 0.9159655942, 0.2614972128])
    order = np.argsort(along, kind="stable")
    fresh = np.ones(len(points), dtype=bool)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    return np.sort(order[fresh])


def _trusted(report: Goodness, radii: Array, known: Array | float) -> Mask:
    """Return which fits represent a surface: thin relative to the radius, surrounded by points, close to the place.

    Residuals may be less than the `known` errors of points: between voxels along a flat face all have the same one.
    """
    noise = np.asarray(report.noise)
    return np.asarray(
        (noise < 0.3 * radii)
        & (np.asarray(report.eccentricity) < 0.5)
        & (np.asarray(report.used) >= 6)
        & (np.sqrt(report.variance) <= np.minimum(0.1 * radii, 1.2 * np.maximum(noise, known)))
        & (report.curvature * radii < 1.6)
        & (np.abs(report.offset) < 4.0 * noise + 0.1 * radii)
    )


def _blended(table: Array, *, oriented: bool) -> Array:
    """Return surfels averaged with their neighbors."""
    tree = kd_tree(table[:, :3])
    distance, index = _nearest_others(tree)
    support = np.maximum(1.2 * _largest(distance[:, :8]), 1e-300)
    out, back = np.zeros_like(table), np.argsort(tree.order)
    _kernels_patches.blend_all(
        len(table), table[tree.order], support, index[:, :NEIGHBORS].astype(np.int32), oriented, out
    )
    return out[back]


def assembled(table: Array, noise: Array, radius: Array, *, oriented: bool) -> Surfels:
    """Return surfels, sorted, with their search structures."""
    tree = kd_tree(table[:, :3])
    table = table[tree.order]
    known: Mask = np.asarray(table[:, 3:6].any(axis=1))
    distance, index = _nearest_others(tree)
    neighbors = index[:, :NEIGHBORS].astype(np.int32)
    support = np.maximum(1.5 * _largest(distance[:, :3]), 1e-300)
    support = np.minimum(support, MAX_SUPPORT_RATIO * support[neighbors].min(axis=1))
    patches = np.zeros((len(table), 14, _kernels_patches.LANES), np.float32)
    _kernels_patches.pack_patches(len(table), table, support, neighbors, oriented, patches)
    normals, beside, beyond = np.where(known[:, None], table[:, 3:6], np.nan), distance[:, -1], distance[:, 7]
    heads = np.column_stack([table[:, :3], normals, support, 2.25 * beside**2, beyond**2])
    return Surfels(
        *tree[:4],
        table=table,
        heads=heads,
        neighbors=neighbors,
        horizon=distance[:, -1].copy(),
        patches=patches,
        noise=noise[tree.order],
        radius=radius[tree.order],
        oriented=oriented,
    )


def _largest(distances: Array) -> Array:
    """Return the largest finite distance in each row, 0 if there is none."""
    return np.asarray(np.where(np.isfinite(distances), distances, 0.0).max(axis=1))


def _nearest_others(tree: Tree) -> tuple[Array, Indices]:
    """Return the distances and indices (m, 13) of the nearest other points, padded by the point itself at infinity."""
    m = len(tree.points)
    distance, index = nearest(tree, tree.points, min(NEIGHBORS + 2, m))
    own: Mask = np.asarray(index == np.arange(m)[:, None])
    own[~own.any(axis=1), -1] = True
    distance, index = distance[~own].reshape(m, -1), index[~own].reshape(m, -1)
    pad = NEIGHBORS + 1 - index.shape[1]
    if pad > 0:
        index = np.concatenate([index, np.repeat(np.arange(m)[:, None], pad, axis=1)], axis=1)
        distance = np.concatenate([distance, np.full((m, pad), np.inf)], axis=1)
    return distance, index
