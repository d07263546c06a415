"""Noise of measured fields, and the smallest smoothing window: defaults that come from the surface itself."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.numerics.robust import NORMAL_MAD
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.diffusion import Diffusion

WINDOW_SHARE = 0.006
"""Width of the smallest window over the bounding box's diagonal (Lee, Varshney and Jacobs 2005: 2 x 0.3 %)."""

WINDOW_EDGES = 1.5
"""Least width of a window in mean edges: a smaller one averages nothing."""

CORRELATION = 0.25
"""Radius, over that of the neighborhoods, within which errors of estimates are correlated (noisy spheres and tori)."""


def smallest_window(diffusion: Diffusion) -> float:
    """Return the width of the smallest useful window on a surface, in its unit of length."""
    return max(WINDOW_SHARE * diffusion.diagonal, WINDOW_EDGES * diffusion.spacing)


def field_noise(diffusion: Diffusion, values: Array) -> float:
    """Return the noise of a field: the robust standard deviation of its difference to its mean over the nearest."""
    residual = _residual(diffusion, values)
    known = residual[np.isfinite(residual)]
    return NORMAL_MAD * float(np.median(np.abs(known))) if len(known) else 0.0


def local_noise(diffusion: Diffusion, known: Curvature) -> Array:
    """Return the standard deviation of H's error at each vertex, (n,): the method's, bounded by what is visible."""
    if known.error is None:
        return np.full(len(known.mean), field_noise(diffusion, known.mean))
    # neighbors with independent errors differ: three times the difference, averaged over three edges, is a bound
    around = diffusion.smoothed(_residual(diffusion, known.mean) ** 2, 3 * diffusion.spacing, steps=1)
    visible = np.sqrt(np.maximum(around, 0.0))
    return np.minimum(np.where(np.isfinite(known.error), known.error, visible), 3 * visible)


def _residual(diffusion: Diffusion, values: Array) -> Array:
    """Return the difference of a field to its mean over the nearest vertices."""
    return values - diffusion.smoothed(values, WINDOW_EDGES * diffusion.spacing, steps=3)


def remaining_noise(diffusion: Diffusion, known: Curvature, scale: float) -> Array:
    """Return the share of the error's standard deviation that remains after smoothing with width `scale`, (n,)."""
    vertex_area = float(np.median(diffusion.areas)) if len(diffusion.areas) else 0.0
    correlated = np.full(len(known.mean), vertex_area)
    if known.scale is not None:
        correlated = np.maximum(correlated, np.pi * (CORRELATION * np.nan_to_num(known.scale)) ** 2)
    # a Gaussian window averages the variance of independent errors over an area of 4 pi scale^2
    window_area = correlated + 4 * np.pi * scale**2
    return np.sqrt(np.divide(correlated, window_area, out=np.ones(len(correlated)), where=window_area > 0))
