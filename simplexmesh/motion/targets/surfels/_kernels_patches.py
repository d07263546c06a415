"""Surfels packed with their neighbors for vector arithmetic, and the blending of their height functions.

A surfel's row: point, unit normal, second-order form (xx, yy, zz, xy, xz, yz); see `_kernels_fit`. Functions called per
vertex take all patches and the number of theirs; places and directions are relative to its surfel, in its supports.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST, LEAN, njit
from simplexmesh._base._kernels_rows import by_rows

LANES = 8  # surfels per patch


@njit(cache=True, error_model="numpy")
def _same_sheet(table, i, j, oriented):
    """Return the cosine between two surfels' normals, 0 beyond 60 degrees or if their line is not tangential."""
    dx, dy, dz = table[j, 0] - table[i, 0], table[j, 1] - table[i, 1], table[j, 2] - table[i, 2]
    nx, ny, nz = table[i, 3], table[i, 4], table[i, 5]
    agree = nx * table[j, 3] + ny * table[j, 4] + nz * table[j, 5]
    if (agree if oriented else abs(agree)) < 0.5:
        return 0.0
    rise = nx * dx + ny * dy + nz * dz
    return agree if rise * rise <= 0.36 * (dx * dx + dy * dy + dz * dz) else 0.0


@by_rows(1000)
def pack_patches(begin, end, table, support, neighbors, oriented, patches):
    """Fill `patches` (m, 14, 8) with each surfel and its seven nearest, side by side for vector arithmetic.

    Relative to the surfel, in units of its support. Rows: point, 1 / support^2, unit normal, second-order form, cosine
    to the surfel's normal. Normal and form are multiplied by the cosine, which flips surfels of opposite orientation;
    row 13 holds its absolute value. Surfels on another sheet have weight zero.
    """
    for i in range(begin, end):
        scale = 1.0 / support[i]
        for k in range(LANES):
            j = i if k == 0 else neighbors[i, k - 1]
            agree = 1.0 if k == 0 else 0.0 if j == i else _same_sheet(table, i, j, oriented)
            for r in range(3):
                patches[i, r, k] = (table[j, r] - table[i, r]) * scale
                patches[i, 4 + r, k] = table[j, 3 + r] * agree
            patches[i, 3, k] = (support[i] / support[j]) ** 2
            for r in range(6):
                patches[i, 7 + r, k] = table[j, 6 + r] * support[i] * agree
            patches[i, 13, k] = abs(agree)


@njit(**LEAN, fastmath=FAST)
def single_height(patches, i, k, place, along):
    """Return value, slope and half the second derivative along a direction of the height above lane `k` of a patch."""
    half = np.float32(0.5)
    (a, b, c), x, y, z = along, place[0] - patches[i, 0, k], place[1] - patches[i, 1, k], place[2] - patches[i, 2, k]
    nx, ny, nz = patches[i, 4, k], patches[i, 5, k], patches[i, 6, k]
    xx, yy, zz = patches[i, 7, k], patches[i, 8, k], patches[i, 9, k]
    xy, xz, yz = patches[i, 10, k], patches[i, 11, k], patches[i, 12, k]
    gx, gy, gz = xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
    hx, hy, hz = xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c
    return (
        nx * x + ny * y + nz * z - half * (gx * x + gy * y + gz * z),
        nx * a + ny * b + nz * c - (gx * a + gy * b + gz * c),
        -half * (hx * a + hy * b + hz * c),
    )


@njit(**LEAN, fastmath=FAST)
def lane_distance(patches, i, k, place):
    """Return the squared distance of a place from lane `k` of a patch."""
    x, y, z = place[0] - patches[i, 0, k], place[1] - patches[i, 1, k], place[2] - patches[i, 2, k]
    return x * x + y * y + z * z


@njit(**LEAN, fastmath=FAST)
def blended_height(patches, i, place, along):
    """Return what `single_height` does of the blended heights, their weight, and how many surfels are closer."""
    one, zero = np.float32(1.0), np.float32(0.0)
    total = f0 = f1 = f2 = closer = zero
    limit = (place[0] * place[0] + place[1] * place[1] + place[2] * place[2]) * np.float32(0.9999)
    for k in range(LANES):
        d = lane_distance(patches, i, k, place)
        share = patches[i, 13, k]
        closer += one if d < limit and share > zero else zero
        w = one - d * patches[i, 3, k]
        w = w if w > zero else zero
        w *= w
        height, slope, bend = single_height(patches, i, k, place, along)
        f0 += w * height
        f1 += w * slope
        f2 += w * bend
        total += w * share
    return f0, f1, f2, total, closer


@njit(**LEAN, fastmath=FAST)
def count_closer(patches, i, place, limit):
    """Return how many surfels of a patch are closer than sqrt(limit) to a place."""
    one, zero = np.float32(1.0), np.float32(0.0)
    count = zero
    for k in range(LANES):
        count += one if lane_distance(patches, i, k, place) < limit else zero
    return count


@njit(**LEAN)
def closest_lane(patches, i, place):
    """Return the lane of the surfel closest to a place among those on the sheet of the first."""
    best, lane = math.inf, 0
    for k in range(LANES):
        d = lane_distance(patches, i, k, place)
        if d < best and patches[i, 13, k] > 0.0:
            best, lane = d, k
    return lane


@by_rows(1000, fastmath=FAST)
def blend_all(begin, end, table, support, neighbors, oriented, out):
    """Fill `out` (m, 12) with each surfel averaged with its neighbors: their height functions, weighted by distance."""
    for i in range(begin, end):
        x, y, z = table[i, 0], table[i, 1], table[i, 2]
        total = value = gx = gy = gz = 0.0
        q = np.zeros(6)
        for k in range(-1, neighbors.shape[1]):
            j = i if k < 0 else neighbors[i, k]
            dx, dy, dz = x - table[j, 0], y - table[j, 1], z - table[j, 2]
            agree = 1.0 if k < 0 else 0.0 if j == i else _same_sheet(table, i, j, oriented)
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
        for k in range(table.shape[1]):
            out[i, k] = table[i, k]
        if not length > 0.3 * total:
            continue
        move = -value / length
        out[i, 0], out[i, 1], out[i, 2] = x + move * gx / length, y + move * gy / length, z + move * gz / length
        out[i, 3], out[i, 4], out[i, 5] = gx / length, gy / length, gz / length
        for r in range(6):
            out[i, 6 + r] = q[r] / length
