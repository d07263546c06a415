"""Surface coordinates made comparable: angles cut open where no points are, ranges scaled."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array


def unfolded(coordinates: Array, periods: tuple[bool, bool]) -> Array:
    """Return surface coordinates (n, 2) unwrapped from the widest gap between angles on, and scaled into [-1, 1]."""
    out = np.stack([_unwrapped(coordinates[:, k]) if periods[k] else coordinates[:, k] for k in range(2)], axis=1)
    low, high = out.min(axis=0), out.max(axis=0)
    return np.where(high > low, 2 * (out - low) / np.where(high > low, high - low, 1.0) - 1, 0.0)


def _unwrapped(angles: Array) -> Array:
    """Return angles as those from the end of their widest gap on."""
    around = np.sort(np.mod(angles, 2 * np.pi))
    gaps = np.diff(np.append(around, around[0] + 2 * np.pi))
    start = around[(int(gaps.argmax()) + 1) % len(around)]
    return np.mod(np.mod(angles, 2 * np.pi) - start, 2 * np.pi)
