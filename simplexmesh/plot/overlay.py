"""Plot of two objects before and after registration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.plot import drawable
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.stage import INK, stage

Array = NDArray[np.float64]

COLORS = ("#e08e45", "#3f7f93")
LIT = {"ambient": 0.3, "diffuse": 0.75, "specular": 0.1, "specular_power": 20}


def overlay(
    source: Any,
    target: Any,
    T_target_source: ArrayLike,
    *,
    level: float | None = None,
    label: int | None = None,
    titles: tuple[str, str] = ("before", "after"),
    view: str | Sequence[float] | None = None,
    up: str = "auto",
) -> pv.Plotter:
    """Plot two objects together, on the left as given, on the right with the source moved to the target.

    Where the surfaces agree, the two colors, orange for the source and blue for the target, alternate in patches.

    Parameters
    ----------
    source, target : anything `surface` takes
        On the left, a source far from the target is drawn centered on it.
    T_target_source : (4, 4) array of float
        As in `Registration`, or `Match.T_a_b`.
    level, label : float, int, optional
        Isovalue, or region, where one is a volume.
    titles : (2,) tuple of str
        Titles of the two panels.
    view : str or (3,) vector, optional
        As for `looked_at`.
    up : {"auto", "x", "y", "z", "-x", "-y", "-z"}
        As for `surface`; "auto" is determined by the target.

    Returns
    -------
    pyvista.Plotter

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> one = sm.ellipsoid((3, 2, 1), 6)
    >>> overlay(one.moved(one.vertices + [1, 0, 0]), one, np.eye(4)).close()
    """
    T = _check.array("T_target_source", T_target_source, (4, 4))
    things = [drawable.as_drawable(each) for each in (source, target)]
    surfaces = [_polydata(each, level, label) for each in things]
    shift, size = _middle(surfaces[1]) - _middle(surfaces[0]), float(np.linalg.norm(np.ptp(surfaces[1].points, axis=0)))
    away = np.eye(4)
    if np.linalg.norm(shift) > size:
        away[:3, 3] = shift
    plotter = stage(columns=2)
    for column, (motion, title) in enumerate(zip((away, T), titles, strict=True)):
        plotter.subplot(0, column)
        for polydata, thing, color, M in zip(surfaces, things, COLORS, (motion, np.eye(4)), strict=True):
            _add(plotter, polydata.transform(M, inplace=False), thing, color)
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return looked_at(plotter, view, up=upright(things[1], up))


def _polydata(thing: Any, level: float | None, label: int | None) -> pv.PolyData:
    """Return the geometry to draw."""
    return drawable.geometry(thing, level, label)[0]


def _middle(polydata: pv.PolyData) -> Array:
    return np.asarray(0.5 * (polydata.points.min(axis=0) + polydata.points.max(axis=0)), dtype=float)


def _add(plotter: pv.Plotter, polydata: pv.PolyData, thing: Any, color: str) -> None:
    """Draw one of the two."""
    if isinstance(thing, PointCloud) and polydata.n_points == polydata.n_cells:
        size = float(np.clip(500 / np.sqrt(max(polydata.n_points, 1)), 3.0, 10.0))
        plotter.add_mesh(polydata, color=color, point_size=size, render_points_as_spheres=True, **LIT)
    else:
        plotter.add_mesh(polydata, color=color, smooth_shading=True, **LIT)
