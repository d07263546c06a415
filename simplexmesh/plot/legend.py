"""Legends: colored dots with names, at the left of a panel or below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh.plot.camera import BAR_NAME, LEGEND_NAME
from simplexmesh.plot.stage import INK

WIDE, COLUMN = 800, 138
"""Pixels: the least width of a panel with a legend at its side; the width of the columns of a legend below it."""


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
        style: dict[str, Any] = {"viewport": True, "name": f"{BAR_NAME} {place}"}
        plotter.add_text(name, position=(left + 21 / width, height), font_size=8, color=INK, **style)
        style["name"] += " dot"
        plotter.add_text("\u2022", position=(left, height - 0.009), font_size=18, color=color, **style)


def entry(plotter: pv.Plotter, place: int, name: str, color: str) -> None:
    """Add an entry to the legend at the left: a dot in the given color, and the name."""
    height = 0.93 - 0.034 * place
    # the width of letters does not depend on that of the panel
    narrow = 1200 * plotter.shape[1] / plotter.window_size[0]
    plotter.add_text(
        "\u2022",
        position=(0.025 * narrow, height - 0.012),
        viewport=True,
        font_size=22,
        color=color,
        name=f"{LEGEND_NAME} dot {place}",
    )
    plotter.add_text(
        name, position=(0.05 * narrow, height), viewport=True, font_size=10, color=INK, name=f"{LEGEND_NAME} {place}"
    )
