"""Smoothed indicator function of the solid bounded by oriented points: Poisson reconstruction.

The Poisson equation is solved on a periodic grid by the fast Fourier transform (M. Kazhdan, Reconstruction of solid
models from oriented point sets, SGP 2005).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from simplexmesh.orientation import _kernels_grid
from simplexmesh.orientation.grid import Grid

Array = NDArray[np.float64]


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


@dataclass(frozen=True, eq=False)
class Poisson:
    """Points on a grid, the area each represents, and the transfer function from normals to the indicator."""

    points: Array
    grid: Grid
    areas: Array
    transfer: NDArray[np.complex64]

    @staticmethod
    def of(points: Array, cell: float) -> Poisson:
        """Return the problem on a grid with a margin wide enough for periodic images not to interfere."""
        extent = float(np.ptp(points, axis=0).max())
        grid = Grid.around(points, cell, margin=6 + 0.12 * extent / cell, fast=True)
        return Poisson(points, grid, _areas(points, grid), _transfer_function(grid.shape))

    def indicator(self, normals: Array) -> Indicator:
        """Return the field whose gradient is closest, by least squares, to the inward normals on the points.

        The lengths of the outward `normals` (n, 3) are confidence weights.
        """
        grid, layer = self.grid, np.zeros((*self.grid.shape, 3), dtype=np.float32)
        unit = 2.0 ** np.round(2 * np.log2(grid.cell))  # areas in the data's unit may be beyond single precision
        _kernels_grid.splat(grid.to_index(self.points), normals * (self.areas / unit)[:, None], layer)
        total: NDArray[np.complex64] = np.zeros(self.transfer.shape, np.complex64)
        for axis, k in enumerate(_wave_numbers(grid.shape)):
            total += k * fft.rfftn(np.ascontiguousarray(layer[..., axis]), workers=-1)
        values = fft.irfftn(total * self.transfer, s=grid.shape, workers=-1) / (grid.cell**2 / unit)
        found = Indicator(grid, values.astype(np.float32))
        level = float(np.average(found.at(self.points)[0], weights=self.areas))
        return Indicator(grid, found.values - np.float32(level))


def _areas(points: Array, grid: Grid) -> Array:
    """Return the surface area each point represents, from a kernel density estimate: overlapping scans count once."""
    count = np.zeros((*grid.shape, 1), dtype=np.float32)
    _kernels_grid.splat(grid.to_index(points), np.ones((len(points), 1)), count)
    density, _ = Indicator(grid, ndimage.gaussian_filter(count[..., 0], 1.0)).at(points)
    spread = np.sqrt(1.0 + 1 / 3)  # of the filter and of splatting; the density of a plane is then 1 / (s sqrt(2 pi))
    return grid.cell**2 / (np.sqrt(2 * np.pi) * spread * np.maximum(density, 1e-6))


def _wave_numbers(shape: tuple[int, int, int]) -> list[NDArray[np.float32]]:
    """Return the wave numbers of a grid's real FFT, in radians per cell, broadcastable along its axes."""
    waves = [2 * np.pi * fft.fftfreq(n) for n in shape[:2]] + [2 * np.pi * fft.rfftfreq(shape[2])]
    return list(np.meshgrid(*[w.astype(np.float32) for w in waves], indexing="ij", sparse=True))


def _transfer_function(shape: tuple[int, int, int]) -> NDArray[np.complex64]:
    """Return the transfer function from the divergence of the normals to the indicator, smoothed by one cell."""
    k = _wave_numbers(shape)
    k2 = k[0] ** 2 + k[1] ** 2 + k[2] ** 2
    k2[0, 0, 0] = 1.0
    return np.asarray(1j * np.exp(-0.5 * k2) / k2)
