"""Point-to-plane iterative closest points, and the covariance of the result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm
from simplexmesh.recognition.rigid import plane_jacobian, robust_weights, small_motion
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

MINIMUM_COSINE = 0.5
"""Least cosine between the normals of corresponding points."""

STEP_TOLERANCE = 1e-6
RANK_TOLERANCE = 1e-10
MINIMUM_INLIERS = 12


@dataclass(frozen=True, eq=False)
class Correspondences:
    """Points of the source, moved, and their nearest points of the target.

    Attributes
    ----------
    residual : (n,) array of float
        Signed distance to the tangent plane at the nearest target point.
    nearest : (n,) array of int
        That point.
    inlier : (n,) array of bool
        Whether it is within reach and the normals agree.
    cosine : (n,) array of float
        Between the normals.
    points : (n, 3) array of float
        The moved points.
    """

    residual: Array
    nearest: NDArray[np.int64]
    inlier: NDArray[np.bool_]
    cosine: Array
    points: Array


def find_correspondences(
    source: Surface, target: Surface, tree: cKDTree, T: Array, reach: float,
    chosen: NDArray[np.int64] | slice = slice(None),
) -> Correspondences:  # fmt: skip
    """Return the correspondences of source points, moved by T (4, 4), with target points no farther than `reach`."""
    points = source.points[chosen] @ T[:3, :3].T + T[:3, 3]
    distance, nearest = tree.query(points, distance_upper_bound=reach, workers=-1)
    found = np.isfinite(distance)
    nearest = np.where(found, nearest, 0)
    normals = target.normals[nearest]
    cosine = dot(source.normals[chosen] @ T[:3, :3].T, normals)
    residual = dot(points - target.points[nearest], normals)
    return Correspondences(residual, nearest, found & (cosine > MINIMUM_COSINE), cosine, points)


def refined(
    source: Surface, target: Surface, tree: cKDTree, start: Array, reach: float, *,
    chosen: NDArray[np.int64] | slice = slice(None), iterations: int = 20, tolerance: float = 0.0,
) -> Array:  # fmt: skip
    """Return the motion (4, 4) that minimizes distances to tangent planes, from a start nearby.

    Gauss-Newton with Geman-McClure weights at twice the robust standard deviation of the residuals. Motions that the
    normals do not determine (equation 6.12 of the thesis: the normal matrix is singular) are excluded from the step.

    Parameters
    ----------
    source, target : Surface
    tree : cKDTree
        Of the target's points.
    start : (4, 4) array of float
    reach : float
        Points farther than this from the target do not count, nor do those whose normals disagree.
    chosen : (k,) array of int or slice
        The source points to use.
    tolerance : float
        The iteration ends when a step is smaller than this fraction of its standard error.
    """
    T = start.copy()
    for _ in range(iterations):
        found = find_correspondences(source, target, tree, T, reach, chosen)
        inlier = found.inlier
        if np.count_nonzero(inlier) < MINIMUM_INLIERS:
            return start
        residual, normals = found.residual[inlier], target.normals[found.nearest[inlier]]
        center, radius, local = _centered(found.points[inlier])
        weight = robust_weights(residual, 1e-9 * radius) * found.cosine[inlier]
        rows = plane_jacobian(local, normals)
        matrix = (rows * weight[:, None]).T @ rows
        values, vectors = np.linalg.eigh(matrix)
        regular = values > RANK_TOLERANCE * values[-1]
        x = -vectors[:, regular] @ ((vectors[:, regular].T @ (rows.T @ (weight * residual))) / values[regular])
        T = small_motion(x[:3] / radius, x[3:], center) @ T
        if norm(x) < STEP_TOLERANCE * radius or x @ matrix @ x < tolerance**2 * _variance(residual, weight):
            break
    return T


def uncertainty(source: Surface, target: Surface, found: Correspondences, T: Array) -> tuple[Array, float]:
    """Return the covariance (6, 6) of a small motion after T, and the root mean square distance to planes.

    The small motion is a rotation vector and a shift. Motions that the normals do not determine get a very large
    variance.

    Parameters
    ----------
    source, target : Surface
        With the points as measured.
    found : Correspondences
        Of all source points.
    T : (4, 4) array of float
    """
    inlier = found.inlier
    if np.count_nonzero(inlier) < MINIMUM_INLIERS:
        return np.full((6, 6), np.inf), float("inf")
    nearest = found.nearest[inlier]
    points, normals = source.points[inlier] @ T[:3, :3].T + T[:3, 3], target.normals[nearest]
    residual = dot(points - target.points[nearest], normals)
    center, radius, local = _centered(points)
    weight = robust_weights(residual, 1e-9 * radius) * found.cosine[inlier]
    rows = plane_jacobian(local, normals)
    values, vectors = np.linalg.eigh((rows * weight[:, None]).T @ rows)
    inverse = (vectors / np.maximum(values, RANK_TOLERANCE * values[-1])) @ vectors.T
    shared = len(nearest) / len(np.unique(nearest))  # points on one plane of the target share its error
    inverse = inverse * shared * _variance(residual, weight)
    A = about_origin(center) @ np.diag([1 / radius] * 3 + [1.0] * 3)
    return A @ inverse @ A.T, float(np.sqrt((residual**2).mean()))


def _centered(points: Array) -> tuple[Array, float, Array]:
    """Return the center of points, their root mean square distance to it, and the points in this frame."""
    center = points.mean(axis=0)
    radius = float(np.sqrt(((points - center) ** 2).sum(axis=1).mean()))
    return center, radius, (points - center) / radius


def _variance(residual: Array, weight: Array) -> float:
    """Return the weighted variance of residuals, with 6 degrees of freedom less."""
    return float((weight * residual**2).sum() / max(weight.sum() - 6, 1.0))


def about_origin(center: Array) -> Array:
    """Return the matrix (6, 6) that expresses small motions about a point as small motions about the origin.

    Examples
    --------
    >>> quarter = np.array([0, 0, 1.0, 0, 0, 0])
    >>> about_origin(np.array([2.0, 0, 0])) @ quarter
    array([ 0.,  0.,  1.,  0., -2.,  0.])
    """
    x, y, z = center
    A = np.eye(6)
    A[3:, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return A
