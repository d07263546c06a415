"""Initial mesh from points: the dual of a coarse Poisson reconstruction.

Without normals, those of local plane fits are oriented by a flood fill of the outside, on the finest grid that does not
leak, and by iterated Poisson reconstruction.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.start.lasting import lasting_genus
from simplexmesh.motion.start.openness import share_bare, share_doubled
from simplexmesh.motion.start.report import Start, StartReport
from simplexmesh.motion.start.solid_mesh import FEWEST, cell_size, solid_mesh
from simplexmesh.motion.start.topology import pieces, without_cavities, without_tunnels
from simplexmesh.numerics.kd_tree import uneven_tree
from simplexmesh.numerics.plane_fits import planes, spacing_of
from simplexmesh.orientation.poisson import Indicator, Poisson, oriented_indicator

MOST_POINTS = 60_000
"""Points used, unless there are more vertices: more take longer and do not change the topology."""

COARSEST, FINEST = 128, 256
"""Cells along the longest side: time against the narrowest tunnel."""

NEITHER = 0.05
"""Mean indicator on the border of its grid up to which neither side of an open surface is more the inner one."""


def start_from_points(
    cloud: PointCloud, vertices: int = 4000, *, components: str = "largest", tunnels: float = 0.0
) -> Start:
    """Return a closed mesh near points of a surface; tunnels narrower than given are sealed."""
    indicator = _indicator(cloud, vertices)
    cell = indicator.grid.cell
    field = np.pad(indicator.values, 1, constant_values=-0.5)
    smallest = FEWEST / vertices * np.count_nonzero(field > 0)
    lasting = lasting_genus(field, components, smallest)
    field -= np.float32(lasting.level)
    solid, dropped = pieces(field > 0, components, smallest)
    solid, sealed = without_tunnels(without_cavities(solid), tunnels / (2 * cell))
    T_world_cell = np.diag([cell, cell, cell, 1.0])
    T_world_cell[:3, 3] = indicator.grid.to_world(np.full((1, 3), -1.0))[0]
    mesh, _ = solid_mesh(field, solid, T_world_cell, vertices)
    lasts = mesh.genus + sealed == lasting.genus
    doubtful = indicator.grid.to_world(lasting.places[: 0 if lasts else None] - 1.0)
    report = StartReport(
        indicator.grid.shape, cell, mesh.genus, mesh.n_components, sealed, dropped,
        openness=share_bare(mesh, cloud.points),
        doubled=share_doubled(mesh, cloud.points) if cloud.normals is None else 0.0,
        doubtful=tuple(map(tuple, doubtful.tolist())),
    )  # fmt: skip
    return Start(mesh, report, indicator)


def _indicator(cloud: PointCloud, vertices: int) -> Indicator:
    """Return the indicator function of the solid that the points bound."""
    points, normals = cloud.points, cloud.normals
    most = max(MOST_POINTS, 2 * vertices)
    if len(points) > most:
        chosen = np.random.default_rng(0).choice(len(points), most, replace=False)
        points, normals = points[chosen], None if normals is None else normals[chosen]
    if normals is None:
        found = planes(points)
        return oriented_indicator(points, found, _cell(points, found.spacing, vertices))
    out = Poisson.of(points, _cell(points, spacing_of(uneven_tree(points)), vertices)).indicator(normals)
    return Indicator(out.grid, -out.values) if out.border.mean() > NEITHER else out


def _cell(points: Array, spacing: float, vertices: int) -> float:
    """Return the cell size: the longest side over 128 to 256, depending on the vertices, but at least 0.8 spacings."""
    longest = float(np.ptp(points, axis=0).max())
    cells = longest / cell_size(len(points) * spacing**2, vertices)
    return max(0.8 * spacing, longest / float(np.clip(cells, COARSEST, FINEST)))
