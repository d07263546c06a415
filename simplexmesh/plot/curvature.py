"""Plot of mean and Gaussian curvature, saliency and surface types in four panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pyvista as pv

from simplexmesh._base import checks
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.classes import classes
from simplexmesh.plot.color_scale import titled
from simplexmesh.plot.heat import heat
from simplexmesh.plot.polydata import as_surface
from simplexmesh.plot.stage import stage
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.fields import known_curvature
from simplexmesh.surface.saliency.hk_classes import hk_classes
from simplexmesh.surface.saliency.regions import regions
from simplexmesh.surface.saliency.saliency import saliency
from simplexmesh.surface.saliency.salient_points import salient_points
from simplexmesh.surface.sampled_surface import as_sampled_surface


def curvature(
    surface: Any,
    *,
    curvature: Curvature | None = None,
    count: int = 12,
    unit: str = "",
    title: str | None = None,
    view: str | Sequence[float] | None = None,
    up: str = "auto",
) -> pv.Plotter:
    """Plot mean and Gaussian curvature, saliency and surface types in four panels.

    Saliency has the most persistent salient points marked; surface types are those of the signs of both curvatures,
    with small regions merged into their surroundings.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud or anything convertible to these
        The surface.
    curvature : Curvature, optional
        Its curvature; computed if not given.
    count : int
        Largest number of salient points marked.
    unit, title, view, up
        As for `surface`; the title is that of the first panel.

    Raises
    ------
    ValueError, TypeError
        Not a surface, the curvature of another surface, a negative count.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.plot.curvature(sm.torus(24, 12).triangulated("dual"), unit="mm").close()
    """
    shown = as_surface(surface)
    count, up = checks.integer("count", count, 0), upright(shown, up)
    samples = as_sampled_surface(shown)
    known = known_curvature(samples, curvature)
    kinds = hk_classes(samples, curvature=known)
    merged = regions(samples, kinds)
    salience = saliency(samples, curvature=known)
    points = salient_points(samples, curvature=known, count=count)
    plotter = stage(columns=4)
    heat(shown, known.mean, name=titled("mean curvature H", unit, -1), title=title, plotter=plotter)
    plotter.subplot(0, 1)
    heat(shown, known.gauss, name=titled("Gaussian curvature K", unit, -2), plotter=plotter)
    plotter.subplot(0, 2)
    heat(shown, salience, name="saliency (rad)", marks=points, plotter=plotter)
    plotter.subplot(0, 3)
    classes(shown, merged.classes[merged.labels], names=kinds.names, colors=kinds.colors, plotter=plotter)
    return looked_at(plotter, view, up=up)
