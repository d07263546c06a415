"""A start for the motion from points: the dual of the surface of the body that they bound, on a coarse grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.errors import TopologyError
from simplexmesh.motion.initial.budget import cell_for
from simplexmesh.motion.initial.indicator import Indicator, areas, frame_for, solved
from simplexmesh.motion.initial.orientation import turned
from simplexmesh.motion.initial.planes import planes, spacing_of
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.initial.sound import sound_mesh
from simplexmesh.motion.initial.start import Start
from simplexmesh.motion.initial.topology import pieces, without_cavities, without_tunnels

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEWEST = 20
_MOST_POINTS = 60_000
_CELL = 0.8
_FINE = 128
_FINEST = 256
_NOT_A_BODY = 0.8


def start_from_points(
    cloud: PointCloud,
    vertices: int = 4000,
    *,
    components: str = "largest",
    tunnels: float = 0.0,
    normals: bool = True,
) -> Start:
    """Return a closed mesh near points that lie on the surface of a body, with or without normals, noisy or not.

    Without normals the outside is flooded on the finest grid that does not leak; that turns normals fitted to the
    neighbors of each point, and the indicator of the body they bound is solved until no more normals turn. Its
    surface is triangulated, brought to one triangle per wanted vertex, and its dual taken. The cells are as wide as
    the points are apart, thicker where noise makes the points a layer.

    Parameters
    ----------
    cloud : PointCloud
    vertices : int
        Wanted number, at least 20.
    components : {'largest', 'all'}
        All means all that are large enough for 20 of the vertices.
    tunnels : float
        Tunnels narrower than this length are sealed; 0 keeps them all.
    normals : bool
        Whether to trust the normals of the cloud, where it has any.

    Returns
    -------
    Start
        Mesh, report, and the indicator of inside and outside.

    Raises
    ------
    TopologyError
        The points bound no body at all: they lie in a plane, say.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> start = start_from_points(PointCloud(sphere(8).vertices), 400)
    >>> start.mesh.n_vertices, start.mesh.genus
    (400, 0)
    """
    vertices = _check.integer("vertices", vertices, FEWEST)
    _check.choice("components", components, ["largest", "all"])
    indicator = _indicator(cloud, vertices, trust=normals)
    openness = _openness(indicator)
    if openness > _NOT_A_BODY:
        raise TopologyError("points must bound a body for init='auto', these do not; give init='plane' or 'sphere'")
    cell = indicator.frame.cell
    field = np.pad(indicator.values, 1, constant_values=-0.5)
    smallest = FEWEST / vertices * np.count_nonzero(field > 0)
    solid, dropped = pieces(field > 0, components, smallest)
    solid, sealed = without_tunnels(without_cavities(solid), tunnels / (2 * cell))
    T_world_cell = np.diag([cell, cell, cell, 1.0])
    T_world_cell[:3, 3] = indicator.frame.to_world(np.full((1, 3), -1.0))[0]
    mesh, _ = sound_mesh(field, solid, T_world_cell, vertices)
    report = StartReport(indicator.frame.shape, cell, mesh.genus, mesh.n_components, sealed, dropped, openness)
    return Start(mesh, report, indicator)


def _indicator(cloud: PointCloud, vertices: int, *, trust: bool) -> Indicator:
    points, normals = cloud.points, cloud.normals if trust else None
    most = max(_MOST_POINTS, 2 * vertices)
    if len(points) > most:
        chosen = np.random.default_rng(0).choice(len(points), most, replace=False)
        points, normals = points[chosen], None if normals is None else normals[chosen]
    longest = float(np.ptp(points, axis=0).max())
    found = planes(points) if normals is None else None
    spacing = spacing_of(points) if found is None else found.spacing
    cells = longest / cell_for(len(points) * spacing**2, vertices)
    cell = max(_CELL * spacing, longest / np.clip(cells, _FINE, _FINEST))
    if found is not None or normals is None:
        return turned(points, found or planes(points), cell)
    frame = frame_for(points, cell)
    out = solved(points, normals, frame, areas(points, frame))
    return out if _border(out).mean() < 0 else Indicator(out.frame, -out.values)


def _border(indicator: Indicator) -> Array:
    values = indicator.values
    return np.concatenate([np.take(values, side, axis=axis).ravel() for axis in range(3) for side in (0, -1)])


def _openness(indicator: Indicator) -> float:
    """Return how uneven the field is far outside, in units of its jump: not at all for closed surfaces.

    Each hole in the data acts like a dipole: the field leaks out of it.
    """
    border, inside = _border(indicator), indicator.values[indicator.values > 0]
    if not len(inside):
        return float(np.inf)
    jump = float(np.median(inside) - np.median(border))
    low, high = np.quantile(border, [0.05, 0.95])
    return float((high - low) / jump) if jump > 0 else float(np.inf)
