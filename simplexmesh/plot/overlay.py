"""Plot of two objects before and after registration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.polydata import as_drawable, check_choice, geometry
from simplexmesh.plot.stage import SURFACE_LIT, add, headline, stage

COLORS = ("#e08e45", "#3f7f93")


def overlay(
    source: Any,
    target: Any,
    T_target_source: ArrayLike,
    *,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
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
        As in `Registration`, or `Match.T_target_source`.
    titles : (2,) tuple of str
        Titles of the two panels.
    level, label, inside, view, up
        As for `surface`; "auto" is determined by the target.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> one = sm.ellipsoid((3, 2, 1), 6)
    >>> overlay(one.moved(one.vertices + [1, 0, 0]), one, np.eye(4)).close()
    """
    T = checks.array("T_target_source", T_target_source, (4, 4))
    things = [as_drawable(each) for each in (source, target)]
    check_choice(things, level, label, inside)
    surfaces = [geometry(each, level, label, inside)[0] for each in things]
    shift, away = np.subtract(surfaces[1].center, surfaces[0].center), np.eye(4)
    if np.linalg.norm(shift) > surfaces[1].length:
        away[:3, 3] = shift
    plotter = stage(columns=2)
    for column, (motion, title) in enumerate(zip((away, T), titles, strict=True)):
        plotter.subplot(0, column)
        for polydata, color, M in zip(surfaces, COLORS, (motion, np.eye(4)), strict=True):
            add(plotter, polydata.transform(M, inplace=False), SURFACE_LIT, color=color)
        headline(plotter, title)
    return looked_at(plotter, view, up=upright(things[1], up))
