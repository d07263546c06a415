"""The blue-to-red colormap for scalars on surfaces, and the automatic limits of its scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from simplexmesh import _check

Array = NDArray[np.float64]

BLUE_TO_RED = ("#2a3fd0", "#28c4e8", "#3fbf4d", "#f4e04a", "#d7281e")
"""From low to high: blue, cyan, green, yellow, red."""

FAILED = "#7d7d7d"
"""Color of vertices without a value: gray, which is not on the scale."""

SHOWN = 95.0
"""Percent of the area whose values are within the automatic limits."""

OFTEN, MOST = 85.0, 4.0
"""Values of both signs are cut at `MOST` times their median magnitude, but with at least `OFTEN` percent of the area
within: curvatures have long tails, and limits at their ends would make everything else green."""

ROUND = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.4, 2.8, 3.0, 3.2, 3.6, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
"""Limits of a scale that begins or is centered at zero are one of these times a power of ten, for short labels."""


def blue_to_red(low: float, high: float) -> pv.LookupTable:
    """Return the lookup table between two values; values beyond have the color of the end, NaN is gray.

    Examples
    --------
    >>> [blue_to_red(0.0, 1.0).map_value(x)[0] for x in (0.0, 1.0)]
    [0.16470588235294117, 0.8431372549019608]
    """
    stops = np.array([pv.Color(color).int_rgba for color in BLUE_TO_RED], dtype=float)
    at = np.linspace(0, len(stops) - 1, 256)
    table = pv.LookupTable()
    table.values = (
        np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(4)], axis=1).round().astype(np.uint8)
    )
    table.scalar_range = (low, high)
    table.nan_color = FAILED
    return table


def _percentiles(values: Array, weights: Array, percents: Sequence[float]) -> list[float]:
    """Return the weighted percentiles of values."""
    order = np.argsort(values)
    mass = np.cumsum(weights[order])
    if not mass[-1] > 0:
        mass = np.arange(1.0, len(values) + 1)
    places = np.searchsorted(mass, np.asarray(percents) / 100 * mass[-1])
    return [float(x) for x in values[order][np.minimum(places, len(values) - 1)]]


def ends(values: Array, limits: Any, areas: Array) -> tuple[float, float]:
    """Return the given limits of the color scale, or automatic ones that include most of the area."""
    if limits is not None:
        if not isinstance(limits, Sequence | np.ndarray) or len(limits) != 2:
            raise ValueError(f"limits must be two numbers, not {limits}")
        low, high = (_check.number("limits", each) for each in limits)
        if not low < high:
            raise ValueError(f"limits must increase, not go from {low:g} to {high:g}")
        return low, high
    there = np.isfinite(values)
    known, seen = values[there], areas[there]
    if not len(known):
        return 0.0, 1.0
    low, high = _percentiles(known, seen, [100 - SHOWN, SHOWN])
    if low < 0 < high:
        middle, often, nearly_all = _percentiles(np.abs(known), seen, [50.0, OFTEN, SHOWN])
        high = _rounded(min(max(MOST * middle, often) or nearly_all, nearly_all))  # the median may be zero
        low = -high
    elif 0 <= low < 0.5 * high:
        low, high = 0.0, _rounded(high)
    return (low, high) if low < high else (low - 0.5, low + 0.5)


def _rounded(value: float) -> float:
    """Return the smallest round number that is at least as large.

    Examples
    --------
    >>> _rounded(0.0571), _rounded(1620.0), _rounded(2.0)
    (0.06, 1800.0, 2.0)
    """
    power = float(f"1e{math.floor(math.log10(value))}")
    return float(f"{next(step for step in ROUND if step * power >= value * (1 - 1e-9)) * power:.6g}")
