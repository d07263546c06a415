"""What probes say: how much of what polynomials find is noise, how much detail, and at which radius least is wrong."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.curvature import _kernels_adaptive as kernels
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LOWEST = 2
"""The degree without a prior; the others have places 0, 1, ... from the next on."""

ANISOTROPIC = 0.5
"""Weight of all of the shape operator, beside H alone, in what is to be right."""

EXACT = 0.01
"""Errors below this share of the curvedness are not worth a choice."""

BENT = 1.0
"""Balls in which radius times curvedness, squared, is more than this are hardly graphs over a plane any longer."""

DROPPED = 0.15
"""Degrees are left out where that adds no more than this share to the squared error."""

SERIES = (225.0, 0.12)
"""The next even degree adds now^2 / before times this, squares, where degree 4 and where degree 6 was the last."""


class Probed(NamedTuple):
    """What fits of all degrees at some radii found around some points: (p, k, ...) rows of probes at radii.

    Attributes
    ----------
    radii : (p, k) array of float
    levels : (p, k, 4, 5) array of float
        Squared change and its variance at unit noise that degrees 2 to 6 bring, to all of the shape operator and to H
        alone; in units of the radius.
    energies, weights : (p, k, 4), (p, k, 4, 4) array of float
        What degrees 3 to 6 take off the sum of squares, and how much unit coefficients of each degree put there.
    misfits : (p, k, 2) array of float
        Residual sum of squares, and its degrees of freedom.
    degrees : (p, k) array of float
        The highest degree fitted, 0 where nothing could be.
    steps : (p, k, 5) array of float
        What each degree adds to -H, signed, in the unit of the points.
    """

    radii: Array
    levels: Array
    energies: Array
    weights: Array
    misfits: Array
    degrees: Array
    steps: Array

    def mean(self, groups: Indices) -> Probed:
        """Means over (q, g) groups of probes; what is signed has none and stays."""
        logs, levels, energies, weights, misfits = (
            sum((part[members] for members in groups.T), np.zeros(())) / groups.shape[1]
            for part in (np.log(self.radii), *self[1:5])
        )
        radii = np.exp(logs)
        return Probed(radii, levels, energies, weights, misfits, np.median(self.degrees[groups], axis=1), self.steps)


def probed(samples: Samples, rows: Indices, radii: Array, directions: Array, *, oriented: bool) -> Probed:
    """Return what probes at the points `rows` say with (p, k) radii."""
    ring, b = samples.one_ring, kernels.BLOCKS
    p, k = radii.shape
    shapes = ((4, b + 1), (b,), (b, b), (2,), (), (b + 1,))
    out = Probed(np.ascontiguousarray(radii), *(np.zeros((p, k, *shape)) for shape in shapes))
    links = (ring.offsets.view(np.uint64), ring.members.view(np.uint64), samples.points, directions, oriented)
    kernels.probes(rows, *links, out.radii, kernels.chunks(p), *out[1:])
    return out


def noise_of(told: Probed) -> float:
    """Return the deviation of the noise, in the unit of the points.

    The median over probes of the residual variance, each corrected for the skew of its distribution; of the radii
    that leave enough degrees of freedom, the least.
    """
    squares = []
    for k in range(told.radii.shape[1]):
        free = told.misfits[:, k, 1]
        enough = free >= 6
        if enough.sum() >= max(3, 0.3 * len(free)):
            square = told.misfits[enough, k, 0] / free[enough] * told.radii[enough, k] ** 2
            squares.append(np.median(square / (1 - 2 / (9 * free[enough])) ** 3))
    return float(np.sqrt(min(squares, default=0.0)))


class Judged(NamedTuple):
    """What is expected at each radius: (p, k) rows.

    Attributes
    ----------
    risk : (p, k) array of float
        Expected squared error of curvature, infinite where nothing could be fitted.
    degrees : (p, k) array of int
        The degree to fit.
    priors : (p, k, 4) array of float
        Deviation of the coefficients of degrees 3 to 6, in radii.
    beyond : (p, k) array of float
        Expected error by what no degree says.
    kept : (p, k, 5) array of float
        The share of each degree's change that is not noise.
    variance : (p, k) array of float
        Of the curvature by noise alone.
    """

    risk: Array
    degrees: Indices
    priors: Array
    beyond: Array
    kept: Array
    variance: Array

    def compared(self, steps: Array, groups: Indices) -> Judged:
        """Raise the risk of radii whose H differs from that of shorter ones by more than those may be wrong (Lepski).

        Parameters
        ----------
        steps : (n, k, 5) array of float
            Of single probes.
        groups : (p, g) array of int
            Which of them each row is the mean of.
        """
        mean = (self.kept[:, None] * steps[groups]).sum(axis=3)
        beyond = self.beyond**2
        for k in range(1, mean.shape[2]):
            for shorter in range(k):
                apart = ((mean[:, :, k] - mean[:, :, shorter]) ** 2).mean(axis=1)
                apart -= self.variance[:, shorter] + self.beyond[:, shorter] ** 2
                beyond[:, k] = np.maximum(beyond[:, k], apart)
        return self._replace(risk=self.risk + beyond - self.beyond**2, beyond=np.sqrt(beyond))


def judged(told: Probed, noise: float) -> Judged:
    """Weigh noise of that deviation against detail."""
    relative = (noise / told.radii) ** 2
    weighed = ANISOTROPIC * told.levels[:, :, :2] + (1 - ANISOTROPIC) * told.levels[:, :, 2:]
    variance = relative[:, :, None] * weighed[:, :, 1]
    signal = np.maximum(weighed[:, :, 0] - variance, 0.0)
    kept = _share(signal, signal + variance)
    kept[:, :, 0] = 1.0
    degree = told.degrees
    over = np.maximum(told.misfits[:, :, 0] / np.maximum(told.misfits[:, :, 1], 1) - relative, 0.0)
    harm = np.where(degree > 3, 1.0, kernels.GENTLE) * kernels.HARM
    beyond = np.maximum(over * harm**2, _truncated(degree, signal))
    noisy = (kept * variance).sum(axis=2)
    bent = np.maximum(told.levels[:, :, 0, 0] - relative * told.levels[:, :, 1, 0], 0.0)
    risk = (noisy + beyond) * (1 + (bent / BENT) ** 4) + EXACT**2 * bent
    risk = np.where((told.misfits[:, :, 1] > 0) & (degree > 0), risk / told.radii**2, np.inf)
    gained = np.where(np.arange(LOWEST, LOWEST + kept.shape[2]) <= degree[:, :, None], signal - kept * variance, 0.0)
    lost = gained[:, :, ::-1].cumsum(axis=2)[:, :, ::-1] - gained
    degrees = LOWEST + (lost <= DROPPED * (noisy + beyond)[:, :, None]).argmax(axis=2)
    by_noise = (kept**2 * variance).sum(axis=2) / told.radii**2
    return Judged(risk, degrees, _priors(told, relative), np.sqrt(beyond) / told.radii, kept, by_noise)


def _share(part: Array, whole: Array) -> Array:
    """Part of whole, 0 where there is none."""
    out: Array = np.where(part > 0, part, 0.0) / np.where(part > 0, whole, 1.0)
    return out


def _truncated(degrees: Array, signal: Array) -> Array:
    """Squares of what the next even degree would add: the last ones continued as a geometric series."""
    last = (degrees.astype(np.int64) // 2 * 2).clip(4) - LOWEST
    now = np.take_along_axis(signal, last[:, :, None], 2)[:, :, 0]
    before = np.take_along_axis(signal, last[:, :, None] - 2, 2)[:, :, 0]
    factor = np.where(last > 2, SERIES[1], SERIES[0])
    out: Array = now * np.minimum(1.0, factor * _share(now, np.maximum(before, 1e-300)))
    return out


def _priors(told: Probed, relative: Array) -> Array:
    """Deviations of coefficients: energies of blocks, from the highest degree down, less noise and the others'."""
    blocks = told.energies.shape[2]
    squares = np.zeros_like(told.energies)
    for d in range(blocks - 1, -1, -1):
        energy = told.energies[:, :, d] - (d + LOWEST + 2) * relative
        energy = energy - (squares[:, :, d + 1 :] * told.weights[:, :, d, d + 1 :]).sum(axis=2)
        squares[:, :, d] = _share(energy, np.maximum(told.weights[:, :, d, d], 1e-300))
        squares[:, :, d] *= told.weights[:, :, d, d] > 0
    return np.sqrt(squares)
