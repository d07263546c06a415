"""A balanced kd-tree over points in flat arrays: construction in place, nearest neighbor and range search.

Node 0 is the root, node i has the children 2 i + 1 and 2 i + 2 and holds the points ``starts[i] : ends[i]`` of the
reordered points; `boxes` holds the lowest and highest coordinates of each node.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit


@njit(cache=True, error_model="numpy")
def _select(points, order, axis, low, high, middle):
    """Reorder ``order[low:high]`` along `axis` such that position `middle` holds its sorted element (quickselect)."""
    left, right = low, high - 1
    while left < right:
        pivot = points[order[(left + right) // 2], axis]
        i, j = left, right
        while i <= j:
            while points[order[i], axis] < pivot:
                i += 1
            while points[order[j], axis] > pivot:
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
        _select(points, order, axis, low, high, middle)
        starts[2 * node + 1], ends[2 * node + 1] = low, middle
        starts[2 * node + 2], ends[2 * node + 2] = middle, high


@njit(cache=True, error_model="numpy")
def box_distance(boxes, node, x, y, z):
    """Return the squared distance from a point to a node's box, 0 inside."""
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, error_model="numpy")
def _insert(squared, index, d, i):
    """Insert a candidate into lists sorted by (distance, index), dropping the last entry."""
    k = len(squared)
    if d > squared[k - 1] or (d == squared[k - 1] and i > index[k - 1]):
        return
    at = k - 1
    while at > 0 and (squared[at - 1] > d or (squared[at - 1] == d and index[at - 1] > i)):
        squared[at] = squared[at - 1]
        index[at] = index[at - 1]
        at -= 1
    squared[at] = d
    index[at] = i


@njit(cache=True, error_model="numpy")
def nearest_in_tree(points, starts, ends, boxes, x, y, z, squared, index, stack):
    """Update `squared`, `index` (k,) with the k nearest points, sorted; initially inf and n.

    `points` are in the tree's order, and so are the indices; ties go to the lower index.
    """
    k = len(squared)
    top = 0
    stack[0] = 0
    while top >= 0:
        node = stack[top]
        top -= 1
        if box_distance(boxes, node, x, y, z) > squared[k - 1]:
            continue
        if 2 * node + 2 >= len(starts):
            for i in range(starts[node], ends[node]):
                dx, dy, dz = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
                _insert(squared, index, dx * dx + dy * dy + dz * dz, i)
            continue
        first, second = 2 * node + 1, 2 * node + 2
        if box_distance(boxes, second, x, y, z) < box_distance(boxes, first, x, y, z):
            first, second = second, first
        stack[top + 1] = second
        stack[top + 2] = first
        top += 2


@njit(cache=True, error_model="numpy", parallel=True)
def all_nearest(points, starts, ends, boxes, queries, squared, index):
    """Fill the squared distances and indices (m, k) of the k nearest points of every query, nearest first."""
    n = len(points)
    for q in prange(len(queries)):
        stack = np.empty(96, np.int64)
        squared[q] = math.inf
        index[q] = n
        nearest_in_tree(
            points, starts, ends, boxes, queries[q, 0], queries[q, 1], queries[q, 2], squared[q], index[q], stack
        )


@njit(cache=True, error_model="numpy")
def within(points, starts, ends, boxes, x, y, z, radius, stride, found, stack):
    """Fill `found` with every `stride`-th point within `radius`; return the number of points before thinning."""
    limit = radius * radius
    count = 0
    top = 0
    stack[0] = 0
    while top >= 0:
        node = stack[top]
        top -= 1
        if box_distance(boxes, node, x, y, z) > limit:
            continue
        if 2 * node + 2 < len(starts):
            stack[top + 1] = 2 * node + 2
            stack[top + 2] = 2 * node + 1
            top += 2
            continue
        for i in range(starts[node], ends[node]):
            dx, dy, dz = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
            if dx * dx + dy * dy + dz * dz <= limit:
                if count % stride == 0 and count // stride < len(found):
                    found[count // stride] = i
                count += 1
    return count
