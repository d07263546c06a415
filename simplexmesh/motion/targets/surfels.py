"""Points turned into surfels: small pieces of a smooth surface, each fitted at the scale the data itself asks for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _vec
from simplexmesh.motion.targets import _kernels_lanes, _kernels_patches, _kernels_points, _kernels_wide
from simplexmesh.motion.targets import _kernels_surfels as kernels
from simplexmesh.motion.targets._kernels_fit import COUNT, CURVATURE, LEAN, NOISE, OFFSET, VARIANCE
from simplexmesh.motion.targets.tree import Tree

Array = NDArray[np.float64]

MOST_SURFELS = 60_000
PILOTS = 2_000
SMALLEST = 12  # points that the smallest scale reaches
LEVELS = 14
LONGEST = 6.0  # how far other rows of points are looked for, in radii of the smallest scale
NEIGHBORS = 12
POOL = 24  # pilots whose biases are averaged
ROOM = 2.0  # in squared supports: so much more than the nearest's squared distance lie about 16 surfels, at any height
BLEND = 1.1  # blending quiets the variance more than the bias: the best radius is larger than that of one fit


@dataclass(frozen=True, eq=False)
class Surfels:
    """Pieces of surface and who is next to whom.

    Attributes
    ----------
    table : (m, 12) array of float
        Point, unit normal, second-order form (xx, yy, zz, xy, xz, yz): see `_kernels_fit`. A normal of zero
        means that no direction is known: the surfel is but a point.
    support : (m,) array of float
        How far from its point each surfel has a say.
    neighbors : (m, 12) array of int
        The nearest surfels of each, nearest first.
    between : (m, 12) array of float
        How far those are.
    horizon : (m,) array of float
        No surfel outside the neighbors is nearer than this.
    heads : (m, 12) array of float
        What a vertex asks of its surfel first: see `_kernels_points.pack_heads`.
    patches : (m, 14, 8) array of float32
        Each surfel with its nearest, packed: see `_kernels_patches.pack_patches`.
    noise : (m,) array of float
        Standard deviation of the points along the normal, around each surfel.
    radius : (m,) array of float
        Of the neighborhood each was fitted to.
    tree : Tree
        Over the points of the surfels, in whose order they all stand.
    wide : tuple
        The same with eight children per node: see `_kernels_wide.pack_wide`.
    oriented : bool
        Whether normals point away from the solid, or either way.
    """

    table: Array
    support: Array
    neighbors: NDArray[np.int32]
    between: Array
    horizon: Array
    heads: Array
    patches: NDArray[np.float32]
    noise: Array
    radius: Array
    tree: Tree
    wide: tuple[Any, ...]
    oriented: bool

    def __len__(self) -> int:
        return len(self.table)

    @cached_property
    def spacing(self) -> float:
        """How far a place on the surface may be from the nearest surfel, all but a hundredth of them."""
        finite = self.horizon[np.isfinite(self.horizon)]
        return float(np.quantile(finite, 0.99)) if len(finite) else 0.0


def fitted_surfels(points: Array, normals: Array | None = None, spread: Array | None = None) -> Surfels:
    """Fit surfels to points.

    Fits at growing radii around some pilot points tell, per scale, the variance (from residuals) and, from what the
    next scale changes, the bias; both are averaged over neighboring pilots, and the radius of the least mean squared
    error is taken (an intersection of confidence intervals, made quieter). Then surfels are fitted at that radius
    around a selection of points as fine as the radius asks for.

    Parameters
    ----------
    points : (n, 3) array of float
    normals : (n, 3) array of float, optional
        Away from the solid; points that face away from a place do not count there.
    spread : (n, 3) array of float, optional
        One standard deviation of each point's error where that lies along a known direction; without it errors are
        taken to be alike in all directions, of unknown size.

    Returns
    -------
    Surfels

    References
    ----------
    O. Lepski, On a problem of adaptive estimation in Gaussian white noise, 1991. C. Loader, Local Regression and
    Likelihood, 1999.
    """
    first = _distinct(points)
    if len(first) < len(points):
        points, normals, spread = points[first], _rows(normals, first), _rows(spread, first)
    tree = Tree.of(points)
    none = np.zeros((0, 3))
    facing = none if normals is None else np.ascontiguousarray(normals[tree.order], dtype=np.float64)
    errors = none if spread is None else np.ascontiguousarray(spread[tree.order], dtype=np.float64)
    data = (tree.points, facing, errors, tree.starts, tree.ends, tree.boxes)
    pilots = np.unique(np.linspace(0, len(points) - 1, PILOTS).astype(np.int64))
    radii = _chosen_radii(data, tree, pilots)
    centers = _thinned(tree.points, np.arange(len(points)), float(np.quantile(radii, 0.1)) / 4)
    if len(centers) > MOST_SURFELS:
        centers = centers[np.linspace(0, len(centers) - 1, MOST_SURFELS).astype(np.int64)]
    near, which = Tree.of(tree.points[pilots]), min(4, len(pilots))
    _, index = near.nearest(tree.points[centers], which)
    wanted = np.exp(np.log(radii[near.order[index]]).mean(axis=1))
    wanted = np.maximum(wanted, _base_radii(tree, centers))
    cell = float(np.quantile(wanted, 0.1)) / 5
    table, reports = np.zeros((len(centers), 12)), np.zeros((len(centers), 6))
    kernels.fit_all(*data, centers, wanted, spread is None, table, reports)
    trusted = _trusted(reports, wanted)
    if spread is not None and normals is not None:  # no outliers there: what is too thin to fit stands as it is
        table[~trusted, :3], table[~trusted, 3:6], table[~trusted, 6:] = (
            tree.points[centers[~trusted]],
            facing[centers[~trusted]],
            0.0,
        )
        reports[~trusted, NOISE] = _vec.norm(errors[centers[~trusted]])
        trusted[:] = True
    good = np.flatnonzero(trusted)
    if len(good) < 4:
        return _bare(tree.points, None if normals is None else facing)
    keep = good[_thinned(table[good, :3], np.arange(len(good)), cell)]
    return _linked(table[keep], reports[keep, NOISE], wanted[keep], oriented=normals is not None, blended=1)


def _bare(points: Array, normals: Array | None) -> Surfels:
    """Return the points themselves as surfels: too few, or too scattered, for a surface."""
    table = np.zeros((len(points), 12))
    table[:, :3] = points
    if normals is not None:
        table[:, 3:6] = normals
    return _linked(table, np.zeros(len(table)), np.zeros(len(table)), oriented=normals is not None)


def _distinct(points: Array) -> NDArray[np.int64]:
    """Return the index of one point of each group of equal ones, in order."""
    along = (points - points[0]) @ np.array([0.5772156649, 0.9159655942, 0.2614972128])
    order = np.argsort(along, kind="stable")
    fresh = np.ones(len(points), dtype=bool)
    fresh[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    return np.sort(order[fresh])


def _rows(values: Array | None, index: NDArray[np.int64]) -> Array | None:
    return None if values is None else values[index]


def _base_radii(tree: Tree, centers: NDArray[np.int64]) -> Array:
    k = min(SMALLEST, len(tree.points))
    distance, _ = tree.nearest(tree.points[centers], k)
    base = 1.25 * distance[:, -1]
    return np.maximum(base, max(float(np.median(base)) * 1e-3, 1e-300))


def _chosen_radii(data: tuple[NDArray[Any], ...], tree: Tree, pilots: NDArray[np.int64]) -> Array:
    """Return, per pilot, the radius of the least mean squared error."""
    near = Tree.of(tree.points[pilots])
    _, index = near.nearest(tree.points[pilots], min(POOL, len(pilots)))
    around = near.order[index]
    bases = np.median(_base_radii(tree, pilots)[around], axis=1)
    largest = max(0.3 * float(np.linalg.norm(tree.boxes[0, 3:] - tree.boxes[0, :3])), bases.max())
    if not len(data[2]):  # points whose errors are known come from a grid, not in rows
        wide = bases.copy()
        kernels.widen(*tree.arrays, pilots, np.minimum(largest, LONGEST * bases), wide)
        bases = np.maximum(bases, np.median(wide[around], axis=1))
    table = np.zeros((len(pilots), LEVELS, 6))
    kernels.fit_scales(*data, pilots, bases, largest, table)
    variance, offset = table[:, :, VARIANCE], table[:, :, OFFSET]
    # errors of fourth order grow fourfold from scale to scale: what the next scale changes tells this one's
    doubt = np.maximum(variance[:, :-1] - variance[:, 1:], 0.25 * variance[:, :-1])
    excess = np.full_like(variance, np.nan)
    excess[:, :-1] = (offset[:, 1:] ** 2 - doubt) / 9
    radius = bases[:, None] * kernels.RATIO ** np.arange(LEVELS)
    blurred = radius < 3.0 * table[:, :, NOISE]
    bias = np.where(np.isfinite(pooled := _pooled(excess, blurred, around)), pooled, 0.0)
    # and no less than that of a fit with these weights to a cylinder: radius^4 curvature^3 / 213
    bend = _pooled(table[:, :, CURVATURE], blurred, around)
    bias = np.maximum(bias, (radius**4 * bend**3 / 213) ** 2)
    error = np.where(blurred | ~np.isfinite(variance), np.inf, variance + bias)
    error[np.isnan(error)] = np.inf
    found: NDArray[np.bool_] = np.asarray(np.isfinite(error).any(axis=1))
    best = np.where(found, np.argmin(error, axis=1), np.argmin(np.where(np.isfinite(variance), 0, 1), axis=1))
    logs = np.log(bases) + best * np.log(kernels.RATIO)
    usable = found[around]
    smooth = (np.where(usable, logs[around], 0.0).sum(axis=1)) / np.maximum(usable.sum(axis=1), 1)
    return BLEND * np.exp(np.where(usable.any(axis=1), smooth, logs))


def _pooled(values: Array, blurred: NDArray[np.bool_], around: NDArray[np.int64]) -> Array:
    """Return, per pilot and scale, the mean over the pilots around that have a value; NaN where most have none."""
    known = np.isfinite(values) & ~blurred
    count = known[around].sum(axis=1)
    total = np.where(known, values, 0.0)[around].sum(axis=1)
    return np.where(4 * count > around.shape[1], total / np.maximum(count, 1), np.nan)


def _trusted(reports: Array, radii: Array) -> NDArray[np.bool_]:
    """Tell which fits are of a surface: thin against the radius, its points all round, the place itself on it."""
    noise, offset = reports[:, NOISE], np.abs(reports[:, OFFSET])
    return np.asarray(
        (noise < 0.3 * radii)
        & (reports[:, LEAN] < 0.5)
        & (reports[:, COUNT] >= 6)
        & (np.sqrt(reports[:, VARIANCE]) <= np.minimum(0.1 * radii, 1.2 * noise))
        & (reports[:, CURVATURE] * radii < 1.6)
        & (offset < 4.0 * noise + 0.1 * radii)
    )


def _thinned(points: Array, index: NDArray[np.int64], cell: float) -> NDArray[np.int64]:
    """Return those of `index` that are the first in their cell of a grid, in order."""
    if cell <= 0.0:
        return index
    at = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    shape = at.max(axis=0) + 1
    key = (at[:, 0] * shape[1] + at[:, 1]) * shape[2] + at[:, 2]
    _, first = np.unique(key, return_index=True)
    return index[np.sort(first)]


def _linked(table: Array, noise: Array, radius: Array, *, oriented: bool, blended: int = 0) -> Surfels:
    """Put surfels in order and find who is next to whom; average each with its neighbors `blended` times."""
    tree = Tree.of(table[:, :3], _kernels_lanes.WIDTH)
    table = np.ascontiguousarray(table[tree.order])
    noise, radius = noise[tree.order], radius[tree.order]
    m = len(table)
    distance, index = tree.nearest(tree.points, min(NEIGHBORS + 2, m))
    own = index == np.arange(m)[:, None]
    own[~own.any(axis=1), -1] = True
    distance, index = distance[~own].reshape(m, -1), index[~own].reshape(m, -1)
    pad = NEIGHBORS + 1 - index.shape[1]
    if pad > 0:
        index = np.concatenate([index, np.repeat(np.arange(m)[:, None], pad, axis=1)], axis=1)
        distance = np.concatenate([distance, np.full((m, pad), np.inf)], axis=1)
    neighbors = np.ascontiguousarray(index[:, :NEIGHBORS].astype(np.int32))
    finite = np.where(np.isfinite(distance), distance, 0.0)
    if blended:
        wide = np.maximum(1.2 * finite[:, :8].max(axis=1), 1e-300)
        out = np.zeros_like(table)
        _kernels_patches.blend_all(table, wide, neighbors, oriented, out)
        return _linked(out, noise, radius, oriented=oriented, blended=blended - 1)
    narrow, support = np.maximum(1.5 * finite[:, :3].max(axis=1), 1e-300), np.zeros(m)
    _kernels_patches.even_support(narrow, neighbors, support)
    patches = np.zeros((m, 14, _kernels_patches.LANES), np.float32)
    _kernels_patches.pack_patches(table, support, neighbors, oriented, patches)
    between, horizon = np.ascontiguousarray(distance[:, :NEIGHBORS]), distance[:, -1].copy()
    return Surfels(
        table=table,
        support=support,
        neighbors=neighbors,
        between=between,
        horizon=horizon,
        heads=_kernels_points.pack_heads(table, support, between, horizon),
        patches=patches,
        noise=noise,
        radius=radius,
        tree=tree,
        wide=_kernels_wide.pack_wide(tree.points, table[:, 3:6], tree.starts, tree.ends, tree.boxes, ROOM * support**2),
        oriented=oriented,
    )
