"""Consistent orientation of normals of arbitrary sign (Hoppe et al. 1992; König, Gumhold 2009)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import minimum_spanning_tree

from simplexmesh.surface import _kernels_propagation as kernels
from simplexmesh.surface.neighborhoods import Neighborhoods

Array = NDArray[np.float64]

TIE = 1e-6
"""Least cost of an edge: sparse matrices cannot store edges of cost zero."""

SOFTENING = 0.1
"""Softening in median squared distances of neighbors: less fails with noise, more in thin parts."""


def propagated(ring: Neighborhoods, points: Array, normals: Array) -> Array:
    """Return the normals with consistent signs, outward as a whole.

    Signs are propagated along a minimum spanning tree of the neighbors (Hoppe et al.), so that they cross sharp edges
    and thin parts last. Consistent normals are reflections of each other at the bisecting plane, as on a circle
    (König, Gumhold), not parallel ones: around the rim of a thin plate parallel normals are inconsistent.

    Parameters
    ----------
    ring : Neighborhoods
        Neighbors of all points.
    points : (n, 3) array of float
    normals : (n, 3) array of float
        Unit vectors of either sign; zero vectors stay.

    References
    ----------
    H. Hoppe, T. DeRose, T. Duchamp, J. McDonald, W. Stuetzle, *Surface reconstruction from unorganized points*,
    SIGGRAPH 1992. S. König, S. Gumhold, *Consistent propagation of normal orientations in point clouds*, VMV 2009.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.surface.samples import as_samples
    >>> ball = sm.sphere(8).normals
    >>> mixed = ball * np.where(np.arange(len(ball)) % 2, 1.0, -1.0)[:, None]
    >>> bool(((propagated(as_samples(ball).one_ring, ball, mixed) * ball).sum(axis=1) > 0).all())
    True
    """
    n = len(points)
    steps = points[ring.members] - points[np.repeat(ring.centers, ring.valence)]
    softening = SOFTENING * float(np.median((steps**2).sum(axis=1))) if len(steps) else 0.0
    costs = 1 + TIE - np.abs(kernels.agreements(ring.offsets, ring.members, points, normals, softening))
    graph = csr_matrix((np.maximum(costs, TIE), ring.members, ring.offsets), (n, n))
    tree = minimum_spanning_tree(graph)  # takes the cheaper of both directions of an edge
    tree = (tree + tree.T).tocsr()
    links = tree.indptr.astype(np.int64), tree.indices.astype(np.int64)
    out: Array = kernels.propagated(*links, points, normals, softening)
    return out
