"""Depths of vertices below a border, meshes without their outermost rows, and polynomial fits of several sizes."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface.curvature._kernels_adaptive import SHORTER, affordable, workspace
from simplexmesh.surface.curvature._kernels_adaptive_balls import collected, gathered, jit, mean_direction, seen
from simplexmesh.surface.curvature._kernels_adaptive_jets import (
    bending,
    factored,
    flattened,
    framed,
    normal_equations,
    solved,
)

LOWEST, HIGHEST = 2, 4
"""Degrees of the fits."""

MOST, TRIES = 640, 8
"""Most points gathered, and how often a ball of more is shortened, by `SHORTER`: a truncated one would depend on the
numbering."""


@njit(cache=True)
def depths(offsets, members, closed, most):
    """Return the number of edges from each vertex to the nearest border, most + 1 where that exceeds `most`."""
    n = closed.shape[0]
    out, queue, stop = np.full(n, most + 1, np.int64), np.empty(n, np.int64), 0
    for i in range(n):
        if not closed[i]:
            out[i] = 0
            queue[stop] = i
            stop += 1
    start = 0
    while start < stop:
        i = queue[start]
        start += 1
        for m in range(offsets[i], offsets[i + 1]):
            j = members[m]
            if out[i] < most and out[j] > most:
                out[j] = out[i] + 1
                queue[stop] = j
                stop += 1
    return out


@njit(cache=True)
def peeled(offsets, members, depths, least):
    """Return the adjacency (CSR) of the vertices of at least this depth; the others lose all neighbors."""
    starts, kept, stop = np.zeros(offsets.shape[0], np.int64), np.empty(members.shape[0], np.int64), 0
    for i in range(depths.shape[0]):
        if depths[i] >= least:
            for m in range(offsets[i], offsets[i + 1]):
                if depths[members[m]] >= least:
                    kept[stop] = members[m]
                    stop += 1
        starts[i + 1] = stop
    return starts, kept[:stop]


@jit
def plain(kept, work, radius, means):
    """Fit polynomials of degrees 2, 3 and 4, write their H, and return whether the positions determine them."""
    _, _, places, heights, columns, sums, matrix, vectors, frame = work
    u, v, z, y, x = heights[0], heights[1], heights[2], vectors[0], vectors[1]
    if not flattened(places, kept, frame, u, v, z, matrix, y, x):
        return False
    highest = affordable(kept, HIGHEST)
    terms = (highest + 1) * (highest + 2) // 2
    normal_equations(highest, u, v, z, kept, columns, sums, matrix, y)
    if factored(matrix, y, terms) < terms:
        return False
    for degree in range(LOWEST, HIGHEST + 1):
        lower = min(degree, highest)
        solved(matrix, y, (lower + 1) * (lower + 2) // 2, x)
        means[degree - LOWEST] = bending(x)[0] / radius
    return True


@Both
def plain_fits(centers, offsets, members, points, directions, oriented, radii, full, chunks, means, lean, inward):
    """Fit polynomials of degrees 2, 3 and 4 to the ball of each radius: `means[row, k, d - 2]` is their H.

    Balls of more than `full[k]` points are shortened. `inward` gets the mean position of the last ball's points from
    the center, in its radius, and `lean` the length of its tangential part. NaN where a fit is not determined.
    """
    for chunk in prange(chunks):
        stamps, work = np.full(points.shape[0], -1, np.int32), workspace(MOST)
        found, around, places, frame, stamp = work[0], work[1], work[2], work[8], 0
        for row in range(chunk * centers.shape[0] // chunks, (chunk + 1) * centers.shape[0] // chunks):
            center = centers[row]
            means[row] = np.nan
            for k in range(radii.shape[1]):
                radius = radii[row, k]
                for _again in range(TRIES):
                    stamp += 1
                    count = gathered(offsets, members, points, center, radius, stamps, stamp, found)
                    if count < MOST:
                        break
                    radius *= SHORTER
                radius *= math.sqrt(min(1.0, full[k] / count))
                collected(found, count, points, directions, around)
                nx, ny, nz = mean_direction(around, count, oriented)
                kept = seen(around, count, nx, ny, nz, oriented, radius, places)
                framed(nx, ny, nz, frame)
                if kept < 7 or not plain(kept, work, radius, means[row, k]):
                    break
            else:
                square = 0.0
                for axis in range(3):
                    for k in range(kept):
                        inward[row, axis] += places[axis, k] / kept
                    square += inward[row, axis] ** 2
                height = nx * inward[row, 0] + ny * inward[row, 1] + nz * inward[row, 2]
                lean[row] = math.sqrt(max(square - height * height, 0.0))
