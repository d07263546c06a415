"""Tests of patches of residuals of one sign on a surface, whose law is that of signs put at random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay

from simplexmesh.cloud.validation.outcome import Outcome
from simplexmesh.cloud.validation.smoothing import at_least

Array = NDArray[np.float64]
Signs = NDArray[np.bool_]
Indices = NDArray[np.int64]


def delaunay_edges(unfolded: Array) -> Indices:
    """Return the edges (e, 2) of the Delaunay triangulation of surface coordinates (n, 2), joggled if degenerate."""
    triangles = Delaunay(unfolded, qhull_options="QJ").simplices
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0).astype(np.int64)


def grid_cells(residuals: Array, unfolded: Array, cells: int, *, diagonal: bool = False) -> tuple[Array, Indices]:
    """Return the sums of residuals in the occupied cells of a grid over [-1, 1] x [-1, 1], and adjacent pairs (e, 2).

    Cells of one side are adjacent, with `diagonal` those of one corner too.
    """
    at = np.clip(((unfolded + 1) / 2 * cells).astype(int), 0, cells - 1)
    row = cells + 1
    occupied, cell = np.unique(at @ [row, 1], return_inverse=True)
    steps = (1, row, row - 1, row + 1) if diagonal else (1, row)
    pairs = []
    for step in steps:
        place = np.minimum(np.searchsorted(occupied, occupied + step), len(occupied) - 1)
        near = np.flatnonzero(occupied[place] == occupied + step)
        pairs.append(np.stack([near, place[near]], axis=1))
    return np.bincount(cell, residuals).astype(float), np.concatenate(pairs).astype(np.int64)


def component_sizes(positive: Signs, edges: Indices) -> Indices:
    """Return the sizes of the components of one sign, by edges (e, 2)."""
    same = edges[positive[edges[:, 0]] == positive[edges[:, 1]]]
    graph = coo_array((np.ones(len(same)), (same[:, 0], same[:, 1])), shape=(len(positive),) * 2)
    return np.bincount(connected_components(graph, directed=False)[1])


def component_count(positive: Signs, edges: Indices) -> float:
    """Return how many components of one sign there are."""
    return float(len(component_sizes(positive, edges)))


def largest_component(positive: Signs, edges: Indices) -> float:
    """Return how many points the largest component of one sign has."""
    return float(component_sizes(positive, edges).max())


def joins(positive: Signs, edges: Indices) -> float:
    """Return how many edges join different signs (Cliff and Ord 1973)."""
    return float(np.count_nonzero(positive[edges[:, 0]] != positive[edges[:, 1]]))


def components_test(
    residuals: Array,
    edges: Indices,
    rng: np.random.Generator,
    *,
    statistic: Callable[[Signs, Indices], float] = component_count,
    trials: int = 199,
) -> Outcome:
    """Test the signs of residuals at the ends of edges (e, 2) by a statistic, which may be too small or too large.

    Components say little: signs put at random on a triangulation make one that is nearly as large as those of relief,
    and relief has as many small ones in it. `joins` find what is to be found in signs.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> at, noise = rng.uniform(-1, 1, (300, 2)), rng.normal(size=300)
    >>> edges = delaunay_edges(at)
    >>> [components_test(d, edges, rng, statistic=joins).passed for d in (noise, noise + 2 * at[:, 0])]
    [True, False]
    """
    positive = residuals > 0
    found = statistic(positive, edges)
    law = np.array([statistic(rng.permutation(positive), edges) for _ in range(trials)])
    return Outcome(found, min(1.0, 2 * min(at_least(found, law), at_least(-found, -law))))
