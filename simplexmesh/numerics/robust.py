"""Robust weights, of residuals among which some are of something else, and weighted quantiles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base.arrays import Array

NORMAL_MAD = 1.4826
"""Standard deviation of a normal law, in medians of the absolute value."""


def weighted_quantiles(values: Array, weights: Array, shares: ArrayLike) -> Array:
    """Return the least values up to which weights, not all zero, reach shares of their sum."""
    order = np.argsort(values)
    mass = np.cumsum(weights[order])
    return np.asarray(values[order[np.searchsorted(mass, np.asarray(shares) * mass[-1])]])


def robust_weights(residuals: Array, floor: float) -> Array:
    """Return Geman-McClure weights at the robust scale of residuals."""
    return np.asarray(1 / (1 + (residuals / robust_scale(residuals, floor)) ** 2) ** 2)


def robust_scale(residuals: Array, floor: float) -> float:
    """Return twice the robust standard deviation of residuals, at least `floor`."""
    return max(2 * NORMAL_MAD * float(np.median(np.abs(residuals))), floor)
