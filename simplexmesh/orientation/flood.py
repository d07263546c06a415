"""Inside and outside of points without normals: flood fill of a grid from its border, up to a wall around the points.

Neither normals nor the noise level need be known. Grids with cells finer than the gaps between points leak, coarser
ones close openings, so the finest grid that does not leak is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.orientation import _kernels_grid
from simplexmesh.orientation.grid import Grid

Array = NDArray[np.float64]

WALL_RADIUS = 1.6
"""In cells: the finest grid that does not leak then has the right genus; thinner walls leak, thicker fill handles."""


@dataclass(frozen=True, eq=False)
class Flood:
    """The result of a flood fill."""

    grid: Grid
    outside: NDArray[np.bool_]  # (nx, ny, nz) samples reached from the border
    wall: NDArray[np.bool_]  # (nx, ny, nz) samples within `WALL_RADIUS` cells of a point

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
