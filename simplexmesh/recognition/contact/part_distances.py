"""Signed distances between two parts, and their derivatives by a small motion of one of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.numerics.rigid import plane_jacobian

FACING_COSINE = -0.3
"""Surfaces face each other where the cosine between their normals is less."""


class Part:
    """A surface with vertex areas, and signed distances to it with equal positions merged; vertices keep their rows."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.points, self.normals, self.diagonal = mesh.vertices, mesh.vertex_normals, mesh.diagonal
        self.areas = np.bincount(mesh.faces.ravel(), np.repeat(norm(mesh.face_vectors) / 6, 3), len(mesh.vertices))
        welded = mesh.welded(report=False)
        self.surface, self.closed = Triangles(welded), welded.is_closed

    def signed_distance(self, points: Array) -> tuple[Array, Array]:
        """Return signed distances (n,) to the surface, NaN beyond its border, and their gradients (n, 3)."""
        distance, direction, beyond = self.surface.signed(points)
        return np.where(beyond, np.nan, distance), direction


class PartDistances(NamedTuple):
    """Signed distances between two parts, at vertices of either near the other, and their derivatives."""

    distance: Array  # (m,)
    jacobian: Array  # (m, 6) by a rotation of the moving part about `center`, in units of 1 / `radius`, and a shift
    area: Array  # (m,) of the moving part's vertices where the surfaces face each other, otherwise 0
    center: Array  # (3,)
    radius: float  # root mean square distance of the vertices to the center
    moving_rows: Indices  # the vertices of the moving part
    fixed_rows: Indices  # and of the fixed one


def part_distances(
    moving: Part, fixed: Part, T: Array, reach: float, behind: float, subset: tuple[Indices, Indices] | None = None
) -> PartDistances:
    """Return the distances of a part moved by T to a fixed one, from -`behind`, if that is open, to `reach`."""
    R, t = T[:3, :3], T[:3, 3]
    moving_rows, fixed_rows = subset or (np.arange(len(moving.points)), np.arange(len(fixed.points)))
    points, fixed_points = moving.points[moving_rows] @ R.T + t, fixed.points[fixed_rows]
    distance, outward = fixed.signed_distance(points)
    back_distance, inward = moving.signed_distance((fixed_points - t) @ R)
    near = _within(distance, reach, np.inf if fixed.closed else behind)
    near_back = _within(back_distance, reach, np.inf if moving.closed else behind)
    contact_points = np.vstack([points[near], fixed_points[near_back]])
    directions = np.vstack([outward[near], -inward[near_back] @ R.T])
    facing = dot(moving.normals[moving_rows] @ R.T, outward) < FACING_COSINE
    area = np.where(facing, moving.areas[moving_rows], 0.0)[near]
    center, radius = t, 1.0
    if len(contact_points):
        center = contact_points.mean(axis=0)
        radius = max(float(np.sqrt(((contact_points - center) ** 2).sum(axis=1).mean())), 1e-300)
    jacobian = plane_jacobian((contact_points - center) / radius, directions)
    distances = np.concatenate([distance[near], back_distance[near_back]])
    areas = np.append(area, np.zeros(int(near_back.sum())))
    return PartDistances(distances, jacobian, areas, center, radius, moving_rows[near], fixed_rows[near_back])


def _within(distance: Array, reach: float, behind: float) -> Mask:
    """Return a mask of the signed distances that are known, at most `reach`, and at least -`behind`."""
    with np.errstate(invalid="ignore"):
        return np.asarray((distance <= reach) & (distance >= -behind))
