"""Line plots with logarithmic axes in panels, and scalars on surfaces in panels with one color scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike

from simplexmesh._base.arrays import Array
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.heat import heat
from simplexmesh.plot.stage import INK, grid

Curves = Mapping[str, tuple[ArrayLike, ArrayLike]]

COLORS = (
    *("#d1495b", "#00798c", "#edae49", "#30638e", "#7d9d5c", "#8a4f7d", "#e07a2f", "#3b9ec9", "#8c6d46"),
    *("#5b5b5b", "#c76aa6", "#1f6f4a", "#9c8ade", "#a8323e", "#b3b31f", "#46566b"),
)
DASHES = ("-", "--", "-.")
MARKS = ("o", "s", "d", "x", "+")
CHARTS, CHART, MAPS, MAP = 3, (430, 360), 5, (280, 300)
"""Columns of charts and of maps, and the sizes of their cells, in pixels."""

MARGIN = 20
"""Margin of charts without axes, in pixels."""


def curves(
    panels: Mapping[str, Curves],
    *,
    x_label: str,
    y_label: str,
    y_limits: tuple[float, float],
    title: str,
) -> pv.Plotter:
    """Plot curves with logarithmic axes in panels, with one legend."""
    names = list(dict.fromkeys(name for panel in panels.values() for name in panel))
    plotter = _cells(len(panels) + 1, CHARTS, CHART)
    across = np.concatenate([np.asarray(x, float) for panel in panels.values() for x, _ in panel.values()])
    limits = (across.min() / 1.15, across.max() * 1.15), y_limits
    for at, (heading, panel) in enumerate(panels.items()):
        plotter.subplot(*divmod(at, CHARTS))
        chart = pv.Chart2D()
        for name, (x, y) in panel.items():
            color, dash, mark = _style(names.index(name))
            u, v = np.asarray(x, float), np.maximum(np.asarray(y, float), y_limits[0])
            kept = np.isfinite(u + v)
            if kept.any():
                chart.line(u[kept], v[kept], color=color, width=2.0, style=dash)
                chart.scatter(u[kept], v[kept], color=color, size=6, style=mark)
        for axis, (low, high), label in zip((chart.x_axis, chart.y_axis), limits, (x_label, y_label), strict=True):
            axis.log_scale, axis.label = True, label
            axis.range = [low, high]
            axis.label_size, axis.tick_label_size = 14, 12
        chart.title, chart.legend_visible, chart.background_color = heading, False, "white"
        plotter.add_chart(chart)
    plotter.subplot(*divmod(len(panels), CHARTS))
    _legend(plotter, title, names, CHART[1])
    return plotter


def maps(panels: Sequence[tuple[str, TriangleMesh, Array]], *, name: str, limits: tuple[float, float]) -> pv.Plotter:
    """Plot scalars on surfaces in panels, with one blue-to-red color scale; vertices without an estimate are gray."""
    plotter = _cells(len(panels), MAPS, MAP)
    for at, (heading, mesh, values) in enumerate(panels):
        plotter.subplot(*divmod(at, MAPS))
        heat(mesh, values, name=name, limits=limits, title=heading, plotter=plotter)
    return looked_at(plotter)


def _cells(count: int, columns: int, cell: tuple[int, int]) -> pv.Plotter:
    """Return an empty white plotter with cells for so many panels."""
    columns = min(columns, count)
    rows = -(-count // columns)
    plotter = grid((rows, columns), (columns * cell[0], rows * cell[1]))
    plotter.set_background("#ffffff")
    return plotter


def _style(k: int) -> tuple[str, str, str]:
    """Return the color, dashes and mark of the k-th curve."""
    return COLORS[k % len(COLORS)], DASHES[k % len(DASHES)], MARKS[k % len(MARKS)]


def _legend(plotter: pv.Plotter, title: str, names: Sequence[str], tall: int) -> None:
    """Draw the legend of the charts."""
    chart = pv.Chart2D()
    chart.hide_axes()
    for axis in (chart.x_axis, chart.y_axis):
        axis.range = [0.0, 1.0]
        axis.margin = 0
    rows = max(len(names), 10)
    for k, name in enumerate(names):
        height = 0.9 * (1 - (k + 0.5) / rows)
        color, dash, mark = _style(k)
        chart.line([0.08, 0.24], [height, height], color=color, width=2.0, style=dash)
        chart.scatter([0.16], [height], color=color, size=7, style=mark)
        middle = (MARGIN + (tall - 2 * MARGIN) * height) / tall
        plotter.add_text(name, position=(0.28, middle - 8 / tall), viewport=True, font_size=8, color=INK)
    chart.legend_visible = False
    plotter.add_chart(chart)
    plotter.add_text(title, position="upper_edge", font_size=10, color=INK)
