"""Noise of measured fields, and the smallest smoothing window: defaults that come from the surface itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.diffusion import Diffusion

Array = NDArray[np.float64]

WINDOW_SHARE = 0.006
"""Width of the smallest window over the bounding box's diagonal (Lee, Varshney and Jacobs 2005: 2 x 0.3 %)."""

WINDOW_EDGES = 1.5
"""Least width of a window in mean edges: a smaller one averages nothing."""

NOISE_WINDOW, MAX_RATIO = 3.0, 3.0
"""Width, in edges, over which differences to neighbors are averaged; and the largest ratio of an error to them."""

CORRELATION = 0.25
"""Radius, over that of the neighborhoods, within which errors of estimates are correlated (noisy spheres and tori)."""

NORMAL_MAD = 1.4826
"""Standard deviation of a normal distribution in units of its median absolute deviation."""


def smallest_window(diffusion: Diffusion) -> float:
    """Return the width of the smallest useful window on a surface, in its unit of length.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.surface.samples import as_samples
    >>> diffusion = Diffusion(as_samples(sm.sphere(16).triangulated("dual")))
    >>> round(smallest_window(diffusion) / diffusion.spacing, 3)
    1.5
    """
    return max(WINDOW_SHARE * diffusion.diagonal, WINDOW_EDGES * diffusion.spacing)


def field_noise(diffusion: Diffusion, values: Array) -> float:
    """Return the noise of a field: the standard deviation of its difference to its mean over the nearest vertices.

    From the median absolute deviation, so that edges and corners, which are few, do not count as noise.
    """
    residual = values - diffusion.smoothed(values, WINDOW_EDGES * diffusion.spacing, steps=3)
    known = residual[np.isfinite(residual)]
    return NORMAL_MAD * float(np.median(np.abs(known))) if len(known) else 0.0


def local_noise(diffusion: Diffusion, known: Curvature) -> Array:
    """Return the standard deviation of H's error at each vertex, (n,): the method's, bounded by what is visible.

    Neighbors with independent errors differ: the error is bounded by three times the difference to neighbors. From
    methods without an error it is `field_noise`, the same everywhere.
    """
    if known.error is None:
        return np.full(len(known.mean), field_noise(diffusion, known.mean))
    residual = known.mean - diffusion.smoothed(known.mean, WINDOW_EDGES * diffusion.spacing, steps=3)
    around = diffusion.smoothed(residual**2, NOISE_WINDOW * diffusion.spacing, steps=1)
    visible = np.sqrt(np.maximum(around, 0.0))
    return np.minimum(np.where(np.isfinite(known.error), known.error, visible), MAX_RATIO * visible)


def remaining_noise(diffusion: Diffusion, known: Curvature, scale: float) -> Array:
    """Return the share of the error's standard deviation that remains after smoothing with width `scale`, (n,).

    A Gaussian window has an effective area of 4 pi scale^2, over which the variance of independent errors is averaged;
    errors are correlated over the area of a vertex, or over part of the neighborhoods where these are larger.
    """
    vertex_area = float(np.median(diffusion.areas)) if len(diffusion.areas) else 0.0
    correlated = np.full(len(known.mean), vertex_area)
    if known.scale is not None:
        correlated = np.maximum(correlated, np.pi * (CORRELATION * np.nan_to_num(known.scale)) ** 2)
    window_area = correlated + 4 * np.pi * scale**2
    return np.sqrt(np.divide(correlated, window_area, out=np.ones(len(correlated)), where=window_area > 0))
