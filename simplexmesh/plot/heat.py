"""Plot of per-vertex scalars in a blue-to-red colormap, with marked points and lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.color_scale import bar, blue_to_red, ends
from simplexmesh.plot.polydata import as_surface, colored, points_of
from simplexmesh.plot.stage import COLORS_LIT, INK, add, headline, stage
from simplexmesh.surface.saliency.fields import field_values

THIN, MARK = 0.0018, 0.009
"""Radii of a line and of a marked point, as shares of the diagonal."""


def heat(
    surface: Any,
    values: ArrayLike,
    *,
    name: str = "",
    limits: tuple[float, float] | None = None,
    marks: Any = None,
    lines: Sequence[Any] = (),
    title: str | None = None,
    view: str | Sequence[float] | None = None,
    up: str = "auto",
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Plot per-vertex scalars on a surface, from blue over cyan, green and yellow to red.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud or anything convertible to these
        The surface or points.
    values : (n,) array of float
        One per vertex or point; NaN is gray.
    name : str
        Name and unit of the quantity, for the color scale. Panels of a plotter with the same name share one scale.
    limits : (2,) tuple of float, optional
        Ends of the scale. By default 95 % of the area is within. With both signs the scale is symmetric about zero, and
        ends earlier where tails are long; otherwise it begins at zero or, if that is far below the values, at their
        5th percentile.
    marks : (m, 3) array of float or SalientPoints, optional
        Points to mark with balls, the first ones larger.
    lines : sequence of Polyline or of (k, 3) arrays of float
        Lines to draw, as returned by `level_lines` and `inversion_lines`.
    title, view, up, plotter
        As for `surface`.

    Raises
    ------
    ValueError, TypeError
        Wrong number of values, limits that do not increase, not a surface.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(24, 12).triangulated("dual")
    >>> heat(ring, sm.curvature(ring, "sine").mean, name="mean curvature (1/mm)").close()
    """
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = as_surface(surface)
    numbers = field_values("values", values, len(points_of(shown)))
    low, high = ends(numbers, limits, _areas(shown))
    style = {"cmap": blue_to_red(low, high), "clim": (low, high), "scalar_bar_args": bar(name, low, high)}
    add(plotter, colored(shown, "heat", np.clip(numbers, low, high)), COLORS_LIT, scalars="heat", **style)
    size = float(np.linalg.norm(np.ptp(points_of(shown), axis=0)))
    if marks is not None:
        _mark(plotter, getattr(marks, "points", marks), size)
    for line in lines:
        _trace(plotter, line, size)
    headline(plotter, title)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


def _mark(plotter: pv.Plotter, points: ArrayLike, size: float) -> None:
    """Add a ball at each point, the first ones larger; `size` is the diagonal of the surface."""
    at = checks.array("marks", points, (None, 3))
    for place, point in enumerate(at):
        radius = size * MARK * (1.0 if place < 5 else 0.7)
        ball = pv.Sphere(radius=radius, center=point, theta_resolution=20, phi_resolution=20)
        plotter.add_mesh(ball, color=INK, specular=0.4)


def _trace(plotter: pv.Plotter, line: Any, size: float) -> None:
    """Add a line as a tube; `size` is the diagonal of the surface."""
    at = checks.array("lines", getattr(line, "points", line), (None, 3))
    if len(at) < 2:
        return
    drawn = pv.lines_from_points(np.asarray(at), close=getattr(line, "closed", False))
    plotter.add_mesh(drawn.strip().tube(radius=THIN * size), color=INK, specular=0.2)


def _areas(shown: Any) -> Array:
    """Return a weight per vertex proportional to its area; equal weights without triangles."""
    if not isinstance(shown, TriangleMesh):
        return np.ones(len(points_of(shown)))
    double = np.linalg.norm(shown.face_vectors, axis=1)
    return np.bincount(shown.faces.ravel(), np.repeat(double, 3), len(points_of(shown))).astype(float)
