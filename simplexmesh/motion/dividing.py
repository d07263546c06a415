"""Faces divided and edges taken out where scores say so: one round of edits, T2, T6, T1 and T7, without any motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.regularize import regularize
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion import _kernels_refine
from simplexmesh.motion.face_score import FaceScore

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

CROWDING = 0.1
"""What a vertex beyond six on a face across costs, where the length of a cut costs 0 to 1."""

MOST_MERGED = 9
"""No two faces are merged into one of more vertices."""


def divided(
    edit: EditableMesh, mesh: SimplexMesh, faces: Indices, budget: int, may_grow: Mask, *, fewest: int = 6
) -> tuple[int, int]:
    """Divide faces in the order given, T2 across those of enough vertices, T6 into the others, and count both.

    A face that another edit of the round has touched waits for the next round, and so does one whose neighbors may not
    grow.

    Parameters
    ----------
    edit : EditableMesh
        A copy of `mesh`; edits may have been done on it.
    mesh : SimplexMesh
    faces : (m,) array of int
        Their numbers in `mesh`.
    budget : int
        At most so many vertices are added.
    may_grow : (f,) array of bool
        Which faces may get vertices from their neighbors.
    fewest : int
        Faces of fewer vertices are divided by T6.

    Returns
    -------
    (int, int)
        How many faces were divided by T2, and by T6.
    """
    sizes = mesh.connectivity.face_sizes[faces]
    done = _cut(edit, mesh, faces[sizes >= fewest], budget // 2, may_grow)
    left, ringed = budget - 2 * done, 0
    for face in faces[sizes < fewest].tolist():
        m = int(mesh.connectivity.face_sizes[face])
        around = edit.around(face)
        whole = len(around) == m and all(_may_grow(edit, int(dart), may_grow) for dart in around)
        if whole and 2 * m <= left and edit.refine_faces([face]).done.all():
            left, ringed = left - 2 * m, ringed + 1
    return done, ringed


def _may_grow(edit: EditableMesh, dart: int, may_grow: Mask) -> bool:
    """Return whether the face on the right of a dart may get a vertex; one made in this round may."""
    across = edit.faces_beside(dart)[1]
    return across >= len(may_grow) or bool(may_grow[across])


def _cut(edit: EditableMesh, mesh: SimplexMesh, faces: Indices, most: int, may_grow: Mask) -> int:
    """T2 on as many of the faces as can be, `most` at the most, in their order; return how many."""
    c = mesh.connectivity
    pairs = np.full((len(faces), 2), -1, np.int32)
    loops = c.twin.reshape(-1), c.face.reshape(-1), c.face_darts, c.face_offsets
    _kernels_refine.best_cuts(np.asarray(mesh.vertices), *loops, may_grow, faces.astype(np.int64), CROWDING, pairs)
    pairs = pairs[pairs[:, 0] >= 0]
    done = at = 0
    while done < most and at < len(pairs):
        batch = edit.insert_edges(*pairs[at : at + most - done].T, in_order=True)
        at += most - done
        done += int(batch.done.sum())
    return done


def removable(connectivity: Connectivity, score: FaceScore) -> tuple[Indices, NDArray[np.int32], Array]:
    """Return the edges that T1 may take out, the four faces around each, and the score of the face it would leave.

    Left out are edges near holes, those that would leave a triangle, and those that would leave a face of more than
    nine vertices. Merging two faces adds their areas and their turns, and their distances as well: that of the middle
    of a face from a curved surface grows like its area. Two equal faces become one of eight times their score.

    Returns
    -------
    darts : (m,) array of int
        One of each edge.
    faces : (m, 4) array of int
        The two beside it, and the two at its ends.
    score : (m,) array of float
        Of the merged face.
    """
    c = connectivity
    twin, face = c.twin.reshape(-1), c.face.reshape(-1)
    darts = np.flatnonzero(np.arange(twin.size) < twin)
    back = twin[darts]
    around = np.stack([face[darts], face[back], face[_turned(darts)], face[_turned(back)]], axis=1)
    sizes = c.face_sizes[around]
    fit = ~c.face_is_hole[around].any(axis=1) & (sizes[:, 2:] > 4).all(axis=1)
    fit &= sizes[:, :2].sum(axis=1) - 4 <= MOST_MERGED
    darts, around = darts[fit], around[fit]
    one, other = around[:, 0], around[:, 1]
    merged = np.maximum(score.elongation[one], score.elongation[other])
    for factor in (score.area, score.curvature, score.distance):
        merged = merged * (factor[one] + factor[other])
    return darts, around, merged


def _turned(darts: NDArray[Any]) -> NDArray[Any]:
    """Return the dart after each one around its vertex."""
    return 3 * (darts // 3) + (darts + 1) % 3


def evened(mesh: SimplexMesh, zone: Mask | None) -> Edited:
    """Return the mesh with even face sizes: regularized or, in a zone only, by T7 where all four faces are in it.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> uneven = sm.refine_face(sm.sphere(8), 40).mesh
    >>> sizes = evened(uneven, np.ones(uneven.connectivity.face_sizes.size, bool)).mesh.connectivity.face_sizes
    >>> sorted({int(size) for size in sizes})
    [5, 6, 7]
    """
    if zone is None:
        return regularize(mesh)
    maps = np.arange(mesh.n_vertices, dtype=np.int32), np.arange(zone.size, dtype=np.int32)
    for _ in range(20):
        c = mesh.connectivity
        twin, face = c.twin.reshape(-1), c.face.reshape(-1)
        darts = np.flatnonzero(np.arange(twin.size) < twin)
        back = twin[darts]
        around = np.stack([face[darts], face[back], face[_turned(darts)], face[_turned(back)]], axis=1)
        sizes = c.face_sizes[around]
        excess = sizes[:, 0] + sizes[:, 1] - sizes[:, 2] - sizes[:, 3]
        fit = (zone & ~c.face_is_hole)[around].all(axis=1) & (excess > 2)
        if not fit.any():
            break
        darts, around = darts[fit], around[fit]
        order = np.argsort(-excess[fit], kind="stable")
        first = taken_apart(around[order], c.face_sizes.size, len(darts))
        edit = EditableMesh(mesh)
        if not edit.swap_edges(darts[order][first], in_order=True).done.any():
            break
        step = edit.result()
        mesh, maps = step.mesh, composed(maps, step)
        zone = carried_zone(zone, step)
    return Edited(mesh, _check.frozen(maps[0]), _check.frozen(maps[1]))


def taken_apart(groups: NDArray[np.int32], count: int, most: int, free: Mask | None = None) -> Indices:
    """Return which of the groups of faces to take, in order, so that no two have a face in common.

    Examples
    --------
    >>> taken_apart(np.array([[0, 1, 2, 3], [3, 4, 5, 6], [4, 5, 6, 7]]), 8, 9)
    array([0, 2])
    """
    out = np.zeros(min(most, len(groups)), np.int64)
    free = np.ones(count, bool) if free is None else free.copy()
    return out[: _kernels_refine.disjoint_rows(groups, free, len(out), out)]


Maps = tuple[NDArray[np.int32], NDArray[np.int32]]


def composed(maps: Maps, step: Edited) -> Maps:
    """Return the maps of vertices and faces through one more step."""
    out = [
        np.where(first >= 0, then[first], -1).astype(np.int32)
        for first, then in zip(maps, (step.vertex_map, step.face_map), strict=True)
    ]
    return out[0], out[1]


def carried_zone(zone: Mask, step: Edited) -> Mask:
    """Return a zone after a step: what was in it, and the faces made since, which only faces of the zone give rise to.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> zone = np.arange(162) == 5
    >>> int(carried_zone(zone, sm.refine_face(sm.sphere(4), 5)).sum())
    7
    """
    out = np.ones(step.mesh.connectivity.face_sizes.size, bool)
    kept = step.face_map >= 0
    out[step.face_map[kept]] = zone[kept]
    return out
