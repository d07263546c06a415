"""The edits of one round of refinement: faces divided (T2, T6), merged (T1) and evened out (T7), without motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.regularize import Regularized, regularize
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density import _kernels_refine
from simplexmesh.motion.density.face_score import FaceScore

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

MOST_MERGED = 9
"""Maximum number of vertices of a merged face."""


def divide_faces(
    edit: EditableMesh, mesh: SimplexMesh, faces: Indices, budget: int, may_grow: Mask, *, fewest: int = 6
) -> tuple[int, int]:
    """Divide faces (m,) of `mesh` in order, by T2 those of `fewest` vertices or more, by T6 the others; count both.

    At most `budget` vertices are added. A face that another edit has touched, or whose neighbors may not grow (f,), is
    skipped.
    """
    sizes = mesh.connectivity.face_sizes[faces]
    done = _divide_by_cuts(edit, mesh, faces[sizes >= fewest], budget // 2, may_grow)
    left, ringed = budget - 2 * done, 0
    for face in faces[sizes < fewest].tolist():
        m = int(mesh.connectivity.face_sizes[face])
        around = edit.around(face)
        allowed = len(around) == m and all(_may_grow(edit, int(dart), may_grow) for dart in around)
        if allowed and 2 * m <= left and edit.refine_faces([face]).done.all():
            left, ringed = left - 2 * m, ringed + 1
    return done, ringed


def _may_grow(edit: EditableMesh, dart: int, may_grow: Mask) -> bool:
    """Return whether the face on the right of a dart may gain a vertex; faces made in this round may."""
    across = edit.faces_beside(dart)[1]
    return across >= len(may_grow) or bool(may_grow[across])


def _divide_by_cuts(edit: EditableMesh, mesh: SimplexMesh, faces: Indices, most: int, may_grow: Mask) -> int:
    """Divide up to `most` of the faces by T2, in their order, and return how many were divided."""
    c = mesh.connectivity
    pairs = np.full((len(faces), 2), -1, np.int32)
    loops = c.twin.reshape(-1), c.face.reshape(-1), c.face_darts, c.face_offsets
    _kernels_refine.best_cuts(np.asarray(mesh.vertices), *loops, may_grow, faces.astype(np.int64), pairs)
    pairs = pairs[pairs[:, 0] >= 0]
    done = start = 0
    while done < most and start < len(pairs):
        batch = edit.insert_edges(*pairs[start : start + most - done].T, in_order=True)
        start += most - done
        done += int(batch.done.sum())
    return done


def removable_edges(connectivity: Connectivity, score: FaceScore) -> tuple[Indices, NDArray[np.int32], Array]:
    """Return a dart of each edge that T1 may remove, the faces (m, 4) on its sides and at its ends, and the new score.

    None is near a hole or leaves a triangle or a face of more than nine vertices. Merging adds areas, curvatures and
    distances, as the distance from the center of a face to a curved surface is proportional to its area: two equal
    faces make one of eight times their score.
    """
    c = connectivity
    darts, around = _edges(c)
    sizes = c.face_sizes[around]
    valid = ~c.face_is_hole[around].any(axis=1) & (sizes[:, 2:] > 4).all(axis=1)
    valid &= sizes[:, :2].sum(axis=1) - 4 <= MOST_MERGED
    darts, around = darts[valid], around[valid]
    one, other = around[:, 0], around[:, 1]
    merged = np.maximum(score.elongation[one], score.elongation[other])
    for factor in (score.area, score.curvature, score.distance):
        merged = merged * (factor[one] + factor[other])
    return darts, around, merged


def _edges(connectivity: Connectivity) -> tuple[Indices, NDArray[np.int32]]:
    """Return one dart (e,) of each edge, and the faces (e, 4) on its sides and at its ends."""
    twin, face = connectivity.twin.reshape(-1), connectivity.face.reshape(-1)
    darts = np.flatnonzero(np.arange(twin.size) < twin)
    ends = np.stack([darts, twin[darts]], axis=1)
    rotated = 3 * (ends // 3) + (ends + 1) % 3
    return darts, face[np.concatenate([ends, rotated], axis=1)]


def with_even_faces(mesh: SimplexMesh, zone: Mask | None) -> Edited:
    """Return the mesh with face sizes evened out by T7: all of it, or only edges whose four faces are in a zone."""
    if zone is None:
        return regularize(mesh)
    maps = np.arange(mesh.n_vertices, dtype=np.int32), np.arange(zone.size, dtype=np.int32)
    for _ in range(20):
        c = mesh.connectivity
        darts, around = _edges(c)
        sizes = c.face_sizes[around]
        excess = sizes[:, 0] + sizes[:, 1] - sizes[:, 2] - sizes[:, 3]
        valid = (zone & ~c.face_is_hole)[around].all(axis=1) & (excess > 2)
        if not valid.any():
            break
        darts, around = darts[valid], around[valid]
        order = np.argsort(-excess[valid], kind="stable")
        first = disjoint_groups(around[order], c.face_sizes.size, len(darts))
        edit = EditableMesh(mesh)
        if not edit.swap_edges(darts[order][first], in_order=True).done.any():
            break
        step = edit.result()
        mesh, maps = step.mesh, composed_maps(maps, step)
        zone = mapped_zone(zone, step)
    return Edited(mesh, checks.frozen(maps[0]), checks.frozen(maps[1]))


def evened(step: Edited, zone: Mask | None = None) -> tuple[Edited, int]:
    """Return edits followed by `with_even_faces`, in a zone of the mesh before if given, and the swaps without one."""
    even = with_even_faces(step.mesh, None if zone is None else mapped_zone(zone, step))
    maps = composed_maps((step.vertex_map, step.face_map), even)
    out = Edited(even.mesh, checks.frozen(maps[0]), checks.frozen(maps[1]))
    return out, even.swaps if isinstance(even, Regularized) else 0


def disjoint_groups(groups: NDArray[np.int32], count: int, most: int, free: Mask | None = None) -> Indices:
    """Return the indices of groups of faces chosen greedily, in order, so that no two share a face."""
    out = np.zeros(min(most, len(groups)), np.int64)
    free = np.ones(count, bool) if free is None else free.copy()
    return out[: _kernels_refine.disjoint_rows(groups, free, len(out), out)]


def with_even_metric(step: Edited) -> SimplexMesh:
    """Return the mesh after edits, with metric parameters 1/3 at new vertices: each refers to one neighbor there."""
    mesh = step.mesh
    if "metric" not in mesh.data:
        return mesh
    metric = np.full((mesh.n_vertices, 3), 1 / 3)
    kept = step.vertex_map[step.vertex_map >= 0]
    metric[kept] = mesh.data["metric"][kept]
    return mesh.with_data(metric=metric)


Maps = tuple[NDArray[np.int32], NDArray[np.int32]]


def composed_maps(maps: Maps, step: Edited) -> Maps:
    """Return the maps of vertices and faces, composed with those of one more edit."""
    out = [
        np.where(first >= 0, then[first], -1).astype(np.int32)
        for first, then in zip(maps, (step.vertex_map, step.face_map), strict=True)
    ]
    return out[0], out[1]


def mapped_zone(zone: Mask, step: Edited) -> Mask:
    """Return the zone (f,) after an edit: its remaining faces, and all new faces, which edits make in the zone only."""
    out = np.ones(step.mesh.connectivity.face_sizes.size, bool)
    kept = step.face_map >= 0
    out[step.face_map[kept]] = zone[kept]
    return out
