"""How far along its normal is the blended surface of surfels from each vertex.

A surfel's row: point, unit normal, second-order form (xx, yy, zz, xy, xz, yz); see `_kernels_fit`.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit, prange

from simplexmesh.motion._kernels import Both
from simplexmesh.motion.targets._kernels_patches import LANES, alone, blended, closer, rivals
from simplexmesh.motion.targets._kernels_tree import box_distance

FACING = 0.2  # smallest cosine between a vertex's normal and that of the data it may see


@njit(cache=True, error_model="numpy")
def _faces(table, j, a, b, c, oriented):
    """Tell whether a surfel may be seen along the normal (a, b, c); one without a normal always may."""
    nx, ny, nz = table[j, 3], table[j, 4], table[j, 5]
    d = nx * a + ny * b + nz * c
    if not oriented:
        d = abs(d)
    return d > FACING or (nx == 0.0 and ny == 0.0 and nz == 0.0)


@njit(cache=True, error_model="numpy")
def _squared(table, j, x, y, z):
    dx, dy, dz = table[j, 0] - x, table[j, 1] - y, table[j, 2] - z
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def _search(table, starts, ends, boxes, x, y, z, a, b, c, oriented, squared, index):
    """Return the nearest surfel that faces the right way and is nearer than (squared, index), in the tree's order."""
    stack = np.empty(96, np.int64)
    top = 0
    stack[0] = 0
    while top >= 0:
        node = stack[top]
        top -= 1
        if box_distance(boxes, node, x, y, z) > squared:
            continue
        if 2 * node + 2 >= len(starts):
            for j in range(starts[node], ends[node]):
                d = _squared(table, j, x, y, z)
                if (d < squared or (d == squared and j < index)) and _faces(table, j, a, b, c, oriented):
                    squared = d
                    index = j
            continue
        first, second = 2 * node + 1, 2 * node + 2
        if box_distance(boxes, second, x, y, z) < box_distance(boxes, first, x, y, z):
            first, second = second, first
        stack[top + 1] = second
        stack[top + 2] = first
        top += 2
    return index


@njit(cache=True, error_model="numpy")
def nearest_facing(table, neighbors, between, horizon, starts, ends, boxes, x, y, z, a, b, c, oriented, limit, start):
    """Return the nearest surfel within sqrt(limit) that faces the right way, or -1: a walk from `start`, with a proof.

    A surfel at distance d from surfel i is at least d - |v - i| from v: the neighbors of i, nearest first, need only be
    read until that exceeds the best; what stands when the reading ends is the nearest, wherever the walk began. Where
    the neighbors end first the walk goes on; where it gets stuck, the tree is searched, bounded by the best.
    """
    here = start
    best, found = math.inf, -1
    for _ in range(12):
        squared = _squared(table, here, x, y, z)
        own = math.sqrt(squared)
        best, found, reach = math.inf, -1, math.inf
        if _faces(table, here, a, b, c, oriented):
            best, found, reach = squared, here, own
        closest, step = squared, here
        proved = False
        for k in range(neighbors.shape[1]):
            if between[here, k] - own > reach:
                proved = True
                break
            j = neighbors[here, k]
            d = _squared(table, j, x, y, z)
            if d < closest:
                closest, step = d, j
            if (d < best or (d == best and j < found)) and _faces(table, j, a, b, c, oriented):
                best, found, reach = d, j, math.sqrt(d)
        if proved or horizon[here] - own > reach:
            return found if best <= limit else -1
        if step == here:
            break
        here = step
    if best > limit:
        best, found = limit, len(table)
    found = _search(table, starts, ends, boxes, x, y, z, a, b, c, oriented, best, found)
    return found if found < len(table) else -1


@njit(cache=True, error_model="numpy")
def _along(table, support, neighbors, horizon, patches, i, x, y, z, a, b, c):
    """Return the signed distance along (a, b, c) from a place to the surface near surfel `i`, NaN beside the data."""
    px, py, pz = table[i, 0] - x, table[i, 1] - y, table[i, 2] - z
    toward = px * a + py * b + pz * c
    nx, ny, nz = table[i, 3], table[i, 4], table[i, 5]
    facing = nx * a + ny * b + nz * c
    if facing == 0.0:
        return toward
    off = px * nx + py * ny + pz * nz
    aside = px * px + py * py + pz * pz - off * off
    if aside > 2.25 * horizon[i] * horizon[i]:
        return math.nan
    plane = off / facing
    qx, qy, qz = x + plane * a, y + plane * b, z + plane * c
    at = i
    fa, fb, fc = np.float32(a), np.float32(b), np.float32(c)
    for turn in range(5):
        scale = 1.0 / support[at]
        rx, ry, rz = (qx - table[at, 0]) * scale, (qy - table[at, 1]) * scale, (qz - table[at, 2]) * scale
        ux, uy, uz = np.float32(rx), np.float32(ry), np.float32(rz)
        f0, f1, f2, total, nearer = blended(patches[at], ux, uy, uz, fa, fb, fc)
        if nearer == 0.0 or turn == 4:
            break
        at = neighbors[at, closer(patches[at], ux, uy, uz) - 1]
    far = rx * rx + ry * ry + rz * rz
    if far >= 4.0:
        return toward
    if total < 1e-3:  # between supports the nearest surfel speaks alone
        f0, f1, f2 = alone(patches[at], ux, uy, uz, fa, fb, fc)
        total = np.float32(1.0)
    slope = abs(f1)
    if slope <= 0.1 * total:
        return toward
    root = 1.0 - 4.0 * f0 * f2 / (slope * slope)
    shift = -2.0 * f0 / (f1 * (1.0 + math.sqrt(root))) if root > 0.0 else -f0 / f1
    shift = support[at] * max(-1.0, min(1.0, shift))
    value = plane + shift
    if far <= 1.0:
        return value
    return toward + (2.0 - math.sqrt(far)) * (value - toward)


@partial(Both, pays_from=1500)  # a vertex costs 60 ns or more
def surfel_gaps(
    vertices,
    normals,
    center,
    reach,
    search,
    table,
    support,
    neighbors,
    between,
    horizon,
    patches,
    starts,
    ends,
    boxes,
    oriented,
    state,
    out,
):
    """Fill the signed distance along each normal, NaN beyond `reach`; surfels are looked for up to `search`.

    Surfels are given from `center`.
    `state` keeps the nearest surfel. Where that of the last call still is clearly nearer than the seven around it, and
    by less than half of the way to the eighth, it still is the nearest of all; otherwise it is looked for.
    """
    limit = search * search
    for v in prange(len(vertices)):
        x, y, z = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        out[v] = math.nan
        if not a * a + b * b + c * c > 0.0:
            continue
        i = np.int64(state[v])
        squared = _squared(table, i, x, y, z)
        known = False
        if 4.0 * squared < between[i, LANES - 1] ** 2 and squared <= limit and _faces(table, i, a, b, c, oriented):
            scale = 1.0 / support[i]
            ux, uy, uz = (x - table[i, 0]) * scale, (y - table[i, 1]) * scale, (z - table[i, 2]) * scale
            d = np.float32(squared * scale * scale * 1.0001)
            known = rivals(patches[i], np.float32(ux), np.float32(uy), np.float32(uz), d) == 1.0
        if not known:
            i = nearest_facing(
                table, neighbors, between, horizon, starts, ends, boxes, x, y, z, a, b, c, oriented, limit, i
            )
            if i < 0:
                continue
            state[v] = i
        gap = _along(table, support, neighbors, horizon, patches, i, x, y, z, a, b, c)
        if abs(gap) <= reach:
            out[v] = gap
