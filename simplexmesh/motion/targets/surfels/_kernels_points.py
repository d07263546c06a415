"""Signed distances along vertex normals to the blended surface of surfels."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import prange

from simplexmesh._base._kernels_both import Both
from simplexmesh._base._kernels_njit import LEAN, njit
from simplexmesh.motion.targets.surfels._kernels_nearest import (
    STALE,
    move_to_front,
    nearest_cached,
    nearest_searched,
    still_nearest,
)
from simplexmesh.motion.targets.surfels._kernels_patches import blended_height, closest_lane, single_height
from simplexmesh.numerics._kernels_vectors import dot, minus, row


@njit(**LEAN)
def _surface_gap(heads, neighbors, patches, i, place, direction):
    """Return the signed distance along a direction from a place to the surface near surfel `i`, NaN beside the data."""
    away, normal = minus(row(heads, i), place), (heads[i, 3], heads[i, 4], heads[i, 5])
    toward = dot(away, direction)
    facing = dot(normal, direction)
    if not abs(facing) > 0.0:
        return toward
    off = dot(away, normal)
    if dot(away, away) - off * off > heads[i, 7]:
        return math.nan
    plane = off / facing
    end = place[0] + plane * direction[0], place[1] + plane * direction[1], place[2] + plane * direction[2]
    along = np.float32(direction[0]), np.float32(direction[1]), np.float32(direction[2])
    for turn in range(5):
        scale = 1.0 / heads[i, 6]
        rise = minus(end, row(heads, i))
        far = dot(rise, rise) * scale * scale
        at = np.float32(rise[0] * scale), np.float32(rise[1] * scale), np.float32(rise[2] * scale)
        f0, f1, f2, total, nearer = blended_height(patches, i, at, along)
        if nearer == 0.0 or turn == 4:
            break
        i = np.int64(neighbors[i, closest_lane(patches, i, at) - 1])
    if far >= 4.0:
        return toward
    if total < 1e-3:  # outside of all supports
        f0, f1, f2 = single_height(patches, i, 0, at, along)
        total = np.float32(1.0)
    slope = abs(f1)
    if slope <= 0.1 * total:
        return toward
    root = 1.0 - 4.0 * f0 * f2 / (slope * slope)
    shift = -2.0 * f0 / (f1 * (1.0 + math.sqrt(root))) if root > 0.0 else -f0 / f1
    shift = heads[i, 6] * max(-1.0, min(1.0, shift))
    value = plane + shift
    return value if far <= 1.0 else toward + (2.0 - math.sqrt(far)) * (value - toward)


@partial(Both, pays_from=1500)  # a vertex costs 60 ns or more
def surfel_gaps(vertices, normals, center, reach, search, surfels, cache, out):
    """Fill the signed distance along each normal, NaN beyond `reach`; surfels are searched within `search`.

    Surfels are relative to `center`.
    """
    points, heads, oriented = surfels.points, surfels.heads, surfels.oriented
    neighbors, patches, known, listed = surfels.neighbors, surfels.patches, cache.known, cache.listed
    for r in prange(len(vertices)):
        v = np.int64(r)
        place = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        direction = row(normals, v)
        out[v] = math.nan
        if not (dot(direction, direction) > 0.0 and dot(place, place) < math.inf):
            continue
        query = place, direction, search
        i = np.int64(listed[v, 0])
        if not still_nearest(heads, patches, i, oriented, query):
            i = nearest_cached(points, heads, oriented, known, listed, v, query)
            if i == STALE:
                i = nearest_searched(surfels, cache, v, query)
            elif i >= 0:
                move_to_front(listed, v, i)
        if i >= 0:
            gap = _surface_gap(heads, neighbors, patches, i, place, direction)
            if abs(gap) <= reach:
                out[v] = gap
