"""Smoothed indicator function of the solid bounded by oriented points: Poisson reconstruction.

The Poisson equation is solved on a periodic grid by the fast Fourier transform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from simplexmesh.motion.initial import _kernels_grid
from simplexmesh.motion.initial.grid import Grid

Array = NDArray[np.float64]

BLUR = 1.0
_MARGIN_FRACTION = 0.12
_MARGIN_CELLS = 6.0


@dataclass(frozen=True, eq=False)
class Indicator:
    """An indicator function on a grid: about 1/2 inside and -1/2 outside of a solid, 0 at its points.

    Attributes
    ----------
    grid : Grid
        Position and resolution.
    values : (nx, ny, nz) array of float
        The samples.
    """

    grid: Grid
    values: NDArray[np.float32]

    def at(self, points: Array) -> tuple[Array, Array]:
        """Return the (n,) values and (n, 3) gradients (per unit of length) at points within the grid."""
        values, gradients = np.zeros(len(points)), np.zeros((len(points), 3))
        _kernels_grid.interpolate(self.values, self.grid.to_index(points), values, gradients)
        return values, gradients / self.grid.cell


def grid_for(points: Array, cell: float) -> Grid:
    """Return a grid around the points with a margin wide enough for periodic images not to interfere."""
    extent = float(np.ptp(points, axis=0).max())
    return Grid.around(points, cell, margin=_MARGIN_CELLS + _MARGIN_FRACTION * extent / cell, fast=True)


def point_areas(points: Array, grid: Grid, blur: float = BLUR) -> Array:
    """Estimate the surface area each point represents, from a kernel density estimate.

    Overlapping scans thus count once. A plane with one point per unit of area, smoothed by a Gaussian of standard
    deviation s, has the density 1 / (s sqrt(2 pi)) on the plane.
    """
    count = np.zeros((*grid.shape, 1), dtype=np.float32)
    index = grid.to_index(points)
    _kernels_grid.splat(index, np.ones((len(points), 1)), count)
    spread = float(np.hypot(blur, np.sqrt(1 / 3)))
    density, _ = Indicator(grid, ndimage.gaussian_filter(count[..., 0], blur)).at(points)
    return grid.cell**2 / (np.sqrt(2 * np.pi) * spread * np.maximum(density, 1e-6))


def wave_numbers(shape: tuple[int, int, int]) -> list[NDArray[np.float32]]:
    """Return the wave numbers of a grid's real FFT, in radians per cell, broadcastable along its axes."""
    waves = [2 * np.pi * fft.fftfreq(n) for n in shape[:2]] + [2 * np.pi * fft.rfftfreq(shape[2])]
    return list(np.meshgrid(*[w.astype(np.float32) for w in waves], indexing="ij", sparse=True))


def transfer_function(shape: tuple[int, int, int], blur: float = BLUR) -> NDArray[np.complex64]:
    """Return the transfer function from the divergence of the normals to the smoothed indicator.

    Examples
    --------
    >>> transfer_function((4, 4, 6)).shape
    (4, 4, 4)
    """
    k = wave_numbers(shape)
    k2 = k[0] ** 2 + k[1] ** 2 + k[2] ** 2
    k2[0, 0, 0] = 1.0
    return np.asarray(1j * np.exp(-0.5 * blur**2 * k2) / k2)


def poisson_indicator(
    points: Array, normals: Array, grid: Grid, weight: Array, transfer: NDArray[np.complex64] | None = None
) -> Indicator:
    """Return the field whose gradient is closest, in the least squares sense, to the inward normals on the points.

    Parameters
    ----------
    points, normals : (n, 3) array of float
        Outward normals; their lengths are confidence weights.
    grid : Grid
        From `grid_for`.
    weight : (n,) array of float
        Area that each point represents, see `point_areas`.
    transfer : array of complex64, optional
        From `transfer_function`, to reuse it for several fields on one grid.

    References
    ----------
    M. Kazhdan, Reconstruction of solid models from oriented point sets, SGP 2005.
    """
    layer = np.zeros((*grid.shape, 3), dtype=np.float32)
    unit = 2.0 ** np.round(2 * np.log2(grid.cell))  # areas in the data's unit may be beyond single precision
    _kernels_grid.splat(grid.to_index(points), normals * (weight / unit)[:, None], layer)
    total: NDArray[np.complex64] | None = None
    for axis, k in enumerate(wave_numbers(grid.shape)):
        part = k * fft.rfftn(np.ascontiguousarray(layer[..., axis]), workers=-1)
        total = part if total is None else total + part
    assert total is not None
    total *= transfer_function(grid.shape) if transfer is None else transfer
    values = fft.irfftn(total, s=grid.shape, workers=-1) / (grid.cell**2 / unit)
    found = Indicator(grid, values.astype(np.float32))
    level = float(np.average(found.at(points)[0], weights=weight))
    return Indicator(grid, found.values - np.float32(level))
