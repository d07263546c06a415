"""Signed distances along vertex normals to the blended surface of surfels."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_nearest import (
    HEAD,
    NONE,
    PATCH,
    move_to_front,
    nearest_cached,
    nearest_searched,
    prefetch_candidates,
    still_nearest,
)
from simplexmesh.motion.targets._kernels_patches import LANES, blended_height, closest_lane, single_height
from simplexmesh.motion.targets._kernels_pointers import data_pointer
from simplexmesh.motion.targets._kernels_wide import NEAREST

PREFETCH_AHEAD = 4  # vertices ahead for which data is prefetched


def pack_heads(table, support, between, horizon):
    """Return (m, 12): the data of each surfel that is read first per vertex.

    Point, unit normal (NaN without one), support and its inverse, squared tangential distance up to which there is
    data, squared distance of the nearest surfel outside of its patch; the rest is padding.
    """
    heads = np.zeros((len(table), HEAD))
    heads[:, :6] = table[:, :6]
    heads[~table[:, 3:6].any(axis=1), 3:6] = np.nan
    heads[:, 6], heads[:, 7] = support, 1.0 / support
    heads[:, 8], heads[:, 9] = 2.25 * horizon * horizon, between[:, LANES - 1] ** 2
    return heads


@njit(cache=True, error_model="numpy")
def _surface_gap(heads, neighbors, width, patches, i, x, y, z, a, b, c):
    """Return the signed distance along (a, b, c) from a point to the surface near surfel `i`, NaN beside the data."""
    h = i * HEAD
    px, py, pz = heads[h] - x, heads[h + 1] - y, heads[h + 2] - z
    toward = px * a + py * b + pz * c
    nx, ny, nz = heads[h + 3], heads[h + 4], heads[h + 5]
    facing = nx * a + ny * b + nz * c
    if not abs(facing) > 0.0:
        return toward
    off = px * nx + py * ny + pz * nz
    aside = px * px + py * py + pz * pz - off * off
    if aside > heads[h + 8]:
        return math.nan
    plane = off / facing
    qx, qy, qz = x + plane * a, y + plane * b, z + plane * c
    fa, fb, fc = np.float32(a), np.float32(b), np.float32(c)
    for turn in range(5):
        scale = heads[h + 7]
        rx, ry, rz = (qx - heads[h]) * scale, (qy - heads[h + 1]) * scale, (qz - heads[h + 2]) * scale
        ux, uy, uz = np.float32(rx), np.float32(ry), np.float32(rz)
        f0, f1, f2, total, nearer = blended_height(patches, i * PATCH, ux, uy, uz, fa, fb, fc)
        if nearer == 0.0 or turn == 4:
            break
        i = np.int64(neighbors[i * width + closest_lane(patches, i * PATCH, ux, uy, uz) - 1])
        h = i * HEAD
    far = rx * rx + ry * ry + rz * rz
    if far >= 4.0:
        return toward
    if total < 1e-3:  # outside of all supports
        f0, f1, f2 = single_height(patches, i * PATCH, ux, uy, uz, fa, fb, fc)
        total = np.float32(1.0)
    slope = abs(f1)
    if slope <= 0.1 * total:
        return toward
    root = 1.0 - 4.0 * f0 * f2 / (slope * slope)
    shift = -2.0 * f0 / (f1 * (1.0 + math.sqrt(root))) if root > 0.0 else -f0 / f1
    shift = heads[h + 6] * max(-1.0, min(1.0, shift))
    value = plane + shift
    return value if far <= 1.0 else toward + (2.0 - math.sqrt(far)) * (value - toward)


@partial(Both, pays_from=1500)  # a vertex costs 40 ns or more
def surfel_gaps(
    vertices, normals, center, reach, search, heads, points, neighbors, patches, tree, oriented, cache, out
):
    """Fill the signed distance along each normal, NaN beyond `reach`; surfels are searched within `search`.

    Surfels are relative to `center`; `tree` is from `_kernels_wide.pack_wide`. `cache` is two arrays, (n, 8) of float
    and (n, 16) of int32, see `_kernels_nearest`.
    """
    nodes, leaves, first, slack, inner, base = tree
    state, lists = cache
    limit, fold, width = search * search, 1.0 if oriented else -1.0, neighbors.shape[1]
    for row in prange(len(vertices)):
        v = np.int64(row)
        x, y, z = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        out[v] = math.nan
        if not (a * a + b * b + c * c > 0.0 and abs(x) + abs(y) + abs(z) < math.inf):
            continue  # the tree requires finite positions
        if v + PREFETCH_AHEAD < len(vertices):
            arrays = data_pointer(points), data_pointer(heads), data_pointer(patches), data_pointer(lists)
            prefetch_candidates(*arrays, v + PREFETCH_AHEAD)
        i = np.int64(lists[v, 0])
        if not still_nearest(data_pointer(heads), data_pointer(patches), i, x, y, z, a, b, c, fold, limit):
            around = data_pointer(points), data_pointer(heads), data_pointer(state), data_pointer(lists), v
            i = nearest_cached(*around, x, y, z, a, b, c, fold, limit)
            if i < 0:
                blocks = (
                    data_pointer(nodes),
                    data_pointer(leaves),
                    data_pointer(first),
                    data_pointer(slack),
                    inner,
                    base,
                )
                i = nearest_searched(*around, blocks, x, y, z, a, b, c, fold, limit)
            elif i != np.int64(lists[v, 0]):
                move_to_front(data_pointer(lists), v * NEAREST, i)
        if i < NONE:
            gap = _surface_gap(
                data_pointer(heads), data_pointer(neighbors), width, data_pointer(patches), i, x, y, z, a, b, c
            )
            if abs(gap) <= reach:
                out[v] = gap
