"""Scenes: one surface, panels side by side, several meshes together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike, NDArray

from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot import skin
from simplexmesh.plot.stage import INK, looked_at, stage

CLAY = "#c9d3dc"
DATA = "#d9c3a5"
PALETTE = ("#c8553d", "#e3a857", "#7d9d5c", "#4f8a8b", "#5d6fa3", "#9b6a97", "#b98b73", "#d98f9f", "#6f6f6f", "#88b7c9")
MOST_EDGES = 25_000  # above so many vertices polygons are too small to be seen, and only darken the surface


def surface(
    mesh: Any,
    *,
    scalars: str | ArrayLike | None = None,
    data: Any = None,
    level: float | None = None,
    label: int | None = None,
    edges: bool | None = None,
    color: str = CLAY,
    opacity: float = 1.0,
    title: str | None = None,
    unit: str = "",
    limits: tuple[float, float] | None = None,
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Show a mesh, smooth, with its polygons drawn over it.

    Parameters
    ----------
    mesh : SimplexMesh, Reconstruction, TriangleMesh, PointCloud, Volume or anything convertible to these
        A volume is shown as its surface at `level` or of `label`.
    scalars : {"mean_curvature", "simplex_angle", "distance"}, name of a vertex array, or (n,) array, optional
        What to color by. "distance" is that of each vertex to the surface or the points of `data`. Curvatures and
        angles have a diverging map with zero in the middle, cut at the 2nd and 98th percentile; others a plain
        one, that of quantities without sign from zero to four times their median.
    data : Volume, PointCloud, TriangleMesh or anything convertible to these, optional
        What "distance" is measured to.
    level, label : float, int, optional
        The surface meant, when `mesh` or `data` is a volume.
    edges : bool, optional
        Whether polygons are drawn; by default up to 25,000 vertices.
    color : str
        Color without scalars.
    opacity : float
        From 0, unseen, to 1.
    title : str, optional
        Text over the picture.
    unit : str
        Unit of length, for the scale (curvatures are in its inverse).
    limits : (2,) tuple of float, optional
        Ends of the color scale.
    plotter : pyvista.Plotter, optional
        Where to add the mesh; a new one when not given.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ValueError
        An unknown name, scalars of another length than the vertices, or "distance" without data.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import torus
    >>> plotter = surface(torus(), scalars="mean_curvature", unit="mm")
    >>> plotter.close()
    """
    plotter = stage() if plotter is None else plotter
    shown = skin.thing(mesh)
    if not isinstance(shown, SimplexMesh) and scalars is not None:
        raise TypeError(f"scalars need a SimplexMesh to color, not {type(shown).__name__}")
    coat, lines = skin.geometry(shown, level, label)
    style: dict[str, Any] = {"color": DATA if isinstance(shown, PointCloud) else color, "opacity": opacity}
    if scalars is not None:
        values, name, power, diverging = skin.scalars_of(shown, scalars, data, level, label)
        coat["scalars"] = skin.per_point(shown, values)
        style = _scale(values, _named(name, unit, power), diverging=diverging, limits=limits) | {"opacity": opacity}
    if isinstance(shown, PointCloud):
        plotter.add_mesh(coat, point_size=_dot(len(coat.points)), render_points_as_spheres=True, **style)
    else:
        actor = plotter.add_mesh(coat, smooth_shading=True, ambient=0.1, specular=0.08, specular_power=25, **style)
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()  # so that lines lie on top
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
    wanted = shown.n_vertices <= MOST_EDGES if isinstance(shown, SimplexMesh) and edges is None else edges
    if wanted and lines is not None:
        strong = np.clip(3000 / max(1, len(coat.points)), 0.15, 0.6)
        plotter.add_mesh(lines, color=INK, line_width=1.0, opacity=float(strong) * opacity, lighting=False)
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return plotter


def panels(
    things: Mapping[str, Any] | Sequence[Mapping[str, Any]],
    *,
    scalars: str | None = None,
    view: str | Sequence[float] | None = None,
    **options: Any,
) -> pv.Plotter:
    """Show several things next to each other under one camera, each with its name.

    Parameters
    ----------
    things : mapping of str to anything `surface` takes
        The title of each panel and what it shows.
    scalars : str, optional
        As for `surface`, for the simplex meshes among them.
    view : str or (3,) vector, optional
        As for `looked_at`.
    **options
        Passed on to `surface`.

    Returns
    -------
    pyvista.Plotter

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> plotter = panels({"coarse": sphere(3), "fine": sphere(9)})
    >>> plotter.close()
    """
    if not isinstance(things, Mapping) or not things:
        raise ValueError(f"things must be a mapping of titles to what is shown, not {type(things).__name__}")
    plotter = stage(columns=len(things))
    for column, (title, thing) in enumerate(things.items()):
        plotter.subplot(0, column)
        shown = skin.thing(thing)
        colored = scalars if isinstance(shown, SimplexMesh) else None
        surface(shown, scalars=colored, title=title, plotter=plotter, **options)
    looked_at(plotter, view)
    plotter.link_views()
    return plotter


def beside(
    data: Any,
    mesh: Any,
    *,
    scalars: str | None = None,
    level: float | None = None,
    label: int | None = None,
    unit: str = "",
    view: str | Sequence[float] | None = None,
) -> pv.Plotter:
    """Show data and the model made of it next to each other, under one camera.

    Parameters
    ----------
    data : Volume, PointCloud, TriangleMesh or anything convertible to these
        A volume is shown as its surface at `level` or of `label`.
    mesh : SimplexMesh or Reconstruction
        The model.
    scalars, level, label, unit, view
        As for `surface` and `panels`.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(5)
    >>> plotter = beside(ball.vertices, ball, scalars="distance")
    >>> plotter.close()
    """
    given, model = skin.thing(data), skin.thing(mesh)
    counts = f"model, {model.n_vertices:,} vertices" if isinstance(model, SimplexMesh) else "model"
    things = {"data": given, counts: model}
    return panels(things, scalars=scalars, data=given, level=level, label=label, unit=unit, view=view)


def together(
    meshes: Mapping[str, Any],
    *,
    colors: Sequence[str] = PALETTE,
    opacity: float | Mapping[str, float] = 1.0,
    edges: bool = False,
    view: str | Sequence[float] | None = None,
    legend: bool = True,
) -> pv.Plotter:
    """Show several meshes in one scene, each in its color, with a legend.

    Parameters
    ----------
    meshes : mapping of str to anything `surface` takes
        Names and meshes.
    colors : sequence of str
        Taken in turn.
    opacity : float or mapping of name to float
        From 0, unseen, to 1.
    edges, legend : bool
        Whether polygons are drawn, and names written.
    view : str or (3,) vector, optional
        As for `looked_at`.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> plotter = together({"one": sphere(4), "other": sphere(4, center=(2, 0, 0))})
    >>> plotter.close()
    """
    plotter = stage()
    entries = []
    for place, (name, mesh) in enumerate(meshes.items()):
        color = colors[place % len(colors)]
        clear = opacity.get(name, 1.0) if isinstance(opacity, Mapping) else opacity
        surface(mesh, color=color, opacity=clear, edges=edges, plotter=plotter)
        entries.append([name, color])
    if legend and entries:
        size = (0.18, min(0.9, 0.032 * len(entries) + 0.02))
        plotter.add_legend(entries, bcolor=None, face="circle", size=size, loc="upper left", font_family="arial")
    looked_at(plotter, view)
    return plotter


def _named(name: str, unit: str, power: int) -> str:
    """Return the title of a scale: what is shown, and its unit, a power of the unit of length."""
    spelled = {1: unit, -1: f"1/{unit}"}.get(power, "") if unit else ""
    return f"{name} ({spelled})" if spelled else name


def _dot(count: int) -> float:
    """Return a size for points, in pixels: the fewer the larger."""
    return float(np.clip(600 / np.sqrt(max(count, 1)), 3.0, 14.0))


def _scale(
    values: NDArray[np.float64], title: str, *, diverging: bool, limits: tuple[float, float] | None
) -> dict[str, Any]:
    """Return how scalars are colored and what their bar says."""
    known = values[np.isfinite(values)]
    if limits is None and diverging:
        most = float(np.percentile(np.abs(known), 98)) if len(known) else 1.0
        limits = (-most or -1.0, most or 1.0)
    elif limits is None and len(known):
        low, high = (float(known.min()), float(known.max()))
        if low >= 0:  # distances: from zero, and a few far ones must not hide how the others differ
            low, high = 0.0, min(high, 4 * float(np.median(known)) or high)
        limits = (low, high if high > low else low + 1.0)
    bar = {
        "title": f"{title}\n",  # the line break keeps it clear of the labels
        "vertical": False,
        "width": 0.5,
        "height": 0.1,
        "position_x": 0.25,
        "position_y": 0.03,
        "n_labels": 5,
        "fmt": "%.3g",
        "color": INK,
        "title_font_size": 16,
        "label_font_size": 13,
    }
    return {
        "scalars": "scalars",
        "cmap": "coolwarm" if diverging else "viridis",
        "clim": limits or (0.0, 1.0),
        "scalar_bar_args": bar,
        "nan_color": "#b0b0b0",
    }
