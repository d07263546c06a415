"""Stacked regression (Breiman 1996): several predictors combined by ridge weights learned where the truth is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIDGES = (1000.0, 10.0, 1.0, 0.1, 0.01)
"""Ridge parameters tried, relative to each predictor's sum of squares; the first shrinks all weights to nearly zero."""


def stacked(training: list[tuple[Array, Array]], most: float) -> tuple[Array, Array]:
    """Return the weights of the predictors, and the residuals.

    The ridge parameter is chosen by cross-validation, each set in turn being left out.

    Parameters
    ----------
    training : list of ((n, g) array of float, (n,) array of float)
        Predictors and responses of each set, in expected errors of the response's present estimate, which is zero.
    most : float
        Predictions are clipped to plus and minus this.

    Returns
    -------
    (g,) array of float, (n of all,) array of float

    Examples
    --------
    >>> predictors = np.random.default_rng(0).normal(size=(2, 50, 3))
    >>> stacked([(one, one @ [1.0, -0.5, 0.2]) for one in predictors], 9.0)[0].round(1)
    array([ 1. , -0.5,  0.2])
    """
    x, y = _together(training)
    if len(training) < 2:
        return np.zeros(x.shape[1]), y
    losses = [sum(_validation_error(training, i, ridge, most) for i in range(len(training))) for ridge in RIDGES]
    weights = _solved(x, y, RIDGES[losses.index(min(losses))])
    residuals: Array = y - (x @ weights).clip(-most, most)
    return weights, residuals


def _together(training: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    return np.concatenate([x for x, _ in training]), np.concatenate([y for _, y in training])


def _validation_error(training: list[tuple[Array, Array]], left_out: int, ridge: float, most: float) -> float:
    """Return the sum of absolute errors on one set with weights learned from the others."""
    x, y = _together(training[:left_out] + training[left_out + 1 :])
    predictors, response = training[left_out]
    return float(np.abs(response - (predictors @ _solved(x, y, ridge)).clip(-most, most)).sum())


def _solved(x: Array, y: Array, ridge: float) -> Array:
    square = x.T @ x
    diagonal = ridge * np.diag(square) + 1e-12 * np.trace(square) + 1e-300
    return np.asarray(np.linalg.solve(square + np.diag(diagonal), x.T @ y), float)
