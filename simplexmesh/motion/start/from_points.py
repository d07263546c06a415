"""Initial mesh from points: the dual of a coarse Poisson reconstruction.

Without normals, those of local plane fits are oriented by a flood fill of the outside, on the finest grid that does not
leak, and by iterated Poisson reconstruction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.start.lasting import lasting_genus
from simplexmesh.motion.start.report import FAR, Start, StartReport
from simplexmesh.motion.start.solid_mesh import FEWEST, cell_size, solid_mesh
from simplexmesh.motion.start.topology import pieces, without_cavities, without_tunnels
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.numerics.kd_tree import uneven_tree
from simplexmesh.numerics.plane_fits import planes, spacing_of
from simplexmesh.orientation.poisson import Indicator, Poisson, oriented_indicator, screened

MOST_POINTS = 60_000
"""Points used, unless there are more vertices: more take longer and do not change the topology."""

COARSEST, FINEST = 128, 256
"""Cells along the longest side: time against the narrowest tunnel."""

FINER = 0.9
"""Ratio of cells from which another try is worth its time where the genus is in doubt."""

NEITHER = 0.05
"""Mean indicator on the border of its grid up to which neither side of an open surface is more the inner one."""

ENOUGH = 5000
"""Points that tell whether two sides share them, and vertices that are asked; more change nothing."""

NEIGHBORS = 100
"""Points that tell it of a place; fewer mislead at more places of plates that are thicker than their noise."""


def start_from_points(
    cloud: PointCloud,
    vertices: int = 4000,
    *,
    components: str = "largest",
    tunnels: float = 0.0,
    cavities: bool = False,
) -> Start:
    """Return a closed mesh near points of a surface; tunnels narrower than given are sealed, cavities unless wanted.

    Where its genus is in doubt, cells as fine as the points allow are tried: what is in no doubt there is taken.
    """
    cut = partial(_cut, cloud=cloud, vertices=vertices, components=components, tunnels=tunnels, cavities=cavities)
    start = _screened(_indicator(cloud, vertices), cloud, cut)
    if not start.report.doubtful:
        return start
    found = planes(cloud.points)  # cells narrower than noise show handles of noise, which last
    finest = max(_cell(cloud.points, found.spacing, vertices, FINEST), 2 * found.noise)
    if finest > FINER * start.report.cell:
        return start
    finer = _screened(_indicator(cloud, vertices, FINEST), cloud, cut)
    return start if finer.report.doubtful or finer.report.is_open else finer


def _screened(smooth: Indicator, cloud: PointCloud, cut: Callable[[Indicator], Start]) -> Start:
    """Return the mesh of the screened indicator, which keeps thin limbs.

    Where its genus is in doubt, as where noise is wider than cells, the smooth indicator is taken if its own is not;
    the doubt is told if the two differ.
    """
    start = cut(screened(smooth, cloud.points))
    if not start.report.doubtful or (other := cut(smooth)).report.doubtful:
        return start
    doubtful = start.report.doubtful if other.report.genus != start.report.genus else ()
    return replace(other, report=replace(other.report, doubtful=doubtful))


def _cut(
    indicator: Indicator, *, cloud: PointCloud, vertices: int, components: str, tunnels: float, cavities: bool
) -> Start:
    """Return the mesh of an indicator, at the level where its genus lasts."""
    field = np.pad(indicator.values, 1, constant_values=-0.5)
    smallest = FEWEST / vertices * np.count_nonzero(field > 0)

    def cut(level: float) -> Start:
        solid, dropped = pieces(field > level, components, smallest)
        solid = solid if cavities else without_cavities(solid)
        solid, sealed = without_tunnels(solid, tunnels / (2 * indicator.grid.cell))
        mesh, _ = solid_mesh(field - np.float32(level), solid, _to_world(indicator), vertices)
        report = StartReport(
            indicator.grid.shape, indicator.grid.cell, mesh.genus, mesh.n_components, sealed, dropped,
            openness=share_bare(mesh, cloud.points),
            doubled=share_doubled(mesh, cloud.points) if cloud.normals is None else 0.0,
        )  # fmt: skip
        return Start(mesh, report, indicator)

    start = cut(0.0)
    if start.report.is_open:
        return start  # whose lids, not data, tell its genus
    lasting = lasting_genus(field, components, smallest)
    start = cut(lasting.level) if lasting.level else start
    lasts = start.report.genus + start.report.tunnels_removed == lasting.genus
    doubtful = indicator.grid.to_world(lasting.places[: 0 if lasts else None] - 1.0)
    return replace(start, report=replace(start.report, doubtful=tuple(map(tuple, doubtful.tolist()))))


def _to_world(indicator: Indicator) -> Array:
    """Return T_world_cell of a field that is padded by one cell."""
    T_world_cell = np.diag([*[indicator.grid.cell] * 3, 1.0])
    T_world_cell[:3, 3] = indicator.grid.to_world(np.full((1, 3), -1.0))[0]
    return T_world_cell


def _indicator(cloud: PointCloud, vertices: int, least: int = COARSEST) -> Indicator:
    """Return the indicator function of the solid that the points bound."""
    points, normals = cloud.points, cloud.normals
    most = max(MOST_POINTS, 2 * vertices)
    if len(points) > most:
        chosen = np.random.default_rng(0).choice(len(points), most, replace=False)
        points, normals = points[chosen], None if normals is None else normals[chosen]
    if normals is None:
        found = planes(points)
        return oriented_indicator(points, found, _cell(points, found.spacing, vertices, least))
    out = Poisson.of(points, _cell(points, spacing_of(uneven_tree(points)), vertices, least)).indicator(normals)
    return Indicator(out.grid, -out.values) if out.border.mean() > NEITHER else out


def _cell(points: Array, spacing: float, vertices: int, least: int = COARSEST) -> float:
    """Return the cell size: the longest side over 128 to 256, depending on the vertices, but at least 0.8 spacings."""
    longest = float(np.ptp(points, axis=0).max())
    cells = longest / cell_size(len(points) * spacing**2, vertices)
    return max(0.8 * spacing, longest / float(np.clip(cells, least, FINEST)))


def share_bare(mesh: SimplexMesh, points: Array) -> float:
    """Return the share of the area of a mesh that is far from all points; parts that face opposite ways count twice."""
    areas = _vertex_areas(mesh)
    away = uneven_tree(points).query(mesh.vertices, workers=-1)[0]
    lids = np.where(away > FAR * norm(np.ptp(points, axis=0)), areas, 0.0)
    return float((2 * lids.sum() - norm(lids @ mesh.normals)) / areas.sum())


def share_doubled(mesh: SimplexMesh, points: Array) -> float:
    """Return the share of the area of a closed mesh where two sides have only the points of one sheet.

    These are most frequent halfway between the sides, those of a solid near the sides: of normal noise wherever it is
    thicker than twice its standard deviation. Both are compared by how far points are from halfway: up to half, and
    from there to one and a half, of their root mean square around each vertex.
    """
    some, at = points[:: max(1, len(points) // ENOUGH)], slice(None, None, max(1, mesh.n_vertices // ENOUGH))
    off = np.abs(Triangles(mesh.triangulated(method="dual")).depths(some) - 0.5)
    off[~(off < 1.5)] = np.inf  # of another place
    around = off[uneven_tree(some).query(mesh.vertices[at], k=min(NEIGHBORS, len(some)), workers=-1)[1]]
    known = np.isfinite(around)
    squares = np.where(known, around, 0.0) ** 2
    scale = np.sqrt(squares.sum(axis=1) / np.maximum(known.sum(axis=1), 1))[:, None]
    halfway = (around < 0.5 * scale).sum(axis=1)
    at_sides = (around < 1.5 * scale).sum(axis=1) - halfway
    areas = _vertex_areas(mesh)[at]
    return float(areas[2 * halfway > at_sides].sum() / areas.sum())


def _vertex_areas(mesh: SimplexMesh) -> Array:
    c = mesh.connectivity
    return np.asarray((mesh.face_areas / c.face_sizes)[c.face].sum(axis=1))
