"""Lines and zones as data sets of PyVista."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.named_arrays import taken
from simplexmesh.data.io import polydata
from simplexmesh.data.triangles import TriangleMesh

if TYPE_CHECKING:
    import pyvista as pv

    from simplexmesh.surface.features.lines.network import FeatureLine


KINDS = ("C0", "Gn")


def polylines(lines: Sequence[FeatureLine]) -> pv.PolyData:
    """Return lines as polylines: cells have their number as "line" and that of their "kind", points their "angle"."""
    out = polydata.polylines(_joined([line.points for line in lines], (0, 3)), _cells(lines))
    out.cell_data["line"] = np.arange(len(lines))
    out.cell_data["kind"] = _kinds(lines)
    out.point_data["angle"] = _joined([line.angle for line in lines], (0,))
    out.field_data["kinds"] = np.array(KINDS)
    return out


def zoned(
    mesh: TriangleMesh, labels: Indices, boundaries: Sequence[tuple[FeatureLine, tuple[int, int]]]
) -> pv.PolyData:
    """Return triangles with the lines between them, which come first; -1 is what cells of the other sort have."""
    lines = [line for line, _ in boundaries]
    places = _joined([mesh.vertices, *(line.points for line in lines)], (0, 3))
    origin = np.concatenate([np.arange(mesh.n_vertices), *(line.vertices for line in lines)])
    out = TriangleMesh(places, mesh.faces, taken(mesh.data, origin), mesh.unit).to_pyvista()
    out.lines = _cells(lines, mesh.n_vertices)
    none, others = np.full(len(labels), -1), np.full(len(lines), -1)
    out.cell_data["zone"] = np.concatenate([others, labels])
    out.cell_data["line"] = np.concatenate([np.arange(len(lines)), none])
    out.cell_data["kind"] = np.concatenate([_kinds(lines), none])
    pairs = np.array([pair for _, pair in boundaries], np.int64).reshape(-1, 2)
    out.cell_data["zones"] = np.concatenate([pairs, np.stack([none, none], axis=1)])
    out.field_data["kinds"] = np.array(KINDS)
    return out


def _cells(lines: Sequence[FeatureLine], start: int = 0) -> Indices:
    """Return the points of each line, in order, after their number; those of the first begin at `start`."""
    cells: list[int] = []
    for line in lines:
        corners = [*range(start, start + len(line.points)), *([start] if line.closed else [])]
        cells += [len(corners), *corners]
        start += len(line.points)
    return np.array(cells, np.int64)


def _kinds(lines: Sequence[FeatureLine]) -> Indices:
    return np.array([KINDS.index(line.kind) for line in lines], np.int64)


def _joined(parts: Sequence[Array], shape: tuple[int, ...]) -> Array:
    return np.concatenate([np.zeros(shape), *parts])
