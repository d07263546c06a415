"""The test whether residuals along an order have as few runs of one sign as noise has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import comb, ndtr

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.outcome import Outcome

FEW = 10
"""Of either sign: with more the number of runs is about normal (Draper and Smith 1966)."""

TURNS = 4
"""Of a helix over the unfolded surface."""


def runs_test(residuals: Array) -> Outcome:
    """Test residuals in order for too few runs of one sign (Wald and Wolfowitz 1940; Chaperon 2002, section 5.2.4).

    The statistic is the number of runs, less its expectation, in deviations; without noise on either side it is 0.
    """
    positive = residuals > 0
    n1 = int(np.count_nonzero(positive))
    n2 = len(residuals) - n1
    if min(n1, n2) == 0:
        return Outcome(0.0, 1.0)
    runs = 1 + int(np.count_nonzero(positive[1:] != positive[:-1]))
    twice = 2 * n1 * n2
    deviation = np.sqrt(twice * (twice - n1 - n2) / ((n1 + n2) ** 2 * max(n1 + n2 - 1, 1)))
    difference = runs - twice / (n1 + n2) - 1
    statistic = float(difference / deviation) if deviation > 0 else 0.0
    if max(n1, n2) <= FEW:
        return Outcome(statistic, _fewer(runs, n1, n2))
    return Outcome(statistic, float(ndtr((difference + 0.5) / deviation)))


def _fewer(runs: int, n1: int, n2: int) -> float:
    """Return the probability of at most some runs of n1 and n2 signs, by counting."""
    ways = 0.0
    for count in range(2, runs + 1):
        half = count // 2
        if count % 2 == 0:
            ways += 2 * comb(n1 - 1, half - 1) * comb(n2 - 1, half - 1)
        else:
            ways += comb(n1 - 1, half) * comb(n2 - 1, half - 1) + comb(n1 - 1, half - 1) * comb(n2 - 1, half)
    return float(min(1.0, ways / comb(n1 + n2, n1)))


def helix_order(unfolded: Array, turns: int = TURNS) -> NDArray[np.intp]:
    """Return the order (n,) of points along a helix over a surface unfolded into [-1, 1] x [-1, 1].

    It goes along the first coordinate while the second grows, in so many turns; a point belongs to the turn below it.
    """
    along, across = ((unfolded + 1) / 2).T
    return np.lexsort((along, np.floor(turns * across - along)))
