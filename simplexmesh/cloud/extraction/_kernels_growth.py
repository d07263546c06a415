"""Growth over the graph of nearest neighbors, and labels that agree with their neighbors. Arrays in, arrays out."""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import LEAN, njit
from simplexmesh.data.primitives._kernels_profiles import at_point

jit = njit(cache=True, error_model="numpy")
lean = njit(**LEAN)


@lean
def at_normal(surface, points, normals, i):
    """Return the distance of a point from a surface, and the cosine of the angle between their normals."""
    _, _, _, distance, gx, gy, gz, _, _ = at_point(surface, points, i)
    frame = surface.frame
    nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
    facing = gx * (frame[0, 0] * nx + frame[0, 1] * ny + frame[0, 2] * nz)
    facing += gy * (frame[1, 0] * nx + frame[1, 1] * ny + frame[1, 2] * nz)
    facing += gz * (frame[2, 0] * nx + frame[2, 1] * ny + frame[2, 2] * nz)
    return distance, abs(facing)


@jit
def distances(surface, points, which):
    """Return distances (m,) of some points from a surface."""
    out = np.empty(len(which))
    for k in range(len(which)):
        out[k] = at_point(surface, points, which[k])[3]
    return out


@jit
def around(surface, graph, free, members, band, aslant):
    """Return how many neighbors of points, each as often as it is one, are free, and of those on a surface."""
    points, normals, near, rows, places = graph
    state = np.zeros(len(points), np.int8)
    left = close = 0
    for i in members:
        for j in near[places[i], 1:]:
            if free[rows[j]]:
                left += 1
                if state[j] == 0:
                    distance, facing = at_normal(surface, points, normals, j)
                    state[j] = 1 if abs(distance) <= band and facing >= aslant else 2
                close += state[j] == 1
    return left, close


@jit
def flood(surface, graph, free, seeds, band, aslant):
    """Return the free points (m,) on a surface within a band and facing as it does, reached over neighbors; distances.

    Points ascend.
    """
    points, normals, near, rows, places = graph
    state, on, off = np.zeros(len(points), np.int8), np.zeros(len(points), np.bool_), np.empty(len(points))
    out = np.empty(len(points), np.int64)
    tried, count, done = places[seeds], 0, 0
    while True:
        for j in tried:
            if state[j] == 0 and free[rows[j]]:
                distance, facing = at_normal(surface, points, normals, j)
                if abs(distance) <= band and facing >= aslant:
                    state[j], on[rows[j]], off[rows[j]] = 1, True, distance
                    out[count] = j
                    count += 1
                else:
                    state[j] = 2
        if done == count:
            members = np.flatnonzero(on)
            return members, off[members]
        tried, done = near[out[done]], done + 1


@jit
def settle(near, cost, none, pull, labels):
    """Let points take, in turn, the label of the least cost (n, m), less a pull for each neighbor that has it.

    Only labels that a neighbor has, or -1 at the cost `none`, are taken; neighbors (n, k) are -1 where there is none.
    `labels` (n,) are changed; returns how many.
    """
    changed = 0
    votes = np.zeros(cost.shape[1], np.int64)
    for i in range(len(near)):
        for j in near[i]:
            if j >= 0 and labels[j] >= 0:
                votes[labels[j]] += 1
        best, least = -1, none
        for j in near[i]:
            k = labels[j] if j >= 0 else -1
            if k >= 0 and votes[k] >= 0:
                value = cost[i, k] - pull * votes[k]
                if value < least:
                    best, least = k, value
        for j in near[i]:
            if j >= 0 and labels[j] >= 0:
                votes[labels[j]] = 0
        if best != labels[i]:
            labels[i] = best
            changed += 1
    return changed
