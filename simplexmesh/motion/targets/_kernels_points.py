"""How far along its normal is the blended surface of surfels from each vertex."""

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
    fetch_kept,
    put_first,
    remembered,
    searched,
    still_nearest,
)
from simplexmesh.motion.targets._kernels_patches import LANES, alone, blended, closer
from simplexmesh.motion.targets._kernels_pointers import start
from simplexmesh.motion.targets._kernels_wide import NEAREST

SOON = 4  # vertices ahead of which memory is asked for what they need


def pack_heads(table, support, between, horizon):
    """Return (m, 12) what a vertex asks of its surfel first, side by side.

    Point, unit normal (NaN without one), support and its inverse, squares of how far aside of it there still is data
    and of how far the nearest surfel outside of its patch is; the rest is not used.
    """
    heads = np.zeros((len(table), HEAD))
    heads[:, :6] = table[:, :6]
    heads[~table[:, 3:6].any(axis=1), 3:6] = np.nan
    heads[:, 6], heads[:, 7] = support, 1.0 / support
    heads[:, 8], heads[:, 9] = 2.25 * horizon * horizon, between[:, LANES - 1] ** 2
    return heads


@njit(cache=True, error_model="numpy")
def _along(heads, neighbors, width, patches, i, x, y, z, a, b, c):
    """Return the signed distance along (a, b, c) from a place to the surface near surfel `i`, NaN beside the data."""
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
        f0, f1, f2, total, nearer = blended(patches, i * PATCH, ux, uy, uz, fa, fb, fc)
        if nearer == 0.0 or turn == 4:
            break
        i = np.int64(neighbors[i * width + closer(patches, i * PATCH, ux, uy, uz) - 1])
        h = i * HEAD
    far = rx * rx + ry * ry + rz * rz
    if far >= 4.0:
        return toward
    if total < 1e-3:  # between supports the nearest surfel speaks alone
        f0, f1, f2 = alone(patches, i * PATCH, ux, uy, uz, fa, fb, fc)
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
    vertices, normals, center, reach, search, heads, points, neighbors, patches, tree, oriented, memory, out
):
    """Fill the signed distance along each normal, NaN beyond `reach`; surfels are looked for up to `search`.

    Surfels are given from `center`; `tree` is what `_kernels_wide.pack_wide` makes of them. `memory` is two arrays,
    (n, 8) of float and (n, 16) of int32, see `_kernels_nearest`.
    """
    nodes, leaves, first, room, inner, base = tree
    kept, lists = memory
    limit, fold, width = search * search, 1.0 if oriented else -1.0, neighbors.shape[1]
    for row in prange(len(vertices)):
        v = np.int64(row)
        x, y, z = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        out[v] = math.nan
        if not (a * a + b * b + c * c > 0.0 and abs(x) + abs(y) + abs(z) < math.inf):
            continue  # the tree takes places for granted: boxes that are none are infinitely far from them
        if v + SOON < len(vertices):
            fetch_kept(start(points), start(heads), start(patches), start(lists), v + SOON)
        i = np.int64(lists[v, 0])
        if not still_nearest(start(heads), start(patches), i, x, y, z, a, b, c, fold, limit):
            around = start(points), start(heads), start(kept), start(lists), v
            i = remembered(*around, x, y, z, a, b, c, fold, limit)
            if i < 0:
                blocks = start(nodes), start(leaves), start(first), start(room), inner, base
                i = searched(*around, blocks, x, y, z, a, b, c, fold, limit)
            elif i != np.int64(lists[v, 0]):
                put_first(start(lists), v * NEAREST, i)
        if i < NONE:
            gap = _along(start(heads), start(neighbors), width, start(patches), i, x, y, z, a, b, c)
            if abs(gap) <= reach:
                out[v] = gap
