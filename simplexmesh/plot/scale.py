"""Color scales: limits, colormap, and the scalar bar under the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.plot.stage import INK


def titled(name: str, unit: str, power: int) -> str:
    """Return the title of a scale: the name of the quantity with its unit, a power of the unit of length."""
    spelled = {1: unit, -1: f"1/{unit}"}.get(power, "") if unit else ""
    return f"{name} ({spelled})" if spelled else name


def scale(
    values: NDArray[np.float64], title: str, *, diverging: bool, limits: tuple[float, float] | None
) -> dict[str, Any]:
    """Return the options of `add_mesh` for scalars: colormap, limits and scalar bar."""
    known = values[np.isfinite(values)]
    if limits is None and diverging:
        most = float(np.percentile(np.abs(known), 98)) if len(known) else 1.0
        limits = (-most or -1.0, most or 1.0)
    elif limits is None and len(known):
        low, high = (float(known.min()), float(known.max()))
        if low >= 0:  # distances: from zero, clipped so that a few outliers do not hide the others
            low, high = 0.0, min(high, max(4 * float(np.median(known)), float(np.percentile(known, 98))) or high)
        limits = (low, high if high > low else low + 1.0)
    return {
        "scalars": "scalars",
        "cmap": "coolwarm" if diverging else "viridis",
        "clim": limits or (0.0, 1.0),
        "scalar_bar_args": bar(title),
        "nan_color": "#b0b0b0",
    }


def bar(title: str, largest: float = 1.0) -> dict[str, Any]:
    """Return the options of the scalar bar under a picture; thousands are written without exponent."""
    return {
        "title": f"{title}\n",  # the line break keeps it clear of the labels
        "vertical": False,
        "width": 0.5,
        "height": 0.1,
        "position_x": 0.25,
        "position_y": 0.03,
        "n_labels": 5,
        "fmt": "%.0f" if 1e3 <= largest < 1e5 else "%.3g",
        "color": INK,
        "title_font_size": 16,
        "label_font_size": 13,
    }
