"""Jets of adaptive scale: polynomials of degree 2 to 6 whose neighborhood follows sampling, noise and detail.

After Cazals and Pouget (2005, Estimating differential quantities using polynomial fitting of osculating jets), with
scales chosen by Lepski's method (1990), empirical Bayes priors on the coefficients, and chords as tangential
coordinates, which make the terms of higher degree small.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.errors import warn
from simplexmesh.surface.curvature.jets import Jets, fitted
from simplexmesh.surface.curvature.rims import improved_at_borders
from simplexmesh.surface.curvature.scales import WIDEST, Scales, scales_of
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]

SHORT_OF_DETAIL = 1.1
"""Details longer than this times the widest radius are reported."""


def _scales(samples: Samples, noise: float | None, detail: float | None) -> Scales:
    if noise is not None:
        noise = _check.number("noise", noise, 0.0)
    if detail is not None:
        detail = _check.number("detail", detail, 0.0, open_low=True)
    found = scales_of(samples, noise=noise, detail=detail)
    if detail is not None:
        _warn_of_unreached(detail, found.spacing[found.spacing > 0])
    return found


def _warn_of_unreached(detail: float, spacing: Array) -> None:
    """Warn if balls of so few points as are fitted do not extend to a detail."""
    if len(spacing) and detail > SHORT_OF_DETAIL * WIDEST * (middle := float(np.median(spacing))):
        warn(
            f"detail of {detail:g} is not reached: neighborhoods end at 250 points, here at a radius of about "
            f"{WIDEST * middle:.2g}; decimate the surface first"
        )


def jets(samples: Samples, around: Neighborhoods, *, noise: float | None, detail: float | None) -> Jets:
    """Fit a jet around each center.

    Raises
    ------
    ValueError
        Noise below zero, or detail that is not positive.
    """
    return fitted(samples, around.centers, _scales(samples, noise, detail), samples.one_ring)


def estimate(
    samples: Samples, around: Neighborhoods, normals: Any, *, noise: float | None = None, detail: float | None = None
) -> Estimates:
    """Fit a polynomial height around each center, at the radius that minimizes the expected error of curvature.

    At borders several fits are combined, with the weights that are best a few rows farther in.

    Parameters
    ----------
    noise : float, optional
        Standard deviation of the noise along the normal, in the unit of the points, if known.
    detail : float, optional
        Smallest length of interest: no neighborhood has a shorter radius, up to some 250 points.
    """
    scales = _scales(samples, noise, detail)
    found = fitted(samples, around.centers, scales, samples.one_ring)
    if detail is None:
        found = improved_at_borders(samples, around.centers, scales, found)
    k1, k2 = found.shape.T.copy()
    mean, gauss = (k1 + k2) / 2, k1 * k2
    return Estimates(k1, k2, mean, gauss, found.reasons, found.d1, found.normals, found.error, found.scale)
