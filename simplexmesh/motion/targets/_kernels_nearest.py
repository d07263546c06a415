"""Nearest surfel facing a vertex, with a cache for vertices that move little between calls (Verlet lists).

Cached per vertex are the surfels nearest to it at some earlier position, and lower bounds of the distance of all others
there. While the vertex has moved less than the margin, the nearest surfel is among them, exactly as a search would find
it (L. Verlet, Computer experiments on classical fluids, 1967).

The state of a vertex is its earlier position and normal, and the distances beyond which all but the first eight and all
but the listed surfels were (8 numbers); its list holds `NEAREST` surfels, nearest first.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_patches import LANES, count_closer
from simplexmesh.motion.targets._kernels_pointers import data_pointer, prefetch, stack_floats, stack_integers
from simplexmesh.motion.targets._kernels_simd import WIDTH
from simplexmesh.motion.targets._kernels_wide import CAPACITY, MAX_SQUARED, NEAREST, search

FACING = 0.2  # minimum cosine between the normals of a vertex and of its surfel
TURN = 0.15  # lists are valid while the normal has changed by less than this
HEAD = 12  # numbers per surfel head: see `_kernels_points.pack_heads`
PATCH = 14 * LANES  # numbers per patch
STATE = 8  # numbers cached per vertex
ROUNDING = 1.0 + 1e-12
NONE = 2**62
CACHE_LINE = 8  # doubles per cache line, or 16 singles
MAX_REMOVED = 32  # consecutive removed vertices that `transfer_cache` can skip


def empty_cache(n):
    """Return an empty cache for `n` vertices: states (n, 8) and lists (n, 16)."""
    return np.zeros((n, STATE)), np.zeros((n, NEAREST), np.int32)


@njit(cache=True, error_model="numpy")
def squared_distance(points, j, x, y, z):
    """Return the squared distance between surfel `j` and a point."""
    dx, dy, dz = points[3 * j] - x, points[3 * j + 1] - y, points[3 * j + 2] - z
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def cosine(heads, j, a, b, c, fold):
    """Return the cosine between a surfel's normal and (a, b, c), absolute if `fold` is -1; NaN without a normal."""
    along = heads[j * HEAD + 3] * a + heads[j * HEAD + 4] * b + heads[j * HEAD + 5] * c
    back = along * fold
    return along if along > back else back


@njit(cache=True, error_model="numpy")
def nearest_of_eight(points, lists, at, x, y, z):
    """Return the nearest of the eight surfels from ``lists[at]`` on, and its squared distance."""
    distances, index = stack_floats(WIDTH), stack_integers(WIDTH)
    for k in range(WIDTH):
        j = np.int64(lists[at + k])
        distances[k], index[k] = squared_distance(points, j, x, y, z), j
    for half in (4, 2, 1):
        for k in range(half):
            d, j = distances[k + half], index[k + half]
            nearer = (d < distances[k]) | ((d == distances[k]) & (j < index[k]))  # branchless
            distances[k], index[k] = d if nearer else distances[k], j if nearer else index[k]
    return index[0], distances[0]


@njit(cache=True, error_model="numpy")
def nearest_facing_of(points, heads, lists, at, x, y, z, a, b, c, fold):
    """Return the nearest surfel facing (a, b, c) in the list from ``lists[at]`` on, and its squared distance."""
    found, best = np.int64(NONE), math.inf
    for k in range(NEAREST):
        j = np.int64(lists[at + k])
        d = squared_distance(points, j, x, y, z)
        if (d < best or (d == best and j < found)) and not cosine(heads, j, a, b, c, fold) <= FACING:
            found, best = j, d
    return found, best


@njit(cache=True, error_model="numpy")
def nearest_listed(points, lists, at, x, y, z, limit, state, m, moved):
    """Return the nearest surfel of a list and its squared distance; infinity if an unlisted one may be nearer.

    Examines the second eight only if one of them may be nearer. Distances beyond the limit are irrelevant.
    """
    found, best = nearest_of_eight(points, lists, at, x, y, z)
    if math.sqrt(min(best, limit)) < state[m + 6] - moved:
        return found, best
    other, second = nearest_of_eight(points, lists, at + 8, x, y, z)
    if second < best or (second == best and other < found):
        found, best = other, second
    return found, best if math.sqrt(min(best, limit)) < state[m + 7] - moved else math.inf


@njit(cache=True, error_model="numpy")
def still_nearest(heads, patches, i, x, y, z, a, b, c, fold, limit):
    """Return whether surfel `i` certainly is the nearest and faces (a, b, c): a cheap sufficient test.

    It holds if no other surfel of its patch is nearer, and all outside the patch are twice as far from it as the point.
    """
    h = i * HEAD
    dx, dy, dz = x - heads[h], y - heads[h + 1], z - heads[h + 2]
    squared = dx * dx + dy * dy + dz * dz
    if squared > limit or cosine(heads, i, a, b, c, fold) <= FACING or not 4.0 * squared < heads[h + 9]:
        return False
    scale = heads[h + 7]
    d = np.float32(squared * scale * scale * 1.0001)
    ux, uy, uz = np.float32(dx * scale), np.float32(dy * scale), np.float32(dz * scale)
    return count_closer(patches, i * PATCH, ux, uy, uz, d) == 1.0


@njit(cache=True, error_model="numpy")
def prefetch_candidates(points, heads, patches, lists, v):
    """Prefetch the data of the candidates of an upcoming vertex."""
    at = v * NEAREST
    i = np.int64(lists[at])
    for line in range(PATCH // (2 * CACHE_LINE)):
        prefetch(patches, PATCH * i + 2 * CACHE_LINE * line)
    prefetch(heads, HEAD * i)
    prefetch(heads, HEAD * i + CACHE_LINE)
    for k in range(1, WIDTH):
        prefetch(points, 3 * np.int64(lists[at + k]))


@njit(cache=True, error_model="numpy")
def move_to_front(lists, at, found):
    """Move a surfel to the front of its list if it is one of the first eight."""
    for k in range(1, WIDTH):
        if lists[at + k] == found:
            lists[at], lists[at + k] = lists[at + k], lists[at]


@njit(cache=True, error_model="numpy")
def nearest_cached(points, heads, state, lists, v, x, y, z, a, b, c, fold, limit):
    """Return the nearest surfel facing (a, b, c) within sqrt(limit), `NONE` if none does, -1 if the cache is stale."""
    m, at = v * STATE, v * NEAREST
    da, db, dc = a - state[m + 3], b - state[m + 4], c - state[m + 5]
    if da * da + db * db + dc * dc > 0.98 * TURN * TURN:
        return np.int64(-1)
    dx, dy, dz = x - state[m], y - state[m + 1], z - state[m + 2]
    moved = ROUNDING * math.sqrt(dx * dx + dy * dy + dz * dz)
    found, best = nearest_listed(points, lists, at, x, y, z, limit, state, m, moved)
    if best < math.inf and cosine(heads, found, a, b, c, fold) <= FACING:
        found, best = nearest_facing_of(points, heads, lists, at, x, y, z, a, b, c, fold)
        if not math.sqrt(min(best, limit)) < state[m + 7] - moved:
            return np.int64(-1)
    elif not best < math.inf:
        return np.int64(-1)
    return found if best <= limit else np.int64(NONE)


@njit(cache=True, error_model="numpy")
def nearest_searched(points, heads, state, lists, v, tree, x, y, z, a, b, c, fold, limit):
    """Return the nearest surfel as `nearest_cached` does, by a tree search, and refresh the cache.

    The old list, or that of the previous vertex, gives an upper bound of the distance.
    """
    m, at = v * STATE, v * NEAREST
    seed = at if v == 0 or lists[at] != lists[at + 1] else at - NEAREST
    found, best = nearest_facing_of(points, heads, lists, seed, x, y, z, a, b, c, fold)
    wide = min(4.0 * limit, MAX_SQUARED)
    if best <= min(limit, MAX_SQUARED):
        wide = min(wide, best + tree[3][found])
    else:  # never as far as the empty lanes
        found, best = np.int64(NONE), min(limit, MAX_SQUARED)
    candidates, distances = stack_integers(CAPACITY), stack_floats(CAPACITY)
    found, best, count, bound = search(
        tree, x, y, z, a, b, c, fold, FACING, FACING - TURN, best, found, wide, candidates, distances
    )
    for k in range(NEAREST):
        lists[at + k] = candidates[k] if k < count else candidates[0] if count > 0 else lists[at + k]
    state[m], state[m + 1], state[m + 2] = x, y, z
    state[m + 3], state[m + 4], state[m + 5] = a, b, c
    state[m + 6] = math.sqrt(distances[WIDTH] if count > WIDTH else bound) / ROUNDING
    state[m + 7] = math.sqrt(bound) / ROUNDING
    return found


@njit(cache=True, error_model="numpy")
def transfer_cache(vertices, normals, center, limit, points, heads, oriented, old, new):
    """Fill the cache `new` of the vertices of an edited mesh from the cache `old`, where it is still valid.

    Edited meshes keep the order of the remaining vertices; new ones are at the end.
    """
    state, lists = old
    fold, at = 1.0 if oriented else -1.0, 0
    for v in range(len(vertices)):
        x, y, z = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        a, b, c = normals[v, 0], normals[v, 1], normals[v, 2]
        for w in range(at, min(at + MAX_REMOVED, len(state))):
            dx, dy, dz = x - state[w, 0], y - state[w, 1], z - state[w, 2]
            if not dx * dx + dy * dy + dz * dz < state[w, 7] * state[w, 7]:
                continue
            around = data_pointer(points), data_pointer(heads), data_pointer(state), data_pointer(lists), w
            if nearest_cached(*around, x, y, z, a, b, c, fold, limit) >= 0:
                new[0][v], new[1][v], at = state[w], lists[w], w + 1
                break
