"""Plot of per-vertex classes, one color each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh._base.arrays import Indices
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.color_scale import PALETTE, legend_of_classes
from simplexmesh.plot.polydata import as_surface, colored, points_of, vertex_cells
from simplexmesh.plot.stage import COLORS_LIT, add, headline, stage


def classes(
    surface: Any,
    labels: Any,
    *,
    names: Sequence[str] | None = None,
    colors: Sequence[str] | None = None,
    title: str | None = None,
    legend: bool = True,
    view: str | Sequence[float] | None = None,
    up: str = "auto",
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Plot classes of vertices, one color each, with a legend of those that occur.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud or anything convertible to these
        The surface or points.
    labels : HKClasses, Regions or (n,) array of int
        The class of each vertex, at least 0; or booleans.
    names, colors : sequence of str, optional
        By class number. Default: those of `labels`, or no names and the colors of a palette.
    title, view, up, plotter
        As for `surface`.
    legend : bool
        Whether to write the names: at the left, or below in a narrow panel.

    Raises
    ------
    ValueError, TypeError
        Labels that are no class numbers, or of wrong length; fewer names or colors than classes; not a surface.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(24, 12).triangulated("dual")
    >>> classes(ring, sm.hk_classes(ring, curvature=sm.curvature(ring, "sine"))).close()
    """
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = as_surface(surface)
    names = getattr(labels, "names", None) if names is None else names
    colors = getattr(labels, "colors", None) if colors is None else colors
    numbers = _classes(labels, shown)
    many = int(numbers.max(initial=-1)) + 1
    for name, given in (("names", names), ("colors", colors)):
        if given is not None and len(given) < many:
            raise ValueError(f"{name} must have one entry per class, at least {many}, not {len(given)}")
    palette = list(colors) if colors is not None else [PALETTE[k % len(PALETTE)] for k in range(many)]
    table = np.array([pv.Color(color).float_rgb for color in palette])
    shaded = vertex_cells if isinstance(shown, TriangleMesh) else colored
    add(plotter, shaded(shown, "classes", table[numbers]), COLORS_LIT, scalars="classes", rgb=True)
    if legend and names is not None:
        legend_of_classes(plotter, [(str(names[k]), palette[k]) for k in np.unique(numbers)])
    headline(plotter, title)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


def _classes(labels: Any, shown: Any) -> Indices:
    numbers = np.asarray(getattr(labels, "labels", labels))
    count = len(points_of(shown))
    if numbers.shape != (count,) or numbers.dtype.kind not in "iub" or numbers.min(initial=0) < 0:
        raise ValueError(
            f"labels must be ({count},) class numbers of at least 0, not {numbers.dtype} of {numbers.shape}"
        )
    return numbers.astype(np.int64)
