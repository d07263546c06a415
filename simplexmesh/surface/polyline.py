"""A polyline on a surface: a level line, or any other chain of edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm


@dataclass(frozen=True, eq=False, repr=False)
class Polyline:
    """A polyline on a surface, with its points on edges.

    Attributes
    ----------
    points : (k, 3) array of float
        In order, higher values on the left seen from outside.
    edges : (k, 2) array of int
        Ends of the edge of each point.
    closed : bool
        Whether the last point is connected to the first.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(60, 24).triangulated("dual")
    >>> [line.closed for line in sm.level_lines(ring, ring.vertices[:, 2])]
    [True, True]
    """

    points: Array
    edges: Indices
    closed: bool

    def __repr__(self) -> str:
        ends = "closed" if self.closed else "open"
        return f"{type(self).__name__}({len(self.points)} points, {ends}, length {self.length:.6g})"

    @property
    def length(self) -> float:
        """Length, in the surface's unit."""
        ends = np.concatenate([self.points, self.points[:1]]) if self.closed else self.points
        return float(norm(np.diff(ends, axis=0)).sum())
