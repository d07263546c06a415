"""The two pictures of the benchmark: errors over distance in panels, and a surface colored by each method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike

from simplexmesh._base.arrays import Array
from simplexmesh.bench.trials.candidates import estimates
from simplexmesh.bench.trials.curve import Curve
from simplexmesh.bench.truth.discretized import split_square
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.color_scale import FAILED, bar, blue_to_red
from simplexmesh.plot.polydata import colored
from simplexmesh.plot.stage import COLORS_LIT, INK, grid
from simplexmesh.surface.sampled_surface import SampledSurface

Curves = Mapping[str, tuple[ArrayLike, ArrayLike]]

COLORS = (
    *("#d1495b", "#00798c", "#edae49", "#30638e", "#7d9d5c", "#8a4f7d", "#e07a2f", "#3b9ec9", "#8c6d46"),
    *("#5b5b5b", "#c76aa6", "#1f6f4a", "#9c8ade", "#a8323e", "#b3b31f", "#46566b"),
)
DASHES = ("-", "--", "-.")
MARKS = ("o", "s", "d", "x", "+")
CHARTS, CHART, MAPS, MAP = 3, (430, 360), 5, (280, 225)
"""Columns of charts and of maps, and the sizes of their cells, in pixels."""

MARGIN = 20
"""Margin of charts without axes, in pixels."""


def convergence(found: Sequence[Curve]) -> pv.Plotter:
    """Plot the error of H at the origin of the cubic over the distance of six neighbors, one panel per pattern."""
    panels: dict[str, Curves] = {}
    for c in found:
        if (c.surface, c.quantity, c.count) == ("cubic", "H", 6):
            panels[f"scheme {c.scheme}"] = panels.get(f"scheme {c.scheme}", {}) | {c.method: (c.distances, c.errors)}
    labels = {"x_label": "distance d", "y_label": "error of H", "title": "cubic, 6 neighbors"}
    return curves(panels, y_limits=(1e-9, 10.0), **labels)


def colors(methods: Sequence[str]) -> pv.Plotter:
    """Plot the mean curvature of the monkey saddle as each method finds it from exact normals."""
    made = split_square(graph("monkey_saddle"), 32)
    samples, normals = SampledSurface(made.vertices, made.faces), made.exact.normals
    found = estimates("curvature", methods, samples, normals=normals)
    panels = [("exact", made.mesh, made.exact.mean)]
    panels += [(method, made.mesh, values) for method, of, values in found if of == "H"]
    return maps(panels, name="mean curvature H", limits=(-1.0, 1.0))


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
    limits = np.log10([across.min() / 1.15, across.max() * 1.15]), np.log10(y_limits)
    for at, (heading, panel) in enumerate(panels.items()):
        plotter.subplot(*divmod(at, CHARTS))
        chart = pv.Chart2D()
        for name, (x, y) in panel.items():
            color, dash, mark = _style(names.index(name))
            u, v = np.log10(np.asarray(x, float)), np.log10(np.maximum(np.asarray(y, float), y_limits[0]))
            kept = np.isfinite(u + v)
            if kept.any():
                chart.line(u[kept], v[kept], color=color, width=2.0, style=dash)
                chart.scatter(u[kept], v[kept], color=color, size=6, style=mark)
        _axes(chart, limits, (x_label, y_label), heading)
        plotter.add_chart(chart)
    plotter.subplot(*divmod(len(panels), CHARTS))
    _legend(plotter, title, names, CHART[1])
    return plotter


def maps(
    panels: Sequence[tuple[str, TriangleMesh, Array]],
    *,
    name: str,
    limits: tuple[float, float],
) -> pv.Plotter:
    """Plot scalars on surfaces in panels, with one blue-to-red color scale in the last cell."""
    plotter = _cells(len(panels) + 1, MAPS, MAP)
    low, high = limits
    for at, (heading, mesh, values) in enumerate(panels):
        plotter.subplot(*divmod(at, MAPS))
        polydata = colored(mesh, "heat", np.clip(values, low, high))
        style = {"scalars": "heat", "cmap": blue_to_red(low, high), "clim": limits, "show_scalar_bar": False}
        plotter.add_mesh(polydata, smooth_shading=True, **COLORS_LIT, **style)
        plotter.add_text(heading, position="upper_edge", font_size=8, color=INK)
        looked_at(plotter, None, up="z")
    plotter.subplot(*divmod(len(panels), MAPS))
    _scale(plotter, name, limits)
    return plotter


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


def _axes(chart: pv.Chart2D, limits: tuple[Array, Array], labels: tuple[str, str], title: str) -> None:
    """Label the axes of a chart of logarithms with the original values."""
    chart.title = title
    for axis, (low, high), label in zip((chart.x_axis, chart.y_axis), limits, labels, strict=True):
        axis.range = [float(low), float(high)]
        axis.tick_locations = _ticks(low, high)
        axis.tick_labels = [
            f"{10.0**power:.3g}" if -4.01 < power < 3.01 else f"1e{power:.0f}" for power in _ticks(low, high)
        ]
        axis.label = label
        axis.label_size, axis.tick_label_size = 14, 12
        axis.grid = True
    chart.legend_visible = False
    chart.background_color = "white"


def _ticks(low: float, high: float) -> list[float]:
    """Return tick locations for an axis of decimal logarithms: up to seven decades, or 1, 2, 5 where there are few."""
    decades = np.arange(np.ceil(low), np.floor(high) + 1e-9)
    if len(decades) > 2:
        return [float(at) for at in decades[:: max(1, -(-len(decades) // 7))]]
    finer = np.arange(np.floor(low), np.ceil(high))[:, None] + np.log10([1.0, 2.0, 5.0])
    return [float(at) for at in finer.ravel() if low <= at <= high]


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


def _scale(plotter: pv.Plotter, name: str, limits: tuple[float, float]) -> None:
    """Draw the color scale alone, with the meaning of gray."""
    point = pv.PolyData(np.zeros((1, 3)))  # invisible; VTK draws no scalar bar without a mesh
    point["heat"] = np.zeros(1)
    style = bar(name, *limits) | {"width": 0.76, "height": 0.24, "position_x": 0.12, "position_y": 0.45, "n_labels": 3}
    style |= {"title_font_size": 15, "label_font_size": 14}
    plotter.add_mesh(
        point, scalars="heat", cmap=blue_to_red(*limits), clim=limits, scalar_bar_args=style, opacity=0.0, point_size=1
    )
    plotter.add_text("\u2022", position=(0.1, 0.17), viewport=True, font_size=24, color=FAILED)
    plotter.add_text("no estimate", position=(0.2, 0.2), viewport=True, font_size=9, color=INK)
