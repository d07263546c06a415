"""The nearest surfel that faces the right way, for vertices that move a little from call to call.

Kept per vertex: the surfels nearest to it where it once was, and how near no other one was there. As long as it has
gone less far than that leaves room for, the nearest is among them, and it is the one that a search would find. (Lists
of neighbors with a margin, as in L. Verlet, Computer experiments on classical fluids, 1967.)

What is kept: place, normal, distances that all but the first eight and all but the whole list were beyond (8 numbers),
and the surfels (`NEAREST` numbers), nearest first.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_lanes import WIDTH
from simplexmesh.motion.targets._kernels_patches import LANES, rivals
from simplexmesh.motion.targets._kernels_pointers import fetch, floats, integers, start
from simplexmesh.motion.targets._kernels_wide import HELD, MOST, NEAREST, search

FACING = 0.2  # smallest cosine between a vertex's normal and that of the data it may see
TURN = 0.15  # lists hold while a normal has moved by less than this
HEAD = 12  # numbers of a surfel's head: see `_kernels_points.pack_heads`
PATCH = 14 * LANES  # numbers of a patch
KEPT = 8  # numbers kept per vertex
ROUNDING = 1.0 + 1e-12
NONE = 2**62
LINE = 8  # numbers that memory hands over at once, or 16 of half the size
AHEAD = 32  # vertices gone in a row that `carry_over` gets past


def nothing_kept(n):
    """Return what is kept of `n` vertices never asked about: numbers (n, 8) and surfels (n, 16)."""
    return np.zeros((n, KEPT)), np.zeros((n, NEAREST), np.int32)


@njit(cache=True, error_model="numpy")
def squared_distance(points, j, x, y, z):
    """Return that from a surfel's point to a place."""
    dx, dy, dz = points[3 * j] - x, points[3 * j + 1] - y, points[3 * j + 2] - z
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def cosine(heads, j, a, b, c, fold):
    """Return that between a surfel's normal and (a, b, c), made positive for a `fold` of -1; NaN without a normal."""
    along = heads[j * HEAD + 3] * a + heads[j * HEAD + 4] * b + heads[j * HEAD + 5] * c
    back = along * fold
    return along if along > back else back


@njit(cache=True, error_model="numpy")
def nearest_of_eight(points, list_, at, x, y, z):
    """Return the nearest of the eight surfels from ``list_[at]`` on, and its squared distance."""
    apart, index = floats(WIDTH), integers(WIDTH)
    for k in range(WIDTH):
        j = np.int64(list_[at + k])
        apart[k], index[k] = squared_distance(points, j, x, y, z), j
    for half in (4, 2, 1):
        for k in range(half):
            d, j = apart[k + half], index[k + half]
            nearer = (d < apart[k]) | ((d == apart[k]) & (j < index[k]))  # no branch depends on the numbers
            apart[k], index[k] = d if nearer else apart[k], j if nearer else index[k]
    return index[0], apart[0]


@njit(cache=True, error_model="numpy")
def nearest_facing_of(points, heads, list_, at, x, y, z, a, b, c, fold):
    """Return the nearest that faces along (a, b, c) of the list from ``list_[at]`` on, and its squared distance."""
    found, best = np.int64(NONE), math.inf
    for k in range(NEAREST):
        j = np.int64(list_[at + k])
        d = squared_distance(points, j, x, y, z)
        if (d < best or (d == best and j < found)) and not cosine(heads, j, a, b, c, fold) <= FACING:
            found, best = j, d
    return found, best


@njit(cache=True, error_model="numpy")
def nearest_listed(points, list_, at, x, y, z, limit, kept, m, moved):
    """Return the nearest surfel of a list and its squared distance; infinity where one not listed may be nearer.

    Looks at eight of them, and at the others only where one of those may be nearer. Past the limit nothing counts.
    """
    found, best = nearest_of_eight(points, list_, at, x, y, z)
    if math.sqrt(min(best, limit)) < kept[m + 6] - moved:
        return found, best
    other, second = nearest_of_eight(points, list_, at + 8, x, y, z)
    if second < best or (second == best and other < found):
        found, best = other, second
    return found, best if math.sqrt(min(best, limit)) < kept[m + 7] - moved else math.inf


@njit(cache=True, error_model="numpy")
def still_nearest(heads, patches, i, x, y, z, a, b, c, fold, limit):
    """Tell at a glance whether surfel `i` is the nearest, and faces along (a, b, c); False if in doubt.

    It is where no other of its patch is nearer, and all outside of the patch are twice as far from it as the place is.
    """
    h = i * HEAD
    dx, dy, dz = x - heads[h], y - heads[h + 1], z - heads[h + 2]
    squared = dx * dx + dy * dy + dz * dz
    if squared > limit or cosine(heads, i, a, b, c, fold) <= FACING or not 4.0 * squared < heads[h + 9]:
        return False
    scale = heads[h + 7]
    d = np.float32(squared * scale * scale * 1.0001)
    ux, uy, uz = np.float32(dx * scale), np.float32(dy * scale), np.float32(dz * scale)
    return rivals(patches, i * PATCH, ux, uy, uz, d) == 1.0


@njit(cache=True, error_model="numpy")
def fetch_kept(points, heads, patches, list_, v):
    """Have the machine bring near what a vertex that comes soon will ask about, at places all over memory."""
    at = v * NEAREST
    i = np.int64(list_[at])
    for line in range(PATCH // (2 * LINE)):
        fetch(patches, PATCH * i + 2 * LINE * line)
    fetch(heads, HEAD * i)
    fetch(heads, HEAD * i + LINE)
    for k in range(1, WIDTH):
        fetch(points, 3 * np.int64(list_[at + k]))


@njit(cache=True, error_model="numpy")
def put_first(list_, at, found):
    """Put a surfel first in its list if it is one of the first eight."""
    for k in range(1, WIDTH):
        if list_[at + k] == found:
            list_[at], list_[at + k] = list_[at + k], list_[at]


@njit(cache=True, error_model="numpy")
def remembered(points, heads, kept, list_, v, x, y, z, a, b, c, fold, limit):
    """Return the nearest surfel within sqrt(limit) that faces along (a, b, c); `NONE` if none does, -1 if unknown."""
    m, at = v * KEPT, v * NEAREST
    da, db, dc = a - kept[m + 3], b - kept[m + 4], c - kept[m + 5]
    if da * da + db * db + dc * dc > 0.98 * TURN * TURN:
        return np.int64(-1)
    dx, dy, dz = x - kept[m], y - kept[m + 1], z - kept[m + 2]
    moved = ROUNDING * math.sqrt(dx * dx + dy * dy + dz * dz)
    found, best = nearest_listed(points, list_, at, x, y, z, limit, kept, m, moved)
    if best < math.inf and cosine(heads, found, a, b, c, fold) <= FACING:
        found, best = nearest_facing_of(points, heads, list_, at, x, y, z, a, b, c, fold)
        if not math.sqrt(min(best, limit)) < kept[m + 7] - moved:
            return np.int64(-1)
    elif not best < math.inf:
        return np.int64(-1)
    return found if best <= limit else np.int64(NONE)


@njit(cache=True, error_model="numpy")
def searched(points, heads, kept, list_, v, tree, x, y, z, a, b, c, fold, limit):
    """Return the nearest surfel as `remembered` does, from the tree, and keep what is around for the next call.

    What was kept, or else what is kept of the vertex before, tells how far there is something at most.
    """
    m, at = v * KEPT, v * NEAREST
    seed = at if v == 0 or list_[at] != list_[at + 1] else at - NEAREST
    found, best = nearest_facing_of(points, heads, list_, seed, x, y, z, a, b, c, fold)
    wide = min(4.0 * limit, MOST)
    if best <= min(limit, MOST):
        wide = min(wide, best + tree[3][found])
    else:  # a search goes no farther than the most, where there are lanes of nothing
        found, best = np.int64(NONE), min(limit, MOST)
    held, apart = integers(HELD), floats(HELD)
    found, best, count, bound = search(
        tree, x, y, z, a, b, c, fold, FACING, FACING - TURN, best, found, wide, held, apart
    )
    for k in range(NEAREST):
        list_[at + k] = held[k] if k < count else held[0] if count > 0 else list_[at + k]
    kept[m], kept[m + 1], kept[m + 2] = x, y, z
    kept[m + 3], kept[m + 4], kept[m + 5] = a, b, c
    kept[m + 6] = math.sqrt(apart[WIDTH] if count > WIDTH else bound) / ROUNDING
    kept[m + 7] = math.sqrt(bound) / ROUNDING
    return found


@njit(cache=True, error_model="numpy")
def carry_over(vertices, normals, center, limit, points, heads, oriented, old, new):
    """Fill what is kept (`new`) of vertices of another mesh from what was kept (`old`), where that holds for them.

    Meshes that are edited keep the order of the vertices that stay; others go, and new ones come at the end.
    """
    kept, lists = old
    fold, at = 1.0 if oriented else -1.0, 0
    for v in range(len(vertices)):
        x, y, z = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        for w in range(at, min(at + AHEAD, len(kept))):
            dx, dy, dz = x - kept[w, 0], y - kept[w, 1], z - kept[w, 2]
            if not dx * dx + dy * dy + dz * dz < kept[w, 7] * kept[w, 7]:
                continue
            around = start(points), start(heads), start(kept), start(lists), w
            if remembered(*around, x, y, z, a, b, c, fold, limit) >= 0:
                new[0][v], new[1][v], at = kept[w], lists[w], w + 1
                break
