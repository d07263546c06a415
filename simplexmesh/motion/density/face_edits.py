"""The score of faces, and the edits of one round of refinement: divisions (T2), merges (T1) and swaps (T7).

The score is a product of four dimensionless factors (Delingette, thesis, 1994, section 5.5.2). The thesis's third, the
Gaussian curvature, vanishes on cylinders, creases and flat faces that span a cavity. Here it is the bending, the
integral of (k1^2 + k2^2) / 2, or squared distance over area where larger: the curvature that would reach the data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.face_geometry import face_areas, face_centroids, face_normals
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density import _kernels_refine
from simplexmesh.motion.model.averages import curvedness
from simplexmesh.motion.targets.protocol import Target, target_gaps

Maps = tuple[Indices32, Indices32]

MOST_MERGED = 9
"""Maximum number of vertices of a merged face."""

LONG, LONGER = 1.4, 2.0
"""Lengths of edges to divide, relative to the mean of the interior ones; the second beside faces of fewer than six
vertices, whose parts are hard to even out."""


TORN = 0.25
"""Of the size of a face: by how much the distances of its vertices to the data may differ if that is one surface."""


@dataclass(frozen=True, eq=False)
class FaceScore:
    """The dimensionless factors of the score of each face, (f,) arrays; holes are included and score 0."""

    area: Array  # over that of the mesh
    elongation: Array  # 1 + (longest - shortest edge) / median edge
    curvature: Array  # integral over the face
    distance: Array  # to the data relative to the reach, 0 to 1; 0 where no data is within reach

    @property
    def total(self) -> Array:
        """(f,) the product of the factors."""
        return self.area * self.elongation * self.curvature * self.distance


def face_distance(mesh: SimplexMesh, target: Target, reach: float) -> tuple[Array, Array]:
    """Return (f,) the mean distance of a face's vertices to the data, or its centroid's if larger; NaN off data.

    The second (f,) is by how much the signed distances of the vertices differ.
    """
    c = mesh.connectivity
    loops, starts = (c.face_vertices, c.face_offsets), c.face_offsets[:-1]
    at = np.concatenate([mesh.vertices, face_centroids(mesh.vertices, *loops)])
    along = np.concatenate([mesh.normals, face_normals(mesh.vertices, *loops)])
    gaps = target_gaps(target, at, along, reach)
    here, middle = gaps[: mesh.n_vertices][c.face_vertices], np.abs(gaps[mesh.n_vertices :])
    seen = np.add.reduceat(np.isfinite(here).astype(float), starts)
    with np.errstate(invalid="ignore"):
        mean = np.add.reduceat(np.nan_to_num(np.abs(here)), starts) / seen
    return np.fmax(mean, middle), np.fmax.reduceat(here, starts) - np.fmin.reduceat(here, starts)


def face_score(mesh: SimplexMesh, away: Array, reach: float) -> FaceScore:
    """Return the score of each face from its distance (f,) to the data, NaN for none, which saturates at `reach`."""
    c = mesh.connectivity
    loops = c.face_vertices, c.face_offsets
    elongation, area = np.zeros(c.face_sizes.size), np.zeros(c.face_sizes.size)
    _kernels_refine.lengths_and_areas(np.asarray(mesh.vertices), *loops, elongation, area)
    area[c.face_is_hole] = 0.0
    away = np.where(c.face_is_hole, 0.0, np.minimum(np.nan_to_num(away), reach))
    bend2 = curvedness(mesh.vertices, mesh.normals, mesh.neighbors) ** 2
    total = area * np.add.reduceat(bend2[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes
    total = np.maximum(total, away**2 / np.maximum(area, np.finfo(float).tiny))
    total[c.face_is_hole] = 0.0
    return FaceScore(area / max(float(area.sum()), np.finfo(float).tiny), elongation, total, away / reach)


def unresolved_faces(mesh: SimplexMesh, target: Target, differ: Array | float = 0.0) -> Mask:
    """Return the faces (f,) smaller than the details that the data shows, if the target has a `resolution`.

    So are those of a mesh at rest whose vertices are not at one surface, but `differ` (f,) in their distances to it:
    where two sides of the data meet, smaller ones would follow now one, now the other, and pile up.
    """
    c, resolution = mesh.connectivity, getattr(target, "resolution", None)
    if resolution is None:
        return np.zeros(len(c.face_sizes), bool)
    loops = c.face_vertices, c.face_offsets
    sizes = np.sqrt(face_areas(mesh.vertices, *loops))
    return np.asarray((sizes < resolution(face_centroids(mesh.vertices, *loops))) | (differ > TORN * sizes))


def divide_faces(edit: EditableMesh, mesh: SimplexMesh, faces: Indices, budget: int, may_grow: Mask) -> int:
    """Divide faces (m,) by T2, in their order, as long as at most `budget` vertices come of it; count those divided."""
    most = budget // 2
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


def removable_edges(connectivity: Connectivity, score: FaceScore) -> tuple[Indices, Indices32, Array]:
    """Return a dart of each edge that T1 may remove, the faces (m, 4) beside it and at its ends, and the new score."""
    c = connectivity
    darts, around = _edges(c)
    sizes = c.face_sizes[around]
    valid = ~c.face_is_hole[around].any(axis=1) & (sizes[:, 2:] > 4).all(axis=1)
    valid &= sizes[:, :2].sum(axis=1) - 4 <= MOST_MERGED
    darts, around = darts[valid], around[valid]
    one, other = around[:, 0], around[:, 1]
    merged = np.maximum(score.elongation[one], score.elongation[other])
    for factor in (score.area, score.curvature, score.distance):  # distances grow with areas
        merged = merged * (factor[one] + factor[other])
    return darts, around, merged


def _edges(connectivity: Connectivity) -> tuple[Indices, Indices32]:
    """Return one dart (e,) of each edge, and the faces (e, 4) on its sides and at its ends."""
    twin, face = connectivity.twin.reshape(-1), connectivity.face.reshape(-1)
    darts = np.flatnonzero(np.arange(twin.size) < twin)
    ends = np.stack([darts, twin[darts]], axis=1)
    rotated = 3 * (ends // 3) + (ends + 1) % 3
    return darts, face[np.concatenate([ends, rotated], axis=1)]


def disjoint_groups(groups: Indices32, count: int, most: int) -> Indices:
    """Return the indices of groups of faces chosen greedily, in order, so that no two share a face."""
    out = np.zeros(min(most, len(groups)), np.int64)
    return out[: _kernels_refine.disjoint_rows(groups, np.ones(count, bool), len(out), out)]


def with_even_metric(step: Edited) -> SimplexMesh:
    """Return the mesh after edits, with metric parameters 1/3 at new vertices: each refers to one neighbor there."""
    mesh = step.mesh
    if "metric" not in mesh.data:
        return mesh
    metric = np.full((mesh.n_vertices, 3), 1 / 3)
    kept = step.vertex_map[step.vertex_map >= 0]
    metric[kept] = mesh.data["metric"][kept]
    return mesh.with_data(metric=metric)


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


def divided_boundary(mesh: SimplexMesh, most: int) -> Edited:
    """Return the mesh with the longest edges on holes, which division of faces leaves coarse, divided by T2."""
    c = mesh.connectivity
    ends = mesh.vertices[c.edge_vertices]
    length = norm(ends[:, 0] - ends[:, 1])
    on_hole = c.face_is_hole[c.edge_faces].any(axis=1)
    if not on_hole.any() or most < 1:
        return EditableMesh(mesh).result()
    face, twin = c.face.reshape(-1), c.twin.reshape(-1)
    relative = length / length[~on_hole].mean()
    long = np.flatnonzero(on_hole & (relative > LONG))
    long = long[np.argsort(-length[long], kind="stable")]
    darts = c.edge_darts[long, 0].astype(np.int64)
    darts = np.where(c.face_is_hole[face[darts]], twin[darts], darts)
    darts = darts[(c.face_sizes[face[darts]] >= 6) | (relative[long] > LONGER)][:most]
    place = np.empty(len(face), np.int64)
    place[c.face_darts] = np.arange(len(face))
    first, size = c.face_offsets[face[darts]], c.face_sizes[face[darts]]
    across = c.face_darts[first + (place[darts] - first + size // 2) % size]
    edit = EditableMesh(mesh)
    edit.insert_edges(darts, across)
    return edit.result()
