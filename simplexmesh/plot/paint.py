"""Numbers on a surface in the colors of hot metal, classes in colors of their own, points marked."""

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
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot import skin
from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.scale import bar
from simplexmesh.plot.scenes import COLORS_LIT, PALETTE, entry, upright
from simplexmesh.plot.stage import INK, stage

Array = NDArray[np.float64]

HOT_METAL = ("#2a3fd0", "#28c4e8", "#3fbf4d", "#f4e04a", "#d7281e")
"""From low to high: blue, cyan, green, yellow, red."""

FAILED = "#7d7d7d"
"""Of vertices without a value: gray, which is not on the scale."""

SHOWN = 95.0
"""Percent of the surface whose values are within the scale, where no limits are given."""

SMOOTH = 60.0
"""Degrees; scans are drawn smooth, and with an edge only where triangles meet at more."""

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
    marks: ArrayLike | None = None,
    lines: Sequence[Any] = (),
    title: str | None = None,
    view: str | Sequence[float] | None = None,
    up: str = "auto",
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Show numbers on a surface in the colors of hot metal: blue, cyan, green, yellow, red.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud or anything convertible to these
        What carries the numbers.
    values : (n,) array of float
        One for each vertex or point; NaN, where there is none, is gray.
    name : str
        What the numbers are, and their unit, for the scale.
    limits : (2,) tuple of float, optional
        Ends of the scale. By default 95 % of the area is within: numbers of both signs have zero in the middle,
        others begin at zero or at their 5th percentile, whichever spreads them more.
    marks : (m, 3) array of float or SalientPoints, optional
        Points to mark with balls, the first ones larger.
    lines : sequence of Polyline or of (k, 3) arrays of float
        Lines to draw, as `level_lines` and `inversion_lines` find them.
    title : str, optional
        Text over the picture.
    view : str or (3,) vector, optional
        As for `looked_at`, when the plotter is new.
    up : {"auto", "x", "y", "z"}
        As for `surface`.
    plotter : pyvista.Plotter, optional
        Where to add; a new one when not given.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ValueError, TypeError
        Values of another length than the vertices, limits that do not rise, not a surface.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(24, 12).triangulated("dual")
    >>> heat(ring, sm.curvature(ring, "sine").mean, name="mean curvature (1/mm)").close()
    """
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = _shown(surface)
    numbers = _values(values, shown)
    low, high = _limits(numbers, limits, _areas(shown))
    coat = colored(shown, "heat", np.clip(numbers, low, high))
    _draw(
        plotter, coat, scalars="heat", cmap=hot_metal(low, high), clim=(low, high), scalar_bar_args=bar(name),
    )  # fmt: skip
    if marks is not None:
        mark(plotter, getattr(marks, "points", marks), size=_diagonal(shown))
    for line in lines:
        trace(plotter, line, size=_diagonal(shown))
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return looked_at(plotter, view, up=upright(shown, up)) if alone else plotter


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
    """Show classes of vertices, each in its color, with a legend of those there are.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud or anything convertible to these
        What is divided.
    labels : HKClasses, Regions or (n,) array of int
        The class of each vertex, at least 0.
    names, colors : sequence of str, optional
        By class number; those of the classes given, or numbers and colors in turn.
    title, view, up, plotter
        As for `heat`.
    legend : bool
        Whether names are written.

    Returns
    -------
    pyvista.Plotter

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.torus(24, 12).triangulated("dual")
    >>> classes(ring, sm.hk_classes(ring, curvature=sm.curvature(ring, "sine"))).close()
    """
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = _shown(surface)
    names = getattr(labels, "names", None) if names is None else names
    colors = getattr(labels, "colors", None) if colors is None else colors
    numbers = np.asarray(getattr(labels, "labels", labels))
    if numbers.shape != (_count(shown),) or numbers.dtype.kind not in "iu" or numbers.min(initial=0) < 0:
        raise ValueError(
            f"labels must be ({_count(shown)},) class numbers of at least 0, not {numbers.dtype} of {numbers.shape}"
        )
    palette = list(colors) if colors is not None else [PALETTE[k % len(PALETTE)] for k in range(numbers.max() + 1)]
    table = np.array([pv.Color(color).float_rgb for color in palette])
    coat = (
        cells(shown, table[numbers]) if isinstance(shown, TriangleMesh) else colored(shown, "classes", table[numbers])
    )
    _draw(plotter, coat, scalars="classes", rgb=True)
    if legend and names is not None:
        for place, k in enumerate(np.unique(numbers)):
            entry(plotter, place, str(names[k]), palette[k])
    if title:
        plotter.add_text(title, position="upper_edge", font_size=11, color=INK)
    return looked_at(plotter, view, up=upright(shown, up)) if alone else plotter


def hot_metal(low: float, high: float) -> pv.LookupTable:
    """Return the color table between two numbers; what is beyond has the color of the end, NaN that of failures.

    Examples
    --------
    >>> [hot_metal(0.0, 1.0).map_value(x)[0] for x in (0.0, 1.0)]
    [0.16470588235294117, 0.8431372549019608]
    """
    stops = np.array([pv.Color(color).int_rgba for color in HOT_METAL], dtype=float)
    at = np.linspace(0, len(stops) - 1, 256)
    table = pv.LookupTable()
    table.values = (
        np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(4)], axis=1).round().astype(np.uint8)
    )
    table.scalar_range = (low, high)
    table.nan_color = FAILED
    return table


def mark(plotter: pv.Plotter, points: ArrayLike, *, size: float, color: str = INK) -> None:
    """Add a ball at each point, the first ones larger; `size` is the diagonal of what they lie on."""
    at = _check.array("marks", points, (None, 3))
    for place, point in enumerate(at):
        radius = size * MARK * (1.0 if place < 5 else 0.7)
        plotter.add_mesh(
            pv.Sphere(radius=radius, center=point, theta_resolution=20, phi_resolution=20), color=color, specular=0.4
        )


def trace(plotter: pv.Plotter, line: Any, *, size: float, color: str = INK) -> None:
    """Add a line as a tube; `size` is the diagonal of what it lies on."""
    at = _check.array("lines", getattr(line, "points", line), (None, 3))
    if len(at) < 2:
        return
    drawn = pv.lines_from_points(np.asarray(at), close=getattr(line, "closed", False))
    plotter.add_mesh(drawn.strip().tube(radius=THIN * size), color=color, specular=0.2)


def colored(shown: Any, name: str, values: Array) -> pv.PolyData:
    """Return what is drawn of a thing, with numbers or colors at its points."""
    if isinstance(shown, SimplexMesh):
        coat, _ = skin.geometry(shown, None, None)
        coat[name] = skin.per_point(shown, values)
        return coat
    if isinstance(shown, PointCloud):
        coat, _ = skin.geometry(PointCloud(shown.points[: skin.MOST_POINTS], _first(shown.normals)), None, None)
        coat[name] = np.repeat(values[: skin.MOST_POINTS], coat.n_points // min(len(values), skin.MOST_POINTS), axis=0)
        return coat
    coat = pv.PolyData.from_regular_faces(np.asarray(shown.vertices), np.asarray(shown.faces))
    coat[name] = values
    return coat.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=SMOOTH, consistent_normals=False,
        auto_orient_normals=False,
    )  # fmt: skip


def cells(shown: TriangleMesh, colors: Array) -> pv.PolyData:
    """Return a surface cut into what is nearest to each vertex, in its color: nothing blends where classes meet."""
    normals, faces = shown.vertex_normals, shown.faces
    a, b, c = faces, np.roll(faces, -1, axis=1), np.roll(faces, 1, axis=1)

    def corners(values: Array) -> Array:
        middle = values[faces].mean(axis=1, keepdims=True) + np.zeros((1, 3, 1))
        parts = values[a], 0.5 * (values[a] + values[b]), middle, 0.5 * (values[a] + values[c])
        return np.stack(parts, axis=2).reshape(-1, 3)

    points = corners(shown.vertices)
    coat = pv.PolyData.from_regular_faces(points, np.arange(len(points)).reshape(-1, 4))
    coat["classes"] = np.repeat(colors[faces].reshape(-1, 3), 4, axis=0)
    coat.point_data["Normals"] = corners(normals)
    coat.point_data.active_normals_name = "Normals"
    return coat


def _first(normals: Array | None) -> Array | None:
    return None if normals is None else normals[: skin.MOST_POINTS]


def _draw(plotter: pv.Plotter, coat: pv.PolyData, **style: Any) -> None:
    if coat.n_points == coat.n_cells:
        plotter.add_mesh(coat, point_size=6, render_points_as_spheres=True, **style)
    else:
        plotter.add_mesh(coat, smooth_shading=True, **COLORS_LIT, **style)


def _shown(surface: Any) -> Any:
    """Return the thing to be drawn; a mesh of the caller's stays as it is, with all its vertices."""
    if isinstance(surface, tuple | list) and len(surface) == 2:
        surface = TriangleMesh(surface[0], surface[1])
    shown = surface if isinstance(surface, PointCloud) else skin.thing(surface)
    if isinstance(shown, Volume | Mapping):
        raise TypeError(f"surface must be a mesh or points, not {type(shown).__name__}")
    return shown


def _count(shown: Any) -> int:
    return len(shown.points if isinstance(shown, PointCloud) else shown.vertices)


def _diagonal(shown: Any) -> float:
    return float(np.linalg.norm(np.ptp(shown.points if isinstance(shown, PointCloud) else shown.vertices, axis=0)))


def _values(values: ArrayLike, shown: Any) -> Array:
    out = np.asarray(values, dtype=float)
    if out.shape != (_count(shown),):
        raise ValueError(f"values must have shape ({_count(shown)},), not {out.shape}")
    return out


def _areas(shown: Any) -> Array:
    """Return how much of what is seen belongs to each vertex or point."""
    if not isinstance(shown, TriangleMesh):
        return np.ones(_count(shown))
    double = np.linalg.norm(shown.face_vectors, axis=1)
    return np.bincount(shown.faces.ravel(), np.repeat(double, 3), _count(shown)).astype(float)


def _percentiles(values: Array, weights: Array, percents: Sequence[float]) -> list[float]:
    """Return the values below which so many percent of the weight are."""
    order = np.argsort(values)
    mass = np.cumsum(weights[order])
    if not mass[-1] > 0:
        mass = np.arange(1.0, len(values) + 1)
    places = np.searchsorted(mass, np.asarray(percents) / 100 * mass[-1])
    return [float(x) for x in values[order][np.minimum(places, len(values) - 1)]]


def _limits(values: Array, limits: tuple[float, float] | None, areas: Array) -> tuple[float, float]:
    """Return the ends of the scale."""
    if limits is not None:
        low, high = (_check.number("limits", each) for each in limits)
        if not low < high:
            raise ValueError(f"limits must rise, not go from {low:g} to {high:g}")
        return low, high
    there = np.isfinite(values)
    known, seen = values[there], areas[there]
    if not len(known):
        return 0.0, 1.0
    low, high = _percentiles(known, seen, [100 - SHOWN, SHOWN])
    if low < 0 < high:
        (most,) = _percentiles(np.abs(known), seen, [SHOWN])
        low, high = -most, most
    elif 0 <= low < 0.5 * high:
        low = 0.0
    return (low, high) if low < high else (low - 0.5, low + 0.5)
