"""A mesh made coarser by T1, where it costs least, and T7, and fitted to the surface it stands for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_corners as evening
from simplexmesh.mesh import _kernels_decimate as kernels
from simplexmesh.mesh import _kernels_exceptions as exceptions
from simplexmesh.mesh import _kernels_regions as regions
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.fitting import Fit, Surface
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

WEIGHTS = kernels.Weights(
    normals=0.3,
    spread=4e-3,
    rim=1.0,
    sizes=0.05,
    turn=0.1,
    bend=-0.5,
    shape=0.1,
    least=4,
    most=10,
    piece=20,
    necks=False,
    flat=np.inf,
)
LAST_RESORT = WEIGHTS._replace(sizes=0.0, bend=-1.0, least=3, most=2**30, piece=4, necks=True)
LAX = WEIGHTS._replace(turn=-0.5, shape=0.05)
"""Of the edges that are swapped last."""

PASSES, PATH = 20, 3
"""How often all edges are looked at, and how many are swapped at most so that a face is no exception."""

ROUNDS = 6
STEPS = 2
"""How often vertices go towards the places where their three regions met, before the fit."""

KNOWN = 0.3
"""A region whose vector area is a smaller part of its area points nowhere."""


class Made(NamedTuple):
    """A mesh with fewer vertices."""

    fit: Fit
    out: Edited
    part_of: Indices  # of each face before, the face that it is part of
    reach: Array  # of each face before, how far the region of that face reaches, rms


def made(mesh: SimplexMesh, wanted: int, surface: Surface, flat: float = np.inf, reach: Array | None = None) -> Made:
    """Return a mesh with fewer vertices, fitted to a surface; edges are removed at any price when nothing limits them.

    Limits are how far regions may be from flat, and how far each (f,) may reach; see `strays`.
    """
    reach = np.full(len(mesh.connectivity.face_sizes), np.inf) if reach is None else reach
    weights = WEIGHTS._replace(flat=flat)
    edit = EditableMesh(mesh)
    count = (mesh.n_vertices - wanted) // 2
    edit._reserve(count)
    corners = _collapsed(mesh, edit, count, weights, reach)
    met = edit._darts.values[: mesh.n_vertices, :3].copy()
    evening.place_vertices(edit._darts, corners)
    out = edit.result()
    rows, c = corners.regions, out.mesh.connectivity
    there = np.flatnonzero(out.face_map >= 0)
    vector, area = rows[there, regions.VECTOR : regions.VECTOR + 3], rows[there, regions.AREA]
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    along, free = np.zeros((len(c.face_sizes), 3)), np.ones(len(c.face_sizes), bool)
    known = length > np.maximum(KNOWN * area[:, None], np.finfo(float).tiny)
    along[out.face_map[there]] = np.where(known, vector / np.where(known, length, 1), 0)
    free[out.face_map[there]] = corners.reach[there] > 0
    fit = Fit(surface, out.mesh, out.face_map[corners.into], along, np.asarray(free[c.vertex_faces].all(axis=1)))
    fit.untangle(strictly=True)
    for _ in range(STEPS):
        fit.advance(met[out.vertex_map >= 0])
    fit.improve(ROUNDS)
    fit.untangle()
    squared = rows[:, regions.SPREAD : regions.SPREAD + 3].sum(axis=1) / np.where(rows[:, 0] > 0, rows[:, 0], 1)
    return Made(fit, out, out.face_map[corners.into], np.sqrt(np.maximum(squared, 0))[corners.into])


def _collapsed(
    mesh: SimplexMesh, edit: EditableMesh, count: int, weights: kernels.Weights, reach: Array
) -> kernels.Corners:
    """T1 up to `count` times, and T7; return the faces as corners."""
    d, c = edit._darts, mesh.connectivity
    rows = regions.face_regions(d)
    energy = regions.energies(rows, weights.normals, weights.spread, weights.rim)
    points = np.ascontiguousarray(rows[:, regions.MIDDLE : regions.MIDDLE + 3])
    into, left = np.arange(len(rows), dtype=np.int32), np.bincount(c.components)
    corners = kernels.Corners(points, rows, energy, reach.copy(), into, c.components, left)
    done = kernels.collapse_cheapest(d, corners, weights, count)
    if done < count and weights.flat == np.inf:
        kernels.collapse_cheapest(d, corners, LAST_RESORT, count - done)
    for swapping in (WEIGHTS, LAX):
        evening.even_out_flat(d, corners, swapping, PASSES)
    exceptions.lessen_exceptions(d, corners, LAX, PATH)
    while (into[into] != into).any():
        into[:] = into[into]
    return corners
