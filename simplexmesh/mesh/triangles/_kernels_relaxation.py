"""Tangential relaxation of closed triangulations, as `_kernels_half_edges` has them.

The reference is in `tests/motion/start/reference.py`.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh.mesh.triangles._kernels_half_edges import MIN_COSINE, area_normal, cosine, following, previous
from simplexmesh.numerics._kernels_vectors import row


@njit(cache=True, error_model="numpy", fastmath=FAST, _nrt=False)
def _one_ring(vertices, corners, mates, first, normal, center):
    """Fill the area normal and the area-weighted centroid of the one-ring triangles of a vertex."""
    normal[0] = normal[1] = normal[2] = center[0] = center[1] = center[2] = 0.0
    total = 0.0
    k = first
    while True:
        p, q, r = row(vertices, corners[k]), row(vertices, corners[following(k)]), row(vertices, corners[previous(k)])
        n = area_normal(p, q, r)
        area = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        total += area
        for i in range(3):
            normal[i] += n[i]
            center[i] += area * (p[i] + q[i] + r[i]) / 3
        k = mates[previous(k)]
        if k == first:
            break
    for i in range(3):
        center[i] = center[i] / total if total > 0 else vertices[corners[first], i]


@njit(cache=True, error_model="numpy", fastmath=FAST, _nrt=False)
def _move_is_valid(vertices, corners, mates, first, moved):
    """Return whether moving a vertex to `moved` turns no triangle around it by more than 60 degrees."""
    k = first
    while True:
        p, q, r = row(vertices, corners[k]), row(vertices, corners[following(k)]), row(vertices, corners[previous(k)])
        if cosine(area_normal(p, q, r), area_normal(moved, q, r)) < MIN_COSINE:
            return False
        k = mates[previous(k)]
        if k == first:
            return True


@njit(cache=True, error_model="numpy", fastmath=FAST)
def relax_round(vertices, corners, mates, first, step):
    """Move each vertex in place, tangentially, by `step` towards the centroid of its triangles, if none turns over."""
    normal, center, moved = np.zeros(3), np.zeros(3), np.zeros(3)
    for v in range(len(vertices)):
        if first[v] < 0:
            continue
        _one_ring(vertices, corners, mates, first[v], normal, center)
        square = dot = 0.0
        for i in range(3):
            square += normal[i] ** 2
            dot += normal[i] * (center[i] - vertices[v, i])
        part = dot / square if square > 0 else 0.0
        scale = step
        for _ in range(4):
            for i in range(3):
                moved[i] = vertices[v, i] + scale * (center[i] - vertices[v, i] - part * normal[i])
            if _move_is_valid(vertices, corners, mates, first[v], moved):
                for i in range(3):
                    vertices[v, i] = moved[i]
                break
            scale *= 0.5
