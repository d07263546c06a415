"""Jets of adaptive scale: polynomials of degree 2 to 6 whose neighborhood follows sampling, noise and detail.

After Cazals and Pouget (2005, Estimating differential quantities using polynomial fitting of osculating jets), with
scales chosen by Lepski's method (1990), empirical Bayes priors on the coefficients, and chords as tangential
coordinates, which make the terms of higher degree small.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import warn
from simplexmesh.surface.curvature.adaptive import _kernels_jets as kernels
from simplexmesh.surface.curvature.adaptive._kernels_balls import Surface
from simplexmesh.surface.curvature.adaptive.scales import WIDEST, Scales, scales_of, surface_of
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.registry import Estimates, Method
from simplexmesh.surface.sampled_surface import SampledSurface


class Jets(NamedTuple):
    """Fits around c centers; `shape` holds k1 and k2, (c, 2), `scale` the mean radius."""

    shape: Array
    d1: Array
    normals: Array
    error: Array
    scale: Array
    reasons: NDArray[np.uint8]


def estimate(
    samples: SampledSurface, around: Neighborhoods, normals: Any, *, noise: float | None, detail: float | None
) -> Estimates:
    """Fit a jet around each center: balls, probes, the scale of least expected error, fits; options of `curvature`."""
    if noise is not None:
        noise = checks.number("noise", noise, 0.0)
    if detail is not None:
        detail = checks.number("detail", detail, 0.0, open_low=True)
    surface = surface_of(samples)
    scales = scales_of(samples, surface, noise=noise, detail=detail)
    if detail is not None:
        _warn_of_unreached(detail, scales.spacing[scales.spacing > 0])
    found = fitted(surface, around.centers, scales)
    k1, k2 = found.shape.T.copy()
    mean, gauss = (k1 + k2) / 2, k1 * k2
    return Estimates(k1, k2, mean, gauss, found.reasons, found.d1, found.normals, found.error, found.scale)


ADAPTIVE = Method(estimate, {"noise": None, "detail": None}, normals=None, own_scale=True)
"""Of normals too, which are among its results."""


def fitted(surface: Surface, rows: Indices, scales: Scales) -> Jets:
    """Fit jets around the points `rows`."""
    n = len(rows)
    out = Jets(np.zeros((n, 2)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n, np.uint8))
    kernels.jets(n, rows, surface, scales, out)
    return out


def _warn_of_unreached(detail: float, spacing: Array) -> None:
    """Warn if balls of so few points as are fitted do not extend to a detail."""
    if len(spacing) and detail > WIDEST * (middle := float(np.median(spacing))):
        warn(
            f"detail of {detail:g} is not reached: neighborhoods end at 250 points, here at a radius of about "
            f"{WIDEST * middle:.2g}; decimate the surface first"
        )
