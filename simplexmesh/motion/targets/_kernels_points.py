"""How far along its normal is the blended surface of surfels from each vertex.

A surfel's row: point, unit normal, second-order form (xx, yy, zz, xy, xz, yz); see `_kernels_surfels`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

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
def nearest_facing(table, neighbors, horizon, starts, ends, boxes, x, y, z, a, b, c, oriented, limit, start):
    """Return the nearest surfel within sqrt(limit) that faces the right way, or -1: a walk from `start`, then a proof.

    All surfels that are not neighbors of i are at least ``horizon[i] - |v - i|`` from v: a walk that ends nearer than
    that has found the nearest, whatever it started from. Where it has not, the tree is searched, bounded by the best.
    """
    here = start
    best, found = math.inf, -1
    for _ in range(12):
        own = _squared(table, here, x, y, z)
        best, found = math.inf, -1
        if _faces(table, here, a, b, c, oriented):
            best, found = own, here
        closest, step = own, here
        for k in range(neighbors.shape[1]):
            j = neighbors[here, k]
            d = _squared(table, j, x, y, z)
            if d < closest:
                closest, step = d, j
            if d < best or (d == best and j < found):
                if _faces(table, j, a, b, c, oriented):
                    best, found = d, j
        if math.sqrt(best) + math.sqrt(own) < horizon[here]:
            return found if best <= limit else -1
        if step == here:
            break
        here = step
    if best > limit:
        best, found = limit, len(table)
    found = _search(table, starts, ends, boxes, x, y, z, a, b, c, oriented, best, found)
    return found if found < len(table) else -1


@njit(cache=True, error_model="numpy")
def _blended(table, support, neighbors, i, sign, x, y, z, a, b, c):
    """Return (value, slope, second order, weight, nearest) along (a, b, c) of the surfels around `i`, blended at a place."""
    total = f0 = f1 = f2 = 0.0
    nx, ny, nz = sign * table[i, 3], sign * table[i, 4], sign * table[i, 5]
    closest, nearest = math.inf, i
    for k in range(-1, neighbors.shape[1]):
        j = i if k < 0 else neighbors[i, k]
        dx, dy, dz = x - table[j, 0], y - table[j, 1], z - table[j, 2]
        d = dx * dx + dy * dy + dz * dz
        jx, jy, jz = table[j, 3], table[j, 4], table[j, 5]
        agree = jx * nx + jy * ny + jz * nz
        if d < closest and abs(agree) > 0.5:
            closest, nearest = d, j
        w = 1.0 - d / (support[j] * support[j])
        if w <= 0.0:
            continue
        w *= w * agree  # agree carries the sign that turns the neighbour the same way
        if abs(agree) < 0.5:
            continue
        gx = table[j, 6] * dx + table[j, 9] * dy + table[j, 10] * dz
        gy = table[j, 9] * dx + table[j, 7] * dy + table[j, 11] * dz
        gz = table[j, 10] * dx + table[j, 11] * dy + table[j, 8] * dz
        hx = table[j, 6] * a + table[j, 9] * b + table[j, 10] * c
        hy = table[j, 9] * a + table[j, 7] * b + table[j, 11] * c
        hz = table[j, 10] * a + table[j, 11] * b + table[j, 8] * c
        f0 += w * (jx * dx + jy * dy + jz * dz - 0.5 * (gx * dx + gy * dy + gz * dz))
        f1 += w * (jx * a + jy * b + jz * c - (gx * a + gy * b + gz * c))
        f2 -= w * 0.5 * (hx * a + hy * b + hz * c)
        total += abs(w)
    return f0, f1, f2, total, nearest


@njit(cache=True, error_model="numpy")
def _along(table, support, neighbors, i, x, y, z, a, b, c):
    """Return the signed distance along the unit vector (a, b, c) from a place to the surface near surfel `i`, or NaN."""
    px, py, pz = table[i, 0] - x, table[i, 1] - y, table[i, 2] - z
    toward = px * a + py * b + pz * c
    nx, ny, nz = table[i, 3], table[i, 4], table[i, 5]
    facing = nx * a + ny * b + nz * c
    if facing == 0.0:
        return toward
    off = px * nx + py * ny + pz * nz
    aside = px * px + py * py + pz * pz - off * off
    if aside > 9.0 * support[i] * support[i]:
        return math.nan  # beside the data, over a hole or beyond a border
    plane = off / facing
    sign = 1.0 if facing > 0.0 else -1.0
    at = i
    shift = 0.0
    value = plane
    for _ in range(4):
        qx, qy, qz = x + value * a, y + value * b, z + value * c
        f0, f1, f2, total, nearest = _blended(table, support, neighbors, at, sign, qx, qy, qz, a, b, c)
        if nearest != at:
            if (
                table[nearest, 3] * table[at, 3] + table[nearest, 4] * table[at, 4] + table[nearest, 5] * table[at, 5]
            ) < 0.0:
                sign = -sign
            at = nearest
            continue
        break
    if total == 0.0 or f1 <= 0.1 * total:
        return toward
    root = f1 * f1 - 4.0 * f0 * f2
    shift = -2.0 * f0 / (f1 + math.sqrt(root)) if root > 0.0 else -f0 / f1
    dx, dy, dz = qx - table[at, 0], qy - table[at, 1], qz - table[at, 2]
    far = math.sqrt(dx * dx + dy * dy + dz * dz) / support[at]
    trust = min(1.0, max(0.0, 2.0 - 2.0 * far)) if far > 0.5 else 1.0
    shift = max(-support[at], min(support[at], shift))
    return toward + trust * (value + shift - toward)


@njit(cache=True, error_model="numpy", parallel=True)
def surfel_gaps(
    vertices, normals, reach, table, support, neighbors, horizon, starts, ends, boxes, oriented, state, out
):
    """Fill the signed distance along each normal, NaN where nothing is within `reach`; `state` keeps where walks ended."""
    limit = reach * reach
    for v in prange(len(vertices)):
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        out[v] = math.nan
        if not a * a + b * b + c * c > 0.0:
            continue
        i = nearest_facing(table, neighbors, horizon, starts, ends, boxes, x, y, z, a, b, c, oriented, limit, state[v])
        if i < 0:
            continue
        state[v] = i
        gap = _along(table, support, neighbors, i, x, y, z, a, b, c)
        if abs(gap) <= reach:
            out[v] = gap
