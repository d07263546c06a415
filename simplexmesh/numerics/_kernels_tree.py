"""A balanced kd-tree over points in flat arrays: construction in place, nearest neighbor and range search.

Node 0 is the root, node i has the children 2 i + 1 and 2 i + 2 and holds the points ``starts[i] : ends[i]`` of the
reordered points; `boxes` holds the lowest and highest coordinates of each node. Kernels take a
`kd_tree.Tree`, or any other named tuple with these fields.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import LEAN, njit
from simplexmesh._base._kernels_rows import by_rows

STACK = 96  # nodes, more than the depth of any tree in memory


@njit(cache=True, error_model="numpy")
def select(keys, order, low, high, middle):
    """Reorder ``order[low:high]`` so that `middle` has what sorting by `keys` puts there (quickselect)."""
    left, right = low, high - 1  # `np.partition` takes four seconds to compile
    while left < right:
        pivot = keys[order[(left + right) // 2]]
        i, j = left, right
        while i <= j:
            while keys[order[i]] < pivot:
                i += 1
            while keys[order[j]] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            return


@njit(cache=True, error_model="numpy")
def build_tree(points, order, starts, ends, boxes):
    """Fill the arrays of a tree with 2^(depth + 1) - 1 nodes and reorder `order`, initially ``arange(n)``."""
    n_nodes = len(starts)
    starts[0], ends[0] = 0, len(points)
    for node in range(n_nodes):
        low, high = starts[node], ends[node]
        for a in range(3):
            boxes[node, a] = math.inf
            boxes[node, 3 + a] = -math.inf
        for i in range(low, high):
            p = order[i]
            for a in range(3):
                boxes[node, a] = min(boxes[node, a], points[p, a])
                boxes[node, 3 + a] = max(boxes[node, 3 + a], points[p, a])
        if 2 * node + 2 >= n_nodes:
            continue
        axis = 0
        for a in range(1, 3):
            if boxes[node, 3 + a] - boxes[node, a] > boxes[node, 3 + axis] - boxes[node, axis]:
                axis = a
        middle = (low + high) // 2
        select(points[:, axis], order, low, high, middle)
        starts[2 * node + 1], ends[2 * node + 1] = low, middle
        starts[2 * node + 2], ends[2 * node + 2] = middle, high


@njit(**LEAN)
def box_distance(boxes, node, place):
    """Return the squared distance from a place to a node's box, 0 inside."""
    dx = max(boxes[node, 0] - place[0], place[0] - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - place[1], place[1] - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - place[2], place[2] - boxes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz


@njit(**LEAN)
def squared_distance(points, i, place):
    """Return the squared distance between point `i` and a place."""
    dx, dy, dz = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
    return dx * dx + dy * dy + dz * dz


@njit(**LEAN)
def insert(squared, index, d, i):
    """Insert a candidate into lists sorted by (distance, index), dropping the last entry."""
    at = len(squared) - 1
    if d > squared[at] or (d == squared[at] and i > index[at]):
        return
    while at > 0 and (squared[at - 1] > d or (squared[at - 1] == d and index[at - 1] > i)):
        squared[at] = squared[at - 1]
        index[at] = index[at - 1]
        at -= 1
    squared[at] = d
    index[at] = i


@njit(**LEAN)
def push_children(boxes, node, place, stack, top):
    """Replace a node at the top of the stack by its children, the nearer one last; return the new top."""
    first, second = 2 * node + 1, 2 * node + 2
    if box_distance(boxes, second, place) < box_distance(boxes, first, place):
        first, second = second, first
    stack[top] = second
    stack[top + 1] = first
    return top + 1


@by_rows(1000)
def all_nearest(begin, end, points, starts, ends, boxes, queries, squared, index):
    """Fill the squared distances and indices (m, k) of the k nearest points, nearest first, ties by the lower index."""
    k = squared.shape[1]
    for q in range(begin, end):
        place = queries[q, 0], queries[q, 1], queries[q, 2]
        stack = np.zeros(STACK, np.int64)
        squared[q] = math.inf
        index[q] = len(points)
        top = 0
        while top >= 0:
            node = stack[top]
            if box_distance(boxes, node, place) > squared[q, k - 1]:
                top -= 1
            elif 2 * node + 2 < len(starts):
                top = push_children(boxes, node, place, stack, top)
            else:
                top -= 1
                for i in range(starts[node], ends[node]):
                    insert(squared[q], index[q], squared_distance(points, i, place), i)


@njit(cache=True, error_model="numpy")
def within(tree, place, radius, stride, found):
    """Fill `found` with every `stride`-th point within `radius`; return the number of points before thinning."""
    stack = np.zeros(STACK, np.int64)
    count = top = kept = 0
    while top >= 0:
        node = stack[top]
        top -= 1
        if box_distance(tree.boxes, node, place) > radius * radius:
            continue
        if 2 * node + 2 < len(tree.starts):
            stack[top + 1] = 2 * node + 2
            stack[top + 2] = 2 * node + 1
            top += 2
            continue
        for i in range(tree.starts[node], tree.ends[node]):
            if squared_distance(tree.points, i, place) <= radius * radius:
                if count == kept * stride and kept < len(found):
                    found[kept] = i
                    kept += 1
                count += 1
    return count
