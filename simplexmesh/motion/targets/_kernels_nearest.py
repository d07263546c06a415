"""The nearest surfel that faces the right way, with a proof, and a bound that tells how long it will stay so.

A surfel's row: point, unit normal, second-order form (xx, yy, zz, xy, xz, yz); see `_kernels_fit`.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import njit

from simplexmesh.motion.targets._kernels_patches import LANES
from simplexmesh.motion.targets._kernels_pointers import floats, integers
from simplexmesh.motion.targets._kernels_tree import box_distance

FACING = 0.2  # smallest cosine between a vertex's normal and that of the data it may see
TURN = 0.15  # bounds hold while a normal has moved by less than this
SLACK = 0.5  # how far past the nearest the tree is searched for a bound, in radii of a patch
HELD = 64  # surfels that a search can hold


@njit(cache=True, error_model="numpy")
def faces(table, j, a, b, c, oriented, least):
    """Tell whether a surfel's cosine with the normal (a, b, c) is above `least`; one without a normal always does."""
    nx, ny, nz = table[j, 3], table[j, 4], table[j, 5]
    d = nx * a + ny * b + nz * c
    if not oriented:
        d = abs(d)
    return d > least or (nx == 0.0 and ny == 0.0 and nz == 0.0)


@njit(cache=True, error_model="numpy")
def squared_distance(points, j, x, y, z):
    """Return that from a surfel's point to a place."""
    dx, dy, dz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def outside(neighbors, i, j):
    """Tell whether surfel `j` is not in the patch of surfel `i`."""
    missing = j != i
    for k in range(LANES - 1):
        missing = missing and neighbors[i, k] != j
    return missing


@njit(cache=True, error_model="numpy")
def _kept(held, apart, count, limit):
    """Keep those held that are not farther than `limit`; return how many they are."""
    kept = 0
    for k in range(count):
        if apart[k] <= limit:
            held[kept], apart[kept] = held[k], apart[k]
            kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def _search(points, table, neighbors, starts, ends, boxes, x, y, z, a, b, c, oriented, squared, index, anchor, slack):
    """Return the nearest surfel that faces the right way and is nearer than (squared, index), anchor, and bound.

    The anchor is the surfel found, or the one given where there is none. No surfel outside of the anchor's patch that
    faces the right way within `TURN` is nearer than the bound.
    """
    stack, boxed, held, apart = integers(96), floats(96), integers(HELD), floats(HELD)
    count, top = 0, 0
    stack[0], boxed[0] = 0, 0.0
    whole = True
    limit = max(squared, (math.sqrt(squared) + slack) ** 2)
    while top >= 0:
        node, away = stack[top], boxed[top]
        top -= 1
        if away > limit:
            continue
        if 2 * node + 2 < len(starts):
            first, second = 2 * node + 1, 2 * node + 2
            near, far = box_distance(boxes, first, x, y, z), box_distance(boxes, second, x, y, z)
            if far < near:
                first, second, near, far = second, first, far, near
            stack[top + 1], boxed[top + 1] = second, far
            stack[top + 2], boxed[top + 2] = first, near
            top += 2
            continue
        for j in range(starts[node], ends[node]):
            d = squared_distance(points, j, x, y, z)
            if d > limit or not faces(table, j, a, b, c, oriented, FACING - TURN):
                continue
            if (d < squared or (d == squared and j < index)) and faces(table, j, a, b, c, oriented, FACING):
                squared, index = d, j
                limit = max(squared, (math.sqrt(squared) + slack) ** 2)
            if count == HELD:
                count = _kept(held, apart, count, limit)
            if count == HELD:  # too many: from here on only the nearest is looked for
                slack, limit = 0.0, squared
                count = _kept(held, apart, count, limit)
            if count < HELD:
                held[count], apart[count] = j, d
                count += 1
            else:
                whole = False
    if index < len(table):
        anchor = index
    bound = limit if whole else 0.0
    for k in range(count):
        if apart[k] < bound and outside(neighbors, anchor, held[k]):
            bound = apart[k]
    return index, anchor, math.sqrt(bound)


@njit(cache=True, error_model="numpy")
def beyond(points, neighbors, horizon, i, x, y, z):
    """Return a distance that no surfel outside of the patch of `i` is nearer than."""
    bound = horizon[i] - math.sqrt(squared_distance(points, i, x, y, z))
    if bound <= 0.0:
        return 0.0
    bound *= bound
    for k in range(LANES - 1, neighbors.shape[1]):
        bound = min(bound, squared_distance(points, neighbors[i, k], x, y, z))
    return math.sqrt(bound)


@njit(cache=True, error_model="numpy")
def nearest_facing(
    points, table, neighbors, between, horizon, starts, ends, boxes, x, y, z, a, b, c, oriented, limit, start
):
    """Return the nearest surfel within sqrt(limit) that faces the right way, or -1: a walk from `start`, with a proof.

    A surfel at distance d from surfel i is at least d - |v - i| from v: the neighbors of i, nearest first, need only be
    read until that exceeds the best; what stands when the reading ends is the nearest, wherever the walk began. Where
    the neighbors end first the walk goes on; where it gets stuck, the tree is searched, bounded by the best.

    Returns with it an anchor, mostly the same surfel, and a bound: no surfel outside of the anchor's patch that faces
    the right way, to within `TURN`, is nearer than that.
    """
    here = np.int64(start)
    best, found = math.inf, np.int64(-1)
    for _ in range(12):
        squared = squared_distance(points, here, x, y, z)
        own = math.sqrt(squared)
        best, found, reach = math.inf, np.int64(-1), math.inf
        if faces(table, here, a, b, c, oriented, FACING):
            best, found, reach = squared, here, own
        closest, step = squared, here
        proved = False
        for k in range(neighbors.shape[1]):
            if between[here, k] - own > reach:
                proved = True
                break
            j = np.int64(neighbors[here, k])
            d = squared_distance(points, j, x, y, z)
            if d < closest:
                closest, step = d, j
            if (d < best or (d == best and j < found)) and faces(table, j, a, b, c, oriented, FACING):
                best, found, reach = d, j, math.sqrt(d)
        if proved or horizon[here] - own > reach:
            bound = beyond(points, neighbors, horizon, found, x, y, z)
            return found if best <= limit else -1, found, bound
        if step == here:
            break
        here = step
    if found < 0 or best > limit:  # found none: even where nothing is too far
        best, found = limit, np.int64(len(table))
    slack = SLACK * between[here, LANES - 1]
    if not slack < math.inf:
        slack = 0.0
    found, anchor, bound = _search(
        points, table, neighbors, starts, ends, boxes, x, y, z, a, b, c, oriented, best, found, here, slack
    )
    return found if found < len(table) else -1, anchor, bound


@njit(cache=True, error_model="numpy")
def nearest_in_patch(points, table, neighbors, i, x, y, z, a, b, c, oriented):
    """Return the nearest surfel that faces the right way in the patch of surfel `i`, -1 if none, and how far it is."""
    best, found = math.inf, np.int64(-1)
    for k in range(-1, LANES - 1):
        j = i if k < 0 else np.int64(neighbors[i, k])
        d = squared_distance(points, j, x, y, z)
        if (d < best or (d == best and j < found)) and faces(table, j, a, b, c, oriented, FACING):
            best, found = d, j
    return found, best
