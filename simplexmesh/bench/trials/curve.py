"""Convergence of an estimate as the neighbors approach: monotonicity, limit and order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.bench.trials.candidates import distance

ROUND_OFF = 4e-15
"""Rounding error of a curvature, 2 z / d^2, times the squared distance."""

NEGLIGIBLE = 2e-9
"""Errors below this count as zero: iterations stop there."""

LIMIT_TOLERANCE = 1e-3
"""Tolerance of a correct limit, over the scale, at the smallest distances."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Estimates (d,) or (d, 3) at a point with neighbors at decreasing distances (d,), NaN where missing."""

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
        return distance(self.values, self.truth)

    @cached_property
    def floor(self) -> Array:
        """(d,) array of float: bounds of rounding errors."""
        rounding = ROUND_OFF / self.distances ** (1 if self.quantity == "N" else 2)
        return np.asarray(np.maximum(NEGLIGIBLE, max(1.0, self.scale) * rounding))

    @property
    def failed(self) -> bool:
        """Whether any estimate is missing."""
        return not np.isfinite(self.errors).all()

    @cached_property
    def monotone(self) -> bool:
        """Whether estimates are monotone in d; for normals, whether errors decrease."""
        if self.failed:
            return False
        steps = np.diff(-self.errors if self.quantity == "N" else self.values)
        significant = steps[np.abs(steps) > self.floor[1:] + self.floor[:-1]]
        return bool((significant > 0).all() or ((significant < 0).all() and self.quantity != "N"))

    @cached_property
    def has_limit(self) -> bool:
        """Whether the range of estimates over the last decade of d is at most a twentieth of that over the first."""
        if self.failed:
            return False
        first, last = self.distances >= self.distances[0] / 10, self.distances <= self.distances[-1] * 10
        allowed = 2 * self.floor[-1] + LIMIT_TOLERANCE * self.scale + 0.05 * _range(self.values[first])
        return bool(_range(self.values[last]) <= allowed)

    @property
    def converges(self) -> bool:
        """Monotone and with a limit, right or wrong (Charton 2014, def. 1.20)."""
        return self.monotone and self.has_limit

    @property
    def limit_is_correct(self) -> bool:
        """Whether the last estimate is within `LIMIT_TOLERANCE` of the truth."""
        return bool(self.errors[-1] <= self.floor[-1] + LIMIT_TOLERANCE * self.scale)

    @property
    def exact(self) -> bool:
        """Whether all errors are within rounding."""
        return bool((self.errors <= self.floor).all())

    @cached_property
    def order(self) -> float:
        """Order of convergence fitted below a distance of 1/4; NaN if fewer than four errors exceed rounding."""
        used = (self.errors > 5 * self.floor) & (self.distances <= 0.25)
        if used.sum() < 4:
            return float("nan")
        return float(np.polyfit(np.log(self.distances[used]), np.log(self.errors[used]), 1)[0])

    def error_at(self, distance: float) -> float:
        """Return the error at the distance nearest to `distance`."""
        return float(self.errors[np.argmin(np.abs(np.log(self.distances / distance)))])


def _range(values: Array) -> float:
    """Return the range of values; of vectors, the diagonal of their bounding box."""
    return float(np.linalg.norm(np.atleast_1d(np.ptp(values, axis=0))))
