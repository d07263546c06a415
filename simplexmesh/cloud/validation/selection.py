"""Scores by which the best of several fitted models is selected: the least is the best.

All take the sum of the squared residuals, the count of the points and that of the parameters (Chaperon 2002, section
5.1).
"""

from __future__ import annotations

import numpy as np


def rms(square_sum: float, count: int) -> float:
    """Return e, the root mean square residual (eq. 5.2), which a richer model never makes larger."""
    return float(np.sqrt(square_sum / count))


def noise(square_sum: float, count: int, parameters: int) -> float:
    """Return e', the deviation of the noise, whose square is unbiased (eq. 5.1): by degrees of freedom, not points."""
    if count <= parameters:
        raise ValueError(f"count must be more than the {parameters} parameters, not {count}")
    return float(np.sqrt(square_sum / (count - parameters)))


def aic(square_sum: float, count: int, parameters: int) -> float:
    """Return the information criterion of normal residuals of unknown deviation, up to a constant (Akaike 1974)."""
    return float(count * np.log(square_sum / count) + 2 * parameters)


def bic(square_sum: float, count: int, parameters: int) -> float:
    """Return the Bayesian information criterion of normal residuals, up to a constant (Schwarz 1978)."""
    return float(count * np.log(square_sum / count) + parameters * np.log(count))


def geometric_aic(square_sum: float, count: int, parameters: int, noise: float, *, dimension: int = 2) -> float:
    """Return the geometric AIC of models that are compared at one deviation of the noise (Kanatani 1998).

    J + 2 (d N + p) noise^2 for a model of dimension d, 2 for surfaces and 1 for curves; `noise` is that of the richest
    of the compared models.
    """
    return float(square_sum + 2 * (dimension * count + parameters) * noise**2)
