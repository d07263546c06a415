"""Plots of one surface, of several in panels, and of several in one scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot import drawable
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.legend import entry
from simplexmesh.plot.scale import scale, titled
from simplexmesh.plot.stage import INK, stage

CLAY = "#c9d3dc"
DATA = "#d9c3a5"
PALETTE = ("#c8553d", "#e3a857", "#7d9d5c", "#4f8a8b", "#5d6fa3", "#9b6a97", "#b98b73", "#d98f9f", "#6f6f6f", "#88b7c9")
SURFACE_LIT = {"ambient": 0.25, "diffuse": 0.85, "specular": 0.08, "specular_power": 25}
COLORS_LIT = {"ambient": 0.72, "diffuse": 0.22, "specular": 0.0}  # nearly flat, to keep the colors of the scale
MOST_EDGES = 25_000  # with more vertices, edges of polygons would only darken the surface


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
    inside: str = "above",
    view: str | Sequence[float] | None = None,
    up: str = "auto",
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Plot a mesh with smooth shading and the edges of its polygons.

    Parameters
    ----------
    mesh : SimplexMesh, Reconstruction, TriangleMesh, PointCloud, Volume or anything convertible to these
        A volume is shown as its surface at `level` or of `label`.
    scalars : {"mean_curvature", "simplex_angle", "distance"}, name of a vertex array, or (n,) array, optional
        Quantity to color by. "distance" is that of each vertex to the surface in `data`, along its normal, as in
        `Reconstruction.distance`; vertices without data nearby are gray. Curvatures and
        angles have a diverging colormap centered at zero, clipped at the 98th percentile of their magnitude; others a
        sequential one, from zero for nonnegative quantities, to the 98th percentile or four times the median.
    data : Volume, PointCloud, TriangleMesh or anything convertible to these, optional
        What "distance" is measured to; default: the mesh's array of that name, which `reconstruct` stores.
    level, label : float, int, optional
        Isovalue, or region, where `mesh` or `data` is a volume.
    edges : bool, optional
        Whether edges are drawn; by default up to 25,000 vertices.
    color : str
        Color without scalars.
    opacity : float
        From 0, invisible, to 1.
    title : str, optional
        Text over the picture.
    unit : str
        Unit of length, for the color scale (curvatures are in its inverse).
    limits : (2,) tuple of float, optional
        Ends of the color scale.
    inside : {"above", "below"}
        Whether the object is above or below `level` in a volume.
    view : str or (3,) vector, optional
        As for `looked_at`, when the plotter is new.
    up : {"auto", "x", "y", "z", "-x", "-y", "-z"}
        The axis that points up. "auto": z, but y for triangle meshes and points whose extent along y exceeds that along
        z by a tenth.
    plotter : pyvista.Plotter, optional
        Plotter to add the mesh to, without placing the camera (see `looked_at`); a new one if not given.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ValueError
        An unknown name, a wrong number of scalars, "distance" without data or such an array; `level`, `label` or
        `inside` without a volume.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import torus
    >>> plotter = surface(torus(), scalars="mean_curvature", unit="mm")
    >>> plotter.close()
    """
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = drawable.as_drawable(mesh)
    _check_choice([shown, data], level, label, inside)
    if not isinstance(shown, SimplexMesh) and scalars is not None:
        raise TypeError(f"scalars need a SimplexMesh to color, not {type(shown).__name__}")
    polydata, lines = drawable.geometry(shown, level, label, inside)
    style: dict[str, Any] = {"color": DATA if isinstance(shown, PointCloud) else color, "opacity": opacity}
    if scalars is not None:
        values, name, power, diverging = drawable.scalars_of(shown, scalars, data, level, label, inside)
        polydata["scalars"] = drawable.per_point(shown, values)
        style = scale(values, titled(name, unit, power), diverging=diverging, limits=limits) | {"opacity": opacity}
    if isinstance(shown, PointCloud) and polydata.n_points == polydata.n_cells:
        plotter.add_mesh(polydata, point_size=_dot(len(polydata.points)), render_points_as_spheres=True, **style)
    elif isinstance(shown, PointCloud):
        plotter.add_mesh(polydata, culling="back", smooth_shading=True, ambient=0.25, diffuse=0.85, **style)
    else:
        light = COLORS_LIT if scalars is not None else SURFACE_LIT
        actor = plotter.add_mesh(polydata, smooth_shading=True, **light, **style)
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()  # so that edges are drawn in front of faces
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
        # The mode is global in VTK. With its default offset for points, half of those drawn as spheres would be hidden.
        actor.mapper.SetResolveCoincidentTopologyPointOffsetParameter(0.0)
    wanted = shown.n_vertices <= MOST_EDGES if isinstance(shown, SimplexMesh) and edges is None else edges
    if wanted and isinstance(shown, Volume):
        lines = polydata.extract_all_edges()
    if wanted and lines is not None:
        strong = np.clip(3000 / max(1, len(polydata.points)), 0.15, 0.6)
        plotter.add_mesh(lines, color=INK, line_width=1.0, opacity=float(strong) * opacity, lighting=False)
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


def _check_choice(things: Sequence[Any], level: float | None, label: int | None, inside: str) -> None:
    """Refuse `level` and `label` without a volume, and `inside` without a level."""
    _check.choice("inside", inside, ("above", "below"))
    things = [drawable.as_drawable(one) for one in things if one is not None]
    volumes = any(isinstance(one, Volume) for one in things)
    if (level, label) != (None, None) and not volumes:
        raise ValueError(f"level and label are for volumes, not for {type(things[-1]).__name__}")
    of = "labels" if volumes else type(things[-1]).__name__
    if inside != "above" and (level is None or label is not None):
        raise ValueError(f"inside is for a level of a volume, not for {of}")


def _check_mapping(name: str, given: Any) -> None:
    """Refuse anything but a mapping of names to objects that holds some."""
    if not isinstance(given, Mapping):
        raise TypeError(f"{name} must be a mapping of titles to objects, not {type(given).__name__}")
    if not given:
        raise ValueError(f"{name} must hold at least one object, not none")


def panels(
    things: Mapping[str, Any],
    *,
    scalars: str | None = None,
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
        As for `surface`, for the simplex meshes among them.
    view : str or (3,) vector, optional
        As for `looked_at`.
    up : {"auto", "x", "y", "z", "-x", "-y", "-z"}
        As for `surface`; "auto" is determined by the first object.
    **options
        Passed on to `surface`.

    Returns
    -------
    pyvista.Plotter

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
    shown = {title: drawable.as_drawable(thing) for title, thing in things.items()}
    level, label, data = (options.pop(name, None) for name in ("level", "label", "data"))
    inside = options.pop("inside", "above")
    _check_choice([*shown.values(), data], level, label, inside)
    plotter = stage(columns=len(shown))
    for column, (title, one) in enumerate(shown.items()):
        plotter.subplot(0, column)
        of: dict[str, Any] = {"scalars": scalars} if isinstance(one, SimplexMesh) else {}
        if isinstance(one, Volume) or (isinstance(one, SimplexMesh) and data is not None):
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
    mesh : SimplexMesh or Reconstruction
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
    given, model = drawable.as_drawable(data), drawable.as_drawable(mesh)
    if isinstance(given, PointCloud) and isinstance(model, SimplexMesh):
        given = drawable.oriented_like(given, model)
    counts = f"model, {model.n_vertices:,} vertices" if isinstance(model, SimplexMesh) else "model"
    things = {"data": given, counts: model}
    options = {"level": level, "label": label, "inside": inside, "unit": unit}
    return panels(things, scalars=scalars, data=given, view=view, up=up, **options)


def together(
    meshes: Mapping[str, Any],
    *,
    colors: Sequence[str] = PALETTE,
    opacity: float | Mapping[str, float] = 1.0,
    edges: bool = False,
    view: str | Sequence[float] | None = None,
    up: str = "z",
    legend: bool = True,
) -> pv.Plotter:
    """Plot several meshes in one scene, each in its color, with a legend.

    Parameters
    ----------
    meshes : mapping of str to anything `surface` takes
        Names and meshes.
    colors : sequence of str
        Used in turn.
    opacity : float or mapping of name to float
        From 0, invisible, to 1.
    edges, legend : bool
        Whether to draw the edges of polygons, and the legend.
    view : str or (3,) vector, optional
        As for `looked_at`.
    up : {"x", "y", "z", "-x", "-y", "-z"}
        The axis that points up.

    Raises
    ------
    TypeError, ValueError
        `meshes` is no mapping, or an empty one; otherwise as for `surface`.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> plotter = together({"one": sphere(4), "other": sphere(4, center=(2, 0, 0))})
    >>> plotter.close()
    """
    _check_mapping("meshes", meshes)
    plotter = stage()
    for place, (name, mesh) in enumerate(meshes.items()):
        color = colors[place % len(colors)]
        clear = opacity.get(name, 1.0) if isinstance(opacity, Mapping) else opacity
        surface(mesh, color=color, opacity=clear, edges=edges, plotter=plotter)
        if legend:
            entry(plotter, place, name, color)
    return looked_at(plotter, view, up=up, window=True)


def _dot(count: int) -> float:
    """Return the size of points in pixels, which decreases with their number."""
    return float(np.clip(600 / np.sqrt(max(count, 1)), 3.0, 14.0))
