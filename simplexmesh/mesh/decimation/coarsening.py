"""Coarsening: greedy edge removal (T1) by least cost, edge swaps (T7), and a fit to the original surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices32, Mask
from simplexmesh._base.vectors import normalized
from simplexmesh.mesh.decimation import _kernels_collapse, _kernels_swap
from simplexmesh.mesh.decimation import _kernels_regions as regions
from simplexmesh.mesh.decimation.fitting import FittedMesh, SurfaceSamples
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.paths import path_vertices
from simplexmesh.mesh.simplex_mesh import SimplexMesh

COST = {"normals": 0.3, "extent": 4e-3, "rim": 1.0, "imbalance": 0.05}
LIMITS = {"turn": 0.1, "bend": -0.5, "quality": 0.1, "min_size": 4, "max_size": 10, "min_component": 20}
WEIGHTS = regions.Weights(**COST, **LIMITS, necks=False, max_deviation=np.inf)  # type: ignore[arg-type]
LAST_RESORT = WEIGHTS._replace(imbalance=0.0, bend=-1.0, min_size=3, max_size=2**30, min_component=4, necks=True)
LAX = WEIGHTS._replace(turn=-0.5, quality=0.05)
"""For the last edge swaps."""

FIT_ROUNDS = 6
"""Half as many take a fifth less time; the rms distance of the elephant is then 3 % larger."""

INITIAL_STEPS = 2
"""Moves, before the fit, towards the points where the three regions of each vertex met; without, rms is 5 % larger."""


class Coarsened(NamedTuple):
    """A mesh with fewer vertices, fitted to the original surface."""

    fit: FittedMesh
    out: Edited
    part_of: Indices32  # (f,) for each original face, the face into which it was merged
    extent: Array  # (f,) for each original face, the rms extent of that face's region


def coarsened(
    mesh: SimplexMesh,
    wanted: int,
    surface: SurfaceSamples,
    max_deviation: float = np.inf,
    max_extent: Array | None = None,
) -> Coarsened:
    """Return a mesh with fewer vertices, at least `wanted`, fitted to a surface; `max_extent` (f,) is of each face."""
    max_extent = np.full(len(mesh.connectivity.face_sizes), np.inf) if max_extent is None else max_extent
    weights = WEIGHTS._replace(max_deviation=max_deviation)
    edit = EditableMesh(mesh)
    count = (mesh.n_vertices - wanted) // 2
    edit._reserve(count)
    corners = _collapsed(mesh, edit, count, weights, max_extent)
    junctions = edit._darts.values[: mesh.n_vertices, :3].copy()
    _kernels_swap.place_vertices(edit._darts, corners)
    out = edit.result()
    part_of = out.face_map[corners.merged_into]
    fit = FittedMesh(surface, out.mesh, part_of, *_targets(corners, out))
    fit.untangle(strictly=True)
    for _ in range(INITIAL_STEPS):
        fit.advance(junctions[out.vertex_map >= 0])
    fit.improve(FIT_ROUNDS)
    fit.untangle()
    rows, moments = corners.regions, slice(regions.MOMENTS, regions.MOMENTS + 3)
    squared = rows[:, moments].sum(axis=1) / np.where(rows[:, regions.AREA] > 0, rows[:, regions.AREA], 1)
    return Coarsened(fit, out, part_of, np.sqrt(np.maximum(squared, 0))[corners.merged_into])


def _targets(corners: regions.Corners, out: Edited) -> tuple[Array, Mask]:
    """Return the target normals (g, 3) of the new faces, zero where unknown, and a mask (n,) of the free vertices."""
    c, rows, kept = out.mesh.connectivity, corners.regions, np.flatnonzero(out.face_map >= 0)
    normals, free = np.zeros((len(c.face_sizes), 3)), np.ones(len(c.face_sizes), bool)
    normals[out.face_map[kept]] = normalized(rows[kept, regions.VECTOR_AREA : regions.VECTOR_AREA + 3])
    free[out.face_map[kept]] = corners.max_extent[kept] > 0
    movable: Mask = np.array(free[c.vertex_faces].all(axis=1))
    for darts in c.contour_darts.values():
        movable[path_vertices(darts, c.twin)[0]] = False
    return normals, movable


def _collapsed(
    mesh: SimplexMesh, edit: EditableMesh, count: int, weights: regions.Weights, max_extent: Array
) -> regions.Corners:
    """Apply T1 up to `count` times, then T7; return the faces as corners of the dual triangulation."""
    d = edit._darts
    corners = regions.corners_of(d, mesh.connectivity.components, max_extent, weights)
    done = _kernels_collapse.collapse_cheapest(d, corners, weights, count)
    if done < count and weights.max_deviation == np.inf:
        _kernels_collapse.collapse_cheapest(d, corners, LAST_RESORT, count - done)
    for limits in (WEIGHTS, LAX):
        _kernels_swap.swap_unequal(d, corners, limits)
    into = corners.merged_into
    while (into[into] != into).any():
        into[:] = into[into]
    return corners
