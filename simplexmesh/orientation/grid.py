"""A grid of cubic cells around points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Array = NDArray[np.float64]


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
