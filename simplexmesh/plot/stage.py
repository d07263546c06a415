"""Plotters with the background and lights of this library, and writing of image files."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh._base import checks
from simplexmesh._base.drafts import draft

INK = "#1d2b36"
LIGHTS = [((-0.9, 0.8, 1.6), 0.8), ((1.4, 0.3, 0.9), 0.35), ((-0.2, -1.0, 1.0), 0.2)]  # key, fill, from below
SURFACE_LIT = {"ambient": 0.25, "diffuse": 0.85, "specular": 0.08, "specular_power": 25}
COLORS_LIT = {"ambient": 0.72, "diffuse": 0.22, "specular": 0.0}  # nearly flat, to keep the colors of the scale


def stage(columns: int = 1, size: tuple[int, int] | None = None) -> pv.Plotter:
    """Return an empty plotter with this library's background and lights.

    Examples
    --------
    >>> stage().close()
    """
    plotter = grid((1, columns), size or ((1200, 900) if columns == 1 else (min(720 * columns, 2160), 720)))
    for column in range(columns):
        plotter.subplot(0, column)
        plotter.set_background("#ffffff", top="#e9eef3")
        plotter.enable_anti_aliasing("fxaa" if has_display() else "ssaa")
    plotter.subplot(0, 0)
    return plotter


def grid(shape: tuple[int, int], size: tuple[int, int], *, window: bool = True) -> pv.Plotter:
    """Return an empty plotter with rows and columns of panels, a width and height in pixels, and lights.

    Without `window` it draws off screen only.
    """
    hidden = not window or not has_display()
    with quiet():
        plotter = pv.Plotter(
            shape=shape, border=False, off_screen=hidden or None, window_size=list(size), lighting="none"
        )
    for position, strength in LIGHTS:  # each goes to every panel
        plotter.add_light(pv.Light(position=position, intensity=strength, light_type="camera light"))
    return plotter


def headline(plotter: pv.Plotter, title: str | None) -> None:
    """Write a title, if any, over the current panel."""
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)


def add(plotter: pv.Plotter, polydata: pv.PolyData, light: dict[str, float], **style: Any) -> Any:
    """Add a surface with smooth shading, or points as balls, the smaller the more there are; return the actor."""
    if polydata.n_points == polydata.n_cells:
        dot = float(np.clip(600 / np.sqrt(max(polydata.n_points, 1)), 3.0, 14.0))
        return plotter.add_mesh(polydata, point_size=dot, render_points_as_spheres=True, **style)
    return plotter.add_mesh(polydata, smooth_shading=True, **light, **style)


def picture(path: str | Path, plotter: pv.Plotter, *, close: bool = True) -> Path:
    """Write the picture of a plotter to an image file, completely or not at all.

    Parameters
    ----------
    path : str or Path
        File name, .png, .jpg or .tif; the folder must exist.
    plotter : pyvista.Plotter
        As returned by the other functions.
    close : bool
        Close the plotter afterwards.

    Raises
    ------
    ValueError
        Another suffix.
    TypeError
        The path is no path, or the plotter is one (arguments swapped).
    OSError
        The folder does not exist or cannot be written to.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a file name, followed by the plotter, not {type(path).__name__}")
    if isinstance(plotter, str | os.PathLike):
        raise TypeError(f"plotter must be a pyvista.Plotter, not {plotter!r}")
    path = Path(path)
    checks.choice("the end of the picture's name", path.suffix.lower(), (".png", ".jpg", ".jpeg", ".tif"))
    with draft(path) as part:
        try:
            with quiet():
                plotter.screenshot(str(part))
        finally:
            if close:
                plotter.close()
    return path


def has_display() -> bool:
    """Whether a window can be opened here.

    Examples
    --------
    >>> has_display() in (True, False)
    True
    """
    if pv.OFF_SCREEN:
        return False
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress VTK's warnings about a missing display while it falls back to off-screen rendering."""
    before = pv.vtk_verbosity()
    pv.vtk_verbosity("off")
    try:
        yield
    finally:
        pv.vtk_verbosity(before)
