"""The colors of hot metal, and between which numbers they run."""

from __future__ import annotations

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
        (most,) = _percentiles(np.abs(known), seen, [SHOWN])
        low, high = -most, most
    elif 0 <= low < 0.5 * high:
        low = 0.0
    return (low, high) if low < high else (low - 0.5, low + 0.5)
