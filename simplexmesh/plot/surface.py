"""Plot of one mesh, cloud or volume."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from itertools import cycle
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.named_arrays import is_color
from simplexmesh.data.points import PointCloud
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.color_scale import PALETTE, scale, titled
from simplexmesh.plot.features import features
from simplexmesh.plot.heat import heat
from simplexmesh.plot.overlay import COLORS
from simplexmesh.plot.polydata import as_drawable, check_choice, colored, geometry, painted_with
from simplexmesh.plot.scalars import scalars_of
from simplexmesh.plot.stage import COLORS_LIT, INK, SURFACE_LIT, add, behind, grid, headline, quiet, stage
from simplexmesh.surface.features.lines.network import FeatureNetwork
from simplexmesh.surface.features.zoning.result import Zones

CLAY = "#c9d3dc"
DATA = "#d9c3a5"
LINES = ("#c23b22", "#1f6fb2", "#2e8b57", "#8e44ad", "#d98c00", "#0e8a8a")
CONTOUR = 0.004
"""Radius of contours, in diagonals of the mesh."""

MOST_EDGES = 25_000
"""With more vertices, edges of polygons would only darken the surface."""


def surface(
    surface: Any,
    *,
    scalars: str | ArrayLike | None = None,
    data: Any = None,
    level: float | None = None,
    label: int | None = None,
    edges: bool | None = None,
    contours: bool = False,
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
    surface : SimplexMesh, Reconstruction, TriangleMesh, PointCloud, Volume or anything convertible to these
        A volume is shown as its surface at `level` or of `label`.
    scalars : str or (n,) array, optional
        Quantity to color by: "mean_curvature", "deviation" or a vertex array, also by name, and of simplex meshes
        "sphere_curvature", "simplex_angle" and "distance"; an array of colors (bytes, as "colors" of a file) is shown
        as it is. "distance" is that of each vertex to the surface in `data`, along its normal, as in
        `Reconstruction.distance`; "deviation" is the signed distance to the surface that `data` is, as by
        `sm.deviation`. Vertices without a value, NaN, are gray. Quantities of both signs have the colors of `heat`,
        green at zero, clipped at the 98th percentile of their magnitude; others a sequential colormap, from the 2nd
        percentile, or from zero if that is below half of the range, to the 98th percentile or four times the median.
    data : Volume, PointCloud, TriangleMesh or anything convertible to these, optional
        What "distance" and "deviation" are measured to; default: the mesh's array of that name; `reconstruct` stores
        the first.
    level, label : float, int, optional
        Isovalue, or region, where `surface` or `data` is a volume.
    edges : bool, optional
        Whether edges are drawn; by default up to 25,000 vertices.
    contours : bool
        Whether the contours of a simplex mesh, if it has some, are drawn, each as a tube in a color of its own.
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

    Raises
    ------
    ValueError
        An unknown name, a wrong number of scalars, "distance" without data or such an array; `level`, `label` or
        `inside` without a volume; `contours` of anything but a simplex mesh.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import torus
    >>> plotter = surface(torus(), scalars="mean_curvature", unit="mm")
    >>> plotter.close()
    """
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = as_drawable(surface)
    check_choice([shown, data], level, label, inside)
    colors = getattr(shown, "data", {}).get(scalars) if isinstance(scalars, str) else None
    painted = colors is not None and is_color(colors)
    is_cloud = isinstance(shown, PointCloud)
    polydata, lines = geometry(shown, level, label, inside)
    style: dict[str, Any] = {"color": DATA if is_cloud else color, "culling": "back" if is_cloud else None}
    light = SURFACE_LIT
    if painted:
        polydata, style, light = painted_with(shown, str(scalars)), {"scalars": "colors", "rgb": True}, COLORS_LIT
    elif scalars is not None:
        found = scalars_of(shown, scalars, data, level, label, inside)
        polydata = colored(shown, "scalars", found.values)
        title_of_scale = titled(found.name, unit, found.power)
        style = scale(found.values, title_of_scale, diverging=found.diverging, limits=limits)
        light = COLORS_LIT
    actor = add(plotter, polydata, light, opacity=opacity, **style)
    if not is_cloud:
        behind(actor, 2.0)  # its edges
    wanted = shown.n_vertices <= MOST_EDGES if isinstance(shown, SimplexMesh) and edges is None else edges
    if wanted and isinstance(shown, Volume):
        lines = polydata.extract_all_edges()
    if wanted and lines is not None:
        strong = np.clip(3000 / max(1, len(polydata.points)), 0.15, 0.6)
        plotter.add_mesh(lines, color=INK, line_width=1.0, opacity=float(strong) * opacity, lighting=False)
    if checks.flag("contours", contours):
        _add_contours(plotter, shown)
    headline(plotter, title)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


def _add_contours(plotter: pv.Plotter, shown: Any) -> None:
    """Add a tube for each contour of a mesh."""
    if not isinstance(shown, SimplexMesh):
        raise ValueError(f"contours are those of a SimplexMesh; a {type(shown).__name__} has none")
    for k, contour in enumerate(shown.contours.values()):
        line = pv.lines_from_points(shown.vertices[contour.vertices], close=contour.closed)
        tube = line.strip().tube(radius=CONTOUR * shown.diagonal, n_sides=12, capping=True)
        plotter.add_mesh(tube, color=LINES[k % len(LINES)], specular=0.2)


def thumbnail(*shown: Any, values: ArrayLike | None = None) -> bytes:
    """Return a small picture of surfaces, or of zones or sharp edges, drawn off screen, as bytes of a PNG file.

    One surface is colored by `values` if given.
    """
    plotter = grid((1, 1), (320, 240), window=False)
    plotter.set_background("white")
    if values is not None:
        heat(shown[0], values, plotter=plotter)
        plotter.remove_scalar_bar()  # its letters would be too small to read
    elif isinstance(shown[0], FeatureNetwork | Zones):
        network, zones = (shown[0], None) if isinstance(shown[0], FeatureNetwork) else (None, shown[0])
        features(shown[0].mesh, network, zones, plotter=plotter)
    elif len(shown) == 1:
        surface(shown[0], plotter=plotter)
    else:
        for one, color in zip(shown, cycle((*COLORS, *PALETTE)), strict=False):
            add(plotter, geometry(one)[0], SURFACE_LIT, color=color)
    looked_at(plotter, None, up=upright(as_drawable(shown[-1]), "auto"))
    out = BytesIO()
    with quiet():
        plotter.screenshot(out)
    plotter.close()
    return out.getvalue()
