"""Inside and outside of points without normals: flood fill of a grid from its border, up to a wall around the points.

Neither normals nor the noise level need be known. Grids with cells finer than the gaps between points leak, coarser
ones close openings, so the finest grid that does not leak is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.initial import _kernels_grid
from simplexmesh.motion.initial.grid import Grid

Array = NDArray[np.float64]

WALL_RADIUS = 1.6


@dataclass(frozen=True, eq=False)
class Flood:
    """The result of a flood fill.

    Attributes
    ----------
    grid : Grid
        Position and resolution.
    outside : (nx, ny, nz) array of bool
        Samples reached from the border.
    wall : (nx, ny, nz) array of bool
        Samples within `WALL_RADIUS` cells of a point.
    """

    grid: Grid
    outside: NDArray[np.bool_]
    wall: NDArray[np.bool_]

    @property
    def enclosed(self) -> float:
        """Volume enclosed by the wall, without the wall."""
        return float(np.count_nonzero(~self.outside & ~self.wall)) * self.grid.cell**3


def flooded(points: Array, cell: float, wall: float = WALL_RADIUS) -> Flood:
    """Return the flood fill, from the border, of a grid with cells of side `cell` around the points.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> flood = flooded(sphere(10).vertices, 0.1)
    >>> bool(2 < flood.enclosed < 4 * np.pi / 3)
    True
    """
    grid = Grid.around(points, cell, margin=wall + 3)
    near, outside = np.zeros(grid.shape, bool), np.empty(grid.shape, bool)
    _kernels_grid.mark_near(grid.to_index(points), wall, near)
    _kernels_grid.flood(near, outside)
    return Flood(grid, outside, near)
