"""Rotation matrices, rotation vectors and angles."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array


def rotation_matrices(vectors: Array) -> Array:
    """Return the rotations (k, 3, 3) of rotation vectors (k, 3), in radians."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / np.where(angle > 0, angle, 1)[:, None]).T
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * K + (1 - c) * (K @ K))


def rotation_vector(R: Array) -> Array:
    """Return the rotation vector (3,) of a rotation (3, 3), in radians."""
    angle = rotation_angle(R)
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    length = np.linalg.norm(axis)
    if length < 1e-6:  # angle 0 or pi
        _, vectors = np.linalg.eigh(0.5 * (R + R.T))
        return np.asarray(angle * vectors[:, 2])
    return np.asarray(angle * axis / length)


def rotation_angle(R: Array) -> float:
    """Return the angle of a rotation (3, 3), in [0, pi]."""
    return float(np.arccos(np.clip((np.trace(R) - 1) / 2, -1.0, 1.0)))


def angles_between(first: Array, second: Array) -> Array:
    """Return the angles (k, m) between rotations (k, 3, 3) and (m, 3, 3), in radians."""
    cosine = (np.einsum("kab,mab->km", first, second) - 1) / 2
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))
