"""The test whether residuals along an order have as few runs of one sign as noise has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.outcome import Outcome

TURNS = 4
"""Of a helix over the unfolded surface."""


def runs_test(residuals: Array) -> Outcome:
    """Test residuals in order for too few runs of one sign (Wald and Wolfowitz 1940; Chaperon 2002, section 5.2.4).

    The statistic is the number of runs, less its expectation, in deviations; without noise on either side it is 0.
    """
    positive = residuals > 0
    n, n1 = len(residuals), int(np.count_nonzero(positive))
    if n1 in (0, n):
        return Outcome(0.0, 1.0)
    runs, twice = 1 + int(np.count_nonzero(positive[1:] != positive[:-1])), 2 * n1 * (n - n1)
    deviation = np.sqrt(twice * (twice - n) / (n**2 * (n - 1)))
    difference = runs - twice / n - 1
    return Outcome(float(difference / deviation), float(ndtr((difference + 0.5) / deviation)))


def helix_order(unfolded: Array, turns: int = TURNS) -> NDArray[np.intp]:
    """Return the order (n,) of points along a helix over a surface unfolded into [-1, 1] x [-1, 1].

    It goes along the first coordinate while the second grows, in so many turns; a point belongs to the turn below it.
    """
    along, across = ((unfolded + 1) / 2).T
    return np.lexsort((along, np.floor(turns * across - along)))
