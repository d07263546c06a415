"""Polynomials of high degree at the borders of meshes that are nearly free of noise.

On one side of a point, fits of low degree err far more than all around it; with every degree more the error falls by
the size of the ball, and only noise, which grows as fast, sets a limit. Scattered points may be nearly interpolated,
those of grids may not. So fits of several degrees to several numbers of points are tried, and the error of each is
estimated from how much H changes with the last degree, and from its residuals.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.curvature import _kernels_high_degree as kernels
from simplexmesh.surface.curvature.jets import Jets, fitted
from simplexmesh.surface.curvature.scales import Scales, shuffling
from simplexmesh.surface.reasons import FOUND
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

RADIUS = 10.0
"""Of the ball whose nearest points are fitted, in spacings."""

TERMS_PER_POINT, MOST_POINTS = (0.9, 0.7, 0.5, 0.33), 170

FITS = np.array(
    [
        (degree, int(np.ceil((degree + 1) * (degree + 2) / 2 / share)))
        for degree in range(4, kernels.HIGHEST + 1)
        for share in TERMS_PER_POINT
        if (degree + 1) * (degree + 2) / 2 / share < MOST_POINTS
    ]
)
"""Degrees and numbers of points; those of fewer terms per point for grids."""

TRIED, COMPARED = 32, 2
"""Border vertices on which all fits are tried, and how many of the best fits are made at every border vertex."""

USABLE = 0.8
"""Least share of those vertices at which a fit must be determined."""

ROWS_PER_CHUNK, MOST_CHUNKS = 16, 64
"""Border vertices per chunk, and most chunks, as the workspace of each is as large as the mesh."""


def refitted(samples: Samples, rows: Indices, at: Indices, scales: Scales, found: Jets) -> Jets:
    """Return jets at the points `rows`, those at `at`, on borders, replaced where a high degree promises less error.

    The error of what it replaces is the expected one, or the difference between the two beyond twice the new error.
    """
    fits, noise, changes = _best(samples, scales)
    if not len(fits):
        return found
    tried = _tried(samples, rows[at], scales, found.some(at), fits)
    errors = np.sqrt((tried.changes**2 + changes**2) / 8 + noise**2 * tried.amplification)
    errors[np.isnan(errors)] = np.inf
    each, chosen = np.arange(len(at)), errors.argmin(axis=1)
    error, jets = errors[each, chosen], tried.jets[each, chosen]
    apart = np.abs(jets[:, :2].mean(axis=1) - found.shape[at].mean(axis=1))
    better = error < np.maximum(found.error[at], apart - 2.0 * error)
    at, jets = at[better], jets[better]
    shape, d1, normals, errors = (part.copy() for part in found[:4])
    shape[at], d1[at], normals[at], errors[at] = jets[:, :2], jets[:, 2:5], jets[:, 5:], error[better]
    return found._replace(shape=shape, d1=d1, normals=normals, error=errors)


class Tried:
    """Fits around n points: what H changes by with the last degree, and so on; NaN where points do not determine it.

    Attributes
    ----------
    changes, squares, amplification : (n, f) array of float
        Absolute change of H with the last degree, sum of squared residuals, variance of H per variance of heights.
    jets : (n, f, 8) array of float
        k1, k2, direction of k1, normal.
    """

    def __init__(self, numbers: Array, jets: Array) -> None:
        self.changes = np.abs(numbers[:, :, 1] - numbers[:, :, 0])
        self.squares, self.amplification = numbers[:, :, 2], numbers[:, :, 3]
        self.jets = jets


def _best(samples: Samples, scales: Scales) -> tuple[Indices, Array, Array]:
    """Return the fits of the least expected error on the mesh's borders, their residuals (RMS) and mean changes."""
    rim = _beside_inner(samples)
    rim = np.sort(rim[shuffling(scales.spacing)[rim].argsort(kind="stable")][:TRIED])
    found = fitted(samples, rim, scales, samples.one_ring)
    known = np.flatnonzero(found.reasons == FOUND)
    tried = _tried(samples, rim[known], scales, found.some(known), FITS)
    determined = ~np.isnan(tried.changes)
    usable = np.flatnonzero(determined.sum(axis=0) > USABLE * max(len(known), 1))
    degrees, points = FITS[usable].T
    changes, squares, amplification = (
        np.nanmean(part[:, usable], axis=0) for part in (tried.changes, tried.squares, tried.amplification)
    )
    noise = np.sqrt(squares / (points - (degrees + 1) * (degrees + 2) // 2))
    errors = np.hypot(changes / 2, noise * np.sqrt(amplification))
    best = errors.argsort(kind="stable")[:COMPARED]
    return FITS[usable[best]], noise[best], changes[best]


def _beside_inner(samples: Samples) -> Indices:
    """Return the border vertices with a neighbor inside: not those of isolated points and of stray triangles."""
    ring = samples.one_ring
    inside = np.repeat(ring.closed, ring.valence)
    return np.unique(ring.members[inside & ~ring.closed[ring.members]])


def _tried(samples: Samples, rows: Indices, scales: Scales, known: Jets, fits: Indices) -> Tried:
    ring, n = samples.one_ring, len(rows)
    numbers, jets = np.full((n, len(fits), 4), np.nan), np.zeros((n, len(fits), 8))
    seen = ring.offsets.view(np.uint64), ring.members.view(np.uint64), samples.points, scales.directions
    around = RADIUS * scales.spacing[rows], known.shape, known.d1, known.normals
    chunks = min(1 + n // ROWS_PER_CHUNK, MOST_CHUNKS)
    kernels.high_degree_fits(rows, *seen, scales.oriented, *around, fits, chunks, numbers, jets)
    return Tried(numbers, jets)
