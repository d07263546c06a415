"""Signed distances along normals to the blended surface of surfels, from the nearest one that faces the vertex.

Cached per vertex are the surfels nearest to it at some earlier position, and a lower bound of the distance of all
others there. While the vertex has moved less than the margin, the nearest surfel is among them, exactly as a search
would find it (L. Verlet, Computer experiments on classical fluids, 1967).
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, LEAN, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array, Indices32
from simplexmesh.motion.targets.surfels._kernels_patches import (
    blended_height,
    closest_lane,
    count_closer,
    single_height,
)
from simplexmesh.numerics._kernels_tree import box_distance, squared_distance
from simplexmesh.numerics._kernels_vectors import dot, minus, row

FACING = 0.2  # minimum cosine between the normals of a vertex and of its surfel

TURN = 0.15  # lists are valid while the normal has changed by less than this

NEAREST = 16  # surfels listed per vertex

NONE, STALE = -1, -2

ROUNDING = 1.0 - 1e-12

SLACK = 2.0  # in squared supports; within as much above the nearest one's squared distance are about 16 surfels


class Cache(NamedTuple):
    """What is known of each vertex since its last search."""

    known: Array  # (n, 7) place relative to the surfels' center, normal, distance of unlisted surfels
    listed: Indices32  # (n, NEAREST) surfels, nearest first
    squared: Array  # (n, NEAREST) their squared distances at that search


def empty_cache(n: int) -> Cache:
    """Return a cache for `n` vertices, none of which has been searched for."""
    return Cache(np.zeros((n, 7)), np.zeros((n, NEAREST), np.int32), np.zeros((n, NEAREST)))


@njit(**LEAN)
def _faces(heads, i, oriented, direction, least):
    """Return whether a surfel faces a direction; one without a normal (NaN) always does."""
    cosine = heads[i, 3] * direction[0] + heads[i, 4] * direction[1] + heads[i, 5] * direction[2]
    return not (cosine if oriented else abs(cosine)) <= least


@njit(**LEAN)
def still_nearest(heads, patches, i, oriented, query):
    """Return whether surfel `i` certainly is the nearest and faces the direction: a cheap sufficient test."""
    place, direction, reach = query
    away = minus(place, row(heads, i))
    squared = dot(away, away)  # surfels outside its patch must be twice as far from it: then they are farther from here
    if squared > reach * reach or not 4.0 * squared < heads[i, 8] or not _faces(heads, i, oriented, direction, FACING):
        return False
    scale = 1.0 / heads[i, 6]
    at = np.float32(away[0] * scale), np.float32(away[1] * scale), np.float32(away[2] * scale)
    return count_closer(patches, i, at, np.float32(squared * scale * scale * 1.0001)) == 1.0


@njit(**LEAN)
def _nearest_listed(points, listed, v, place):
    """Return the nearest listed surfel, whichever way it faces, and its squared distance; without branches."""
    found, best = int(listed[v, 0]), math.inf
    for k in range(NEAREST):
        j = int(listed[v, k])
        d = squared_distance(points, j, place)
        nearer = (d < best) | ((d == best) & (j < found))
        found, best = j if nearer else found, d if nearer else best
    return found, best


@njit(**LEAN)
def _nearest_facing(heads, oriented, listed, v, query):
    """Return the nearest listed surfel that faces the direction, `NONE` if none does, and its squared distance."""
    place, direction, _ = query
    found, best = NONE, math.inf
    for k in range(NEAREST):
        j = int(listed[v, k])
        d = squared_distance(heads, j, place)
        if (d < best or (d == best and j < found)) and _faces(heads, j, oriented, direction, FACING):
            found, best = j, d
    return found, best


@njit(**LEAN)
def nearest_cached(points, heads, oriented, known, listed, v, query):
    """Return the nearest surfel facing a query's direction within reach, `NONE`, or `STALE` if a search is due."""
    place, direction, reach = query
    turn = direction[0] - known[v, 3], direction[1] - known[v, 4], direction[2] - known[v, 5]
    move = minus(place, row(known, v))
    margin = known[v, 6] * ROUNDING - math.sqrt(dot(move, move))
    if dot(turn, turn) > 0.98 * TURN * TURN or not margin > 0.0:
        return STALE
    found, best = _nearest_listed(points, listed, v, place)
    if not _faces(heads, found, oriented, direction, FACING):
        found, best = _nearest_facing(heads, oriented, listed, v, query)
    limit = reach * reach
    if not min(best, limit) < margin * margin:
        return STALE
    return found if best <= limit else NONE


@njit(**LEAN)
def _list(squared, listed, v, d, i):
    """Insert a surfel into the list of a vertex, sorted by (distance, index), and drop the last one."""
    at = NEAREST - 1
    while at > 0 and (squared[v, at - 1] > d or (squared[v, at - 1] == d and listed[v, at - 1] > i)):
        squared[v, at], listed[v, at] = squared[v, at - 1], listed[v, at - 1]
        at -= 1
    squared[v, at], listed[v, at] = d, i


@njit(**LEAN)
def _next_node(boxes, node, trail, place, limit):
    """Return the next node near enough, -1 at the end, and the trail: a bit for each level, set where both are done."""
    while node > 0:
        if trail & 1:
            node, trail = (node - 1) >> 1, trail >> 1
            continue
        trail |= 1
        beside = node + 1 if node & 1 else node - 1
        if box_distance(boxes, beside, place) <= limit:
            return beside, trail
    return -1, trail


@njit(**LEAN)
def nearest_searched(surfels, cache, v, query):
    """Return the nearest surfel by a tree search, bounded by old lists, and refresh the cache."""
    points, heads, boxes, oriented = surfels.points, surfels.heads, surfels.boxes, surfels.oriented
    known, listed, squared = cache.known, cache.listed, cache.squared
    place, direction, reach = query
    found, best = _nearest_facing(heads, oriented, listed, v if v == 0 or known[v, 6] > 0.0 else v - 1, query)
    wide = 4.0 * reach * reach
    if best <= reach * reach:
        wide = min(wide, best + SLACK * heads[found, 6] ** 2)
    else:
        found, best = len(points), reach * reach
    for k in range(NEAREST):
        listed[v, k], squared[v, k] = len(points), wide
    node, trail = 0, 0
    while node >= 0:
        limit = max(best, squared[v, NEAREST - 1])
        while 2 * node + 2 < len(surfels.starts):
            node, trail = 2 * node + 1, trail << 1
            near, far = box_distance(boxes, node, place), box_distance(boxes, node + 1, place)
            node, trail = node + 1 if far < near else node, trail | 1 if max(near, far) > limit else trail
        for i in range(surfels.starts[node], surfels.ends[node]):
            d = squared_distance(points, i, place)
            if d <= max(best, squared[v, NEAREST - 1]) and _faces(heads, i, oriented, direction, FACING - TURN):
                if d < squared[v, NEAREST - 1] or (d == squared[v, NEAREST - 1] and i < listed[v, NEAREST - 1]):
                    _list(squared, listed, v, d, i)
                if (d < best or (d == best and i < found)) and _faces(heads, i, oriented, direction, FACING):
                    found, best = i, d
        node, trail = _next_node(boxes, node, trail, place, max(best, squared[v, NEAREST - 1]))
    for k in range(NEAREST):
        listed[v, k] = listed[v, k] if listed[v, k] < len(points) else listed[v, 0] % len(points)
    for a in range(3):
        known[v, a], known[v, 3 + a] = place[a], direction[a]
    known[v, 6] = math.sqrt(squared[v, NEAREST - 1])
    return found if found < len(points) else NONE


@njit(**LEAN)
def move_to_front(listed, v, found):
    """Move a surfel to the front of a vertex's list."""
    for k in range(1, NEAREST):
        if listed[v, k] == found:
            listed[v, 0], listed[v, k] = listed[v, k], listed[v, 0]


@njit(**LEAN)
def _surface_gap(heads, neighbors, patches, i, place, direction):
    """Return the signed distance along a direction from a place to the surface near surfel `i`, NaN beside the data."""
    away, normal = minus(row(heads, i), place), (heads[i, 3], heads[i, 4], heads[i, 5])
    toward = dot(away, direction)
    facing = dot(normal, direction)
    if not abs(facing) > 0.0:
        return toward
    off = dot(away, normal)
    if dot(away, away) - off * off > heads[i, 7]:
        return math.nan
    plane = off / facing
    end = place[0] + plane * direction[0], place[1] + plane * direction[1], place[2] + plane * direction[2]
    along = np.float32(direction[0]), np.float32(direction[1]), np.float32(direction[2])
    for turn in range(5):
        scale = 1.0 / heads[i, 6]
        rise = minus(end, row(heads, i))
        far = dot(rise, rise) * scale * scale
        at = np.float32(rise[0] * scale), np.float32(rise[1] * scale), np.float32(rise[2] * scale)
        f0, f1, f2, total, nearer = blended_height(patches, i, at, along)
        if nearer == 0.0 or turn == 4:
            break
        i = np.int64(neighbors[i, closest_lane(patches, i, at) - 1])
    if far >= 4.0:
        return toward
    if total < 1e-3:  # outside of all supports
        f0, f1, f2 = single_height(patches, i, 0, at, along)
        total = np.float32(1.0)
    slope = abs(f1)
    if slope <= 0.1 * total:
        return toward
    root = 1.0 - 4.0 * f0 * f2 / (slope * slope)
    shift = -2.0 * f0 / (f1 * (1.0 + math.sqrt(root))) if root > 0.0 else -f0 / f1
    shift = heads[i, 6] * max(-1.0, min(1.0, shift))
    value = plane + shift
    return value if far <= 1.0 else toward + (2.0 - math.sqrt(far)) * (value - toward)


@by_rows(1500, fastmath=FAST)  # a vertex costs 60 ns or more
def surfel_gaps(begin, end, vertices, normals, center, reach, search, surfels, cache, out):
    """Fill the distances along normals, NaN beyond `reach`; surfels, relative to `center`, are sought in `search`."""
    points, heads, oriented = surfels.points, surfels.heads, surfels.oriented
    neighbors, patches, known, listed = surfels.neighbors, surfels.patches, cache.known, cache.listed
    for v in range(begin, end):
        place = vertices[v, 0] - center[0], vertices[v, 1] - center[1], vertices[v, 2] - center[2]
        direction = row(normals, v)
        out[v] = math.nan
        if not (dot(direction, direction) > 0.0 and dot(place, place) < math.inf):
            continue
        query = place, direction, search
        i = np.int64(listed[v, 0])
        if not still_nearest(heads, patches, i, oriented, query):
            i = nearest_cached(points, heads, oriented, known, listed, v, query)
            if i == STALE:
                i = nearest_searched(surfels, cache, v, query)
            elif i >= 0:
                move_to_front(listed, v, i)
        if i >= 0:
            gap = _surface_gap(heads, neighbors, patches, i, place, direction)
            if abs(gap) <= reach:
                out[v] = gap
