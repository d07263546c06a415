"""Robust weights: of residuals among which some are of something else."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array

NORMAL_MAD = 1.4826
"""Standard deviation of a normal law, in medians of the absolute value."""


def robust_weights(residuals: Array, floor: float) -> Array:
    """Return Geman-McClure weights at the robust scale of residuals."""
    return np.asarray(1 / (1 + (residuals / robust_scale(residuals, floor)) ** 2) ** 2)


def robust_scale(residuals: Array, floor: float) -> float:
    """Return twice the robust standard deviation of residuals, at least `floor`."""
    return max(2 * NORMAL_MAD * float(np.median(np.abs(residuals))), floor)
