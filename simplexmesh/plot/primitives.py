"""Plot of primitives and pipes over the points they were found in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh.cloud.extraction.result import Extraction
from simplexmesh.data.conversion import as_points
from simplexmesh.data.primitives import Primitive
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.polydata import MOST_POINTS
from simplexmesh.plot.stage import INK, SURFACE_LIT, add, headline, stage

COLORS = {
    "plane": "#b5c7d8",
    "sphere": "#e3a857",
    "cylinder": "#5b9bbf",
    "cone": "#b07fb8",
    "oblique cone": "#b07fb8",
    "torus": "#d9705a",
    "beam": "#8a97a6",
    "flange": "#5aa38c",
    "flange pair": "#5aa38c",
    "line": INK,
    "circle": INK,
}
"""Colors of kinds."""


def primitives(
    cloud: Any,
    found: Any,
    *,
    title: str | None = None,
    view: str | Sequence[float] | None = None,
    up: str = "z",
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Plot primitives, in a color for each kind, over the points of a cloud.

    Parameters
    ----------
    cloud : PointCloud, array, PyVista object or path
        The points.
    found : Extraction, Plant, PipeLine, Primitive or several primitives
        What was found in them, each with its ends.
    title, view, up, plotter
        As for `plot.surface`.

    Raises
    ------
    ValueError
        A primitive without ends.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> points = sm.sphere(8).vertices
    >>> primitives(points, sm.fit_primitive(points, "sphere")).close()
    """
    points = as_points(cloud, "cloud")
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    for primitive in _primitives(found):
        part, color = primitive.to_pyvista(), COLORS[primitive.kind]
        if part.n_cells:
            part = part.compute_normals(split_vertices=True, auto_orient_normals=False)
            add(plotter, part, SURFACE_LIT, color=color)
        else:
            plotter.add_mesh(part, color=color, line_width=4)
    some = points.points[:: max(1, -(-len(points.points) // MOST_POINTS))]
    plotter.add_points(np.asarray(some), color=INK, point_size=1.5, opacity=0.35)
    headline(plotter, title)
    return looked_at(plotter, view, up=upright(points, up), window=True) if alone else plotter


def _primitives(found: Any) -> Iterable[Any]:
    """Return the primitives of what was found."""
    if isinstance(found, Primitive):
        return (found,)
    if isinstance(found, Extraction):
        return found.primitives
    return [each.primitive for each in found.elements] if hasattr(found, "elements") else tuple(found)
