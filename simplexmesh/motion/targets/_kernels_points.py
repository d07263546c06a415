"""How far along its normal is the blended surface of surfels from each vertex."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit, prange

from simplexmesh.motion._kernels import Both
from simplexmesh.motion.targets._kernels_nearest import FACING, TURN, beyond, nearest_facing, nearest_in_patch
from simplexmesh.motion.targets._kernels_patches import LANES, alone, blended, closer, rivals
from simplexmesh.motion.targets._kernels_pointers import start

HEAD = 12  # numbers of a surfel's head: see `pack_heads`
PATCH = 14 * LANES
ROUNDING = 1.0 + 1e-12
MARGIN = 1.1  # a nearest surfel becomes the anchor where what is outside its patch is farther by this


def pack_heads(table, support, between, horizon):
    """Return (m, 12) what a vertex asks of its surfel first, side by side.

    Point, unit normal, support and its inverse, distance of the nearest surfel outside its patch, square of how far
    aside of it there still is data, smallest cosine of a normal that sees it (below any for one without a normal).
    """
    heads = np.zeros((len(table), HEAD))
    heads[:, :6] = table[:, :6]
    heads[:, 6], heads[:, 7] = support, 1.0 / support
    heads[:, 8], heads[:, 9] = between[:, LANES - 1], 2.25 * horizon * horizon
    heads[:, 10] = np.where(table[:, 3:6].any(axis=1), FACING, -1.0)
    return heads


@njit(cache=True, error_model="numpy")
def _along(heads, neighbors, width, patches, i, x, y, z, a, b, c):
    """Return the signed distance along (a, b, c) from a place to the surface near surfel `i`, NaN beside the data."""
    h = i * HEAD
    px, py, pz = heads[h] - x, heads[h + 1] - y, heads[h + 2] - z
    toward = px * a + py * b + pz * c
    nx, ny, nz = heads[h + 3], heads[h + 4], heads[h + 5]
    facing = nx * a + ny * b + nz * c
    if facing == 0.0:
        return toward
    off = px * nx + py * ny + pz * nz
    aside = px * px + py * py + pz * pz - off * off
    if aside > heads[h + 9]:
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
    if far <= 1.0:
        return value
    return toward + (2.0 - math.sqrt(far)) * (value - toward)


@njit(cache=True, error_model="numpy")
def _still_nearest(heads, patches, memory, m, x, y, z, a, b, c, oriented, limit):
    """Tell whether a vertex's anchor is the nearest surfel that faces the right way, at a glance; False if in doubt."""
    i = np.int64(memory[m + 7])
    h = i * HEAD
    dx, dy, dz = x - heads[h], y - heads[h + 1], z - heads[h + 2]
    squared = dx * dx + dy * dy + dz * dz
    facing = heads[h + 3] * a + heads[h + 4] * b + heads[h + 5] * c
    if squared > limit or not (facing if oriented else abs(facing)) > heads[h + 10]:
        return False
    if not 4.0 * squared < heads[h + 8] ** 2 and not math.sqrt(squared) < _bound(memory, m, x, y, z, a, b, c):
        return False
    scale = heads[h + 7]
    d = np.float32(squared * scale * scale * 1.0001)
    ux, uy, uz = np.float32(dx * scale), np.float32(dy * scale), np.float32(dz * scale)
    return rivals(patches, i * PATCH, ux, uy, uz, d) == 1.0


@njit(cache=True, error_model="numpy")
def _bound(memory, m, x, y, z, a, b, c):
    """Return how near no surfel outside the anchor's patch is: what was found out last, less the way gone since."""
    dx, dy, dz = x - memory[m], y - memory[m + 1], z - memory[m + 2]
    da, db, dc = a - memory[m + 3], b - memory[m + 4], c - memory[m + 5]
    if da * da + db * db + dc * dc > 0.98 * TURN * TURN:
        return 0.0
    return memory[m + 6] - ROUNDING * math.sqrt(dx * dx + dy * dy + dz * dz)


@partial(Both, pays_from=1500)  # a vertex costs 40 ns or more
def surfel_gaps(
    vertices,
    normals,
    center,
    reach,
    search,
    heads,
    points,
    table,
    neighbors,
    between,
    horizon,
    patches,
    starts,
    ends,
    boxes,
    oriented,
    memory,
    out,
):
    """Fill the signed distance along each normal, NaN beyond `reach`; surfels are looked for up to `search`.

    Surfels are given from `center`.

    `memory` (n, 8) keeps, per vertex, the place and the normal for which a nearest surfel was last looked for, how near
    no surfel outside of the anchor's patch was then, and the anchor. A vertex that has gone less far than that leaves
    room for need look at the patch only, and finds the same surfel as a search would; see `nearest_facing`.
    """
    limit = search * search
    for v in prange(len(vertices)):
        x, y, z = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        out[v] = math.nan
        if not a * a + b * b + c * c > 0.0:
            continue
        i = np.int64(memory[v, 7])
        m = np.int64(v) * 8
        if not _still_nearest(start(heads), start(patches), start(memory), m, x, y, z, a, b, c, oriented, limit):
            bound, known, anchor = _bound(start(memory), m, x, y, z, a, b, c), False, i
            if bound > 0.0:
                found, squared = nearest_in_patch(points, table, neighbors, i, x, y, z, a, b, c, oriented)
                known = min(math.sqrt(squared), search) < bound
            if known:
                i = found if squared <= limit else np.int64(-1)
                if i >= 0 and i != anchor:
                    bound = beyond(points, neighbors, horizon, i, x, y, z)
                    if bound > MARGIN * math.sqrt(squared):
                        anchor = i
            else:
                if i == 0 and m > 0:  # never asked about: start from the vertex before
                    i = np.int64(memory[v - 1, 7])
                i, anchor, bound = nearest_facing(
                    points,
                    table,
                    neighbors,
                    between,
                    horizon,
                    starts,
                    ends,
                    boxes,
                    x,
                    y,
                    z,
                    a,
                    b,
                    c,
                    oriented,
                    limit,
                    i,
                )
            if not known or anchor != np.int64(memory[v, 7]):
                memory[v, 0], memory[v, 1], memory[v, 2] = x, y, z
                memory[v, 3], memory[v, 4], memory[v, 5] = a, b, c
                memory[v, 6], memory[v, 7] = bound / ROUNDING, anchor
            if i < 0:
                continue
        gap = _along(start(heads), start(neighbors), neighbors.shape[1], start(patches), i, x, y, z, a, b, c)
        if abs(gap) <= reach:
            out[v] = gap
