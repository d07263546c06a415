"""Poisson reconstruction: the smoothed indicator function of the solid that points bound, and so their outward normals.

The equation is solved by the fast Fourier transform (M. Kazhdan, Reconstruction of solid models from oriented point
sets, SGP 2005). Normals that contradict their indicator are flipped, repeatedly (F. Hou, C. Wang, W. Wang, H. Qin, C.
Qian, Y. He, Iterative Poisson surface reconstruction for unoriented points, ACM Trans. Graph. 41, 2022; there from
random normals). Of several initializations the one is best whose indicator is most alike at all points; its energy does
not tell, as sheets whose two sides face the same way have more, nor does how much of space is clearly inside or out,
as that prefers cups that are full. The first comes from a flood fill of a grid from its border: grids finer than the
gaps between points leak, coarser ones close openings, so the finest that does not leak is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import dot, normalized
from simplexmesh.numerics.plane_fits import Planes, sided
from simplexmesh.orientation import _kernels_grid

WALL_RADIUS = 1.6
"""In cells: the finest grid that does not leak then has the right genus; thinner walls leak, thicker fill handles."""

MOST_FLIPS = 8
"""Iterations; normals that were right but for noise settle in 1 to 4, those of a flood that leaked hardly ever do."""

MOSTLY = 0.9
"""Share of normals on which most floods agree with the right ones, of walls of three point spacings and more."""

SURE = 0.15
"""Spread of the indicator, whose jump is 1, below which the first normals are believed: 0.1 on thin noisy walls."""

SCREEN, PRIOR = 1.5, 0.1
"""Of screening: its radius in cells, and the share of the usual density of points where it is halved, for outliers."""

BEYOND = 0.35
"""Magnitude of the indicator, whose jump is 1, where a side is wrong: edges have 0.3, filled tunnels up to 1."""

MOST_BEYOND = 0.1
"""Share of such sides above which none is turned: filled tunnels have up to 0.08, and more of fins became wrong."""

PATIENCE, FEWER = 3, 0.9
"""Rounds in which wrong sides become fewer by this factor as tunnels open from their ends; those of noise stay."""

DOUBTFUL = 1.5
"""Factor on the spread of an indicator whose normals do not settle, and of one whose normals contradict most floods."""

FLOOD_CELLS = (16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Cells along the longest side of the grids that are flooded."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A grid of cubic cells around points."""

    origin: Array  # (3,) position of sample (0, 0, 0)
    cell: float  # side of the cells
    shape: tuple[int, int, int]  # number of samples along each axis

    @staticmethod
    def around(points: Array, cell: float, *, margin: float, fast: bool = False) -> Grid:
        """Return the grid around the points with a margin in cells; `fast` rounds up to efficient FFT lengths."""
        low, high = points.min(axis=0), points.max(axis=0)
        count = np.ceil((high - low) / cell + 2 * margin).astype(int) + 1
        if fast:
            count = np.array([fft.next_fast_len(int(n), real=True) for n in count])
        origin = (low + high) / 2 - cell * (count - 1) / 2
        return Grid(origin, cell, (int(count[0]), int(count[1]), int(count[2])))

    def to_index(self, points: Array) -> Array:
        """Return continuous grid indices of points."""
        return (points - self.origin) / self.cell

    def to_world(self, index: Array) -> Array:
        """Return the positions of grid indices, in the unit of the points."""
        return self.origin + self.cell * index


@dataclass(frozen=True, eq=False)
class Flood:
    """The result of a flood fill."""

    grid: Grid
    outside: Mask  # (nx, ny, nz) samples reached from the border
    wall: Mask  # (nx, ny, nz) samples within `WALL_RADIUS` cells of a point

    @property
    def enclosed(self) -> float:
        """Volume enclosed by the wall, without the wall."""
        return float(np.count_nonzero(~self.outside & ~self.wall)) * self.grid.cell**3


def flooded(points: Array, cell: float) -> Flood:
    """Return the flood fill, from the border, of a grid with cells of side `cell` around the points."""
    grid = Grid.around(points, cell, margin=WALL_RADIUS + 3)
    wall = np.zeros(grid.shape, bool)
    _kernels_grid.mark_near(grid.to_index(points), WALL_RADIUS, wall)
    filled = wall.copy()
    _kernels_grid.flood(filled)
    return Flood(grid, filled ^ wall, wall)


@dataclass(frozen=True, eq=False)
class Indicator:
    """An indicator function on a grid: about 1/2 inside and -1/2 outside of a solid, 0 at its points."""

    grid: Grid
    values: NDArray[np.float32]  # (nx, ny, nz)

    def at(self, points: Array) -> tuple[Array, Array]:
        """Return the (n,) values and (n, 3) gradients (per unit of length) at points within the grid."""
        values, gradients = np.zeros(len(points)), np.zeros((len(points), 3))
        _kernels_grid.interpolate(self.values, self.grid.to_index(points), values, gradients)
        return values, gradients / self.grid.cell

    @property
    def border(self) -> Array:
        """The samples on the six sides of the grid."""
        return np.concatenate([np.take(self.values, side, axis=axis).ravel() for axis in range(3) for side in (0, -1)])


def screened(indicator: Indicator, points: Array) -> Indicator:
    """Return the indicator less its mean at the points nearby, as 0 at all points only in the mean loses thin limbs.

    Screening as of M. Kazhdan, H. Hoppe, Screened Poisson surface reconstruction, ACM Trans. Graph. 32(3), 2013, but
    within a radius of the points and in two rounds, which needs no solver of sparse systems.
    """
    grid, values = indicator.grid, indicator.values.copy()
    at = grid.to_index(points)

    def blurred(weights: Array) -> NDArray[np.float32]:
        out = np.zeros(grid.shape, np.float32)
        _kernels_grid.splat(at, weights, out)
        return np.asarray(ndimage.gaussian_filter(out, SCREEN, truncate=3.0))

    density = blurred(np.ones(len(points)))
    density += np.float32(PRIOR * np.median(Indicator(grid, density).at(points)[0]))
    for _ in range(2):
        values -= blurred(Indicator(grid, values).at(points)[0]) / density
    return Indicator(grid, values)


@dataclass(frozen=True, eq=False)
class Poisson:
    """Points on a grid, the area each represents, and the transfer function from divergence to the indicator."""

    points: Array
    grid: Grid
    areas: Array
    transfer: NDArray[np.float32]

    @staticmethod
    def of(points: Array, cell: float) -> Poisson:
        """Return the problem on a grid with a margin wide enough for periodic images not to interfere."""
        extent = float(np.ptp(points, axis=0).max())
        grid = Grid.around(points, cell, margin=6 + 0.12 * extent / cell, fast=True)
        return Poisson(points, grid, _areas(points, grid), _transfer_function(grid.shape))

    def indicator(self, normals: Array) -> Indicator:
        """Return the field whose gradient is closest to minus the outward normals, whose lengths are weights."""
        grid, divergence = self.grid, np.zeros(self.grid.shape, np.float32)
        unit = 2.0 ** np.round(2 * np.log2(grid.cell))  # areas in the data's unit may be beyond single precision
        at, weights = grid.to_index(self.points), self.areas / unit
        for axis, half in enumerate(np.eye(3) / 2):  # of a cell to both sides: differences of neighboring samples
            _kernels_grid.splat(at - half, normals[:, axis] * weights, divergence)
            _kernels_grid.splat(at + half, -normals[:, axis] * weights, divergence)
        spectrum = fft.rfftn(divergence, workers=-1)
        spectrum *= self.transfer
        values = fft.irfftn(spectrum, s=grid.shape, workers=-1, overwrite_x=True)
        values *= np.float32(unit / grid.cell**2)
        values -= np.float32(np.average(Indicator(grid, values).at(self.points)[0], weights=self.areas))
        return Indicator(grid, values)


def _areas(points: Array, grid: Grid) -> Array:
    """Return the surface area each point represents, from a kernel density estimate: overlapping scans count once."""
    count = np.zeros(grid.shape, np.float32)
    _kernels_grid.splat(grid.to_index(points), np.ones(len(points)), count)
    density, _ = Indicator(grid, ndimage.gaussian_filter(count, 1.0)).at(points)
    spread = np.sqrt(1.0 + 1 / 3)  # of the filter and of splatting; the density of a plane is then 1 / (s sqrt(2 pi))
    return grid.cell**2 / (np.sqrt(2 * np.pi) * spread * np.maximum(density, 1e-6))


def _transfer_function(shape: tuple[int, int, int]) -> NDArray[np.float32]:
    """Return the transfer function from the divergence of the normals to the indicator, smoothed by one cell."""
    waves = [2 * np.pi * fft.fftfreq(n) for n in shape[:2]] + [2 * np.pi * fft.rfftfreq(shape[2])]  # radians per cell
    k = np.meshgrid(*[w.astype(np.float32) for w in waves], indexing="ij", sparse=True)
    laplacian = 4 * (np.sin(k[0] / 2) ** 2 + np.sin(k[1] / 2) ** 2 + np.sin(k[2] / 2) ** 2)  # of the same differences
    laplacian[0, 0, 0] = 1.0
    # differences sharpen by k^2 / 24 to second order, which the smoothing takes back
    return np.asarray(np.exp(-13 / 24 * (k[0] ** 2 + k[1] ** 2 + k[2] ** 2)) / laplacian)


@dataclass(frozen=True, eq=False)
class Fixpoint:
    """Normals that agree, or nearly, with their indicator, that of the last iteration."""

    normals: Array
    field: Indicator
    settled: bool  # hardly any normal flipped last

    def spread(self, places: Array, areas: Array) -> float:
        """Return the standard deviation of the indicator at places of the surface."""
        values = self.field.at(places)[0]
        return float(np.sqrt(np.average((values - np.average(values, weights=areas)) ** 2, weights=areas)))


def fixpoint(problem: Poisson, normals: Array) -> Fixpoint:
    """Flip normals that contradict their indicator until hardly any do."""
    for _ in range(MOST_FLIPS):
        field = problem.indicator(normals)
        wrong = dot(normals, field.at(problem.points)[1]) > 0
        normals = np.where(wrong[:, None], -normals, normals)
        settled = bool(np.count_nonzero(wrong) < 1e-3 * len(normals))
        if settled:
            break
    return Fixpoint(normals, field, settled)


def oriented_indicator(points: Array, found: Planes, cell: float) -> Indicator:
    """Return the indicator function, with cells of side `cell`, of the solid that points with unoriented normals bound.

    The first initialization comes from the flood that encloses most. If its normals settle, most floods agree with
    them and their indicator is alike at all points, they are right. If not, what most floods say is tried as it is,
    for cavities that no coarse flood enters, and led by a coarse grid, where holes in the data close, but also thin
    walls cancel out; normals that point away from the centroid, for open containers that all floods enter; and, if
    they do not settle or most floods disagree, the flood least in doubt, for fins and gaps of few spacings. Then
    neighbors on the other side of walls are known, and normals are fitted again without them, and tunnels opened that
    no flood entered.
    """
    fine = Poisson.of(points, cell)
    floods = list(_floods(points, found.spacing))
    votes = [_opposed_to(found.normals, _inward(flood, points)) for flood in floods]
    common = _opposed_to(found.normals, -np.sum(votes[1:] or votes, axis=0))  # without the coarsest

    def faults(each: Fixpoint) -> int:
        return int(not each.settled) + int((dot(each.normals, common) > 0).mean() < MOSTLY)

    def doubt(each: Fixpoint) -> float:
        return each.spread(found.places, fine.areas) * DOUBTFUL ** faults(each)

    best = fixpoint(fine, votes[int(np.argmax([flood.enclosed for flood in floods]))])
    if faults(best) or doubt(best) > SURE:
        coarse = Poisson.of(points, 2 * cell)
        away = _opposed_to(found.normals, points.mean(axis=0) - points)
        tried = [common, *(fixpoint(coarse, normals).normals for normals in (common, away))]
        if faults(best):
            tried.append(min(votes, key=lambda vote: doubt(Fixpoint(vote, fine.indicator(vote), settled=False))))
        best = min((best, *(fixpoint(fine, normals) for normals in tried)), key=doubt)
    best = min(chain((best,), _turned(fine, found, best)), key=doubt)
    return fine.indicator(sided(points, normalized(-best.field.at(points)[1]), found.near))


def _turned(problem: Poisson, found: Planes, first: Fixpoint) -> Iterator[Fixpoint]:
    """Yield normals turned, round by round, where the indicator is beyond that of a side.

    In a tunnel that is filled, all normals that point out of it agree with an indicator that jumps up into it again.
    """
    field, left = first.field, list[int]()
    while True:
        inward = field.at(problem.points)[1]
        beyond = np.abs(field.at(found.places)[0]) > BEYOND
        left.append(int(beyond.sum()))
        if left[0] > MOST_BEYOND * len(beyond):
            return
        before, lately = left[:-PATIENCE], left[-PATIENCE:]
        if not left[-1] or (before and min(lately) > FEWER * min(before)):
            return
        inward[beyond] *= -1
        normals = sided(problem.points, normalized(-inward), found.near)
        field = problem.indicator(normals)
        yield Fixpoint(normals, field, first.settled)


def _floods(points: Array, spacing: float) -> Iterator[Flood]:
    """Yield floods from coarse to fine; finer, thinner walls enclose more volume until they leak."""
    longest = float(np.ptp(points, axis=0).max())
    for cells in FLOOD_CELLS:
        if cells == FLOOD_CELLS[0] or longest / cells > 0.6 * spacing:
            yield flooded(points, longest / cells)


def _inward(flood: Flood, points: Array) -> Array:
    """Return the gradient of a flood's smoothed inside at points."""
    smooth = ndimage.gaussian_filter(np.where(flood.outside, np.float32(-0.5), np.float32(0.5)), 1.5)
    return Indicator(flood.grid, smooth).at(points)[1]


def _opposed_to(normals: Array, inward: Array) -> Array:
    """Return the normals flipped to point against the given directions."""
    return np.where(dot(normals, inward)[:, None] > 0, -normals, normals)
