"""Plotters with the background and lights of this library, and writing of image files."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyvista as pv

from simplexmesh import _check
from simplexmesh._draft import draft

INK = "#1d2b36"
LIGHTS = [((-0.9, 0.8, 1.6), 0.8), ((1.4, 0.3, 0.9), 0.35), ((-0.2, -1.0, 1.0), 0.2)]  # key, fill, from below


def stage(columns: int = 1, size: tuple[int, int] | None = None) -> pv.Plotter:
    """Return an empty plotter with this library's background and lights.

    Examples
    --------
    >>> stage().close()
    """
    hidden = not has_display() or None
    width = size or ((1200, 900) if columns == 1 else (min(720 * columns, 2160), 720))
    with quiet():
        plotter = pv.Plotter(
            shape=(1, columns), border=False, off_screen=hidden, window_size=list(width), lighting="none"
        )
    for column in range(columns):
        plotter.subplot(0, column)
        plotter.set_background("#ffffff", top="#e9eef3")
        plotter.enable_anti_aliasing("ssaa" if hidden or pv.OFF_SCREEN else "fxaa")
    plotter.subplot(0, 0)
    for position, strength in LIGHTS:  # each goes to every panel
        plotter.add_light(pv.Light(position=position, intensity=strength, light_type="camera light"))
    return plotter


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
    _check.choice("the end of the picture's name", path.suffix.lower(), (".png", ".jpg", ".jpeg", ".tif"))
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
