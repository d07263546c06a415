"""Flat faces without interior vertices, as in files from CAD: curvature is not sampled there."""

from __future__ import annotations

from weakref import WeakSet

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import warn
from simplexmesh._base.vectors import dot, norm, normalized, triangle_vectors
from simplexmesh.surface.sampled_surface import SampledSurface

SHARP = np.radians(30.0)
"""Dihedral angle above which an edge is sharp."""

FLAT = np.radians(2.0)
"""Median angle of all other edges below which a surface consists of flat faces; on rough scans it is larger."""

_CHECKED: WeakSet[SampledSurface] = WeakSet()


def unsampled_share(samples: SampledSurface) -> float:
    """Return the share of the area in triangles with all corners on sharp edges, 0 without triangles."""
    if samples.faces is None or not len(samples.faces):
        return 0.0
    faces, points = samples.faces, samples.points
    vectors = triangle_vectors(points, faces)
    areas = norm(vectors)
    on_edge = _on_sharp_edges(faces, normalized(vectors), areas > 0, len(points))
    return float(areas[on_edge[faces].all(axis=1)].sum() / areas.sum()) if areas.any() else 0.0


def _on_sharp_edges(faces: Indices, normals: Array, valid: Mask, n: int) -> Mask:
    """Return which vertices are on sharp edges, none on rough surfaces; `valid` triangles have an area."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    keys = ends[:, 0] * n + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    first, second = order[:-1], order[1:]
    pair = (keys[first] == keys[second]) & valid[first // 3] & valid[second // 3]
    first, second = first[pair], second[pair]
    cosine = dot(normals[first // 3], normals[second // 3])
    sharp, out = cosine < np.cos(SHARP), np.zeros(n, bool)
    if sharp.all() or np.median(cosine[~sharp]) > np.cos(FLAT):
        out[ends[first[sharp]]] = True
    return out


def warn_of_unsampled_faces(samples: SampledSurface) -> None:
    """Warn, once per surface, if most of it is in flat faces without interior vertices."""
    if samples in _CHECKED:
        return
    _CHECKED.add(samples)
    share = unsampled_share(samples)
    if share > 0.5:
        warn(
            f"{share:.0%} of the surface has no vertices between sharp edges to measure curvature at, "
            "as in files from CAD; simplexmesh.divided(surface) adds some"
        )
