"""How far along its normal is the blended surface of surfels from each vertex.

A surfel's row: point, unit normal, second-order form (xx, yy, zz, xy, xz, yz); see `_kernels_surfels`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from simplexmesh.motion._kernels import FAST, Both
from simplexmesh.motion.targets._kernels_tree import box_distance

WIDEST = 1.5  # no neighbor's support is wider than this, against a surfel's own: see `even_support`
LANES = 8  # surfels in a patch
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
def _kinship(table, i, j, oriented):
    """Return the cosine between the normals of two surfels of one sheet, 0 where they are not of one sheet.

    They are where they face alike within 60 degrees and the way from one to the other runs along the first.
    """
    dx, dy, dz = table[j, 0] - table[i, 0], table[j, 1] - table[i, 1], table[j, 2] - table[i, 2]
    nx, ny, nz = table[i, 3], table[i, 4], table[i, 5]
    agree = nx * table[j, 3] + ny * table[j, 4] + nz * table[j, 5]
    if (agree if oriented else abs(agree)) < 0.5:
        return 0.0
    rise = nx * dx + ny * dy + nz * dz
    return agree if rise * rise <= 0.36 * (dx * dx + dy * dy + dz * dz) else 0.0


@njit(cache=True, error_model="numpy", parallel=True)
def pack_patches(table, support, neighbors, oriented, patches):
    """Fill `patches` (m, 14, 8) with each surfel and its seven nearest, side by side for vector arithmetic.

    Relative to the surfel, in units of its support. Rows: point, 1 / support^2, unit normal, second-order form, cosine
    to the surfel's normal. Those that face the other way are turned (normal and form times the cosine, row 13 its
    size); those of another sheet have a share of zero.
    """
    for row in prange(len(table)):
        i = np.int64(row)  # the loop's own index is unsigned: together with signed ones it would become a float
        scale = 1.0 / support[i]
        for k in range(LANES):
            j = i if k == 0 else neighbors[i, k - 1]
            agree = 1.0 if k == 0 else 0.0 if j == i else _kinship(table, i, j, oriented)
            for r in range(3):
                patches[i, r, k] = (table[j, r] - table[i, r]) * scale
                patches[i, 4 + r, k] = table[j, 3 + r] * agree
            patches[i, 3, k] = (support[i] / support[j]) ** 2
            for r in range(6):
                patches[i, 7 + r, k] = table[j, 6 + r] * support[i] * agree
            patches[i, 13, k] = abs(agree)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _rivals(patch, x, y, z, limit):
    """Return how many of a patch's other surfels are nearer than sqrt(limit) to a place, all in units of the patch."""
    one, zero = np.float32(1.0), np.float32(0.0)
    count = zero
    for k in range(LANES):
        dx, dy, dz = x - patch[0, k], y - patch[1, k], z - patch[2, k]
        count += one if dx * dx + dy * dy + dz * dz < limit else zero
    return count


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _blended(patch, x, y, z, a, b, c):
    """Return (value, slope, second order, weight) of a patch's blended height along (a, b, c), and its rivals' number."""
    one, zero, half = np.float32(1.0), np.float32(0.0), np.float32(0.5)
    total = f0 = f1 = f2 = rivals = zero
    limit = (x * x + y * y + z * z) * np.float32(0.9999)
    for k in range(LANES):
        dx, dy, dz = x - patch[0, k], y - patch[1, k], z - patch[2, k]
        d = dx * dx + dy * dy + dz * dz
        share = patch[13, k]
        rivals += one if d < limit and share > zero else zero
        w = one - d * patch[3, k]
        w = w if w > zero else zero
        w *= w
        nx, ny, nz = patch[4, k], patch[5, k], patch[6, k]
        xx, yy, zz, xy, xz, yz = patch[7, k], patch[8, k], patch[9, k], patch[10, k], patch[11, k], patch[12, k]
        gx = xx * dx + xy * dy + xz * dz
        gy = xy * dx + yy * dy + yz * dz
        gz = xz * dx + yz * dy + zz * dz
        hx = xx * a + xy * b + xz * c
        hy = xy * a + yy * b + yz * c
        hz = xz * a + yz * b + zz * c
        f0 += w * (nx * dx + ny * dy + nz * dz - half * (gx * dx + gy * dy + gz * dz))
        f1 += w * (nx * a + ny * b + nz * c - (gx * a + gy * b + gz * c))
        f2 += w * (hx * a + hy * b + hz * c)
        total += w * share
    return f0, f1, -half * f2, total, rivals


@njit(cache=True, error_model="numpy")
def _closer(patch, x, y, z):
    """Return the lane of the surfel nearest to a place among those that face along with the first."""
    best, lane = math.inf, 0
    for k in range(LANES):
        dx, dy, dz = x - patch[0, k], y - patch[1, k], z - patch[2, k]
        d = dx * dx + dy * dy + dz * dz
        if d < best and patch[13, k] > 0.0:
            best, lane = d, k
    return lane


@njit(cache=True, error_model="numpy")
def _along(table, support, neighbors, patches, i, x, y, z, a, b, c):
    """Return the signed distance along (a, b, c) from a place to the surface near surfel `i`, NaN beside the data."""
    px, py, pz = table[i, 0] - x, table[i, 1] - y, table[i, 2] - z
    toward = px * a + py * b + pz * c
    nx, ny, nz = table[i, 3], table[i, 4], table[i, 5]
    facing = nx * a + ny * b + nz * c
    if facing == 0.0:
        return toward
    off = px * nx + py * ny + pz * nz
    aside = px * px + py * py + pz * pz - off * off
    if aside > 9.0 * support[i] * support[i]:
        return math.nan
    plane = off / facing
    qx, qy, qz = x + plane * a, y + plane * b, z + plane * c
    at = i
    fa, fb, fc = np.float32(a), np.float32(b), np.float32(c)
    for turn in range(5):
        scale = 1.0 / support[at]
        rx, ry, rz = (qx - table[at, 0]) * scale, (qy - table[at, 1]) * scale, (qz - table[at, 2]) * scale
        ux, uy, uz = np.float32(rx), np.float32(ry), np.float32(rz)
        f0, f1, f2, total, rivals = _blended(patches[at], ux, uy, uz, fa, fb, fc)
        if rivals == 0.0 or turn == 4:
            break
        at = neighbors[at, _closer(patches[at], ux, uy, uz) - 1]
    far = rx * rx + ry * ry + rz * rz
    if far >= 4.0:
        return toward
    slope = abs(f1)
    if total < 1e-3 or slope <= 0.1 * total:
        # between supports: the nearest surfel's plane
        side = table[at, 3] * a + table[at, 4] * b + table[at, 5] * c
        shift = -(table[at, 3] * rx + table[at, 4] * ry + table[at, 5] * rz)
        shift = shift / side if abs(side) > FACING else 0.0
    else:
        root = 1.0 - 4.0 * f0 * f2 / (slope * slope)
        shift = -2.0 * f0 / (f1 * (1.0 + math.sqrt(root))) if root > 0.0 else -f0 / f1
    shift = support[at] * max(-1.0, min(1.0, shift))
    value = plane + shift
    if far <= 1.0:
        return value
    return toward + (2.0 - math.sqrt(far)) * (value - toward)


@Both
def surfel_gaps(
    vertices,
    normals,
    reach,
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
    """Fill the signed distance along each normal, NaN where nothing is within `reach`; `state` keeps the nearest.

    Where the nearest surfel of the last call still is clearly nearer than the seven around it, and by less than half
    of the way to the eighth, it still is the nearest of all; otherwise it is looked for.
    """
    limit = reach * reach
    for v in prange(len(vertices)):
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
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
            known = _rivals(patches[i], np.float32(ux), np.float32(uy), np.float32(uz), d) == 1.0
        if not known:
            i = nearest_facing(
                table, neighbors, between, horizon, starts, ends, boxes, x, y, z, a, b, c, oriented, limit, i
            )
            if i < 0:
                continue
            state[v] = i
        gap = _along(table, support, neighbors, patches, i, x, y, z, a, b, c)
        if abs(gap) <= reach:
            out[v] = gap


@njit(cache=True, error_model="numpy", parallel=True)
def even_support(support, neighbors, out):
    """Fill `out` with the supports, none more than `WIDEST` times that of a neighbor."""
    for i in prange(len(support)):
        out[i] = support[i]
        for k in range(neighbors.shape[1]):
            out[i] = min(out[i], WIDEST * support[neighbors[i, k]])


@njit(cache=True, error_model="numpy", parallel=True, fastmath=FAST)
def blend_all(table, support, neighbors, oriented, out):
    """Fill `out` (m, 12) with each surfel averaged with its neighbors: their height functions, weighted by nearness."""
    for row in prange(len(table)):
        i = np.int64(row)  # the loop's own index is unsigned: together with signed ones it would become a float
        x, y, z = table[i, 0], table[i, 1], table[i, 2]
        total = value = gx = gy = gz = 0.0
        q = np.zeros(6)
        for k in range(-1, neighbors.shape[1]):
            j = i if k < 0 else neighbors[i, k]
            dx, dy, dz = x - table[j, 0], y - table[j, 1], z - table[j, 2]
            agree = 1.0 if k < 0 else 0.0 if j == i else _kinship(table, i, j, oriented)
            w = 1.0 - (dx * dx + dy * dy + dz * dz) / (support[j] * support[j])
            if w <= 0.0 or agree == 0.0:
                continue
            w *= w * agree
            hx = table[j, 6] * dx + table[j, 9] * dy + table[j, 10] * dz
            hy = table[j, 9] * dx + table[j, 7] * dy + table[j, 11] * dz
            hz = table[j, 10] * dx + table[j, 11] * dy + table[j, 8] * dz
            value += w * (table[j, 3] * dx + table[j, 4] * dy + table[j, 5] * dz - 0.5 * (hx * dx + hy * dy + hz * dz))
            gx += w * (table[j, 3] - hx)
            gy += w * (table[j, 4] - hy)
            gz += w * (table[j, 5] - hz)
            for r in range(6):
                q[r] += w * table[j, 6 + r]
            total += abs(w)
        length = math.sqrt(gx * gx + gy * gy + gz * gz)
        out[i] = table[i]
        if not length > 0.3 * total:
            continue
        move = -value / length
        out[i, 0], out[i, 1], out[i, 2] = x + move * gx / length, y + move * gy / length, z + move * gz / length
        out[i, 3], out[i, 4], out[i, 5] = gx / length, gy / length, gz / length
        for r in range(6):
            out[i, 6 + r] = q[r] / length
