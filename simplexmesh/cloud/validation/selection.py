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
    """Return e', the deviation of the noise, whose square is unbiased (eq. 5.1): by degrees of freedom, not points.

    Examples
    --------
    >>> float(round(noise(95.0, 100, 5), 6))
    1.0
    """
    if count <= parameters:
        raise ValueError(f"count must be more than the {parameters} parameters, not {count}")
    return float(np.sqrt(square_sum / (count - parameters)))


def aic(square_sum: float, count: int, parameters: int) -> float:
    """Return Akaike's information criterion of normal residuals of unknown deviation, up to a constant.

    References
    ----------
    H. Akaike, *A new look at the statistical model identification*, 1974.
    """
    return float(count * np.log(square_sum / count) + 2 * parameters)


def bic(square_sum: float, count: int, parameters: int) -> float:
    """Return the Bayesian information criterion of normal residuals of unknown deviation, up to a constant.

    References
    ----------
    G. Schwarz, *Estimating the dimension of a model*, 1978.
    """
    return float(count * np.log(square_sum / count) + parameters * np.log(count))


def geometric_aic(square_sum: float, count: int, parameters: int, noise: float, *, dimension: int = 2) -> float:
    """Return Kanatani's geometric AIC, of models that are compared at one deviation of the noise.

    J + 2 (d N + p) noise^2 for a model of dimension d, 2 for surfaces and 1 for curves; `noise` is that of the richest
    of the compared models.

    References
    ----------
    K. Kanatani, *Geometric information criterion for model selection*, 1998.
    """
    return float(square_sum + 2 * (dimension * count + parameters) * noise**2)
