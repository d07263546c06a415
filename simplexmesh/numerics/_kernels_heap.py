"""Kernels of an indexed binary heap: a priority queue of numbered items whose costs can change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices, Indices32


class Heap(NamedTuple):
    """A binary heap of items, the cheapest first; `place` is the position of each item, -1 if it is not queued."""

    item: Indices32
    place: Indices32
    cost: Array
    size: Indices


@njit(cache=True)
def new_heap(count: int) -> Heap:
    """Return an empty heap for the items below `count`."""
    return Heap(np.empty(count, np.int32), np.full(count, -1, np.int32), np.empty(count), np.zeros(1, np.int64))


@njit(cache=True, _nrt=False)
def sift(heap: Heap, at: int) -> None:
    """Move the item at position `at` up or down to restore heap order; ties are broken by item number."""
    item = heap.item[at]
    cost = heap.cost[item]
    while at > 0:
        above = heap.item[(at - 1) // 2]
        if heap.cost[above] < cost or (heap.cost[above] == cost and above < item):
            break
        heap.item[at] = above
        heap.place[above] = at
        at = (at - 1) // 2
    while 2 * at + 1 < heap.size[0]:
        below = 2 * at + 1
        if below + 1 < heap.size[0]:
            one, other = heap.item[below], heap.item[below + 1]
            if heap.cost[other] < heap.cost[one] or (heap.cost[other] == heap.cost[one] and other < one):
                below += 1
        child = heap.item[below]
        if cost < heap.cost[child] or (cost == heap.cost[child] and item < child):
            break
        heap.item[at] = child
        heap.place[child] = at
        at = below
    heap.item[at] = item
    heap.place[item] = at


@njit(cache=True, _nrt=False)
def put(heap: Heap, item: int, cost: float) -> None:
    """Insert an item or change its cost; an infinite cost removes it."""
    at = heap.place[item]
    if cost == np.inf:
        if at < 0:
            return
        heap.place[item] = -1
        heap.size[0] -= 1
        last = heap.item[heap.size[0]]
        if last != item:
            heap.item[at] = last
            heap.place[last] = at
            sift(heap, at)
        return
    heap.cost[item] = cost
    if at < 0:
        at = heap.size[0]
        heap.item[at] = item
        heap.size[0] += 1
    sift(heap, at)
