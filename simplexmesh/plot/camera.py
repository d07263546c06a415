"""Camera placement: direction of view, and a scale at which everything fits between title and color scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh

UPS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
SIDES = {  # name: direction to the camera, up; the first letter points right, the second up
    "xy": ((0, 0, 1), (0, 1, 0)),
    "xz": ((0, -1, 0), (0, 0, 1)),
    "yz": ((1, 0, 0), (0, 0, 1)),
    "yx": ((0, 0, -1), (1, 0, 0)),
    "zx": ((0, 1, 0), (1, 0, 0)),
    "zy": ((-1, 0, 0), (0, 1, 0)),
}
CORNER = {"x": (0.6, 0.8, 1.0), "y": (0.7, 0.55, 1.0), "z": (0.7, -1.0, 0.55)}  # from the front, the right and above
UPS |= {f"-{name}": (-x, -y, -z) for name, (x, y, z) in UPS.items()}
CORNER |= {"-x": (-0.6, -0.8, 1.0), "-y": (-0.7, -0.55, 1.0), "-z": (-0.7, -1.0, -0.55)}  # the same fronts
TITLE, BAR, LEGEND = 0.08, 0.17, 0.2  # shares of the picture reserved for them
MARGIN = 0.03
TALL, WIDE = (600, 1080), (1200, 720)
"""Window sizes in pixels for bodies much taller than wide, and much wider than tall; interpolated in between."""
LEGEND_NAME = "legend entry"  # prefix of the names of a legend's actors
BAR_NAME = "entry below"  # the same for a legend at the bottom, in place of a color scale


def looked_at(
    plotter: pv.Plotter, view: str | Sequence[float] | None = None, *, up: str = "z", window: bool = False
) -> pv.Plotter:
    """Place the camera of every panel so that its contents fit between its title and its color scale.

    The projection is parallel. Panels whose contents overlap in space share one camera, and so one scale; otherwise
    each is fitted on its own.

    Parameters
    ----------
    plotter : pyvista.Plotter
        With all its contents.
    view : str or (3,) vector, optional
        ``"xy"``, ``"-xz"`` and the like, with the first axis to the right and the second up (the minus looks from the
        other side), or the direction from the object to the camera. By default from the front right and above.
    up : {"x", "y", "z", "-x", "-y", "-z"}
        The axis that points up, or down with a minus, unless `view` names two axes.
    window : bool
        Fit the proportions of the window of a single panel to the body.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> looked_at(sm.plot.surface(sm.sphere(4)), "xz").close()
    """
    toward, upward = _directions(view, up)
    right = np.cross(upward, toward)
    axes = np.stack([right, upward, toward])
    panels = list(plotter.renderers)
    boxes = [_extent(renderer, axes) for renderer in panels]
    shown = [box for box in boxes if box is not None]
    if not shown:
        return plotter
    low, high = np.max([box[0] for box in shown], axis=0), np.min([box[1] for box in shown], axis=0)
    shared = bool((low <= high).all())
    if shared:
        both = np.min([box[0] for box in shown], axis=0), np.max([box[1] for box in shown], axis=0)
        boxes = [both for _ in boxes]
    bands = np.max([_bands(renderer) for renderer in panels], axis=0)
    if window and len(panels) == 1 and not bands[2]:  # names at the left were placed in the window as it is
        plotter.window_size = _window(shown[0], bands)
    for box, renderer in zip(boxes, panels, strict=True):
        if box is not None:
            _place(renderer, box, axes, bands)
    if shared:
        plotter.link_views()
    return plotter


def upright(shown: Any, up: str = "auto") -> str:
    """Return the axis that points up: the given one, or for "auto" the default of the object."""
    if checks.choice("up", up, ("auto", *UPS)) != "auto":
        return up
    if isinstance(shown, Volume | SimplexMesh):
        return "z"
    _, deep, high = np.ptp(shown.bounds, axis=0)
    return "y" if deep > 1.1 * high > 0 else "z"


def _directions(view: str | Sequence[float] | None, up: str) -> tuple[Array, Array]:
    """Return orthogonal unit vectors, to the camera and upward in the picture."""
    checks.choice("up", up, tuple(UPS))
    sides: tuple[Any, Any]
    if view is None:
        sides = CORNER[up], UPS[up]
    elif isinstance(view, str):
        name = checks.choice("view", view.removeprefix("-"), tuple(SIDES))
        sides = SIDES[name]
        if view.startswith("-"):
            sides = tuple(-x for x in sides[0]), sides[1]
    else:
        sides = checks.array("view", view, (3,)), UPS[up]
    toward, upward = (np.asarray(side, dtype=float) for side in sides)
    if not np.linalg.norm(toward):
        raise ValueError("view must not be the zero vector")
    toward = toward / np.linalg.norm(toward)
    upward = upward - (upward @ toward) * toward
    if np.linalg.norm(upward) < 1e-6:  # looking along the up axis
        upward = np.roll(toward, 1) - (np.roll(toward, 1) @ toward) * toward
    return toward, upward / np.linalg.norm(upward)


def _extent(renderer: Any, axes: Array) -> tuple[Array, Array] | None:
    """Return the bounds of the contents of a panel along the given axes."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for actor in renderer.actors.values():
        mapper = getattr(actor, "mapper", None)
        if mapper is not None:
            mapper.Update()  # a pending filter for normals may change the points
        points = getattr(getattr(mapper, "dataset", None), "points", None)
        if points is not None and len(points):
            along = np.asarray(points, dtype=float) @ axes.T
            low, high = np.minimum(low, along.min(axis=0)), np.maximum(high, along.max(axis=0))
    return (low, high) if np.isfinite(low).all() else None


def _bands(renderer: Any) -> tuple[float, float, float]:
    """Return the shares of a panel reserved above, below and on the left."""
    kinds = [actor.GetClassName() for actor in renderer.GetViewProps()]
    legend, below = (any(str(name).startswith(kind) for name in renderer.actors) for kind in (LEGEND_NAME, BAR_NAME))
    return (
        TITLE if any("CornerAnnotation" in kind for kind in kinds) else 0.0,
        BAR if below or any("ScalarBar" in kind for kind in kinds) else 0.0,
        LEGEND if legend else 0.0,
    )


def _window(box: tuple[Array, Array], bands: Array) -> list[int]:
    """Return the width and height in pixels of the window for a box."""
    (width, height, _), (top, bottom, left) = box[1] - box[0], bands
    asked = width / (1 - left - 2 * MARGIN), height / (1 - top - bottom - 2 * MARGIN)
    wide, tall = np.log(WIDE[0] / WIDE[1]), np.log(TALL[0] / TALL[1])
    least = 1e-12 * max(asked) or 1.0
    share = (np.clip(np.log(max(asked[0], least) / max(asked[1], least)), tall, wide) - tall) / (wide - tall)
    return [int(10 * round(0.1 * (a + share * (b - a)))) for a, b in zip(TALL, WIDE, strict=True)]


def _aspect(renderer: Any) -> float:
    """Return the width of a panel over its height."""
    x0, y0, x1, y1 = renderer.GetViewport()
    width, height = renderer.parent.window_size
    return float(width * (x1 - x0) / (height * (y1 - y0)))


def _place(renderer: Any, box: tuple[Array, Array], axes: Array, bands: Array) -> None:
    """Put a panel's camera in front of the center of a box, where it fits between the reserved bands."""
    aspect = _aspect(renderer)
    (width, height, _), (top, bottom, left) = box[1] - box[0], bands
    least = 1e-9 + 1e-9 * float(np.abs(box).max())
    wide, tall = width / (aspect * (1 - left - 2 * MARGIN)), height / (1 - top - bottom - 2 * MARGIN)
    scale = max(0.5 * wide, 0.5 * tall, least)  # half the height of the picture in the unit of length
    middle = 0.5 * (box[0] + box[1]) - np.array([left * scale * aspect, (bottom - top) * scale, 0.0])
    away = 2.0 * float(np.linalg.norm(box[1] - box[0])) + scale
    camera = renderer.camera
    camera.enable_parallel_projection()
    camera.focal_point = middle @ axes
    camera.position = (middle + np.array([0.0, 0.0, away])) @ axes
    camera.up = axes[1]
    camera.parallel_scale = scale
    renderer.camera_set = True
    renderer.ResetCameraClippingRange()
