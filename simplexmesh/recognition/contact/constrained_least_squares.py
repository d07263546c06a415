"""Linear least squares with inequality constraints: a small quadratic program (Lawson and Hanson 1974, chapter 23)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from simplexmesh._base.arrays import Array

REGULARIZATION = 1e-3
"""Ridge parameter relative to the trace of the normal matrix, which keeps undetermined components at zero."""

RELAXATION = 1e-3
"""Coefficient of the common slack variable of all constraints: a step of the same cost would be 1,000 times as long."""


def constrained_least_squares(jacobian: Array, weight: Array, residual: Array, bounds: Array, lower: Array) -> Array:
    """Return the x (n,) that minimizes the sum of weight (residual + jacobian x)^2 subject to bounds x >= lower."""
    n = jacobian.shape[1]
    matrix = (jacobian * weight[:, None]).T @ jacobian
    trace = float(np.trace(matrix))
    matrix = matrix / trace + REGULARIZATION * np.eye(n) if trace > 0 else np.eye(n)
    gradient = jacobian.T @ (weight * residual) / trace if trace > 0 else np.zeros(n)
    factor = np.linalg.inv(np.linalg.cholesky(matrix))
    free = factor @ gradient  # with x = factor' (y - free) the objective is the squared norm of y
    rotated = bounds @ factor.T
    y = _minimum_norm(np.hstack([rotated, np.full((len(bounds), 1), RELAXATION)]), lower + rotated @ free)[:n]
    return np.asarray(factor.T @ (y - free))


def _minimum_norm(bounds: Array, lower: Array) -> Array:
    """Return the y of minimum norm with bounds y >= lower, which must be feasible (least distance programming)."""
    scale = lower.max(initial=0.0)
    if not scale > 0:
        return np.zeros(bounds.shape[1])
    system = np.vstack([bounds.T, lower / scale])
    target = np.append(np.zeros(bounds.shape[1]), 1.0)
    remainder = system @ nnls(system, target, maxiter=50 * len(lower) + 500)[0] - target
    return np.asarray(-scale * remainder[:-1] / remainder[-1])
