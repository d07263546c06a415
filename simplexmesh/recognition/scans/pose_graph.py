"""The poses that agree best with measured poses of pairs: least squares in which pairs that contradict count little.

All are found together, so that errors of a chain do not add up (F. Lu, E. Milios, Globally consistent range scan
alignment, 1997).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.recognition.scans.scan_pairs import Measured, Pair

SYSTEMATIC = 0.3
"""Part of the distances between two scans that neighboring points share, as a scanner's distortions are: more points do
not average it away."""

ROUNDING = 1e-9
"""Least deviation of a measured pose, as a part of the extent of scans."""

OUTLYING = 3.0
"""Standard deviations from which a pair loses weight."""


def optimized(poses: Array, pairs: Sequence[Pair], measured: Sequence[Measured], radius: float) -> tuple[Array, Array]:
    """Return poses (n, 4, 4) near those given, the first of which stays, and their covariances (n, 6, 6)."""
    source, target = np.array(pairs).T
    inverse = np.linalg.inv([each.T for each in measured])
    whitening = np.array([_whitening(each, radius) for each in measured])

    def moved(x: Array) -> Array:
        return np.concatenate([poses[:1], motions(x.reshape(-1, 6)) @ poses[1:]])

    def residuals(x: Array) -> Array:
        at = moved(x)
        off = np.linalg.inv(at[target]) @ at[source] @ inverse  # what is to be done after the measured pose
        small = np.hstack([Rotation.from_matrix(off[:, :3, :3]).as_rotvec(), off[:, :3, 3]])
        return np.asarray(np.einsum("eab,eb->ea", whitening, small).ravel())

    def jacobian(x: Array) -> Array:
        return _jacobian(moved(x), x.reshape(-1, 6), source, target, whitening)

    # each of the six residuals of a pair is weighted alone: a pair may be sure of some directions only
    start = np.zeros(6 * (len(poses) - 1))
    found = least_squares(residuals, start, jacobian, loss="cauchy", f_scale=OUTLYING, x_scale="jac")
    freedom = max(6 * (len(pairs) - len(poses) + 1), 1)
    variance = max(1.0, 2 * found.cost / freedom)
    covariances = np.zeros((len(poses), 6, 6))
    rows = jacobian(found.x)  # that of `found` is 0 for pairs that contradict
    weights = 1 / (1 + (residuals(found.x) / OUTLYING) ** 2)
    full = variance * np.linalg.inv((rows * weights[:, None]).T @ rows)
    for k in range(1, len(poses)):
        covariances[k] = full[6 * k - 6 : 6 * k, 6 * k - 6 : 6 * k]
    return moved(found.x), covariances


def _jacobian(at: Array, x: Array, source: Indices, target: Indices, whitening: Array) -> Array:
    """Return the derivatives (6 e, 6 n - 6) of residuals that are small after poses (n, 4, 4) moved by x (n - 1, 6)."""
    frame, pair = np.asarray(np.linalg.inv(at[target]), np.float64), np.arange(len(source))
    blocks = np.zeros((len(source), 6, 6))  # of a small motion of the world, as the target has it
    blocks[:, :3, :3] = blocks[:, 3:, 3:] = frame[:, :3, :3]
    blocks[:, 3:, :3] = _cross_matrices(frame[:, :3, 3]) @ frame[:, :3, :3]
    out = np.zeros((len(source), 6, len(at), 6))
    out[pair, :, source] = whitening @ blocks
    out[pair, :, target] = -whitening @ blocks
    out[:, :, 1:, :3] += np.einsum("eakb,kbc->eakc", out[:, :, 1:, 3:], _cross_matrices(x[:, 3:]))
    return out[:, :, 1:].reshape(6 * len(source), -1)


def _cross_matrices(vectors: Array) -> Array:
    """Return the matrices (k, 3, 3) of cross products with vectors (k, 3) on the left."""
    return -np.cross(vectors[:, None], np.eye(3))


def motions(x: Array) -> Array:
    """Return the motions (k, 4, 4) of rotation vectors and shifts (k, 6)."""
    out = np.zeros((len(x), 4, 4))
    out[:, :3, :3], out[:, :3, 3], out[:, 3, 3] = Rotation.from_rotvec(x[:, :3]).as_matrix(), x[:, 3:], 1.0
    return out


def _whitening(measured: Measured, radius: float) -> Array:
    """Return the matrix (6, 6) that gives small motions after a measured pose unit covariance."""
    shared = max(SYSTEMATIC * measured.error, ROUNDING * radius)  # exact planes leave no distance at all
    covariance = measured.covariance + np.diag([(shared / radius) ** 2] * 3 + [shared**2] * 3)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
