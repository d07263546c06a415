"""Initial mesh from points: the dual of a coarse Poisson reconstruction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.errors import TopologyError
from simplexmesh.motion.initial.budget import cell_size
from simplexmesh.motion.initial.indicator import Indicator, grid_for, point_areas, poisson_indicator
from simplexmesh.motion.initial.orientation import oriented_indicator
from simplexmesh.motion.initial.planes import planes, spacing_of
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.initial.solid_mesh import solid_mesh
from simplexmesh.motion.initial.start import Start
from simplexmesh.motion.initial.topology import pieces, without_cavities, without_tunnels

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MIN_VERTICES = 20
_MAX_POINTS = 60_000
_CELL_PER_SPACING = 0.8
_MIN_CELLS = 128
_MAX_CELLS = 256
_MAX_OPENNESS = 0.8


def start_from_points(
    cloud: PointCloud,
    vertices: int = 4000,
    *,
    components: str = "largest",
    tunnels: float = 0.0,
    normals: bool = True,
) -> Start:
    """Return a closed mesh near points sampled from the surface of a solid, with or without normals, noisy or not.

    Without normals, those of local plane fits are oriented by a flood fill of the outside, on the finest grid that does
    not leak, and by iterated Poisson reconstruction. The isosurface of the resulting indicator function is decimated to
    one triangle per wanted vertex and dualized. The cells are about as wide as the point spacing, wider with noise.

    Parameters
    ----------
    cloud : PointCloud
    vertices : int
        Number of vertices, at least 20.
    components : {'largest', 'all'}
        'all' keeps every component large enough for 20 of the vertices.
    tunnels : float
        Tunnels narrower than this length are sealed; 0 keeps all.
    normals : bool
        Whether to use the normals of the cloud, if it has any.

    Returns
    -------
    Start
        Mesh, report and indicator function.

    Raises
    ------
    TopologyError
        The points do not bound a solid: they lie in a plane, for example.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> start = start_from_points(PointCloud(sphere(8).vertices), 400)
    >>> start.mesh.n_vertices, start.mesh.genus
    (400, 0)
    """
    vertices = _check.integer("vertices", vertices, MIN_VERTICES)
    _check.choice("components", components, ["largest", "all"])
    indicator = _indicator(cloud, vertices, use_normals=normals)
    openness = _openness(indicator)
    if openness > _MAX_OPENNESS:
        raise TopologyError("points must bound a solid for init='auto', these do not; give init='plane' or 'sphere'")
    cell = indicator.grid.cell
    field = np.pad(indicator.values, 1, constant_values=-0.5)
    smallest = MIN_VERTICES / vertices * np.count_nonzero(field > 0)
    solid, dropped = pieces(field > 0, components, smallest)
    solid, sealed = without_tunnels(without_cavities(solid), tunnels / (2 * cell))
    T_world_cell = np.diag([cell, cell, cell, 1.0])
    T_world_cell[:3, 3] = indicator.grid.to_world(np.full((1, 3), -1.0))[0]
    mesh, _ = solid_mesh(field, solid, T_world_cell, vertices)
    report = StartReport(indicator.grid.shape, cell, mesh.genus, mesh.n_components, sealed, dropped, openness)
    return Start(mesh, report, indicator)


def _indicator(cloud: PointCloud, vertices: int, *, use_normals: bool) -> Indicator:
    """Return the indicator function of the solid that the points bound."""
    points, normals = cloud.points, cloud.normals if use_normals else None
    most = max(_MAX_POINTS, 2 * vertices)
    if len(points) > most:
        chosen = np.random.default_rng(0).choice(len(points), most, replace=False)
        points, normals = points[chosen], None if normals is None else normals[chosen]
    if normals is None:
        found = planes(points)
        return oriented_indicator(points, found, _cell(points, found.spacing, vertices))
    grid = grid_for(points, _cell(points, spacing_of(points), vertices))
    out = poisson_indicator(points, normals, grid, point_areas(points, grid))
    return out if _border_values(out).mean() < 0 else Indicator(out.grid, -out.values)


def _cell(points: Array, spacing: float, vertices: int) -> float:
    """Return the cell size: the longest side over 128 to 256, depending on the vertices, but at least 0.8 spacings."""
    longest = float(np.ptp(points, axis=0).max())
    cells = longest / cell_size(len(points) * spacing**2, vertices)
    return max(_CELL_PER_SPACING * spacing, longest / float(np.clip(cells, _MIN_CELLS, _MAX_CELLS)))


def _border_values(indicator: Indicator) -> Array:
    """Return the samples on the six sides of the grid."""
    values = indicator.values
    return np.concatenate([np.take(values, side, axis=axis).ravel() for axis in range(3) for side in (0, -1)])


def _openness(indicator: Indicator) -> float:
    """Return the spread of the field on the border of the grid, relative to its jump: 0 for closed surfaces.

    Each hole in the data acts like a dipole whose field extends outside.
    """
    border, inside = _border_values(indicator), indicator.values[indicator.values > 0]
    if not len(inside):
        return float(np.inf)
    jump = float(np.median(inside) - np.median(border))
    low, high = np.quantile(border, [0.05, 0.95])
    return float((high - low) / jump) if jump > 0 else float(np.inf)
