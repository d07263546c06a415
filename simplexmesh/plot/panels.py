"""Plots of several objects: in panels under one camera, data beside its model, and together in one scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pyvista as pv

from simplexmesh.data.points import PointCloud
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.color_scale import PALETTE, entry
from simplexmesh.plot.polydata import as_drawable, check_choice, oriented_like
from simplexmesh.plot.stage import stage
from simplexmesh.plot.surface import surface


def panels(
    things: Mapping[str, Any],
    *,
    scalars: str | None = None,
    data: Any = None,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    view: str | Sequence[float] | None = None,
    up: str = "auto",
    **options: Any,
) -> pv.Plotter:
    """Plot several objects in panels with titles, under one camera.

    Parameters
    ----------
    things : mapping of str to anything `surface` takes
        Title and object of each panel.
    scalars : str, optional
        As for `surface`, for the simplex meshes among them, or without any for all but `data` and volumes.
    data, level, label, inside, view, up, **options
        As for `surface`; "auto" is determined by the first object.

    Raises
    ------
    TypeError, ValueError
        `things` is no mapping, or an empty one; otherwise as for `surface`.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> plotter = panels({"coarse": sphere(3), "fine": sphere(9)})
    >>> plotter.close()
    """
    _check_mapping("things", things)
    shown = {title: as_drawable(thing) for title, thing in things.items()}
    check_choice([*shown.values(), data], level, label, inside)
    models: Any = SimplexMesh if any(isinstance(one, SimplexMesh) for one in shown.values()) else object
    plotter = stage(columns=len(shown))
    for column, (title, one) in enumerate(shown.items()):
        plotter.subplot(0, column)
        is_model = isinstance(one, models) and one is not data and not isinstance(one, Volume)
        of: dict[str, Any] = {"scalars": scalars} if is_model else {}
        if isinstance(one, Volume) or (is_model and data is not None):
            of |= {"data": data, "level": level, "label": label, "inside": inside}
        surface(one, title=title, plotter=plotter, **of, **options)
    return looked_at(plotter, view, up=upright(next(iter(shown.values())), up))


def beside(
    data: Any,
    mesh: Any,
    *,
    scalars: str | None = None,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    unit: str = "",
    view: str | Sequence[float] | None = None,
    up: str = "auto",
) -> pv.Plotter:
    """Plot data and its model in two panels, under one camera.

    Parameters
    ----------
    data : Volume, PointCloud, TriangleMesh or anything convertible to these
        A volume is shown as its surface at `level` or of `label`.
    mesh : anything `surface` takes
        The model.
    scalars, level, label, inside, unit, view, up
        As for `surface` and `panels`.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(5)
    >>> plotter = beside(ball.vertices, ball, scalars="distance")
    >>> plotter.close()
    """
    given, model = as_drawable(data), as_drawable(mesh)
    if isinstance(given, PointCloud) and isinstance(model, SimplexMesh):
        given = oriented_like(given, model)
    counts = f"model, {model.n_vertices:,} vertices" if isinstance(model, SimplexMesh) else "model"
    things = {"data": given, counts: model}
    where: dict[str, Any] = {"level": level, "label": label, "inside": inside}
    return panels(things, scalars=scalars, data=given, view=view, up=up, unit=unit, **where)


def together(
    things: Mapping[str, Any],
    *,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    colors: Sequence[str] = PALETTE,
    opacity: float | Mapping[str, float] = 1.0,
    edges: bool = False,
    view: str | Sequence[float] | None = None,
    up: str = "z",
    legend: bool = True,
) -> pv.Plotter:
    """Plot several objects in one scene, each in its color, with a legend.

    Parameters
    ----------
    things : mapping of str to anything `surface` takes
        Names and objects.
    level, label, inside
        As for `surface`, for the volumes among them.
    colors : sequence of str
        Used in turn.
    opacity : float or mapping of name to float
        From 0, invisible, to 1.
    edges, legend : bool
        Whether to draw the edges of polygons, and the legend.
    view, up
        As for `looked_at`.

    Raises
    ------
    TypeError, ValueError
        `things` is no mapping, or an empty one; otherwise as for `surface`.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> plotter = together({"one": sphere(4), "other": sphere(4, center=(2, 0, 0))})
    >>> plotter.close()
    """
    _check_mapping("things", things)
    shown = {name: as_drawable(thing) for name, thing in things.items()}
    check_choice([*shown.values()], level, label, inside)
    plotter = stage()
    for place, (name, one) in enumerate(shown.items()):
        color = colors[place % len(colors)]
        clear = opacity.get(name, 1.0) if isinstance(opacity, Mapping) else opacity
        of: dict[str, Any] = {"level": level, "label": label, "inside": inside} if isinstance(one, Volume) else {}
        surface(one, color=color, opacity=clear, edges=edges, plotter=plotter, **of)
        if legend:
            entry(plotter, place, name, color)
    return looked_at(plotter, view, up=up, window=True)


def _check_mapping(name: str, given: Any) -> None:
    """Refuse anything but a mapping of names to objects that holds some."""
    if not isinstance(given, Mapping):
        raise TypeError(f"{name} must be a mapping of titles to objects, not {type(given).__name__}")
    if not given:
        raise ValueError(f"{name} must hold at least one object, not none")
