"""Plots of spherical attribute images: one, and how similar two are over all rotations or translations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from scipy.spatial.transform import Rotation

from simplexmesh._base.arrays import Array
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot.camera import looked_at
from simplexmesh.plot.color_scale import scale
from simplexmesh.plot.polydata import per_point
from simplexmesh.plot.scalars import SIGNED
from simplexmesh.plot.stage import headline, stage
from simplexmesh.plot.surface import surface
from simplexmesh.recognition.sai.attribute_image import SAI
from simplexmesh.recognition.sai.distance_maps import NODES, around_rotation, over_patch, over_sphere, rotation_plane
from simplexmesh.recognition.sai.match import check_comparable, match
from simplexmesh.recognition.sai.match_result import Match
from simplexmesh.recognition.sai.sphere_domain import sphere_domain

NAME = "distance of the angles (rad)"
HIGH = 0.6
"""Height where the distance is zero, in radii."""

FRONT = np.array([0.98, -0.25, 0.8])
"""Direction of the pole under the first hypothesis, chosen so that its peak is seen from the side."""

LIT = {"ambient": 0.45, "diffuse": 0.55, "specular": 0.05}

RINGS, SPOKES = 30, 90
SHOWN = 3
COLORS = ("#d1495b", "#edae49", "#f2f2f2")


def signature(
    sai: SAI,
    *,
    fitted: bool = False,
    view: str | Sequence[float] | None = None,
    up: str = "z",
    title: str | None = None,
    limits: tuple[float, float] | None = None,
) -> pv.Plotter:
    """Plot a signature: each vertex of the sphere at radius pi + phi, colored by phi; hidden ones gray, at radius pi.

    On a torus, a cylinder or a disc, scaled by pi, vertices are displaced by phi along the normal.

    Parameters
    ----------
    sai : SAI
        As returned by `simplexmesh.sai`.
    fitted : bool
        Also show the mesh fitted to the object, on the left, scaled to the sphere and in the same colors.
    view, up, title, limits
        As for `surface`; limits in radians.

    References
    ----------
    H. Delingette, thesis, 1994, section 6.2.2.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> plotter = signature(sm.sai(sm.ellipsoid((3, 2, 1), 12), frequency=5))
    >>> plotter.close()
    """
    if not isinstance(sai, SAI):
        raise TypeError(f"sai must be an SAI, as returned by simplexmesh.sai, not {type(sai).__name__}")
    values = np.where(sai.hidden, np.nan, sai.angles)
    plotter = stage(columns=2 if fitted else 1)
    model = sai._domain.mesh
    outward = model.vertices if sai.topology == "sphere" else model.normals
    images = [model.moved(np.pi * model.vertices + np.where(sai.hidden, 0.0, sai.angles)[:, None] * outward)]
    if fitted:
        at = sai.mesh.vertices - 0.5 * (sai.mesh.vertices.min(axis=0) + sai.mesh.vertices.max(axis=0))
        size = 1.1 * np.pi * np.linalg.norm(model.vertices, axis=1).max()
        images.insert(0, sai.mesh.moved(at * (size / np.linalg.norm(at, axis=1).max())))
    for column, mesh in enumerate(images):
        plotter.subplot(0, column)
        headed = title if column == 0 else None
        surface(mesh.with_data(**{SIGNED: values}), scalars=SIGNED, limits=limits, plotter=plotter, title=headed)
    return looked_at(plotter, view, up=up)


def landscape(
    source: SAI,
    target: SAI,
    *,
    found: Sequence[Match] | None = None,
    view: str | Sequence[float] | None = None,
    title: str | None = None,
) -> pv.Plotter:
    """Plot how the distance of two signatures depends on the rotation between them.

    The smaller the distance, the higher and brighter the plot. Left, at each point of the sphere: the least distance
    over all rotations that take a pole of the source there. Right: rotations relative to the best one, in the plane of
    rotation vectors through the second and third hypothesis, up to half a turn at the edge. Balls mark the hypotheses,
    red the first. A single peak means that the match is unambiguous, several equal ones that the object is symmetric.
    For signatures on a torus, a cylinder or a disc: the distance under each translation.

    Parameters
    ----------
    source, target : SAI
        As for `simplexmesh.match`.
    found : sequence of Match, optional
        As returned by `simplexmesh.match`; computed if not given.
    view, title
        As for `surface`.

    Raises
    ------
    ValueError, TypeError
        No hypothesis; signatures of two frequencies or topologies.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> one = sm.sai(sm.ellipsoid((3, 2, 1), 12), frequency=5)
    >>> landscape(one, one).close()
    """
    check_comparable(source, target)
    sai_a, sai_b = target, source
    hypotheses = list(match(source, target) if found is None else found)
    if not hypotheses:
        raise ValueError("found must hold at least one hypothesis, not none")
    if sai_a.topology != "sphere":
        values, model, plotter = over_patch(sai_a, sai_b), sai_a._domain.mesh, stage()
        _on_mesh(plotter, model, 0.5 * model.normals, values, (0.0, float(values.max())))
        headline(plotter, title)
        return looked_at(plotter, view)
    shown, axes = hypotheses[:SHOWN], rotation_plane(hypotheses)
    pole = shown[0].rotation.T @ (FRONT / np.linalg.norm(FRONT))
    values = over_sphere(sai_a, sai_b, pole)
    ground, disc = sphere_domain(NODES).mesh, pv.Disc(inner=0.0, outer=1.0, r_res=RINGS, c_res=SPOKES)
    tops = [one.rotation @ pole for one in shown]
    at = [int(np.argmax(ground.vertices @ top)) for top in tops]
    values[at] = np.minimum(values[at], [one.distance for one in shown])
    slices = around_rotation(sai_a, sai_b, shown[0].rotation, np.pi * disc.points[:, :2].astype(float) @ axes)
    limits = (0.0, float(max(values.max(), np.nanmax(slices))))
    plotter = stage(columns=2)
    _on_mesh(plotter, ground, ground.vertices, values, limits)
    headline(plotter, title or "image of a pole of the source")
    for color, top, vertex in zip(COLORS, tops, at, strict=False):
        _mark(plotter, top * (1.03 + _height(values[vertex], limits)), color)
    plotter.subplot(0, 1)
    slices = np.nan_to_num(slices, nan=limits[1])
    disc.points[:, 2] = _height(slices, limits)
    _draw(plotter, disc, slices, limits)
    headline(plotter, "rotations relative to the best")
    for color, one in zip(COLORS, shown, strict=False):
        off = axes @ Rotation.from_matrix(one.rotation @ shown[0].rotation.T).as_rotvec() / np.pi
        _mark(plotter, np.array([*off, 0.03 + _height(one.distance, limits)]), color)
    return looked_at(plotter, view)


def _on_mesh(
    plotter: pv.Plotter, mesh: SimplexMesh, outward: Array, values: Array, limits: tuple[float, float]
) -> None:
    """Draw a height field on a mesh."""
    fan = mesh.moved(mesh.vertices + _height(values, limits)[:, None] * outward).triangulated(method="fan")
    polydata = pv.PolyData.from_regular_faces(np.asarray(fan.vertices), np.asarray(fan.faces))
    _draw(plotter, polydata, per_point(mesh, values), limits)


def _draw(plotter: pv.Plotter, polydata: pv.PolyData, values: Array, limits: tuple[float, float]) -> None:
    """Draw a height field with values at its points, without the normals of the flat disc."""
    polydata.clear_data()
    polydata["scalars"] = values
    style = scale(values, NAME, diverging=False, limits=limits) | {"cmap": "viridis_r"}
    plotter.add_mesh(polydata, smooth_shading=True, **LIT, **style)


def _height(values: Any, limits: tuple[float, float]) -> Any:
    """Return heights, which decrease with the distance."""
    return HIGH * (1 - np.asarray(values) / max(limits[1], 1e-12))


def _mark(plotter: pv.Plotter, at: Array, color: str) -> None:
    ball = pv.Sphere(radius=0.045, center=at)
    plotter.add_mesh(ball, color=color, smooth_shading=True, ambient=0.4, diffuse=0.7, specular=0.3)
