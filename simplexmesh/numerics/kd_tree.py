"""A kd-tree in flat arrays, for use in kernels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.numerics import _kernels_tree

LEAF = 12
"""Points per leaf, at most."""


class Tree(NamedTuple):
    """A balanced kd-tree, from `kd_tree`."""

    points: Array  # (n, 3), in the tree's order: neighbors in space are close in memory
    starts: Indices  # (m,) first point of each node
    ends: Indices
    boxes: Array  # (m, 6) lowest and highest coordinates of each node's points
    order: Indices  # (n,) original index of each point


def kd_tree(points: Array) -> Tree:
    """Return the tree of (n, 3) points, n at least 1."""
    nodes = 2 ** (max(0, int(np.ceil(np.log2(len(points) / LEAF)))) + 1) - 1
    order = np.arange(len(points))
    starts, ends, boxes = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64), np.zeros((nodes, 6))
    points = np.ascontiguousarray(points, dtype=np.float64)
    _kernels_tree.build_tree(points, order, starts, ends, boxes)
    return Tree(points[order], starts, ends, boxes, order)


def uneven_tree(points: Array) -> cKDTree:
    """Return SciPy's tree of (n, 3) points with boxes halved: built in half the time, faster for places far off."""
    return cKDTree(points, balanced_tree=False, compact_nodes=False)


def nearest(tree: Any, queries: Array, k: int) -> tuple[Array, Indices]:
    """Return distances and indices (in the tree's order) of the `k` nearest points, (m, k), nearest first."""
    squared, index = np.zeros((len(queries), k)), np.zeros((len(queries), k), np.int64)
    rows = np.ascontiguousarray(queries)
    _kernels_tree.all_nearest(len(rows), tree.points, tree.starts, tree.ends, tree.boxes, rows, squared, index)
    return np.sqrt(squared), index
