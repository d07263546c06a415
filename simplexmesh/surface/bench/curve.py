"""Convergence of an estimate as the neighbors approach: monotonicity, limit and order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUND_OFF = 4e-15
"""Rounding error of a curvature, 2 z / d^2, times the squared distance."""

NEGLIGIBLE = 2e-9
"""Errors below this count as zero: iterations stop there."""

LIMIT_TOLERANCE = 1e-3
"""Tolerance of a correct limit, over the scale, at the smallest distances."""

FIT_BELOW = 0.25
"""Largest distance of the errors that orders are fitted to."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Estimates of one quantity at one point by one method, over decreasing distances.

    Attributes
    ----------
    method, quantity, surface, scheme : str
        Quantities: "H", "K", and "N", the normal.
    count : int
        Number of neighbors.
    distances : (d,) array of float
        Decreasing.
    values : (d,) or (d, 3) array of float
        Estimates; NaN where there is none.
    truth : () or (3,) array of float
    scale : float
        Unit of the errors: the largest principal curvature (1 if that is 0), its square for K, 1 for normals.
    """

    method: str
    quantity: str
    surface: str
    scheme: str
    count: int
    distances: Array
    values: Array
    truth: Array
    scale: float

    @cached_property
    def errors(self) -> Array:
        """(d,) array of float: absolute errors, |N - truth| for normals."""
        difference = self.values - self.truth
        out: Array = np.abs(difference) if difference.ndim == 1 else np.linalg.norm(difference, axis=1)
        return out

    @cached_property
    def floor(self) -> Array:
        """(d,) array of float: bounds of rounding errors."""
        rounding = ROUND_OFF / self.distances ** (1 if self.quantity == "N" else 2)
        out: Array = np.maximum(NEGLIGIBLE, max(1.0, self.scale) * rounding)
        return out

    @cached_property
    def failed(self) -> bool:
        """Whether any estimate is missing."""
        return not np.isfinite(self.errors).all()

    @cached_property
    def monotone(self) -> bool:
        """Whether estimates are monotone in d; for normals, whether errors decrease."""
        if self.failed:
            return False
        sequence = -self.errors if self.quantity == "N" else self.values
        steps = np.diff(sequence)
        significant = steps[np.abs(steps) > self.floor[1:] + self.floor[:-1]]
        return bool((significant > 0).all() or ((significant < 0).all() and self.quantity != "N"))

    @cached_property
    def has_limit(self) -> bool:
        """Whether the range of estimates over the last decade of d is at most a twentieth of that over the first."""
        if self.failed:
            return False
        first = self.distances >= self.distances[0] / 10
        last = self.distances <= self.distances[-1] * 10
        return _spread(self.values[last]) <= 2 * self.floor[-1] + LIMIT_TOLERANCE * self.scale + 0.05 * _spread(
            self.values[first]
        )

    @cached_property
    def converges(self) -> bool:
        """Monotone and with a limit, right or wrong (Charton 2014, def. 1.20)."""
        return self.monotone and self.has_limit

    @cached_property
    def limit_is_correct(self) -> bool:
        """Whether the last estimate is within `LIMIT_TOLERANCE` of the truth."""
        return bool(self.errors[-1] <= self.floor[-1] + LIMIT_TOLERANCE * self.scale)

    @cached_property
    def exact(self) -> bool:
        """Whether all errors are within rounding."""
        return bool((self.errors <= self.floor).all())

    @cached_property
    def order(self) -> float:
        """Fitted order of convergence; NaN if fewer than four errors exceed rounding."""
        used = (self.errors > 5 * self.floor) & (self.distances <= FIT_BELOW)
        if used.sum() < 4:
            return float("nan")
        return float(np.polyfit(np.log(self.distances[used]), np.log(self.errors[used]), 1)[0])

    def error_at(self, distance: float) -> float:
        """Return the error at the distance nearest to `distance`."""
        return float(self.errors[np.argmin(np.abs(np.log(self.distances / distance)))])


def _spread(values: Array) -> float:
    """Return the range of values; of vectors, the diagonal of their bounding box."""
    return float(np.linalg.norm(np.atleast_1d(np.ptp(values, axis=0))))
