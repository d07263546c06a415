"""Rigid motions between corresponding points: point to point, and point to plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, dot
from simplexmesh.numerics.robust import robust_weights

TANGENTIAL_WEIGHT = 0.02
"""Weight of tangential residuals, small since those of neighbors are correlated; without any, motions that the normals
do not determine, of nearly round bodies for example, would be arbitrary."""


def rotation_angle(T: Array) -> float:
    """Return the angle of a rigid motion (4, 4), in [0, pi]."""
    return float(Rotation.from_matrix(T[:3, :3]).magnitude())


def point_pairs(pairs: Any, owners: str) -> tuple[Array, Array]:
    """Return the two arrays (k, 3) of a pair of corresponding points; `owners` names whose they are in the message."""
    if not isinstance(pairs, tuple | list) or len(pairs) != 2:
        raise TypeError(f"pairs must be two arrays of points, {owners}")
    first = checks.array("pairs[0]", pairs[0], (None, 3))
    return first, checks.array("pairs[1]", pairs[1], (len(first), 3))


def relative_extents(points: Array) -> Array:
    """Return the principal extents (3,) of points relative to the largest, which comes first."""
    extents = np.linalg.svd(points - points.mean(axis=0), full_matrices=False, compute_uv=False)
    return np.asarray(extents / max(extents[0], 1e-300))


def rigid_fit(source: Array, target: Array) -> Array:
    """Return the rigid motion (4, 4) between corresponding points, in least squares (Horn 1987, Kabsch 1976)."""
    center, goal = source.mean(axis=0), target.mean(axis=0)
    u, _, v = np.linalg.svd((source - center).T @ (target - goal))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    T = np.eye(4)
    T[:3, :3] = (u @ sign @ v).T
    T[:3, 3] = goal - T[:3, :3] @ center
    return T


def point_to_plane_fit(source: Array, target: Array, normals: Array, start: Array) -> Array:
    """Return the rigid motion (4, 4) that minimizes robust distances to tangent planes (Delingette 1994, 6.11)."""
    T = start.copy()
    extent = max(float(np.sqrt(((target - target.mean(axis=0)) ** 2).sum(axis=1).mean())), 1e-300)
    for _ in range(20):
        at = source @ T[:3, :3].T + T[:3, 3]
        center = at.mean(axis=0)
        residual = dot(at - target, normals)
        weight = robust_weights(residual, 1e-12 * extent)
        local = (at - center) / extent
        rows = plane_jacobian(local, normals)
        tangential = at - target - residual[:, None] * normals
        variance = max(float(np.median((tangential**2).sum(axis=1))), 1e-24 * extent**2, 1e-300)
        relative_weight = TANGENTIAL_WEIGHT * float(np.median(residual**2)) / variance
        matrix = (rows * weight[:, None]).T @ rows
        vector = rows.T @ (weight * residual)
        for axis in np.eye(3):
            projected = axis - dot(normals, axis[None])[:, None] * normals
            rows = plane_jacobian(local, projected)
            matrix += relative_weight * rows.T @ rows
            vector += relative_weight * rows.T @ dot(tangential, axis[None])
        x = -np.linalg.pinv(matrix, rcond=1e-9, hermitian=True) @ vector
        T = small_motion(x[:3] / extent, x[3:], center) @ T
        if np.linalg.norm(x) < 1e-9 * extent:
            break
    return T


def plane_jacobian(points: Array, normals: Array) -> Array:
    """Return the derivatives (n, 6) of distances to planes by a small rotation about the origin and a shift."""
    return np.hstack([cross(points, normals), normals])


def small_motion(vector: Array, shift: Array, center: Array) -> Array:
    """Return the motion (4, 4) of a rotation vector about a center, followed by a shift."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
    T[:3, 3] = center + shift - T[:3, :3] @ center
    return T
