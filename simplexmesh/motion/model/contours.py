"""Contours in motion: rims of holes and contours with conditions, which move as polygons in space, not as a surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import dot, norm, normalized, sums
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model import _kernels_contours
from simplexmesh.motion.model._kernels_contours import Courses, Shapes
from simplexmesh.motion.model._kernels_step import SHAPE, Forces, Frames, Moving, Step
from simplexmesh.motion.model.conditions import Condition

MIN_WIDTH = 3.0
"""In mean edges of the mesh: narrower holes of the data are below its resolution and attract nothing."""

MAX_SPACING = 1.5
"""In distances between neighbors along a hole: points of the border farther away belong to other holes."""


def rims_of(connectivity: Connectivity) -> Courses:
    """Return the courses of all holes."""
    c = connectivity
    loops = [c.face_vertices[c.face_offsets[f] : c.face_offsets[f + 1]] for f in np.flatnonzero(c.face_is_hole)]
    return courses([(loop, True) for loop in loops])


def courses(lines: Sequence[tuple[NDArray[np.integer[Any]], bool]]) -> Courses:
    """Return the courses of contours, given by their vertices and whether they are closed."""
    parts: list[list[NDArray[np.integer[Any]]]] = [[np.zeros(0, np.int64)] for _ in range(3)]
    start = 0
    for vertices, closed in lines:
        rows = start + np.arange(len(vertices))
        before, after = np.roll(rows, 1), np.roll(rows, -1)
        if not closed:
            before[[0, -1]] = after[[0, -1]] = rows[[0, -1]]
        for part, values in zip(parts, (vertices, before, after), strict=True):
            part.append(values)
        start += len(rows)
    return Courses(*(np.concatenate(part).astype(np.int32) for part in parts))


def wide_border(target: Any, edge: float) -> Array:
    """Return the points (k, 3) on the border of a target that a mesh of this mean edge resolves."""
    border = getattr(target, "border", None)
    return np.zeros((0, 3)) if border is None else np.asarray(border.wider(MIN_WIDTH * edge))


class BorderAttraction:
    """Attraction of boundary vertices to points (k, 3), by a fraction `weight` of the distance in one iteration."""

    def __init__(self, points: Array, weight: float) -> None:
        if len(points) > 3000:  # more take time and move nothing
            points = points[np.random.default_rng(0).choice(len(points), 3000, replace=False)]
        self.points, self.weight = points, weight
        self._tree = cKDTree(points)

    def displacements(self, vertices: Array, rims: Courses, reach: float) -> Array:
        """Return (m, 3) the way, across its hole, of each boundary vertex to the mean of its nearest points."""
        positions = vertices[rims.vertices]
        ahead, back = positions[rims.after], positions[rims.before]
        distance, nearest = self._tree.query(positions)
        step = self.points[nearest] - positions
        near, owner = cKDTree(positions).query(self.points)  # means of what is nearest draw vertices into corners
        side = 0.5 * (norm(ahead - positions) + norm(back - positions))
        assigned = near < MAX_SPACING * side[owner]
        count = np.bincount(owner[assigned], minlength=len(positions))
        total = sums(self.points[assigned], owner[assigned], len(positions))
        matched = count > 0
        step[matched] = total[matched] / count[matched, None] - positions[matched]
        along = normalized(ahead - back)
        step -= dot(step, along)[:, None] * along  # keeps the spacing along the hole
        step[distance > reach] = 0.0
        return np.asarray(self.weight * step)


class Contours:
    """Contours, and rims that the border of the data attracts, under the force of 1-simplex meshes (1994, 3.2, 4.8)."""

    def __init__(
        self, mesh: SimplexMesh, reference: SimplexMesh, attraction: BorderAttraction, conditions: Sequence[Condition]
    ) -> None:
        self.rims, self.attraction = rims_of(mesh.connectivity), attraction
        self._conditions = conditions
        moving = [(condition.line, condition._shape) for condition in conditions if condition._shape is not None]
        drawn = courses([(line.vertices, line.closed) for line, _ in moving])
        first = len(self.rims.vertices)
        shifted = (drawn.vertices, drawn.before + np.int32(first), drawn.after + np.int32(first))
        self.courses = Courses(*(np.concatenate(both) for both in zip(self.rims, shifted, strict=True)))
        m = len(self.courses.vertices)
        self.shapes = Shapes(np.full(m, np.nan), np.full(m, np.nan), np.zeros((m, 3)))
        for line, shape in moving:
            for mine, given in zip(self.shapes, shape, strict=True):
                mine[first : first + len(line)] = given
            first += len(line)
        self._shape = ContourShape(self.courses.vertices, reference.vertices, mesh.neighbors)

    def prescribe(self, vertices: Array, frames: Frames) -> None:
        """Give vertices with a condition on the surface the curvature that averages take there."""
        for condition in self._conditions:
            condition.prescribe(vertices, frames)

    def step(
        self, moving: Moving, normals: Array, constraint: NDArray[np.int8], extra: Array | None, reach: float,
        forces: Forces, out: Step,
    ) -> None:  # fmt: skip
        """Fill the rows of the next step of contours, displaced by `extra` (n, 3) too; what is pinned goes there."""
        extra = np.zeros_like(moving.vertices) if extra is None else extra.copy()
        if len(self.attraction.points):
            extra[self.rims.vertices] += self.attraction.displacements(moving.vertices, self.rims, reach)
        goals = self.goals(moving.vertices, constraint)
        _kernels_contours.contour_step(self.courses, moving, normals, goals, extra, forces, out)
        for condition in self._conditions:
            condition.place(moving, out)

    def goals(self, vertices: Array, constraint: NDArray[np.int8]) -> Array:
        """Return (m, 3) the goal of the internal force at each vertex of contours."""
        out = np.zeros((len(self.courses.vertices), 3))
        elastic = (constraint[self.courses.vertices] == SHAPE).any()
        restored = self._shape.positions(vertices) if elastic else out
        _kernels_contours.contour_goals(vertices, self.courses, self.shapes, constraint, restored, out)
        return out


class ContourShape:
    """Positions of vertices on contours relative to the vertices within two edges, taken from a reference mesh (n, 3).

    A contour in space has no normal, and frames of the few nearest neighbors amplify errors. The least-squares
    similarity between whole neighborhoods does not (M. Müller et al., "Meshless deformations based on shape matching",
    ACM Transactions on Graphics 24 (3), 2005).
    """

    def __init__(self, rows: Indices32, vertices: Array, neighbors: Indices32) -> None:
        near = neighbors[rows]
        self._neighborhoods = np.concatenate([rows[:, None], near, neighbors[near].reshape(-1, 9)], axis=1)
        weights = np.ones(self._neighborhoods.shape)
        weights[:, 4:][self._neighborhoods[:, 4:] == rows[:, None]] = 0.0
        self._weights = weights / weights.sum(axis=1, keepdims=True)
        self._offsets, _ = self._centered(vertices)
        self._size2 = np.maximum((self._weights * dot(self._offsets, self._offsets)).sum(axis=1), 1e-300)

    def _centered(self, vertices: Array) -> tuple[Array, Array]:
        """Return each neighborhood (m, 13, 3) relative to its weighted centroid, and the centroids (m, 3)."""
        positions = vertices[self._neighborhoods]
        centers = np.einsum("mk,mki->mi", self._weights, positions)
        return positions - centers[:, None], centers

    def positions(self, vertices: Array) -> Array:
        """Return (m, 3) the reference positions, mapped by the best similarity to each present neighborhood."""
        offsets, centers = self._centered(vertices)
        U, S, Vt = np.linalg.svd(np.einsum("mki,mk,mkj->mij", offsets, self._weights, self._offsets))
        sign = np.where(np.linalg.det(U) * np.linalg.det(Vt) < 0, -1.0, 1.0)
        U[:, :, 2] *= sign[:, None]
        scale = (S[:, 0] + S[:, 1] + sign * S[:, 2]) / self._size2
        return centers + scale[:, None] * np.einsum("mij,mjk,mk->mi", U, Vt, self._offsets[:, 0])
