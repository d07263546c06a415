"""Probes: fits of all degrees at several radii around some points, and the risk (expected squared error) of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.curvature.adaptive import _kernels_probes as kernels
from simplexmesh.surface.curvature.adaptive._kernels_balls import Surface
from simplexmesh.surface.curvature.adaptive._kernels_jets import RESIDUAL_BIAS
from simplexmesh.surface.curvature.adaptive._kernels_polynomials import HIGHEST

LOWEST = 2
"""The lowest degree, which has no prior; arrays over degrees with priors begin at the next."""

NEGLIGIBLE = 0.01
"""Errors below this share of the curvedness do not matter to the choice of the radius."""

DROP_BELOW = 0.15
"""Degrees are dropped if that increases the squared error by no more than this share."""

DECAY = (225.0, 0.12)
"""The squared change by the next even degree is last^2 / before times this, where the last was 4 and where it was 6."""


class ProbeFits(NamedTuple):
    """Statistics of fits of all degrees around p probes at k radii, in units of the radius but for the increments."""

    radii: Array  # (p, k)
    changes: Array  # (p, k, 2, 5) squared change by degrees 2 to 6, of the shape operator and of H alone
    variances: Array  # (p, k, 2, 5) of these, at unit noise
    energies: Array  # (p, k, 4) reduction of the sum of squares by degrees 3 to 6
    weights: Array  # (p, k, 4, 4) of unit coefficients of each degree in that
    squares: Array  # (p, k) residual sum
    freedom: Array  # (p, k) its degrees of freedom
    degrees: Array  # (p, k) the highest fitted, 0 where none could be
    increments: Array  # (p, k, 5) change of -H by each degree, in the unit of the points

    def mean(self, groups: Indices) -> ProbeFits:
        """Return means over (q, g) groups of probes; `increments`, which are signed, stay as they are."""
        (q, g), p = groups.shape, len(self.radii)
        over = csr_array((np.full(q * g, 1 / g), groups.ravel(), np.arange(0, q * g + 1, g)), shape=(q, p))

        def averaged(part: Array) -> Array:
            return np.asarray((over @ part.reshape(p, -1)).reshape(q, *part.shape[1:]))

        means = {name: averaged(getattr(self, name)) for name in self._fields[1:7]}
        degrees = np.median(self.degrees[groups], axis=1)
        return self._replace(radii=np.exp(averaged(np.log(self.radii))), degrees=degrees, **means)


def probe_fits(surface: Surface, rows: Indices, radii: Array) -> ProbeFits:
    """Fit probes at the points `rows` with (p, k) radii."""
    degrees = HIGHEST - 1  # 2 to the highest; those from 3 on have priors
    shapes = (2, degrees), (2, degrees), (degrees - 1,), (degrees - 1, degrees - 1), (), (), (), (degrees,)
    out = ProbeFits(np.ascontiguousarray(radii), *(np.zeros((*radii.shape, *shape)) for shape in shapes))
    kernels.probes(len(rows), rows, surface, out)
    return out


def noise_level(fits: ProbeFits) -> float:
    """Return the standard deviation of the noise: the least over radii of the median residual, less skewness."""
    squares = []
    for k in range(fits.radii.shape[1]):
        free = fits.freedom[:, k]
        enough = free >= 6
        if enough.sum() >= max(3, 0.3 * len(free)):
            square = fits.squares[enough, k] / free[enough] * fits.radii[enough, k] ** 2
            squares.append(np.median(square / (1 - 2 / (9 * free[enough])) ** 3))
    return float(np.sqrt(min(squares, default=0.0)))


class Risks(NamedTuple):
    """Expected errors of p probes at k radii, and how to fit there."""

    risk: Array  # (p, k) expected squared error of curvature, infinite where nothing could be fitted
    degrees: Indices  # (p, k) to fit
    priors: Array  # (p, k, 4) deviations of the coefficients of degrees 3 to 6, in radii
    truncation: Array  # (p, k) expected error of curvature by terms of higher degree
    shrinkage: Array  # (p, k, 5) share of each degree's change that is not noise
    variance: Array  # (p, k) of the curvature by noise alone

    def compared(self, increments: Array, groups: Indices) -> Risks:
        """Raise the risk of radii whose H differs from that of shorter ones by more than their errors (Lepski 1990)."""
        mean = (self.shrinkage[:, None] * increments[groups]).sum(axis=3)
        truncation = self.truncation**2
        for k in range(1, mean.shape[2]):
            for shorter in range(k):
                difference = ((mean[:, :, k] - mean[:, :, shorter]) ** 2).mean(axis=1)
                difference -= self.variance[:, shorter] + self.truncation[:, shorter] ** 2
                truncation[:, k] = np.maximum(truncation[:, k], difference)
        return self._replace(risk=self.risk + truncation - self.truncation**2, truncation=np.sqrt(truncation))


def risks(fits: ProbeFits, noise: float) -> Risks:
    """Return the risks of fits under noise of that standard deviation."""
    relative = (noise / fits.radii) ** 2
    variance = relative[:, :, None] * fits.variances.mean(axis=2)  # the shape operator counts as much as H alone
    signal = np.maximum(fits.changes.mean(axis=2) - variance, 0.0)
    shrinkage = _ratio(signal, signal + variance)
    shrinkage[:, :, 0] = 1.0
    degree = fits.degrees
    excess = np.maximum(fits.squares / np.maximum(fits.freedom, 1) - relative, 0.0)
    known = np.arange(LOWEST, len(RESIDUAL_BIAS))  # medians of probes, some of which failed, may lie below
    bias = np.interp(degree, known, RESIDUAL_BIAS[LOWEST:])
    truncation = np.maximum(excess * bias**2, _truncated(degree, signal))
    noise_risk = (shrinkage * variance).sum(axis=2)
    curved = np.maximum(fits.changes[:, :, 0, 0] - relative * fits.variances[:, :, 0, 0], 0.0)
    # where radius times curvedness exceeds 1 the ball is hardly a graph over a plane
    risk = (noise_risk + truncation) * (1 + curved**4) + NEGLIGIBLE**2 * curved
    risk = np.where((fits.freedom > 0) & (degree > 0), risk / fits.radii**2, np.inf)
    gain = np.where(
        np.arange(LOWEST, LOWEST + shrinkage.shape[2]) <= degree[:, :, None], signal - shrinkage * variance, 0.0
    )
    loss = gain[:, :, ::-1].cumsum(axis=2)[:, :, ::-1] - gain
    degrees = LOWEST + (loss <= DROP_BELOW * (noise_risk + truncation)[:, :, None]).argmax(axis=2)
    noise_variance = (shrinkage**2 * variance).sum(axis=2) / fits.radii**2
    return Risks(risk, degrees, _priors(fits, relative), np.sqrt(truncation) / fits.radii, shrinkage, noise_variance)


def _ratio(part: Array, whole: Array) -> Array:
    """Return part / whole where the part is positive, 0 elsewhere."""
    out: Array = np.where(part > 0, part, 0.0) / np.where(part > 0, whole, 1.0)
    return out


def _truncated(degrees: Array, signal: Array) -> Array:
    """Return the squared change the next even degree would make, continuing the last ones as a geometric series."""
    last = (degrees.astype(np.int64) // 2 * 2).clip(4) - LOWEST
    now = np.take_along_axis(signal, last[:, :, None], 2)[:, :, 0]
    before = np.take_along_axis(signal, last[:, :, None] - 2, 2)[:, :, 0]
    factor = np.where(last > 2, DECAY[1], DECAY[0])
    out: Array = now * np.minimum(1.0, factor * _ratio(now, np.maximum(before, 1e-300)))
    return out


def _priors(fits: ProbeFits, relative: Array) -> Array:
    """Return standard deviations of coefficients: block energies less those of noise and of higher degrees."""
    blocks = fits.energies.shape[2]
    squares = np.zeros_like(fits.energies)
    for d in range(blocks - 1, -1, -1):
        energy = fits.energies[:, :, d] - (d + LOWEST + 2) * relative
        energy = energy - (squares[:, :, d + 1 :] * fits.weights[:, :, d, d + 1 :]).sum(axis=2)
        squares[:, :, d] = _ratio(energy, np.maximum(fits.weights[:, :, d, d], 1e-300))
        squares[:, :, d] *= fits.weights[:, :, d, d] > 0
    return np.sqrt(squares)
