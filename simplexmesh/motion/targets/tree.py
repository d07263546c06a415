"""A kd-tree in flat arrays, for use in kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.targets import _kernels_tree

Array = NDArray[np.float64]
LEAF = 12


@dataclass(frozen=True, eq=False)
class Tree:
    """A balanced kd-tree; constructed by `Tree.of`.

    Attributes
    ----------
    points : (n, 3) array of float
        The points, in the tree's order: neighbors in space are close in memory.
    order : (n,) array of int
        Original index of each point.
    starts, ends : (m,) array of int
        Range of the points of each node.
    boxes : (m, 6) array of float
        Lowest and highest coordinates of each node's points.
    """

    points: Array
    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    boxes: Array

    @staticmethod
    def of(points: Array, leaf: int = LEAF) -> Tree:
        """Build the tree of (n, 3) points, n at least 1, with at most `leaf` points per leaf.

        Examples
        --------
        >>> tree = Tree.of(np.array([[0.0, 0, 0], [5, 0, 0], [9, 0, 0]]))
        >>> distance, index = tree.nearest(np.array([[4.0, 0, 0]]), 2)
        >>> distance, tree.order[index]
        (array([[1., 4.]]), array([[1, 0]]))
        """
        n = len(points)
        depth = max(0, int(np.ceil(np.log2(max(n, 1) / leaf))))
        nodes = 2 ** (depth + 1) - 1
        order = np.arange(n)
        starts, ends, boxes = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64), np.zeros((nodes, 6))
        points = np.ascontiguousarray(points, dtype=np.float64)
        _kernels_tree.build_tree(points, order, starts, ends, boxes)
        return Tree(points[order], order, starts, ends, boxes)

    @property
    def arrays(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], Array]:
        """The arguments of the tree kernels."""
        return self.points, self.starts, self.ends, self.boxes

    def nearest(self, queries: Array, k: int) -> tuple[Array, NDArray[np.int64]]:
        """Return distances and indices (in the tree's order) of the `k` nearest points, (m, k), nearest first."""
        squared = np.zeros((len(queries), k))
        index = np.zeros((len(queries), k), np.int64)
        _kernels_tree.all_nearest(*self.arrays, np.ascontiguousarray(queries), squared, index)
        return np.sqrt(squared), index
