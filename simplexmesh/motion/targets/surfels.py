"""Surfels: points converted to small quadratic surface pieces, each fitted at a data-driven scale."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _vec
from simplexmesh.motion.targets import _kernels_patches, _kernels_points, _kernels_simd, _kernels_wide
from simplexmesh.motion.targets import _kernels_surfels as kernels
from simplexmesh.motion.targets._kernels_fit import COUNT, CURVATURE, ECCENTRICITY, NOISE, OFFSET, VARIANCE
from simplexmesh.motion.targets.tree import Tree

Array = NDArray[np.float64]

MAX_SURFELS = 60_000
PILOTS = 2_000
MIN_NEIGHBORS = 12  # points within the smallest scale
LEVELS = 14
MAX_WIDENING = 6.0  # search radius for other scan rows, in radii of the smallest scale
NEIGHBORS = 12
POOLED_PILOTS = 24  # neighboring pilots averaged
SLACK = 2.0  # in squared supports; squared distances up to this above the nearest one include about 16 surfels
BLEND_FACTOR = 1.1  # blending reduces variance more than bias, so the best radius is larger than for a single fit


@dataclass(frozen=True, eq=False)
class Surfels:
    """Surface elements with their adjacency and search structures.

    Attributes
    ----------
    table : (m, 12) array of float
        Point, unit normal, second-order form (xx, yy, zz, xy, xz, yz): see `_kernels_fit`. The normal is zero if it is
        unknown: the surfel is then a mere point.
    support : (m,) array of float
        Radius of influence of each surfel.
    neighbors : (m, 12) array of int
        The nearest surfels of each, nearest first.
    neighbor_distances : (m, 12) array of float
        Their distances.
    horizon : (m,) array of float
        Lower bound of the distance of all other surfels.
    heads : (m, 12) array of float
        The data read first per vertex: see `_kernels_points.pack_heads`.
    patches : (m, 14, 8) array of float32
        Each surfel packed with its nearest: see `_kernels_patches.pack_patches`.
    noise : (m,) array of float
        Standard deviation of the points along the normal, around each surfel.
    radius : (m,) array of float
        Radius of the neighborhood of each fit.
    tree : Tree
        The kd-tree of the points of the surfels, which are in its order.
    wide_tree : tuple
        The same with eight children per node: see `_kernels_wide.pack_wide`.
    oriented : bool
        Whether the normals are oriented away from the solid.
    """

    table: Array
    support: Array
    neighbors: NDArray[np.int32]
    neighbor_distances: Array
    horizon: Array
    heads: Array
    patches: NDArray[np.float32]
    noise: Array
    radius: Array
    tree: Tree
    wide_tree: tuple[Any, ...]
    oriented: bool

    def __len__(self) -> int:
        return len(self.table)

    @cached_property
    def spacing(self) -> float:
        """The 99th percentile of `horizon`: how far a place on the surface may be from the nearest surfel."""
        finite = self.horizon[np.isfinite(self.horizon)]
        return float(np.quantile(finite, 0.99)) if len(finite) else 0.0


def fitted_surfels(points: Array, normals: Array | None = None, spread: Array | None = None) -> Surfels:
    """Fit surfels to points.

    At some pilot points, fits at growing radii give, per scale, the variance (from residuals) and the bias (from the
    change to the next scale). Both are averaged over neighboring pilots, and the radius of the least mean squared error
    is chosen (a smoothed variant of the intersection of confidence intervals). Surfels are then fitted at these radii
    around a subset of the points, with a spacing proportional to the radius.

    Parameters
    ----------
    points : (n, 3) array of float
    normals : (n, 3) array of float, optional
        Oriented away from the solid; points facing away from a place are excluded from its fit.
    spread : (n, 3) array of float, optional
        One standard deviation of each point's error along a known direction. Without it errors are assumed isotropic,
        of unknown size.

    Returns
    -------
    Surfels

    References
    ----------
    O. Lepski, On a problem of adaptive estimation in Gaussian white noise, 1991. C. Loader, Local Regression and
    Likelihood, 1999.
    """
    first = _first_occurrences(points)
    if len(first) < len(points):
        points, normals, spread = points[first], _selected(normals, first), _selected(spread, first)
    tree = Tree.of(points)
    none = np.zeros((0, 3))
    facing = none if normals is None else np.ascontiguousarray(normals[tree.order], dtype=np.float64)
    errors = none if spread is None else np.ascontiguousarray(spread[tree.order], dtype=np.float64)
    data = (tree.points, facing, errors, tree.starts, tree.ends, tree.boxes)
    centers, radii = _centers_and_radii(data, tree)
    cell = float(np.quantile(radii, 0.1)) / 5
    table, reports = np.zeros((len(centers), 12)), np.zeros((len(centers), 6))
    kernels.fit_all(*data, centers, radii, spread is None, table, reports)
    trusted = _trusted(reports, radii)
    if spread is not None and normals is not None:  # without outliers, places too thin for a fit are kept as points
        lone = centers[~trusted]
        table[~trusted, :3], table[~trusted, 3:6], table[~trusted, 6:] = tree.points[lone], facing[lone], 0.0
        reports[~trusted, NOISE] = _vec.norm(errors[lone])
        trusted[:] = True
    good = np.flatnonzero(trusted)
    if len(good) < 4:
        return _unfitted(tree.points, None if normals is None else facing)
    keep = good[_thinned(table[good, :3], np.arange(len(good)), cell)]
    return _assembled(table[keep], reports[keep, NOISE], radii[keep], oriented=normals is not None, blended=1)


def _centers_and_radii(data: tuple[NDArray[Any], ...], tree: Tree) -> tuple[NDArray[np.int64], Array]:
    """Return the points around which surfels are fitted, and the radii, interpolated from the pilots'."""
    n = len(tree.points)
    pilots = np.unique(np.linspace(0, n - 1, PILOTS).astype(np.int64))
    chosen = _chosen_radii(data, tree, pilots)
    centers = _thinned(tree.points, np.arange(n), float(np.quantile(chosen, 0.1)) / 4)
    if len(centers) > MAX_SURFELS:
        centers = centers[np.linspace(0, len(centers) - 1, MAX_SURFELS).astype(np.int64)]
    near = Tree.of(tree.points[pilots])
    _, index = near.nearest(tree.points[centers], min(4, len(pilots)))
    radii = np.exp(np.log(chosen[near.order[index]]).mean(axis=1))
    return centers, np.maximum(radii, _base_radii(tree, centers))


def _unfitted(points: Array, normals: Array | None) -> Surfels:
    """Return the points themselves as surfels, if they are too few or too scattered for fits."""
    table = np.zeros((len(points), 12))
    table[:, :3] = points
    if normals is not None:
        table[:, 3:6] = normals
    return _assembled(table, np.zeros(len(table)), np.zeros(len(table)), oriented=normals is not None)


def _first_occurrences(points: Array) -> NDArray[np.int64]:
    """Return the index of one point of each group of equal ones, in order; by a scalar sort, which is fast."""
    along = (points - points[0]) @ np.array([0.5772156649, 0.9159655942, 0.2614972128])
    order = np.argsort(along, kind="stable")
    fresh = np.ones(len(points), dtype=bool)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    return np.sort(order[fresh])


def _selected(values: Array | None, index: NDArray[np.int64]) -> Array | None:
    return None if values is None else values[index]


def _base_radii(tree: Tree, centers: NDArray[np.int64]) -> Array:
    """Return the smallest radii: 1.25 times the distance of the 12th nearest point."""
    k = min(MIN_NEIGHBORS, len(tree.points))
    distance, _ = tree.nearest(tree.points[centers], k)
    base = 1.25 * distance[:, -1]
    return np.maximum(base, max(float(np.median(base)) * 1e-3, 1e-300))


def _chosen_radii(data: tuple[NDArray[Any], ...], tree: Tree, pilots: NDArray[np.int64]) -> Array:
    """Return, per pilot, the radius of least mean squared error."""
    near = Tree.of(tree.points[pilots])
    _, index = near.nearest(tree.points[pilots], min(POOLED_PILOTS, len(pilots)))
    around = near.order[index]
    bases = np.median(_base_radii(tree, pilots)[around], axis=1)
    largest = max(0.3 * float(np.linalg.norm(tree.boxes[0, 3:] - tree.boxes[0, :3])), bases.max())
    if not len(data[2]):  # points with known errors come from a grid, not from scan rows
        wide = bases.copy()
        kernels.widen(*tree.arrays, pilots, np.minimum(largest, MAX_WIDENING * bases), wide)
        bases = np.maximum(bases, np.median(wide[around], axis=1))
    table = np.zeros((len(pilots), LEVELS, 6))
    kernels.fit_scales(*data, pilots, bases, largest, table)
    variance, offset = table[:, :, VARIANCE], table[:, :, OFFSET]
    # fourth-order bias grows fourfold per scale, so the change to the next scale is three times this one's
    doubt = np.maximum(variance[:, :-1] - variance[:, 1:], 0.25 * variance[:, :-1])
    excess = np.full_like(variance, np.nan)
    excess[:, :-1] = (offset[:, 1:] ** 2 - doubt) / 9
    radius = bases[:, None] * kernels.RATIO ** np.arange(LEVELS)
    blurred = radius < 3.0 * table[:, :, NOISE]
    bias = np.where(np.isfinite(pooled := _pooled(excess, blurred, around)), pooled, 0.0)
    # at least the bias of a fit with these weights to a cylinder: radius^4 curvature^3 / 213
    bend = _pooled(table[:, :, CURVATURE], blurred, around)
    bias = np.maximum(bias, (radius**4 * bend**3 / 213) ** 2)
    error = np.where(blurred | ~np.isfinite(variance), np.inf, variance + bias)
    error[np.isnan(error)] = np.inf
    found: NDArray[np.bool_] = np.asarray(np.isfinite(error).any(axis=1))
    best = np.where(found, np.argmin(error, axis=1), np.argmin(np.where(np.isfinite(variance), 0, 1), axis=1))
    logs = np.log(bases) + best * np.log(kernels.RATIO)
    usable = found[around]
    smooth = (np.where(usable, logs[around], 0.0).sum(axis=1)) / np.maximum(usable.sum(axis=1), 1)
    return BLEND_FACTOR * np.exp(np.where(usable.any(axis=1), smooth, logs))


def _pooled(values: Array, blurred: NDArray[np.bool_], around: NDArray[np.int64]) -> Array:
    """Return, per pilot and scale, the mean over neighboring pilots; NaN unless more than a quarter have a value."""
    known = np.isfinite(values) & ~blurred
    count = known[around].sum(axis=1)
    total = np.where(known, values, 0.0)[around].sum(axis=1)
    return np.where(4 * count > around.shape[1], total / np.maximum(count, 1), np.nan)


def _trusted(reports: Array, radii: Array) -> NDArray[np.bool_]:
    """Return which fits represent a surface: thin relative to the radius, surrounded by points, close to the place."""
    noise, offset = reports[:, NOISE], np.abs(reports[:, OFFSET])
    return np.asarray(
        (noise < 0.3 * radii)
        & (reports[:, ECCENTRICITY] < 0.5)
        & (reports[:, COUNT] >= 6)
        & (np.sqrt(reports[:, VARIANCE]) <= np.minimum(0.1 * radii, 1.2 * noise))
        & (reports[:, CURVATURE] * radii < 1.6)
        & (offset < 4.0 * noise + 0.1 * radii)
    )


def _thinned(points: Array, index: NDArray[np.int64], cell: float) -> NDArray[np.int64]:
    """Return those of `index` that are the first in their grid cell, in order."""
    if cell <= 0.0:
        return index
    at = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    shape = at.max(axis=0) + 1
    key = (at[:, 0] * shape[1] + at[:, 1]) * shape[2] + at[:, 2]
    _, first = np.unique(key, return_index=True)
    return index[np.sort(first)]


def _assembled(table: Array, noise: Array, radius: Array, *, oriented: bool, blended: int = 0) -> Surfels:
    """Sort surfels and build the search structures, after blending each `blended` times with its neighbors."""
    tree = Tree.of(table[:, :3], _kernels_simd.WIDTH)
    table = np.ascontiguousarray(table[tree.order])
    noise, radius = noise[tree.order], radius[tree.order]
    m = len(table)
    distance, index = _nearest_others(tree)
    neighbors = np.ascontiguousarray(index[:, :NEIGHBORS].astype(np.int32))
    finite = np.where(np.isfinite(distance), distance, 0.0)
    if blended:
        wide = np.maximum(1.2 * finite[:, :8].max(axis=1), 1e-300)
        out = np.zeros_like(table)
        _kernels_patches.blend_all(table, wide, neighbors, oriented, out)
        return _assembled(out, noise, radius, oriented=oriented, blended=blended - 1)
    narrow, support = np.maximum(1.5 * finite[:, :3].max(axis=1), 1e-300), np.zeros(m)
    _kernels_patches.limit_support(narrow, neighbors, support)
    patches = np.zeros((m, 14, _kernels_patches.LANES), np.float32)
    _kernels_patches.pack_patches(table, support, neighbors, oriented, patches)
    neighbor_distances, horizon = np.ascontiguousarray(distance[:, :NEIGHBORS]), distance[:, -1].copy()
    return Surfels(
        table=table,
        support=support,
        neighbors=neighbors,
        neighbor_distances=neighbor_distances,
        horizon=horizon,
        heads=_kernels_points.pack_heads(table, support, neighbor_distances, horizon),
        patches=patches,
        noise=noise,
        radius=radius,
        tree=tree,
        wide_tree=_kernels_wide.pack_wide(
            tree.points, table[:, 3:6], tree.starts, tree.ends, tree.boxes, SLACK * support**2
        ),
        oriented=oriented,
    )


def _nearest_others(tree: Tree) -> tuple[Array, NDArray[np.int64]]:
    """Return the distances and indices (m, 13) of the nearest other points, padded by the point itself at infinity."""
    m = len(tree.points)
    distance, index = tree.nearest(tree.points, min(NEIGHBORS + 2, m))
    own = index == np.arange(m)[:, None]
    own[~own.any(axis=1), -1] = True
    distance, index = distance[~own].reshape(m, -1), index[~own].reshape(m, -1)
    pad = NEIGHBORS + 1 - index.shape[1]
    if pad > 0:
        index = np.concatenate([index, np.repeat(np.arange(m)[:, None], pad, axis=1)], axis=1)
        distance = np.concatenate([distance, np.full((m, pad), np.inf)], axis=1)
    return distance, index
