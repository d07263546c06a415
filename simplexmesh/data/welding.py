"""Merge vertices by position, exactly or within a tolerance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import counted, warn
from simplexmesh.data.points import distinct

MOST_NEAR = 1000
"""Vertices within the tolerance of one, on average, beyond which no triangles would be left, and no memory."""


def are_proper(faces: Indices) -> Mask:
    """Return (f,) bool: whether each triangle has three distinct vertices."""
    a, b, c = faces.T
    out: Mask = (a != b) & (b != c) & (c != a)
    return out


def is_single_valued(positions: Array, values: NDArray[Any]) -> bool:
    """Whether equal positions have equal rows of values, as texture coordinates have where there are no seams."""
    first, inverse = distinct_positions(positions, 0.0)
    return bool((values == values[first][inverse]).all())


def distinct_positions(vertices: Array, tolerance: float) -> tuple[Indices, Indices]:
    """Return the first vertex at each distinct position, in order, and the index of each vertex among them."""
    if tolerance > 0:
        vertices = vertices[_representatives(vertices, tolerance)]
    return distinct(vertices)


def _representatives(vertices: Array, tolerance: float) -> Indices:
    """Return, for each vertex, the first of its cluster: vertices connected by steps of at most `tolerance`."""
    from scipy import sparse, spatial
    from scipy.sparse import csgraph

    n, tree = len(vertices), spatial.cKDTree(vertices)
    some = vertices[:: max(1, n // 1000)]
    if (near := tree.query_ball_point(some, tolerance, return_length=True).mean()) > MOST_NEAR:
        raise ValueError(f"a tolerance of {tolerance:g} merges {near:,.0f} vertices with each, which leaves no surface")
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    links = sparse.coo_matrix((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = csgraph.connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    out: Indices = first[group]
    return out


def report_welding(merged: int, collapsed: int, unused: int) -> None:
    """Warn about merged vertices, collapsed faces and unused vertices, if there are any."""
    repairs = []
    if merged:
        repairs.append(f"merged {counted(merged, 'duplicate vertex', 'duplicate vertices')}")
    if collapsed:
        repairs.append(f"removed {counted(collapsed, 'collapsed face', 'collapsed faces')}")
    if unused:
        repairs.append(f"removed {counted(unused, 'vertex', 'vertices')} without a face")
    if repairs:
        warn(", ".join(repairs))
