"""What colors mean: scales, with their limits and the bar under the picture; legends of colored dots with names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.units import power_of_unit
from simplexmesh.numerics.robust import weighted_quantiles
from simplexmesh.plot.camera import BAR_NAME, LEGEND_NAME
from simplexmesh.plot.stage import INK

BLUE_TO_RED = ("#2a3fd0", "#28c4e8", "#3fbf4d", "#f4e04a", "#d7281e")
"""From low to high: blue, cyan, green, yellow, red."""

FAILED = "#7d7d7d"
"""Color of vertices without a value: gray, which is not on the scale."""

SHOWN = 95.0
"""Percent of the area whose values are within the automatic limits."""

OFTEN, MOST = 85.0, 4.0
"""Values of both signs are cut at `MOST` times their median magnitude, but with at least `OFTEN` percent of the area
within: curvatures have long tails, and limits at their ends would make everything else green."""

LABELS = 5
"""Numbers on a scalar bar."""

ROUND = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.4, 2.8, 3.0, 3.2, 3.6, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
"""Limits of a scale that begins or is centered at zero are one of these times a power of ten, for short labels."""

PALETTE = ("#c8553d", "#e3a857", "#7d9d5c", "#4f8a8b", "#5d6fa3", "#9b6a97", "#b98b73", "#d98f9f", "#6f6f6f", "#88b7c9")
WIDE, COLUMN = 800, 138
"""Pixels: the least width of a panel with a legend at its side; the width of the columns of a legend below it."""


def blue_to_red(low: float, high: float) -> pv.LookupTable:
    """Return the lookup table between two values; values beyond have the color of the end, NaN is gray."""
    stops = np.array([pv.Color(color).int_rgba for color in BLUE_TO_RED], dtype=float)
    at = np.linspace(0, len(stops) - 1, 256)
    channels = [np.interp(at, np.arange(len(stops)), channel) for channel in stops.T]
    table = pv.LookupTable()
    table.values = np.stack(channels, axis=1).round().astype(np.uint8)
    table.scalar_range = (low, high)
    table.nan_color = FAILED
    return table


def ends(values: Array, limits: Any, areas: Array) -> tuple[float, float]:
    """Return the given limits of the blue-to-red scale, or automatic ones that include most of the area."""
    if limits is not None:
        if not isinstance(limits, Sequence | np.ndarray) or len(limits) != 2:
            raise ValueError(f"limits must be two numbers, not {limits}")
        low, high = (checks.number("limits", each) for each in limits)
        if not low < high:
            raise ValueError(f"limits must increase, not go from {low:g} to {high:g}")
        return low, high
    there = np.isfinite(values)
    known, seen = values[there], areas[there]
    if not len(known):
        return 0.0, 1.0
    seen = seen if seen.sum() > 0 else np.ones(len(known))
    low, high = weighted_quantiles(known, seen, np.divide([100 - SHOWN, SHOWN], 100)).tolist()
    if low < 0 < high:
        shares = np.divide([50.0, OFTEN, SHOWN], 100)
        middle, often, nearly_all = weighted_quantiles(np.abs(known), seen, shares).tolist()
        high = _rounded(min(max(MOST * middle, often) or nearly_all, nearly_all))  # the median may be zero
        low = -high
    elif 0 <= low < 0.5 * high:
        low, high = 0.0, _rounded(high)
    return (low, high) if low < high else (low - 0.5, low + 0.5)


def _format(low: float, high: float) -> str:
    """Return the one format of the labels of a bar, with the fewest digits that place all of them well."""
    labels = np.linspace(low, high, LABELS)
    kind = "f" if 1e-3 <= np.abs(labels).max() < 1e5 else "e"
    formats = (f"%.{digits}{kind}" for digits in range(8))
    close = 0.01 * (labels[1] - labels[0])
    return next((each for each in formats if all(abs(float(each % x) - x) <= close for x in labels)), "%.3g")


def _rounded(value: float) -> float:
    """Return the smallest round number that is at least as large."""
    power = float(f"1e{math.floor(math.log10(value))}")
    return float(f"{next(step for step in ROUND if step * power >= value * (1 - 1e-9)) * power:.6g}")


def scale(values: Array, title: str, *, diverging: bool, limits: tuple[float, float] | None) -> dict[str, Any]:
    """Return the options of `add_mesh` for scalars of simplex meshes: colormap, limits and scalar bar.

    The bar tells the share of the values beyond limits that nobody gave.
    """
    known, automatic = values[np.isfinite(values)], limits is None
    if limits is None and diverging:
        most = float(np.percentile(np.abs(known), 98)) if len(known) else 1.0
        limits = (-most or -1.0, most or 1.0)
    elif limits is None and len(known):
        low, middle, high = (float(x) for x in np.percentile(known, [2, 50, 98]))
        if low >= 0 and (low < 0.5 * high or low == high):  # distances: from zero, up to a few outliers
            most = float(known.max())
            low, high = 0.0, min(most, max(4 * middle, high) or most)
        limits = (low, high if high > low else low + 1.0)
    limits = limits or (0.0, 1.0)
    beyond = float(np.mean((known < limits[0]) | (known > limits[1]))) if automatic and len(known) else 0.0
    title = ", ".join(filter(None, (title, f"{100 * beyond:.2g}% beyond" if beyond else "")))
    return {
        "scalars": "scalars",
        "cmap": blue_to_red(*limits) if diverging else "viridis",
        "clim": limits,
        "scalar_bar_args": bar(title, *limits),
        "nan_color": "#b0b0b0",
    }


def titled(name: str, unit: str, power: int) -> str:
    """Return the title of a scale: the name of the quantity with its unit, a power of the unit of length."""
    of = power_of_unit(unit, power)
    return f"{name} ({of})" if of else name


def bar(title: str, low: float, high: float) -> dict[str, Any]:
    """Return the options of the scalar bar under a picture, whose ends are low and high."""
    return {
        "title": f"{title}\n",  # the line break keeps it clear of the labels
        "vertical": False,
        "width": 0.5,
        "height": 0.1,
        "position_x": 0.25,
        "position_y": 0.03,
        "n_labels": LABELS,
        "fmt": _format(low, high),
        "color": INK,
        "title_font_size": 16,
        "label_font_size": 13,
    }


def legend_of_classes(plotter: pv.Plotter, entries: Sequence[tuple[str, str]]) -> None:
    """Write names at the left or, in a narrow panel, below, where its neighbors have a color scale."""
    width = plotter.window_size[0] / plotter.shape[1]
    if width >= WIDE:
        for place, (name, color) in enumerate(entries):
            entry(plotter, place, name, color)
        return
    columns = int(np.clip(width // COLUMN, 1, max(len(entries), 1)))
    rows = -(-len(entries) // columns)
    columns = -(-len(entries) // rows)
    begin = 0.5 * (1 - columns * COLUMN / width)
    for place, (name, color) in enumerate(entries):
        column, row = divmod(place, rows)
        left, height = begin + column * COLUMN / width, 0.025 + 0.036 * (rows - 1 - row)
        _write(plotter, name, INK, (left + 21 / width, height), 8, f"{BAR_NAME} {place}")
        _write(plotter, "\u2022", color, (left, height - 0.009), 18, f"{BAR_NAME} {place} dot")


def entry(plotter: pv.Plotter, place: int, name: str, color: str) -> None:
    """Add an entry to the legend at the left: a dot in the given color, and the name."""
    height = 0.93 - 0.034 * place
    narrow = 1200 * plotter.shape[1] / plotter.window_size[0]  # the width of letters does not depend on the panel's
    _write(plotter, "\u2022", color, (0.025 * narrow, height - 0.012), 22, f"{LEGEND_NAME} dot {place}")
    _write(plotter, name, INK, (0.05 * narrow, height), 10, f"{LEGEND_NAME} {place}")


def _write(plotter: pv.Plotter, text: str, color: str, at: tuple[float, float], size: int, name: str) -> None:
    plotter.add_text(text, position=at, viewport=True, font_size=size, color=color, name=name)
