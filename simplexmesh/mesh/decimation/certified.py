"""Distances to a triangulated surface, and a certificate that other triangles are within a distance of it everywhere.

Triangles are bisected until one triangle of the surface is near all three corners of each part, and so, distance to a
convex set being convex, near all of it; or until the part, every point within side / sqrt(3) of a corner, is too small.
"""

from __future__ import annotations

from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.decimation import _kernels_fitting as kernels

RESOLUTION, ROUNDING = 0.05, 1e-12
"""Parts smaller than this times the distance, or times the largest coordinate, are not bisected and count as beyond."""

FARTHER = 1.1
"""Once a point beyond the distance is found, only points farther by this factor are searched for."""

MAX_PARTS = 1000
"""A triangle in more parts at once counts as beyond: a bound on memory."""


class Parts(NamedTuple):
    """Parts of triangles."""

    owner: Indices  # (p,) the triangle that each is of
    corners: Array  # (p, 3, 3)
    near: Indices  # (p, 3) the triangle of the surface closest to each corner
    far: Array  # (p, 3) its distance

    @property
    def sides(self) -> Array:
        """(p, 3) the lengths of the sides, each from a corner to the next."""
        return norm(np.roll(self.corners, -1, axis=1) - self.corners)

    def chosen(self, which: Mask) -> Parts:
        """Return the parts of a mask."""
        return Parts._make(values[which] for values in self)


class Surface:
    """Triangles in a bounding-box tree; degenerate ones, such as segments with two corners the same, are allowed."""

    def __init__(self, points: Array, triangles: NDArray[np.integer]) -> None:
        self.points = np.array(points, np.float64)
        self.triangles = np.array(triangles, np.int64)
        self._tree = igl.AABB()
        if len(self.triangles):
            self._tree.init(self.points, self.triangles)

    def closest(self, points: Array) -> tuple[Indices, Array, Array]:
        """Return the closest triangle (p,) of points (p, 3), the closest point (p, 3) on it, and the distance (p,)."""
        if not len(points):
            return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
        squared, found, closest = self._tree.squared_distance(self.points, self.triangles, np.ascontiguousarray(points))
        return np.ravel(found), np.reshape(closest, (-1, 3)), np.sqrt(np.ravel(squared))

    def beyond(self, points: Array, triangles: NDArray[np.integer], distance: float) -> tuple[Indices, Array]:
        """Return the triangles not certainly within a distance, and nearly the farthest point (p, 3) of each."""
        found, _, far = self.closest(points)
        parts = Parts(np.arange(len(triangles)), points[triangles], found[triangles], far[triangles])
        worst, where = np.full(len(triangles), -1.0), np.zeros((len(triangles), 3))
        for corner in triangles.T:
            farther = far[corner] > worst
            worst[farther], where[farther] = far[corner[farther]], points[corner[farther]]
        uncertain = np.zeros(len(triangles), bool)
        smallest = max(RESOLUTION * distance, ROUNDING * float(np.abs(points).max()))
        while len(parts.owner):
            limit = np.where(worst > distance, FARTHER * worst, distance)[parts.owner]
            parts = parts.chosen(~self._within(parts, limit))
            crowded = np.bincount(parts.owner, minlength=len(triangles)) > MAX_PARTS
            final = (parts.sides.max(axis=1) < smallest) | crowded[parts.owner]
            uncertain[parts.owner[final]] = True
            parts, new, middles = self._bisected(parts.chosen(~final))
            rising = np.argsort(new, kind="stable")
            farther = rising[new[rising] > worst[parts.owner[rising]]]
            worst[parts.owner[farther]], where[parts.owner[farther]] = new[farther], middles[farther]
        out = np.flatnonzero(uncertain | (worst > distance))
        return out, where[out]

    def _within(self, parts: Parts, limit: Array) -> Mask:
        """Return which parts are certainly within their limits (p,) of the surface."""
        out = parts.far.max(axis=1) + parts.sides.max(axis=1) / np.sqrt(3) <= limit
        left = np.flatnonzero(~out)
        out[left] = kernels.are_covered(self.points, self.triangles, parts.corners[left], parts.near[left], limit[left])
        return out

    def _bisected(self, parts: Parts) -> tuple[Parts, Array, Array]:
        """Return the first and the second halves of parts, and the distances and positions of their new corners."""
        row, start = np.arange(len(parts.owner)), parts.sides.argmax(axis=1)
        end = (start + 1) % 3
        middle = (parts.corners[row, start] + parts.corners[row, end]) / 2
        found, _, far = self.closest(middle)
        one, other = (Parts._make(np.array(values) for values in parts) for _ in range(2))
        for half, corner in ((one, end), (other, start)):
            half.corners[row, corner], half.near[row, corner], half.far[row, corner] = middle, found, far
        return Parts._make(np.concatenate(both) for both in zip(one, other, strict=True)), far, middle
