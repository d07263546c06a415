"""A bounding volume hierarchy with eight children per node, whose boxes are tested at once with SIMD instructions.

Made from a balanced kd-tree (see `_kernels_tree`) by merging three of its levels into one; the root takes the rest.
Node `i` has the children ``base + 8 i + k``, the root the children ``1 + k``; numbers from `inner` on are leaves.
Leaves hold up to eight surfels: points and normals. Arrays are passed as pointers (see `_kernels_pointers`): lane k of
row r of block i is at ``(6 i + r) 8 + k``.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_pointers import stack_floats, stack_integers
from simplexmesh.motion.targets._kernels_simd import (
    WIDTH,
    less,
    less_equal,
    load,
    maximum,
    population_count,
    store,
    trailing_zeros,
)

BLOCK = 6 * WIDTH
NEAREST = 16  # candidates cached per vertex
TRIM_FROM = 24  # number of candidates above which a search discards all but the nearest
CAPACITY = TRIM_FROM + 2 * WIDTH
MAX_SQUARED = 1e300  # upper limit of squared distances


@njit(cache=True, error_model="numpy")
def pack_wide(points, normals, starts, ends, boxes, slack):
    """Return nodes (n, 6, 8), leaves (l, 6, 8), first surfel of each leaf (l,), `slack`, `inner` and `base`.

    The kd-tree must have at most eight points per leaf. Empty lanes are at infinity. Surfels without a normal get one
    of NaN, which compares false with any limit.
    """
    n_leaves = (len(starts) + 1) // 2
    levels, depth = [0], 0
    while 2**depth < n_leaves:
        depth += 1
    if depth > 0:
        levels = list(range((depth - 1) % 3 + 1, depth, 3))
        levels.insert(0, 0)
    inner = 0
    for level in levels:
        inner += 2**level
    nodes = np.full((inner, 6, WIDTH), np.inf)
    at = 0
    for level in levels:
        step = (depth - 1) % 3 + 1 if level == 0 else 3
        step = min(step, depth)
        for i in range(2**level):
            for k in range(2**step):
                nodes[at, :, k] = boxes[2 ** (level + step) - 1 + i * 2**step + k]
            at += 1
    leaves = np.full((n_leaves, 6, WIDTH), np.inf)
    first = starts[n_leaves - 1 :].copy()
    for leaf in range(n_leaves):
        for k in range(ends[n_leaves - 1 + leaf] - first[leaf]):
            j = first[leaf] + k
            leaves[leaf, :3, k] = points[j]
            leaves[leaf, 3:, k] = normals[j] if normals[j].any() else np.full(3, np.nan)
    return nodes, leaves, first, slack, inner, (1 if depth == 0 else 2 ** ((depth - 1) % 3 + 1)) - 7


@njit(cache=True, error_model="numpy")
def box_distances(nodes, at, x, y, z):
    """Return the squared distances from a point to the boxes of a node's children, 0 inside."""
    dx = maximum(maximum(load(nodes, at) - x, x - load(nodes, at + 24)), 0.0)
    dy = maximum(maximum(load(nodes, at + 8) - y, y - load(nodes, at + 32)), 0.0)
    dz = maximum(maximum(load(nodes, at + 16) - z, z - load(nodes, at + 40)), 0.0)
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def surfel_distances(leaves, at, x, y, z):
    """Return the squared distances from a point to the surfels of a leaf."""
    dx, dy, dz = load(leaves, at) - x, load(leaves, at + 8) - y, load(leaves, at + 16) - z
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def cosines(leaves, at, a, b, c, fold):
    """Return the cosines between the normals of a leaf's surfels and (a, b, c), in absolute value if `fold` is -1."""
    along = load(leaves, at + 24) * a + load(leaves, at + 32) * b + load(leaves, at + 40) * c
    return maximum(along, along * fold)


@njit(cache=True, error_model="numpy")
def keep_nearest(candidates, distances, count):
    """Sort the candidates by distance and keep the first `NEAREST`; return their number and the next squared distance.

    Sorts by counting ranks, without data-dependent branches.
    """
    index, squared, following = stack_integers(NEAREST), stack_floats(NEAREST), math.inf
    for k in range(NEAREST):
        index[k] = -1
    for k in range(count, count + WIDTH):
        distances[k] = math.inf
    for k in range(count):
        rank, d = 0, distances[k]
        for j in range(0, count, WIDTH):
            rank += population_count(less(load(distances, j), d))
        while rank < NEAREST and index[rank] >= 0:  # ties
            rank += 1
        if rank < NEAREST:
            index[rank], squared[rank] = candidates[k], d
        else:
            following = min(following, d)
    count = min(count, NEAREST)
    for k in range(count):
        candidates[k], distances[k] = index[k], squared[k]
    return count, following


@njit(cache=True, error_model="numpy")
def push_children(squared, within, first, stack, stack_distance, top):
    """Push a node's children in the mask `within` on the stack, the nearest last; return the new top."""
    nearest, least = top + 1, math.inf
    while within:
        k = trailing_zeros(within)
        within &= within - 1
        top += 1
        stack[top], stack_distance[top] = first + k, squared[k]
        if squared[k] < least:
            nearest, least = top, squared[k]
    if nearest < top:
        stack[nearest], stack[top] = stack[top], stack[nearest]
        stack_distance[nearest], stack_distance[top] = stack_distance[top], stack_distance[nearest]
    return top


@njit(cache=True, error_model="numpy")
def scan_leaf(
    leaves, at, j, slack, x, y, z, a, b, c, fold, min_cosine, loose_cosine,
    limit, found, list_limit, count, candidates, distances
):  # fmt: skip
    """Add the surfels of a leaf, the first of which is `j`; return limit, found, list_limit and count: see `search`."""
    lanes, facing = surfel_distances(leaves, at, x, y, z), cosines(leaves, at, a, b, c, fold)
    within = less_equal(lanes, max(limit, list_limit)) & ~less_equal(facing, loose_cosine)
    squared, cosine = stack_floats(WIDTH), stack_floats(WIDTH)
    store(squared, 0, lanes)
    store(cosine, 0, facing)
    while within:
        k = trailing_zeros(within)
        within &= within - 1
        d = squared[k]
        candidates[count], distances[count] = j + k, d
        count += 1 if d <= list_limit else 0
        if d <= limit and not cosine[k] <= min_cosine and (d < limit or j + k < found):
            limit, found, list_limit = d, j + k, min(list_limit, d + slack[j + k])
    if count > TRIM_FROM:
        count, following = keep_nearest(candidates, distances, count)
        list_limit = min(list_limit, following)
    return limit, found, list_limit, count


@njit(cache=True, error_model="numpy")
def search(tree, x, y, z, a, b, c, fold, min_cosine, loose_cosine, limit, found, list_limit, candidates, distances):
    """Return the nearest surfel with a cosine above `min_cosine`, and list the candidates around it.

    Searches within sqrt(limit), starting from `found`, known to be at that distance (or a number past all surfels:
    none). Fills `candidates` and `distances` with the `NEAREST` nearest surfels with a cosine above `loose_cosine`
    within sqrt(list_limit), nearest first; `list_limit` shrinks to `slack` beyond the nearest. Returns the surfel
    found, its squared distance, the number of candidates, and a lower bound of the squared distance of any other such
    surfel.
    """
    nodes, leaves, starts, slack, inner, base = tree
    stack, stack_distance, squared = stack_integers(128), stack_floats(128), stack_floats(WIDTH)
    count, top = 0, 0
    stack[0], stack_distance[0] = 0, 0.0
    while top >= 0:
        node, distance = stack[top], stack_distance[top]
        top -= 1
        if distance > max(limit, list_limit):
            continue
        lanes, first = box_distances(nodes, node * BLOCK, x, y, z), base + WIDTH * node if node > 0 else 1
        within = less_equal(lanes, max(limit, list_limit))
        store(squared, 0, lanes)
        if first < inner:
            top = push_children(squared, within, first, stack, stack_distance, top)
            continue
        while within:
            k = trailing_zeros(within)
            within &= within - 1
            if squared[k] <= max(limit, list_limit):
                leaf = first + k - inner
                limit, found, list_limit, count = scan_leaf(
                    leaves, leaf * BLOCK, starts[leaf], slack, x, y, z, a, b, c, fold, min_cosine, loose_cosine,
                    limit, found, list_limit, count, candidates, distances,
                )  # fmt: skip
    count, following = keep_nearest(candidates, distances, count)
    while count > 0 and distances[count - 1] > list_limit:
        count -= 1
    return found, limit, count, min(list_limit, following)
