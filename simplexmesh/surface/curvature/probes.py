"""Probes: fits of all degrees at several radii around some points, and the risk (expected squared error) of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from simplexmesh.surface.curvature import _kernels_adaptive_probes as kernels
from simplexmesh.surface.curvature._kernels_adaptive import RESIDUAL_BIAS, chunks
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LOWEST = 2
"""The lowest degree, which has no prior; arrays over degrees with priors begin at the next."""

ANISOTROPIC = 0.5
"""Weight of the whole shape operator in the risk, against H alone."""

NEGLIGIBLE = 0.01
"""Errors below this share of the curvedness do not matter to the choice of the radius."""

CURVED = 1.0
"""Where the square of radius times curvedness exceeds this the ball is hardly a graph over a plane."""

DROP_BELOW = 0.15
"""Degrees are dropped if that increases the squared error by no more than this share."""

DECAY = (225.0, 0.12)
"""The squared change by the next even degree is last^2 / before times this, where the last was 4 and where it was 6."""


class ProbeFits(NamedTuple):
    """Statistics of fits of all degrees around p probes at k radii.

    Attributes
    ----------
    radii : (p, k) array of float
    levels : (p, k, 4, 5) array of float
        Squared change by degrees 2 to 6 and its variance at unit noise, of the whole shape operator and of H alone, in
        units of the radius.
    energies, weights : (p, k, 4), (p, k, 4, 4) array of float
        Reduction of the sum of squares by degrees 3 to 6, and the weight of unit coefficients of each degree in it.
    residuals : (p, k, 2) array of float
        Residual sum of squares, and its degrees of freedom.
    degrees : (p, k) array of float
        The highest degree fitted, 0 where nothing could be.
    increments : (p, k, 5) array of float
        Change of -H by each degree, in the unit of the points.
    """

    radii: Array
    levels: Array
    energies: Array
    weights: Array
    residuals: Array
    degrees: Array
    increments: Array

    def mean(self, groups: Indices) -> ProbeFits:
        """Return means over (q, g) groups of probes; `increments`, which are signed, stay as they are."""
        (q, g), p = groups.shape, len(self.radii)
        over = csr_array((np.full(q * g, 1 / g), groups.ravel(), np.arange(0, q * g + 1, g)), shape=(q, p))
        parts = np.log(self.radii), *self[1:5]
        means = over @ np.hstack([part.reshape(p, -1) for part in parts])
        ends = np.cumsum([part[0].size for part in parts])[:-1]
        logs, levels, energies, weights, residuals = (
            mean.reshape(q, *part.shape[1:]) for mean, part in zip(np.hsplit(means, ends), parts, strict=True)
        )
        degrees = np.median(self.degrees[groups], axis=1)
        return ProbeFits(np.exp(logs), levels, energies, weights, residuals, degrees, self.increments)


def probe_fits(samples: Samples, rows: Indices, radii: Array, directions: Array, *, oriented: bool) -> ProbeFits:
    """Fit probes at the points `rows` with (p, k) radii."""
    ring, b = samples.one_ring, kernels.BLOCKS
    p, k = radii.shape
    shapes = ((4, b + 1), (b,), (b, b), (2,), (), (b + 1,))
    out = ProbeFits(np.ascontiguousarray(radii), *(np.zeros((p, k, *shape)) for shape in shapes))
    links = (ring.offsets.view(np.uint64), ring.members.view(np.uint64), samples.points, directions, oriented)
    kernels.probes(rows, *links, out.radii, chunks(p), *out[1:])
    return out


def noise_level(fits: ProbeFits) -> float:
    """Return the standard deviation of the noise, in the unit of the points.

    The median over probes of the residual variance, corrected for the skewness of its distribution; the least over
    radii with enough degrees of freedom.
    """
    squares = []
    for k in range(fits.radii.shape[1]):
        free = fits.residuals[:, k, 1]
        enough = free >= 6
        if enough.sum() >= max(3, 0.3 * len(free)):
            square = fits.residuals[enough, k, 0] / free[enough] * fits.radii[enough, k] ** 2
            squares.append(np.median(square / (1 - 2 / (9 * free[enough])) ** 3))
    return float(np.sqrt(min(squares, default=0.0)))


class Risks(NamedTuple):
    """Expected errors of p probes at k radii, and how to fit there.

    Attributes
    ----------
    risk : (p, k) array of float
        Expected squared error of curvature, infinite where nothing could be fitted.
    degrees : (p, k) array of int
        The degree to fit.
    priors : (p, k, 4) array of float
        Standard deviation of the coefficients of degrees 3 to 6, in radii.
    truncation : (p, k) array of float
        Expected error of curvature by terms of higher degree.
    shrinkage : (p, k, 5) array of float
        Share of each degree's change that is not noise.
    variance : (p, k) array of float
        Variance of the curvature by noise alone.
    """

    risk: Array
    degrees: Indices
    priors: Array
    truncation: Array
    shrinkage: Array
    variance: Array

    def compared(self, increments: Array, groups: Indices) -> Risks:
        """Raise the risk of radii whose H differs from that of shorter ones by more than those' errors (Lepski 1990).

        Parameters
        ----------
        increments : (n, k, 5) array of float
            Of the single probes.
        groups : (p, g) array of int
            The probes that each row is the mean of.
        """
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
    weighted = ANISOTROPIC * fits.levels[:, :, :2] + (1 - ANISOTROPIC) * fits.levels[:, :, 2:]
    variance = relative[:, :, None] * weighted[:, :, 1]
    signal = np.maximum(weighted[:, :, 0] - variance, 0.0)
    shrinkage = _ratio(signal, signal + variance)
    shrinkage[:, :, 0] = 1.0
    degree = fits.degrees
    excess = np.maximum(fits.residuals[:, :, 0] / np.maximum(fits.residuals[:, :, 1], 1) - relative, 0.0)
    known = np.arange(LOWEST, len(RESIDUAL_BIAS))  # medians of probes, some of which failed, may lie below
    bias = np.interp(degree, known, RESIDUAL_BIAS[LOWEST:])
    truncation = np.maximum(excess * bias**2, _truncated(degree, signal))
    noise_risk = (shrinkage * variance).sum(axis=2)
    curved = np.maximum(fits.levels[:, :, 0, 0] - relative * fits.levels[:, :, 1, 0], 0.0)
    risk = (noise_risk + truncation) * (1 + (curved / CURVED) ** 4) + NEGLIGIBLE**2 * curved
    risk = np.where((fits.residuals[:, :, 1] > 0) & (degree > 0), risk / fits.radii**2, np.inf)
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
