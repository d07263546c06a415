"""Per-vertex scalars in a blue-to-red colormap, per-vertex classes, marked points and lines on a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.plot import drawable
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.colored import colored, vertex_cells
from simplexmesh.plot.colormap import blue_to_red, ends
from simplexmesh.plot.legend import legend_of_classes
from simplexmesh.plot.scale import bar
from simplexmesh.plot.scenes import COLORS_LIT, PALETTE
from simplexmesh.plot.stage import INK, stage

Array = NDArray[np.float64]

THIN = 0.0018
"""Radius of a line, as a share of the diagonal."""

MARK = 0.009
"""Radius of a marked point, as a share of the diagonal."""


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
    title : str, optional
        Text over the picture.
    view : str or (3,) vector, optional
        As for `looked_at`, when the plotter is new.
    up : {"auto", "x", "y", "z", "-x", "-y", "-z"}
        As for `surface`.
    plotter : pyvista.Plotter, optional
        Plotter to add to; a new one if not given.

    Returns
    -------
    pyvista.Plotter

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
    shown = shown_of(surface)
    numbers = _values(values, shown)
    low, high = ends(numbers, limits, _areas(shown))
    polydata = colored(shown, "heat", np.clip(numbers, low, high))
    _draw(
        plotter, polydata, scalars="heat", cmap=blue_to_red(low, high), clim=(low, high),
        scalar_bar_args=bar(name, high),
    )  # fmt: skip
    if marks is not None:
        mark(plotter, getattr(marks, "points", marks), size=_diagonal(shown))
    for line in lines:
        trace(plotter, line, size=_diagonal(shown))
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


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
        As for `heat`.
    legend : bool
        Whether to write the names: at the left, or below in a narrow panel.

    Returns
    -------
    pyvista.Plotter

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
    shown = shown_of(surface)
    names = getattr(labels, "names", None) if names is None else names
    colors = getattr(labels, "colors", None) if colors is None else colors
    numbers = _classes(labels, shown)
    many = int(numbers.max(initial=-1)) + 1
    for name, given in (("names", names), ("colors", colors)):
        if given is not None and len(given) < many:
            raise ValueError(f"{name} must have one entry per class, at least {many}, not {len(given)}")
    palette = list(colors) if colors is not None else [PALETTE[k % len(PALETTE)] for k in range(many)]
    table = np.array([pv.Color(color).float_rgb for color in palette])
    triangles = isinstance(shown, TriangleMesh)
    _draw(
        plotter, vertex_cells(shown, table[numbers]) if triangles else colored(shown, "classes", table[numbers]),
        scalars="classes", rgb=True,
    )  # fmt: skip
    if legend and names is not None:
        legend_of_classes(plotter, [(str(names[k]), palette[k]) for k in np.unique(numbers)])
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


def mark(plotter: pv.Plotter, points: ArrayLike, *, size: float, color: str = INK) -> None:
    """Add a ball at each point, the first ones larger; `size` is the diagonal of the surface."""
    at = _check.array("marks", points, (None, 3))
    for place, point in enumerate(at):
        radius = size * MARK * (1.0 if place < 5 else 0.7)
        plotter.add_mesh(
            pv.Sphere(radius=radius, center=point, theta_resolution=20, phi_resolution=20), color=color, specular=0.4
        )


def trace(plotter: pv.Plotter, line: Any, *, size: float, color: str = INK) -> None:
    """Add a line as a tube; `size` is the diagonal of the surface."""
    at = _check.array("lines", getattr(line, "points", line), (None, 3))
    if len(at) < 2:
        return
    drawn = pv.lines_from_points(np.asarray(at), close=getattr(line, "closed", False))
    plotter.add_mesh(drawn.strip().tube(radius=THIN * size), color=color, specular=0.2)


def _draw(plotter: pv.Plotter, polydata: pv.PolyData, **style: Any) -> None:
    if polydata.n_points == polydata.n_cells:
        plotter.add_mesh(polydata, point_size=6, render_points_as_spheres=True, **style)
    else:
        plotter.add_mesh(polydata, smooth_shading=True, **COLORS_LIT, **style)


def shown_of(surface: Any) -> Any:
    """Return the object to draw; meshes keep all their vertices."""
    if isinstance(surface, tuple | list) and len(surface) == 2:
        surface = TriangleMesh(surface[0], surface[1])
    shown = surface if isinstance(surface, PointCloud) else drawable.as_drawable(surface)
    if isinstance(shown, Volume | Mapping):
        raise TypeError(f"surface must be a mesh or points, not {type(shown).__name__}")
    return shown


def _classes(labels: Any, shown: Any) -> NDArray[np.int64]:
    numbers = np.asarray(getattr(labels, "labels", labels))
    if numbers.shape != (_count(shown),) or numbers.dtype.kind not in "iub" or numbers.min(initial=0) < 0:
        wanted = f"({_count(shown)},) class numbers of at least 0"
        raise ValueError(f"labels must be {wanted}, not {numbers.dtype} of {numbers.shape}")
    return numbers.astype(np.int64)


def _count(shown: Any) -> int:
    return len(shown.points if isinstance(shown, PointCloud) else shown.vertices)


def _diagonal(shown: Any) -> float:
    return float(np.linalg.norm(np.ptp(shown.points if isinstance(shown, PointCloud) else shown.vertices, axis=0)))


def _values(values: ArrayLike, shown: Any) -> Array:
    given = _check.any_array("values", values)
    if given.dtype.kind not in "biuf":
        raise TypeError(f"values must be numbers, not {given.dtype}")
    if given.shape != (_count(shown),):
        raise ValueError(f"values must have shape ({_count(shown)},), not {given.shape}")
    return given.astype(float)


def _areas(shown: Any) -> Array:
    """Return a weight per vertex proportional to its area; equal weights without triangles."""
    if not isinstance(shown, TriangleMesh):
        return np.ones(_count(shown))
    double = np.linalg.norm(shown.face_vectors, axis=1)
    return np.bincount(shown.faces.ravel(), np.repeat(double, 3), _count(shown)).astype(float)
