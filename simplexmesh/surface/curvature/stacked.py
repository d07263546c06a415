"""Several guesses made one, with weights learned where the truth is known (stacked regressions, Breiman 1996)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIDGES = (1000.0, 10.0, 1.0, 0.1, 0.01)
"""By so much, in shares of how much each guess varies, weights may be held back; the first leaves nearly none."""


def stacked(lessons: list[tuple[Array, Array]], most: float) -> tuple[Array, Array]:
    """Return the weights of guesses that come nearest to what is wanted, and what they leave.

    They are held back, towards zero, by as much as is best where each lesson in turn is left out and foretold.

    Parameters
    ----------
    lessons : list of ((n, g) array of float, (n,) array of float)
        Guesses and what is wanted, as differences from what is believed without them, in its expected errors.
    most : float
        No sum of weighted guesses counts for more.

    Returns
    -------
    (g,) array of float, (n of all,) array of float

    Examples
    --------
    >>> guesses = np.random.default_rng(0).normal(size=(2, 50, 3))
    >>> stacked([(one, one @ [1.0, -0.5, 0.2]) for one in guesses], 9.0)[0].round(1)
    array([ 1. , -0.5,  0.2])
    """
    x, y = _together(lessons)
    if len(lessons) < 2:
        return np.zeros(x.shape[1]), y
    losses = [sum(_missed(lessons, i, ridge, most) for i in range(len(lessons))) for ridge in RIDGES]
    weights = _solved(x, y, RIDGES[losses.index(min(losses))])
    rest: Array = y - (x @ weights).clip(-most, most)
    return weights, rest


def _together(lessons: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    return np.concatenate([x for x, _ in lessons]), np.concatenate([y for _, y in lessons])


def _missed(lessons: list[tuple[Array, Array]], left_out: int, ridge: float, most: float) -> float:
    """Return by how much one lesson is missed by what the others teach, in all."""
    x, y = _together(lessons[:left_out] + lessons[left_out + 1 :])
    asked, wanted = lessons[left_out]
    return float(np.abs(wanted - (asked @ _solved(x, y, ridge)).clip(-most, most)).sum())


def _solved(x: Array, y: Array, ridge: float) -> Array:
    square = x.T @ x
    held = ridge * np.diag(square) + 1e-12 * np.trace(square) + 1e-300
    return np.asarray(np.linalg.solve(square + np.diag(held), x.T @ y), float)
