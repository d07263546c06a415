"""The target of points in several parts, each with a surface of its own, of which each vertex sees one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.motion.targets.points import SurfelTarget
from simplexmesh.motion.targets.surfels.surfels import assembled, fits
from simplexmesh.numerics.kd_tree import nearest

APART = 4.0
"""Distance of the places to which parts are moved, in diagonals of all of them."""


class PartedPoints(SurfelTarget):
    """The surfaces of parts of points, moved apart so that none is near another: one search then serves all.

    Parameters
    ----------
    points, normals : (n, 3) array of float
        Points and outward normals.
    parts : sequence of arrays of int
        The points of each part, at least one.
    errors : (n, 3) array of float, optional
        As of `SurfelTarget`.
    """

    def __init__(self, points: Array, normals: Array, parts: Sequence[Indices], errors: Array | None) -> None:
        self.center = points.mean(axis=0)
        self._reach = float(np.linalg.norm(np.ptp(points, axis=0)))
        self._shift = np.zeros((len(parts), 3))
        self._shift[:, 0] = APART * self._reach * np.arange(len(parts))
        whole = sum(map(len, parts))
        each = [
            fits(points[p] - self.center, normals[p], None if errors is None else errors[p], share=len(p) / whole)
            for p in parts
        ]
        for shift, fit in zip(self._shift, each, strict=True):
            fit.table[:, :3] += shift
        self._take(assembled(*map(np.concatenate, zip(*each, strict=True)), oriented=True))

    def gap_to(self, part: Indices, vertices: Array, normals: Array, reach: float) -> Array:
        """Return what `gap` does, of the part (n,) that each vertex sees; none is farther than the diagonal."""
        return self.gap(vertices + self._shift[part], normals, min(reach, self._reach))

    def facing(self, part: Indices, places: Array, reach: float) -> tuple[Array, Array]:
        """Return the normals (n, 3) of parts (n,) near places, and how far the parts are along them, or NaN."""
        index = nearest(self._surfels, places + self._shift[part] - self.center, 1)[1][:, 0]
        normals = np.ascontiguousarray(self._surfels.table[index, 3:6])
        return normals, self.gap_to(part, places, normals, reach)
