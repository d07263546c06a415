"""The test of residuals against noise of known deviation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.outcome import Outcome


def chi_square_test(residuals: Array, noise: ArrayLike, parameters: float) -> Outcome:
    """Test whether residuals are larger than noise of a deviation, one or (n,) for each point.

    The sum of (residual / noise)^2 has the chi-square law with n - parameters degrees of freedom (Chaperon 2002,
    section 5.2.2, where the ratio of deviations is said to have it).
    """
    statistic = float(((residuals / np.asarray(noise, float)) ** 2).sum())
    return Outcome(statistic, float(chdtrc(len(residuals) - parameters, statistic)))
