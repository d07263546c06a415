"""The rigid motion between points that correspond, exactly or but for a slide along the surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot
from simplexmesh.recognition.rotations import rotations_of

Array = NDArray[np.float64]

ROUNDS = 20

SLIDING = 0.02
"""Slides of neighbors are alike, and so tell less than their number says."""


def rigid_fit(source: Array, target: Array) -> Array:
    """Return the rigid motion (4, 4) that brings points nearest to others, in least squares (Horn 1987, Kabsch 1976).

    Parameters
    ----------
    source, target : (k, 3) array of float
        Points that correspond, at least three.

    Examples
    --------
    >>> points = np.random.default_rng(0).normal(size=(9, 3))
    >>> bool(np.allclose(rigid_fit(points, points + [1, 2, 3])[:3, 3], [1, 2, 3]))
    True
    """
    middle, goal = source.mean(axis=0), target.mean(axis=0)
    u, _, v = np.linalg.svd((source - middle).T @ (target - goal))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    T = np.eye(4)
    T[:3, :3] = (u @ sign @ v).T
    T[:3, 3] = goal - T[:3, :3] @ middle
    return T


def to_planes(source: Array, target: Array, normals: Array, start: Array) -> Array:
    """Return the rigid motion (4, 4) that brings points to the tangent planes at others, from a start nearby.

    Gauss and Newton's method on E1 (Delingette 1994, equation 6.11), with Geman and McClure's weights at twice the
    residuals' own spread; it comes to the minimum of the thesis's mechanical iteration (6.13) in fewer steps. So that
    motions which the normals leave open, of nearly round bodies say, stay near the start, slides along the surface
    count too, as much less as they are larger.

    Parameters
    ----------
    source, target, normals : (k, 3) array of float
        Points that correspond, and unit normals at the targets.
    start : (4, 4) array of float

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> points, normals = rng.normal(size=(60, 3)), rng.normal(size=(60, 3))
    >>> T = np.eye(4)
    >>> T[:3, :3] = rotations_of(np.array([[0.1, -0.05, 0.2]]))[0]
    >>> moved = points @ T[:3, :3].T
    >>> bool(np.allclose(to_planes(points, moved, normals, np.eye(4)), T, atol=1e-9))
    True
    """
    T = start.copy()
    extent = max(float(np.sqrt(((target - target.mean(axis=0)) ** 2).sum(axis=1).mean())), 1e-300)
    for _ in range(ROUNDS):
        at = source @ T[:3, :3].T + T[:3, 3]
        middle = at.mean(axis=0)
        lack = dot(at - target, normals)
        spread = max(2 * 1.4826 * float(np.median(np.abs(lack))), 1e-12 * extent)
        weight = 1 / (1 + (lack / spread) ** 2) ** 2
        arms = (at - middle) / extent
        rows = np.hstack([cross(arms, normals), normals])
        slide = at - target - lack[:, None] * normals
        trust = SLIDING * float(np.median(lack**2)) / max(float(np.median((slide**2).sum(axis=1))), 1e-24 * extent**2)
        matrix = (rows * weight[:, None]).T @ rows
        vector = rows.T @ (weight * lack)
        for axis in np.eye(3):
            along = axis - dot(normals, axis[None])[:, None] * normals
            rows = np.hstack([cross(arms, along), along])
            matrix += trust * rows.T @ rows
            vector += trust * rows.T @ dot(slide, axis[None])
        x = -np.linalg.pinv(matrix, rcond=1e-9, hermitian=True) @ vector
        step = np.eye(4)
        step[:3, :3] = rotations_of(x[None, :3] / extent)[0]
        step[:3, 3] = middle + x[3:] - step[:3, :3] @ middle
        T = step @ T
        if np.linalg.norm(x) < 1e-9 * extent:
            break
    return T
