"""Plot of the sharp edges and zones of a surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.plot.camera import looked_at, upright
from simplexmesh.plot.polydata import colored
from simplexmesh.plot.stage import COLORS_LIT, INK, add, behind, headline, stage
from simplexmesh.surface.features.exporting import polylines
from simplexmesh.surface.features.feature_lines import prepared
from simplexmesh.surface.features.lines.network import FeatureNetwork
from simplexmesh.surface.features.zones import zones as zones_of
from simplexmesh.surface.features.zoning.result import Zones

PALE = (
    *("#b5d2ee", "#f8d9a8", "#bfe0b6", "#f2bfb7", "#d3c5ec", "#abdfdb", "#f3e9ae", "#f6cbdf", "#ddcebd", "#cdd6dc"),
    *("#93b7db", "#e3bc80"),
)
"""Colors of zones, light enough for dark lines."""

SHARP, SMOOTH, NODE = 0.0022, 0.0014, 0.005
"""Radii of lines of kind "C0" and of others, and of nodes, in diagonals of the surface."""

DEEPEST = 0.01
"""In diagonals: lines are seen through walls thinner than this."""

DEPTHS = 65_000
"""Steps of VTK's offsets from the nearest to the farthest point."""


def features(
    surface: Any,
    network: FeatureNetwork | None = None,
    zones: Zones | None = None,
    *,
    title: str | None = None,
    view: str | Sequence[float] | None = None,
    up: str = "auto",
    plotter: pv.Plotter | None = None,
) -> pv.Plotter:
    """Plot the zones of a surface, neighbors in different colors, its sharp edges as dark lines, and their nodes.

    Where two zones meet without a sharp edge the line between them is thinner.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh or anything convertible to triangles
        The surface.
    network : FeatureNetwork, optional
        Its sharp edges. Default: those of `zones`, or what `feature_lines` finds.
    zones : Zones, optional
        Its zones. Default: those between the sharp edges.
    title, view, up, plotter
        As for `plot.surface`.

    Raises
    ------
    ValueError, TypeError
        A network or zones of another surface; not a surface of triangles.
    TopologyError
        When an edge has more than two triangles, or the surface is one-sided.

    Examples
    --------
    >>> import pyvista as pv, simplexmesh as sm
    >>> cube = sm.divided(pv.Cube().triangulate().clean(), 0.1)
    >>> features(cube, sm.feature_lines(cube)).close()
    """
    if zones is None:
        zones = zones_of(surface, network)
    elif not np.array_equal(prepared(surface).faces, checks.instance("zones", zones, Zones).mesh.faces):
        raise ValueError("zones must be those of this surface: its triangles are others")
    network = zones.network if network is None else checks.instance("network", network, FeatureNetwork)
    alone, plotter = plotter is None, stage() if plotter is None else plotter
    shown = zones.mesh
    behind(add(plotter, _painted(zones), COLORS_LIT, scalars="zones", rgb=True), _depth(network) * DEPTHS)
    smooth = [line for line, _ in zones.boundaries if line.kind != "C0"]
    for lines, radius in ((network.lines, SHARP), (smooth, SMOOTH)):
        if lines:
            tubes = polylines(lines).tube(radius=radius * shown.diagonal, n_sides=12, capping=True)
            plotter.add_mesh(tubes, color=INK, specular=0.2)
    if len(network.nodes):
        ball = pv.Sphere(radius=NODE * shown.diagonal, theta_resolution=16, phi_resolution=16)
        plotter.add_mesh(pv.PolyData(network.nodes).glyph(geom=ball, scale=False, orient=False), color=INK)
    headline(plotter, title)
    return looked_at(plotter, view, up=upright(shown, up), window=True) if alone else plotter


def _depth(network: FeatureNetwork) -> float:
    """Return how far the lines run from the vertices that they follow, in diagonals of the surface."""
    mesh = network.mesh
    off = [np.linalg.norm(line.points - mesh.vertices[line.vertices], axis=1) for line in network.lines]
    return min(float(np.quantile(np.concatenate(off), 0.9)) / mesh.diagonal, DEEPEST) if off else 0.0


def _painted(zones: Zones) -> pv.PolyData:
    """Return the surface in the colors of its zones, its vertices split between zones, so that no shade crosses."""
    faces, labels, count = zones.mesh.faces.astype(np.int64), zones.labels, len(zones)
    used, corners = np.unique(faces * count + labels[:, None], return_inverse=True)
    split = TriangleMesh(zones.mesh.vertices[used // count], corners.reshape(-1, 3))
    table = np.array([pv.Color(color).float_rgb for color in PALE])
    return colored(split, "zones", table[colors(zones)[used % count]])


def colors(zones: Zones) -> Indices:
    """Return the number of a color (z,) for each zone: another than its neighbors have, and one used little so far."""
    pairs = np.array([pair for _, pair in zones.boundaries], np.int64).reshape(-1, 2)
    out, uses = np.full(len(zones), -1), np.zeros(len(PALE))
    for k in range(len(zones)):
        beside = np.concatenate([pairs[pairs[:, 0] == k, 1], pairs[pairs[:, 1] == k, 0]])
        taken = np.bincount(out[beside][out[beside] >= 0], minlength=len(PALE))
        out[k] = np.lexsort((uses, taken))[0]
        uses[out[k]] += 1
    return out
