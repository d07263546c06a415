"""The colors of hot metal, and between which numbers they run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from simplexmesh import _check

Array = NDArray[np.float64]

HOT_METAL = ("#2a3fd0", "#28c4e8", "#3fbf4d", "#f4e04a", "#d7281e")
"""From low to high: blue, cyan, green, yellow, red."""

FAILED = "#7d7d7d"
"""Of vertices without a value: gray, which is not on the scale."""

SHOWN = 95.0
"""Percent of the surface whose values are within the scale, where no limits are given."""

OFTEN, MOST = 85.0, 4.0
"""Of numbers of both signs less may be: so many percent, down to so many times the middle size. Curvatures have long
tails, and on a scale that reaches to their ends all else would be green."""

ROUND = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.4, 2.8, 3.0, 3.2, 3.6, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
"""A scale that begins or is centered at zero ends at one of these, times a power of ten: its labels are short."""


def hot_metal(low: float, high: float) -> pv.LookupTable:
    """Return the color table between two numbers; what is beyond has the color of the end, NaN that of failures.

    Examples
    --------
    >>> [hot_metal(0.0, 1.0).map_value(x)[0] for x in (0.0, 1.0)]
    [0.16470588235294117, 0.8431372549019608]
    """
    stops = np.array([pv.Color(color).int_rgba for color in HOT_METAL], dtype=float)
    at = np.linspace(0, len(stops) - 1, 256)
    table = pv.LookupTable()
    table.values = (
        np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(4)], axis=1).round().astype(np.uint8)
    )
    table.scalar_range = (low, high)
    table.nan_color = FAILED
    return table


def _percentiles(values: Array, weights: Array, percents: Sequence[float]) -> list[float]:
    """Return the values below which so many percent of the weight are."""
    order = np.argsort(values)
    mass = np.cumsum(weights[order])
    if not mass[-1] > 0:
        mass = np.arange(1.0, len(values) + 1)
    places = np.searchsorted(mass, np.asarray(percents) / 100 * mass[-1])
    return [float(x) for x in values[order][np.minimum(places, len(values) - 1)]]


def ends(values: Array, limits: Any, areas: Array) -> tuple[float, float]:
    """Return the ends of the scale: those asked for, or such that most of what is seen is between them."""
    if limits is not None:
        if not isinstance(limits, Sequence | np.ndarray) or len(limits) != 2:
            raise ValueError(f"limits must be two numbers, not {limits}")
        low, high = (_check.number("limits", each) for each in limits)
        if not low < high:
            raise ValueError(f"limits must rise, not go from {low:g} to {high:g}")
        return low, high
    there = np.isfinite(values)
    known, seen = values[there], areas[there]
    if not len(known):
        return 0.0, 1.0
    low, high = _percentiles(known, seen, [100 - SHOWN, SHOWN])
    if low < 0 < high:
        middle, often, nearly_all = _percentiles(np.abs(known), seen, [50.0, OFTEN, SHOWN])
        high = _rounded(min(max(MOST * middle, often) or nearly_all, nearly_all))  # most may be zero
        low = -high
    elif 0 <= low < 0.5 * high:
        low, high = 0.0, _rounded(high)
    return (low, high) if low < high else (low - 0.5, low + 0.5)


def _rounded(value: float) -> float:
    """Return the next round number that is no less.

    Examples
    --------
    >>> _rounded(0.0571), _rounded(1620.0), _rounded(2.0)
    (0.06, 1800.0, 2.0)
    """
    power = float(f"1e{math.floor(math.log10(value))}")
    return float(f"{next(step for step in ROUND if step * power >= value * (1 - 1e-9)) * power:.6g}")
