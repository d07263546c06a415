"""What a test of residuals says."""

from __future__ import annotations

from dataclasses import dataclass

SIGNIFICANCE = 0.05
"""How often a right model is rejected."""


@dataclass(frozen=True, repr=False)
class Outcome:
    """One test of the hypothesis that residuals are noise.

    Attributes
    ----------
    statistic : float
        What the test computes.
    p_value : float
        Probability of a statistic that speaks against noise as much, were it noise.
    significance : float
        Below it the hypothesis is rejected.

    Examples
    --------
    >>> Outcome(2.7, 0.004), Outcome(2.7, 0.004).passed
    (Outcome(2.7, p 0.004, rejected), False)
    """

    statistic: float
    p_value: float
    significance: float = SIGNIFICANCE

    @property
    def passed(self) -> bool:
        """Whether the hypothesis stands."""
        return self.p_value >= self.significance

    def __repr__(self) -> str:
        return f"Outcome({self.statistic:.3g}, p {self.p_value:.3g}, {'passed' if self.passed else 'rejected'})"
