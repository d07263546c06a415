"""Legends: colored dots with names, at the left of a panel or below."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv

from simplexmesh.plot.camera import BAR_NAME, LEGEND_NAME
from simplexmesh.plot.stage import INK

PALETTE = ("#c8553d", "#e3a857", "#7d9d5c", "#4f8a8b", "#5d6fa3", "#9b6a97", "#b98b73", "#d98f9f", "#6f6f6f", "#88b7c9")
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
