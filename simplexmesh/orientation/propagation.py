"""Consistent orientation of normals of arbitrary sign, propagated from neighbor to neighbor.

Signs are propagated along a minimum spanning tree of the neighbors (H. Hoppe, T. DeRose, T. Duchamp, J. McDonald,
W. Stuetzle, *Surface reconstruction from unorganized points*, SIGGRAPH 1992), so that they cross sharp edges and thin
parts last. Consistent normals are reflections of each other at the bisecting plane, as on a circle (S. König,
S. Gumhold, *Consistent propagation of normal orientations in point clouds*, VMV 2009), not parallel ones: around the
rim of a thin plate parallel normals are inconsistent.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import minimum_spanning_tree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.numerics.kd_tree import uneven_tree
from simplexmesh.orientation import _kernels_consistency as kernels

LEAST_AGREEMENT = 0.75
"""Share of neighboring normals within 90 degrees: with fewer, normals do not tell inside from outside."""

SOFTENING = 0.1
"""Softening in median squared distances of neighbors: less fails with noise, more in thin parts."""


def agreement(points: Array, normals: Array) -> float:
    """Return the share of neighbors, of 2,000 points at most, whose normals are within 90 degrees of each other."""
    some = np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(int)
    _, near = uneven_tree(points).query(points[some], k=min(5, len(points)))
    return float((np.einsum("ij,ikj->ik", normals[some], normals[near[:, 1:]]) > 0).mean())


def propagated(offsets: Indices, members: Indices, points: Array, normals: Array) -> Array:
    """Return unit normals (n, 3) with consistent signs; those of point i agree with its `members` from `offsets[i]`."""
    n, tie = len(points), 1e-6  # sparse matrices cannot store edges of cost zero
    steps = points[members] - points[np.repeat(np.arange(n), np.diff(offsets))]
    softening = SOFTENING * float(np.median((steps**2).sum(axis=1))) if len(steps) else 0.0
    costs = 1 + tie - np.abs(kernels.agreements(offsets, members, points, normals, softening))
    graph = csr_matrix((np.maximum(costs, tie), members, offsets), (n, n))
    tree = minimum_spanning_tree(graph)  # takes the cheaper of both directions of an edge
    tree = (tree + tree.T).tocsr()
    links = tree.indptr.astype(np.int64), tree.indices.astype(np.int64)
    out: Array = kernels.propagated(*links, points, normals, softening)
    return out
