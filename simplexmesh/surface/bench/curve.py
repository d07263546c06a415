"""How an estimate behaves as the neighbors draw near: monotone, with a limit, with the right one, how fast."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUND_OFF = 4e-15
"""Of a curvature times the squared distance: what double precision leaves of 2 z / d^2."""

SMALL = 2e-9
"""Errors below this count as none: iterations stop there."""

LOOSE = 1e-3
"""Of the scale: a limit missed by less is met, at the smallest distances tried."""

FIT_BELOW = 0.25
"""Orders are fitted to errors at distances up to this."""


@dataclass(frozen=True, eq=False)
class Curve:
    """The answers of one method for one quantity at one point, over distances that fall.

    Attributes
    ----------
    method, quantity, surface, scheme : str
        Quantities: "H", "K", and "N", the normal.
    count : int
        Of neighbors.
    distances : (d,) array of float
        Falling.
    values : (d,) or (d, 3) array of float
        Estimates; NaN where there is none.
    truth : () or (3,) array of float
    scale : float
        What errors are relative to: the largest principal curvature there (1 where it is flat), its square for K, 1
        for normals.
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
        """(d,) array of float: how far off, of normals the distance |N - truth|."""
        off = self.values - self.truth
        out: Array = np.abs(off) if off.ndim == 1 else np.linalg.norm(off, axis=1)
        return out

    @cached_property
    def floor(self) -> Array:
        """(d,) array of float: errors that double precision explains."""
        blur = ROUND_OFF / self.distances ** (1 if self.quantity == "N" else 2)
        out: Array = np.maximum(SMALL, max(1.0, self.scale) * blur)
        return out

    @cached_property
    def failed(self) -> bool:
        """Whether some estimate is missing."""
        return not np.isfinite(self.errors).all()

    @cached_property
    def monotone(self) -> bool:
        """Whether estimates only rise, or only fall, as d does; of normals, whether errors only fall."""
        if self.failed:
            return False
        course = -self.errors if self.quantity == "N" else self.values
        steps = np.diff(course)
        seen = steps[np.abs(steps) > self.floor[1:] + self.floor[:-1]]
        return bool((seen > 0).all() or ((seen < 0).all() and self.quantity != "N"))

    @cached_property
    def has_limit(self) -> bool:
        """Whether estimates settle: over the last decade of d they spread at most a twentieth of over the first."""
        if self.failed:
            return False
        first = self.distances >= self.distances[0] / 10
        last = self.distances <= self.distances[-1] * 10
        return _spread(self.values[last]) <= 2 * self.floor[-1] + LOOSE * self.scale + 0.05 * _spread(
            self.values[first]
        )

    @cached_property
    def converges(self) -> bool:
        """Monotone and with a limit, right or wrong (Charton 2014, def. 1.20)."""
        return self.monotone and self.has_limit

    @cached_property
    def limit_is_correct(self) -> bool:
        """Whether the last estimate is the truth, to a thousandth."""
        return bool(self.errors[-1] <= self.floor[-1] + LOOSE * self.scale)

    @cached_property
    def exact(self) -> bool:
        """Whether there is no error at any distance."""
        return bool((self.errors <= self.floor).all())

    @cached_property
    def order(self) -> float:
        """Power of d the error falls with, fitted; NaN where fewer than four errors stand out of round-off."""
        used = (self.errors > 5 * self.floor) & (self.distances <= FIT_BELOW)
        if used.sum() < 4:
            return float("nan")
        return float(np.polyfit(np.log(self.distances[used]), np.log(self.errors[used]), 1)[0])

    def error_at(self, distance: float) -> float:
        """Return the error at the distance nearest to one."""
        return float(self.errors[np.argmin(np.abs(np.log(self.distances / distance)))])


def _spread(values: Array) -> float:
    """Return the largest difference of two values, of vectors the diagonal of their bounding box."""
    return float(np.linalg.norm(np.atleast_1d(np.ptp(values, axis=0))))
