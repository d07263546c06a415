"""A tree whose nodes have eight children each, side by side: one look at a node tells how far all eight boxes are.

Made from a balanced kd-tree (see `_kernels_tree`), three of whose levels make one of this; the root has what is left.
Node `i` has the children ``base + 8 i + k``, those of the root are ``1 + k``; numbers from `inner` on are the leaves.
Leaves hold up to eight surfels: points and normals. What is read per vertex is read through pointers, see
`_kernels_pointers`: lane k of row r of block i is at ``(6 i + r) 8 + k``.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_lanes import WIDTH, bits, eight, larger, less, lowest, no_more, put
from simplexmesh.motion.targets._kernels_pointers import floats, integers

BLOCK = 6 * WIDTH
NEAREST = 16  # surfels that are kept per vertex
FULL = 24  # surfels held from which on a search keeps the nearest only
HELD = FULL + 2 * WIDTH
MOST = 1e300  # squared distance; nothing is as far


@njit(cache=True, error_model="numpy")
def pack_wide(points, normals, starts, ends, boxes, room):
    """Return nodes (n, 6, 8), leaves (l, 6, 8), first surfel of each leaf (l,), `room`, `inner` and `base`.

    The tree must have no more than eight points in a leaf. Empty lanes are infinitely far. Surfels without a normal
    have one of NaN: no comparison finds that they face away.
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
    return nodes, leaves, first, room, inner, (1 if depth == 0 else 2 ** ((depth - 1) % 3 + 1)) - 7


@njit(cache=True, error_model="numpy")
def boxes_apart(nodes, at, x, y, z):
    """Return the squared distances from a place to the boxes of a node's children, 0 inside."""
    dx = larger(larger(eight(nodes, at) - x, x - eight(nodes, at + 24)), 0.0)
    dy = larger(larger(eight(nodes, at + 8) - y, y - eight(nodes, at + 32)), 0.0)
    dz = larger(larger(eight(nodes, at + 16) - z, z - eight(nodes, at + 40)), 0.0)
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def surfels_apart(leaves, at, x, y, z):
    """Return the squared distances of a leaf's surfels."""
    dx, dy, dz = eight(leaves, at) - x, eight(leaves, at + 8) - y, eight(leaves, at + 16) - z
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def cosines(leaves, at, a, b, c, fold):
    """Return those of the normals of a leaf's surfels with (a, b, c); made positive for a `fold` of -1."""
    along = eight(leaves, at + 24) * a + eight(leaves, at + 32) * b + eight(leaves, at + 40) * c
    return larger(along, along * fold)


@njit(cache=True, error_model="numpy")
def keep_nearest(held, apart, count):
    """Sort those held by distance and drop all but the `NEAREST` first; return how many stay, and how near the next is.

    Each one's rank is counted, which takes no branch that depends on the numbers.
    """
    index, squared, following = integers(NEAREST), floats(NEAREST), math.inf
    for k in range(NEAREST):
        index[k] = -1
    for k in range(count, count + WIDTH):
        apart[k] = math.inf
    for k in range(count):
        rank, d = 0, apart[k]
        for j in range(0, count, WIDTH):
            rank += bits(less(eight(apart, j), d))
        while rank < NEAREST and index[rank] >= 0:  # another one is as far
            rank += 1
        if rank < NEAREST:
            index[rank], squared[rank] = held[k], d
        else:
            following = min(following, d)
    count = min(count, NEAREST)
    for k in range(count):
        held[k], apart[k] = index[k], squared[k]
    return count, following


@njit(cache=True, error_model="numpy")
def push(squared, within, first, stack, boxed, top):
    """Put a node's children of the mask `within` on the stack, the nearest last; return its top."""
    nearest, least = top + 1, math.inf
    while within:
        k = lowest(within)
        within &= within - 1
        top += 1
        stack[top], boxed[top] = first + k, squared[k]
        if squared[k] < least:
            nearest, least = top, squared[k]
    if nearest < top:
        stack[nearest], stack[top] = stack[top], stack[nearest]
        boxed[nearest], boxed[top] = boxed[top], boxed[nearest]
    return top


@njit(cache=True, error_model="numpy")
def look(leaves, at, j, room, x, y, z, a, b, c, fold, least, loose, limit, found, wide, count, held, apart):
    """Take in the surfels of a leaf, of which `j` is the first; return limit, found, wide and count: see `search`."""
    lanes, facing = surfels_apart(leaves, at, x, y, z), cosines(leaves, at, a, b, c, fold)
    within = no_more(lanes, max(limit, wide)) & ~no_more(facing, loose)
    squared, cosine = floats(WIDTH), floats(WIDTH)
    put(squared, 0, lanes)
    put(cosine, 0, facing)
    while within:
        k = lowest(within)
        within &= within - 1
        d = squared[k]
        held[count], apart[count] = j + k, d
        count += 1 if d <= wide else 0
        if d <= limit and not cosine[k] <= least and (d < limit or j + k < found):
            limit, found, wide = d, j + k, min(wide, d + room[j + k])
    if count > FULL:
        count, following = keep_nearest(held, apart, count)
        wide = min(wide, following)
    return limit, found, wide, count


@njit(cache=True, error_model="numpy")
def search(tree, x, y, z, a, b, c, fold, least, loose, limit, found, wide, held, apart):
    """Return the nearest surfel whose cosine is above `least`, and what else is around.

    Looks within sqrt(limit), where `found` is known already (a number past all surfels: none). Fills `held` and
    `apart` with the `NEAREST` nearest surfels whose cosine is above `loose` within sqrt(wide), nearest first; `wide`
    shrinks to `room` more than the nearest. Returns the surfel found, its squared distance, how many are held, and a
    squared distance that no other such surfel is nearer than.
    """
    nodes, leaves, starts, room, inner, base = tree
    stack, boxed, squared = integers(128), floats(128), floats(WIDTH)
    count, top = 0, 0
    stack[0], boxed[0] = 0, 0.0
    while top >= 0:
        node, away = stack[top], boxed[top]
        top -= 1
        if away > max(limit, wide):
            continue
        lanes, first = boxes_apart(nodes, node * BLOCK, x, y, z), base + WIDTH * node if node > 0 else 1
        within = no_more(lanes, max(limit, wide))
        put(squared, 0, lanes)
        if first < inner:
            top = push(squared, within, first, stack, boxed, top)
            continue
        while within:
            k = lowest(within)
            within &= within - 1
            if squared[k] <= max(limit, wide):
                leaf = first + k - inner
                limit, found, wide, count = look(
                    leaves, leaf * BLOCK, starts[leaf], room, x, y, z, a, b, c, fold, least, loose, limit, found, wide,
                    count, held, apart,
                )  # fmt: skip
    count, following = keep_nearest(held, apart, count)
    while count > 0 and apart[count - 1] > wide:
        count -= 1
    return found, limit, count, min(wide, following)
