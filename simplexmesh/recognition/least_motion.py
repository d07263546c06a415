"""The least-squares motion under linear bounds: a small quadratic program (Lawson and Hanson 1974, chapter 23)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Array = NDArray[np.float64]

FAINT = 1e-3
"""What nothing draws stays: this share of the strongest pull holds it."""

YIELDING = 1e-3
"""Bounds that cannot all be met give way together, at the price of a step a thousand times as long."""


def least_motion(rows: Array, weight: Array, gap: Array, bounds: Array, floor: Array) -> Array:
    """Return the x that makes the sum of weight (gap + rows x)^2 least while bounds x >= floor.

    Parameters
    ----------
    rows : (m, n) array of float
    weight, gap : (m,) array of float
        Weights of zero throughout ask for the shortest x.
    bounds : (k, n) array of float
    floor : (k,) array of float
        Where not all bounds can be met, all are missed by as little as one number can say.

    Examples
    --------
    >>> rows, bounds = np.eye(2), np.array([[1.0, 1.0]])
    >>> least_motion(rows, np.ones(2), np.array([3.0, 3.0]), bounds, np.array([-2.0])).round(3).tolist()
    [-1.0, -1.0]
    """
    n = rows.shape[1]
    matrix = (rows * weight[:, None]).T @ rows
    strongest = float(np.trace(matrix))
    matrix = matrix / strongest + FAINT * np.eye(n) if strongest > 0 else np.eye(n)
    pull = rows.T @ (weight * gap) / strongest if strongest > 0 else np.zeros(n)
    lower = np.linalg.inv(np.linalg.cholesky(matrix))
    free = lower @ pull  # with x = lower' (y - free) the sum is the square of y
    turned = bounds @ lower.T
    y = _least_distance(np.hstack([turned, np.full((len(bounds), 1), YIELDING)]), floor + turned @ free)[:n]
    return np.asarray(lower.T @ (y - free))


def _least_distance(bounds: Array, floor: Array) -> Array:
    """Return the shortest y with bounds y >= floor, which some y must meet."""
    unit = floor.max(initial=0.0)
    if not unit > 0:
        return np.zeros(bounds.shape[1])
    system = np.vstack([bounds.T, floor / unit])
    wanted = np.append(np.zeros(bounds.shape[1]), 1.0)
    left = system @ nnls(system, wanted, maxiter=50 * len(floor) + 500)[0] - wanted
    return np.asarray(-unit * left[:-1] / left[-1])
