"""The test of residuals for a normal law of any mean and deviation (Kolmogorov and Smirnov)."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from simplexmesh._base.arrays import Array
from simplexmesh.cloud.validation.outcome import Outcome

LAW = np.array(
    [
        (0.0, 1.0),
        (0.324, 0.999),
        (0.3721, 0.99),
        (0.4253, 0.95),
        (0.4591, 0.9),
        (0.5248, 0.75),
        (0.6134, 0.5),
        (0.7199, 0.25),
        (0.7845, 0.15),
        (0.8312, 0.1),
        (0.9048, 0.05),
        (0.9704, 0.025),
        (1.0529, 0.01),
        (1.1113, 0.005),
        (1.2305, 0.001),
    ]
)
"""Statistics and their probabilities, by 300,000 trials of 1,000 values (made again in the tests)."""


def largest_difference(probabilities: Array) -> float:
    """Return D_n, the largest difference of the probabilities a law gives to values from their shares (eq. 5.3)."""
    ordered, n = np.sort(probabilities), len(probabilities)
    after = np.arange(1, n + 1) / n
    return float(max((after - ordered).max(), (ordered - after).max() + 1 / n))


def normality_test(residuals: Array) -> Outcome:
    """Test residuals for a normal law of any mean and deviation (Lilliefors 1967, Stephens 1974).

    The statistic is D_n; the p-value is that of (sqrt n - 0.01 + 0.85 / sqrt n) D_n.
    """
    centered, deviation = residuals - residuals.mean(), max(residuals.std(ddof=1), np.finfo(float).tiny)
    found, root = largest_difference(ndtr(centered / deviation)), np.sqrt(len(residuals))
    return Outcome(found, estimated_law((root - 0.01 + 0.85 / root) * found))


def estimated_law(statistic: float) -> float:
    """Return the probability of more than a statistic of `normality_test`.

    Logarithms of the simulated probabilities are interpolated, and continued as those of exp(-c statistic^2).
    """
    at, logarithm = LAW[:, 0] ** 2, np.log(LAW[:, 1])
    if statistic > LAW[-1, 0]:
        slope = (logarithm[-1] - logarithm[-2]) / (at[-1] - at[-2])
        return float(np.exp(logarithm[-1] + slope * (statistic**2 - at[-1])))
    return float(np.exp(np.interp(statistic**2, at, logarithm)))
