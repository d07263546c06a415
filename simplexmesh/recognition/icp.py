"""Points to tangent planes: the last step of a registration, on the points themselves, and what it leaves uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import cross, dot, norm
from simplexmesh.recognition.rotations import rotations_of
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

ALIKE = 0.5
"""Points correspond whose normals have at least this cosine."""

STILL = 1e-6
LOST = 1e-10


@dataclass(frozen=True, eq=False)
class Pairing:
    """Points of the source, moved, and what they come to lie on.

    Attributes
    ----------
    lack : (n,) array of float
        Distance to the plane of the nearest point of the target, along its normal.
    near : (n,) array of int
        That point.
    common : (n,) array of bool
        Whether there is a point near whose normal is alike.
    alike : (n,) array of float
        Cosine between the normals.
    at : (n, 3) array of float
    """

    lack: Array
    near: NDArray[np.int64]
    common: NDArray[np.bool_]
    alike: Array
    at: Array


def paired(source: Surface, target: Surface, tree: cKDTree, T: Array, reach: float,
           chosen: NDArray[np.int64] | slice = slice(None)) -> Pairing:  # fmt: skip
    """Return what chosen points of the source lie on after the motion T (4, 4), no farther than reach."""
    at = source.points[chosen] @ T[:3, :3].T + T[:3, 3]
    distance, near = tree.query(at, distance_upper_bound=reach, workers=-1)
    found = np.isfinite(distance)
    near = np.where(found, near, 0)
    normals = target.normals[near]
    alike = dot(source.normals[chosen] @ T[:3, :3].T, normals)
    return Pairing(dot(at - target.points[near], normals), near, found & (alike > ALIKE), alike, at)


def information(at: Array, normals: Array, weight: Array) -> tuple[Array, Array]:
    """Return the rows (n, 6) by which small motions about zero change distances to planes, and their normal matrix."""
    rows = np.hstack([cross(at, normals), normals])
    return rows, (rows * weight[:, None]).T @ rows


def refined(
    source: Surface, target: Surface, tree: cKDTree, start: Array, reach: float, *,
    chosen: NDArray[np.int64] | slice = slice(None), rounds: int = 20,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the motion (4, 4) that brings points to tangent planes, from a start nearby, and its covariance (6, 6).

    Gauss and Newton's method with Geman and McClure's weights, at twice the spread of the residuals. The covariance is
    that of a small motion after it, a rotation vector and a shift; what the normals leave open (equation 6.12 of the
    thesis: their matrix is singular) is not moved and has an enormous variance.

    Parameters
    ----------
    source, target : Surface
    tree : cKDTree
        Of the target's points.
    start : (4, 4) array of float
    reach : float
        Points farther than this from the target have no part in it, nor those whose normals are not alike.
    """
    T, covariance = start.copy(), np.full((6, 6), np.inf)
    for _ in range(rounds):
        found = paired(source, target, tree, T, reach, chosen)
        common = found.common
        if np.count_nonzero(common) < 12:
            return start, covariance
        lack, normals, at = found.lack[common], target.normals[found.near[common]], found.at[common]
        middle = at.mean(axis=0)
        arm = float(np.sqrt(((at - middle) ** 2).sum(axis=1).mean()))
        spread = max(2 * 1.4826 * float(np.median(np.abs(lack))), 1e-9 * arm)
        weight = found.alike[common] / (1 + (lack / spread) ** 2) ** 2
        rows, matrix = information((at - middle) / arm, normals, weight)
        values, vectors = np.linalg.eigh(matrix)
        sound = values > LOST * values[-1]
        x = -vectors[:, sound] @ ((vectors[:, sound].T @ (rows.T @ (weight * lack))) / values[sound])
        step = np.eye(4)
        step[:3, :3] = rotations_of(x[None, :3] / arm)[0]
        step[:3, 3] = middle + x[3:] - step[:3, :3] @ middle
        T = step @ T
        if norm(x) < STILL * arm:
            break
    # Points that come to lie on the same plane of the target share its error.
    shared = np.count_nonzero(common) / len(np.unique(found.near[common]))
    variance = shared * float((weight * lack**2).sum() / max(weight.sum() - 6, 1.0))
    inverse = (vectors / np.maximum(values, LOST * values[-1])) @ vectors.T * variance
    scale = np.diag([1 / arm] * 3 + [1.0] * 3)
    A = about_zero(middle) @ scale
    return T, A @ inverse @ A.T


def about_zero(middle: Array) -> Array:
    """Return the matrix (6, 6) that makes small motions about a point into the same motions about zero.

    Examples
    --------
    >>> quarter = np.array([0, 0, 1.0, 0, 0, 0])
    >>> about_zero(np.array([2.0, 0, 0])) @ quarter
    array([ 0.,  0.,  1.,  0., -2.,  0.])
    """
    x, y, z = middle
    A = np.eye(6)
    A[3:, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return A
