"""Automatic choice of an isovalue."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def otsu_threshold(values: NDArray[Any]) -> float:
    """Return the threshold of the largest between-class variance in a histogram of 256 bins (Otsu 1979)."""
    counts, edges = np.histogram(values, bins=256)
    middles = 0.5 * (edges[:-1] + edges[1:])
    below = np.cumsum(counts)[:-1].astype(float)
    above = counts.sum() - below
    sums = np.cumsum(counts * middles)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = below * above * (sums[:-1] / below - (sums[-1] - sums[:-1]) / above) ** 2
    return float(edges[1 + int(np.nanargmax(spread))])
