"""Point-to-plane iterative closest points, and the covariance of the result.

Small motions are a rotation vector, then a shift. Those that the normals do not determine (equation 6.12 of
Delingette's thesis, 1994: the normal matrix is singular) are left out of a step, and get a very large variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.numerics.rigid import plane_jacobian, small_motion
from simplexmesh.numerics.robust import robust_weights
from simplexmesh.recognition.register.oriented_points import OrientedPoints

MINIMUM_COSINE = 0.5
"""Least cosine between the normals of corresponding points: noise turns normals, the other side of a sheet too."""

STEP_TOLERANCE = 3e-5
"""Largest last step, in root mean square radii: smaller ones take longer and change less than the noise of scans."""

RANK_TOLERANCE = 1e-10
MINIMUM_INLIERS = 12


@dataclass(frozen=True, eq=False)
class Correspondences:
    """Points of the source, moved, and the rows of their nearest points of the target."""

    residual: Array  # (n,) signed distance to the tangent plane at the nearest point
    nearest: Indices  # (n,)
    near: Mask  # (n,) within reach
    inlier: Mask  # (n,) within reach, and the normals agree
    cosine: Array  # (n,) between the normals
    points: Array  # (n, 3)


def find_correspondences(
    source: OrientedPoints, target: OrientedPoints, tree: cKDTree, T: Array, reach: float,
    chosen: Indices | slice = slice(None),
) -> Correspondences:  # fmt: skip
    """Return the correspondences of source points, moved by T (4, 4), with target points no farther than `reach`."""
    points = source.points[chosen] @ T[:3, :3].T + T[:3, 3]
    workers = -1 if len(points) > 1000 else 1  # starting threads takes as long as searching for a few hundred
    distance, nearest = tree.query(points, distance_upper_bound=reach, workers=workers)
    near = np.isfinite(distance)
    nearest = np.where(near, nearest, 0)
    normals = target.normals[nearest]
    cosine = dot(source.normals[chosen] @ T[:3, :3].T, normals)
    residual = dot(points - target.points[nearest], normals)
    return Correspondences(residual, nearest, near, near & (cosine > MINIMUM_COSINE), cosine, points)


def refined(
    source: OrientedPoints, target: OrientedPoints, tree: cKDTree, start: Array, reach: float, *,
    chosen: Indices | slice = slice(None), iterations: int = 20,
) -> Array:  # fmt: skip
    """Return the motion (4, 4) nearby of least robust distances to tangent planes, from points within `reach`."""
    T = start.copy()
    for _ in range(iterations):
        found = find_correspondences(source, target, tree, T, reach, chosen)
        inlier = found.inlier
        if np.count_nonzero(inlier) < MINIMUM_INLIERS:
            return start
        residual, normals = found.residual[inlier], target.normals[found.nearest[inlier]]
        center, radius, rows, weight = _equations(found.points[inlier], normals, residual, found.cosine[inlier])
        x = -np.linalg.lstsq((rows * weight[:, None]).T @ rows, rows.T @ (weight * residual), rcond=RANK_TOLERANCE)[0]
        T = small_motion(x[:3] / radius, x[3:], center) @ T
        if norm(x) < STEP_TOLERANCE * radius:
            break
    return T


def uncertainty(
    source: OrientedPoints, target: OrientedPoints, found: Correspondences, T: Array
) -> tuple[Array, float]:
    """Return the covariance (6, 6) of a small motion after T (4, 4), and the root mean square distance to planes."""
    inlier = found.inlier
    if np.count_nonzero(inlier) < MINIMUM_INLIERS:
        return np.full((6, 6), np.inf), float("inf")
    nearest = found.nearest[inlier]
    points, normals = source.points[inlier] @ T[:3, :3].T + T[:3, 3], target.normals[nearest]
    residual = dot(points - target.points[nearest], normals)
    center, radius, rows, weight = _equations(points, normals, residual, found.cosine[inlier])
    values, vectors = np.linalg.eigh((rows * weight[:, None]).T @ rows)
    inverse = (vectors / np.maximum(values, RANK_TOLERANCE * values[-1])) @ vectors.T
    shared = len(nearest) / len(np.unique(nearest))  # points on one plane of the target share its error
    variance = float((weight * residual**2).sum() / max(weight.sum() - 6, 1.0))
    A = about_origin(center) @ np.diag([1 / radius] * 3 + [1.0] * 3)
    return A @ (inverse * shared * variance) @ A.T, float(np.sqrt((residual**2).mean()))


def _equations(points: Array, normals: Array, residual: Array, cosine: Array) -> tuple[Array, float, Array, Array]:
    """Return center and root mean square radius of points, and rows (n, 6) and weights (n,) of equations there."""
    center = points.mean(axis=0)
    radius = float(np.sqrt(((points - center) ** 2).sum(axis=1).mean()))
    rows = plane_jacobian((points - center) / radius, normals)
    return center, radius, rows, robust_weights(residual, 1e-9 * radius) * cosine


def about_origin(center: Array) -> Array:
    """Return the matrix (6, 6) that expresses small motions about a point as small motions about the origin."""
    x, y, z = center
    A = np.eye(6)
    A[3:, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return A


def between_frames(T: Array, source_center: Array, target_center: Array, unit: float) -> Array:
    """Return a motion (4, 4) between surfaces about their centers, in a unit, as one between the frames of the data."""
    out = T.copy()
    out[:3, 3] = target_center + unit * T[:3, 3] - T[:3, :3] @ source_center
    return out
