"""Plotters with the background and lights of this library, and writing of image files."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from html import escape
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pyvista as pv
from pyvista.plotting.text import CornerAnnotation, Text
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from simplexmesh._base import checks
from simplexmesh._base.drafts import draft

INK = "#1d2b36"
LIGHTS = [((-0.9, 0.8, 1.6), 0.8), ((1.4, 0.3, 0.9), 0.35), ((-0.2, -1.0, 1.0), 0.2)]  # key, fill, from below
SURFACE_LIT = {"ambient": 0.25, "diffuse": 0.85, "specular": 0.08, "specular_power": 25}
COLORS_LIT = {"ambient": 0.72, "diffuse": 0.22, "specular": 0.0}  # nearly flat, to keep the colors of the scale
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".html")
UPPER_EDGE = 7  # where VTK writes titles
BESIDE_BAR = 1.2  # vtk.js puts the color scale at the right, where nothing is reserved for it
SCREEN = 0.85  # share of the screen that a window takes at most, along either side


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
    """Return an empty plotter of panels, size in pixels, with lights; without `window` it draws off screen only."""
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


def behind(actor: Any, steps: float) -> None:
    """Draw a surface as if it were farther away by some steps of depth, so that lines in it, or under it, are seen."""
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, steps)
    # The mode is global in VTK. With its default offset for points, half of those drawn as spheres would be hidden.
    actor.mapper.SetResolveCoincidentTopologyPointOffsetParameter(0.0)


def picture(path: str | Path, plotter: pv.Plotter, *, close: bool = True) -> Path:
    """Write the picture of a plotter to a file, completely or not at all.

    Parameters
    ----------
    path : str or Path
        File name, .png, .jpg or .tif, or .html for a page on which the scene can be turned, in any browser, also
        without a network (``pip install 'simplexmesh[notebook]'``); the folder must exist.
    plotter : pyvista.Plotter
        As returned by the other functions.
    close : bool
        Close the plotter afterwards.

    Raises
    ------
    ValueError
        Another suffix.
    TypeError
        The path is no path, or the plotter no plotter (arguments swapped).
    OSError
        The folder does not exist or cannot be written to.
    ImportError
        A page, and the extra `notebook` is not installed.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from tempfile import gettempdir
    >>> picture(Path(gettempdir(), "ball.png"), sm.plot.surface(sm.sphere(4))).name
    'ball.png'
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a file name, followed by the plotter, not {type(path).__name__}")
    path = Path(path)
    checks.choice("the end of the picture's name", path.suffix.lower(), PICTURES)
    with draft(path) as part:
        if not hasattr(plotter, "screenshot"):
            raise TypeError(f"plotter must be a pyvista.Plotter, not {checks.type_name(plotter)}")
        try:
            with quiet():
                if path.suffix.lower() == ".html":
                    part.write_text(_page(plotter), encoding="utf-8")
                else:
                    plotter.screenshot(str(part))
        finally:
            if close:
                plotter.close()
    return path


def _page(plotter: pv.Plotter) -> str:
    """Return a page that shows the scene, with its texts, which vtk.js does not draw, over it."""
    try:
        from trame_vtk.modules.vtk import serializers
        from trame_vtk.tools.vtksz2html import write_html
    except ImportError as error:
        raise ImportError("a page needs trame-vtk: pip install 'simplexmesh[notebook]'") from error
    serializers.initialize_serializers()
    context, window = serializers.SynchronizationContext(), plotter.render_window
    window.Render()  # places the lights
    scene = serializers.serialize(None, window, serializers.reference_id(window), context, 0)
    cameras = [renderer.camera for renderer in plotter.renderers]
    room = BESIDE_BAR if len(plotter.scalar_bars) else 1.0
    for part in (part for renderer in scene["dependencies"] for part in renderer["dependencies"]):
        for camera in cameras:
            if part["id"] == serializers.reference_id(camera):
                part["properties"] |= {
                    "parallelProjection": bool(camera.parallel_projection),
                    "parallelScale": room * camera.parallel_scale,
                }
    scene["extra"] = {"camera": serializers.reference_id(cameras[0]), "centerOfRotation": cameras[0].focal_point}
    arrays = {
        one["hash"]: one | {"content": context.get_cached_data_array(one["hash"], binary=False)}
        for one in serializers.extract_array_hash(scene)
    }
    packed, page = BytesIO(), StringIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        archive.writestr("index.json", json.dumps({"hashes": arrays, "scene": scene}))
    write_html(packed.getvalue(), page)
    over = f'<div class="content" style="position:fixed;inset:0"></div>{_texts(plotter)}</body>'
    return re.sub("<title>.*?</title>", "<title>simplexmesh</title>", page.getvalue(), count=1).replace("</body>", over)


def _texts(plotter: pv.Plotter) -> str:
    """Return the titles and legends of a plotter as HTML."""
    found = []
    for renderer in plotter.renderers:
        left, low, right, top = renderer.GetViewport()
        for actor in renderer.actors.values():
            if isinstance(actor, CornerAnnotation):  # a title
                x, y, text, size, shift = 0.5, 0.97, actor.GetText(UPPER_EDGE), 12.0, "translate(-50%,50%)"
            elif isinstance(actor, Text):
                (x, y), text, size, shift = actor.position, actor.input, 0.8 * actor.prop.font_size, "none"
            else:
                continue
            place = f"left:{100 * (left + x * (right - left)):.1f}%;bottom:{100 * (low + y * (top - low)):.1f}%"
            letters = f"font:{size:.0f}pt sans-serif;color:{pv.Color(actor.prop.color).hex_rgb}"
            style = f"position:fixed;z-index:9;pointer-events:none;{place};transform:{shift};{letters}"
            found.append(f'<div style="{style}">{escape(text)}</div>')
    return "".join(found)


def has_display() -> bool:
    """Whether a window can be opened here.

    Examples
    --------
    >>> has_display() in (True, False)
    True
    """
    return not pv.OFF_SCREEN and (not sys.platform.startswith("linux") or _answers(os.environ.get("DISPLAY", "")))


@cache
def _answers(display: str) -> bool:
    """Whether there is an X server at the address in the environment; without one VTK draws off screen only."""
    with quiet():
        return bool(display) and bool(vtkRenderWindow().IsA("vtkXOpenGLRenderWindow"))


def fit_screen(plotter: pv.Plotter) -> None:
    """Scale the window of a plotter, in proportion, to the screen it will be on."""
    size, screen = np.array(plotter.window_size), np.array(plotter.render_window.GetScreenSize())
    if screen.all():  # else the display tells no size
        plotter.window_size = (size * (SCREEN * screen / size).min()).astype(int).tolist()


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress VTK's warnings about a missing display while it falls back to off-screen rendering."""
    before = pv.vtk_verbosity()
    pv.vtk_verbosity("off")
    try:
        yield
    finally:
        pv.vtk_verbosity(before)
