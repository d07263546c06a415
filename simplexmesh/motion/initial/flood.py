"""Inside and outside of bare points: the outside of a grid is flooded up to a wall around the points.

Nothing need be known of normals or noise. Cells finer than the gaps between points leak, coarser ones close what
should stay open, so the finest grid that does not leak is the one to use.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.initial import _kernels_grid
from simplexmesh.motion.initial.frame import Frame

Array = NDArray[np.float64]

WALL = 1.6


@dataclass(frozen=True, eq=False)
class Flood:
    """A flooded grid.

    Attributes
    ----------
    frame : Frame
        Where the grid is.
    outside : (nx, ny, nz) array of bool
        Samples reached from the border.
    wall : (nx, ny, nz) array of bool
        Samples nearer than `WALL` cells to a point.
    """

    frame: Frame
    outside: NDArray[np.bool_]
    wall: NDArray[np.bool_]

    @property
    def hollow(self) -> float:
        """Volume enclosed by the wall, wall not counted."""
        return float(np.count_nonzero(~self.outside & ~self.wall)) * self.frame.cell**3


def flooded(points: Array, cell: float, wall: float = WALL) -> Flood:
    """Return the grid of cells of side `cell` around the points, flooded from its border.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> flood = flooded(sphere(10).vertices, 0.1)
    >>> bool(2 < flood.hollow < 4 * np.pi / 3)
    True
    """
    frame = Frame.around(points, cell, margin=wall + 3)
    near, outside = np.zeros(frame.shape, bool), np.empty(frame.shape, bool)
    _kernels_grid.raise_wall(frame.to_index(points), wall, near)
    _kernels_grid.flood(near, outside)
    return Flood(frame, outside, near)
