"""Consistent sides: signs of normals that agree along a tree, and whether triangles agree on which side is outward."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit


@njit(cache=True, error_model="numpy")
def agreements(offsets, members, points, normals, softening):
    """Return for each member the scalar product of its normal with its center's, reflected at their bisecting plane.

    It is 1 for normals of a circle through both points. `softening`, a squared length, weakens the reflection between
    close points, whose direction is mostly noise.
    """
    out = np.zeros(members.shape[0])
    for i in range(points.shape[0]):
        for m in range(offsets[i], offsets[i + 1]):
            out[m] = _agreement(points, normals, i, members[m], softening)
    return out


@njit(cache=True, error_model="numpy")
def _agreement(points, normals, i, j, softening):
    square = softening
    along_i = along_j = direct = 0.0
    for axis in range(3):
        step = points[j, axis] - points[i, axis]
        square += step * step
        along_i += normals[i, axis] * step
        along_j += normals[j, axis] * step
        direct += normals[i, axis] * normals[j, axis]
    if square > 0.0:
        direct -= 2.0 * along_i * along_j / square
    return direct


@njit(cache=True, error_model="numpy")
def propagated(offsets, members, points, normals, softening):
    """Return normals whose signs agree along the edges of a forest; outward by the volume of each tree."""
    out = normals.copy()
    n = out.shape[0]
    visited = np.zeros(n, np.bool_)
    queue = np.empty(n, np.int64)
    for root in range(n):
        if visited[root]:
            continue
        visited[root] = True
        queue[0] = root
        start, stop = 0, 1
        while start < stop:
            i = queue[start]
            start += 1
            for m in range(offsets[i], offsets[i + 1]):
                j = members[m]
                if not visited[j]:
                    visited[j] = True
                    queue[stop] = j
                    stop += 1
                    if _agreement(points, out, i, j, softening) < 0.0:
                        out[j] = -out[j]
        centroid = np.zeros(3)
        for k in range(stop):
            centroid += points[queue[k]] / stop
        volume = 0.0
        for k in range(stop):
            for axis in range(3):
                volume += out[queue[k], axis] * (points[queue[k], axis] - centroid[axis])
        if volume < 0.0:
            for k in range(stop):
                out[queue[k]] = -out[queue[k]]
    return out


@njit(cache=True)
def clashing_edges(offsets, ahead, behind):
    """Return how many edges all their triangles, copies counting once, traverse alike, from wedges of one-rings."""
    n = offsets.shape[0] - 1
    owner = np.full(n, -1, np.int64)  # of the counts: how many triangles leave a center for a vertex, or come from it
    leaving, coming = np.zeros(n, np.int8), np.zeros(n, np.int8)
    apex_leaving, apex_coming = np.zeros(n, np.int64), np.zeros(n, np.int64)
    count = 0
    for i in range(n):
        for wedge in range(offsets[i], offsets[i + 1]):
            j, k = ahead[wedge], behind[wedge]
            if owner[j] != i:
                owner[j], leaving[j], coming[j] = i, 0, 0
            if owner[k] != i:
                owner[k], leaving[k], coming[k] = i, 0, 0
            if leaving[j] == 0:
                leaving[j], apex_leaving[j] = 1, k
            elif apex_leaving[j] != k:
                leaving[j] = 2
            if coming[k] == 0:
                coming[k], apex_coming[k] = 1, j
            elif apex_coming[k] != j:
                coming[k] = 2
        for wedge in range(offsets[i], offsets[i + 1]):
            for j in (ahead[wedge], behind[wedge]):
                if j > i and max(leaving[j], coming[j]) == 2 and min(leaving[j], coming[j]) == 0:
                    count += 1
                    leaving[j] = coming[j] = 0
    return count
