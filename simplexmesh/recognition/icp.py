"""Points to tangent planes: the last step of a registration, on the points themselves, and what it leaves uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import cross, dot, norm
from simplexmesh.recognition.rotation_vectors import rotation_matrices
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

ALIKE = 0.5
"""Points correspond whose normals have at least this cosine."""

STILL = 1e-6
LOST = 1e-10
FEWEST = 12


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
    chosen: NDArray[np.int64] | slice = slice(None), rounds: int = 20, still: float = 0.0,
) -> Array:  # fmt: skip
    """Return the motion (4, 4) that brings points to tangent planes, from a start nearby.

    Gauss and Newton's method with Geman and McClure's weights, at twice the spread of the residuals. What the normals
    leave open (equation 6.12 of the thesis: their matrix is singular) is not moved.

    Parameters
    ----------
    source, target : Surface
    tree : cKDTree
        Of the target's points.
    start : (4, 4) array of float
    reach : float
        Points farther than this from the target have no part in it, nor those whose normals are not alike.
    still : float
        Done when a step is smaller than this share of what is uncertain about the motion.
    """
    T = start.copy()
    for _ in range(rounds):
        found = paired(source, target, tree, T, reach, chosen)
        common = found.common
        if np.count_nonzero(common) < FEWEST:
            return start
        lack, normals = found.lack[common], target.normals[found.near[common]]
        middle, arm, arms = _centered(found.at[common])
        weight = _trust(lack, arm) * found.alike[common]
        rows, matrix = information(arms, normals, weight)
        values, vectors = np.linalg.eigh(matrix)
        regular = values > LOST * values[-1]
        x = -vectors[:, regular] @ ((vectors[:, regular].T @ (rows.T @ (weight * lack))) / values[regular])
        step = np.eye(4)
        step[:3, :3] = rotation_matrices(x[None, :3] / arm)[0]
        step[:3, 3] = middle + x[3:] - step[:3, :3] @ middle
        T = step @ T
        if norm(x) < STILL * arm or x @ matrix @ x < still**2 * _variance(lack, weight):
            break
    return T


def uncertainty(source: Surface, target: Surface, found: Pairing, T: Array) -> tuple[Array, float]:
    """Return the covariance (6, 6) of a small motion after T, and the root mean square distance to planes.

    A rotation vector and a shift. What the normals leave open has an enormous variance.

    Parameters
    ----------
    source, target : Surface
        As they were measured.
    found : Pairing
        Of all points of the source.
    T : (4, 4) array of float
    """
    common = found.common
    if np.count_nonzero(common) < FEWEST:
        return np.full((6, 6), np.inf), float("inf")
    near = found.near[common]
    at, normals = source.points[common] @ T[:3, :3].T + T[:3, 3], target.normals[near]
    lack = dot(at - target.points[near], normals)
    middle, arm, arms = _centered(at)
    weight = _trust(lack, arm) * found.alike[common]
    values, vectors = np.linalg.eigh(information(arms, normals, weight)[1])
    # Points that come to lie on the same plane of the target share its error.
    shared = len(near) / len(np.unique(near))
    inverse = (vectors / np.maximum(values, LOST * values[-1])) @ vectors.T * shared * _variance(lack, weight)
    A = about_zero(middle) @ np.diag([1 / arm] * 3 + [1.0] * 3)
    return A @ inverse @ A.T, float(np.sqrt((lack**2).mean()))


def _centered(at: Array) -> tuple[Array, float, Array]:
    """Return the middle of points, their root mean square distance to it, and the points as seen from there in it."""
    middle = at.mean(axis=0)
    arm = float(np.sqrt(((at - middle) ** 2).sum(axis=1).mean()))
    return middle, arm, (at - middle) / arm


def _trust(lack: Array, arm: float) -> Array:
    """Return Geman and McClure's weights, at twice the spread of residuals."""
    spread = max(2 * 1.4826 * float(np.median(np.abs(lack))), 1e-9 * arm)
    return np.asarray(1 / (1 + (lack / spread) ** 2) ** 2)


def _variance(lack: Array, weight: Array) -> float:
    """Return the variance of residuals."""
    return float((weight * lack**2).sum() / max(weight.sum() - 6, 1.0))


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
