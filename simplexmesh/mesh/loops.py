"""Short tunnel loops of a closed surface, found by their homology classes and linking numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from simplexmesh._vec import norm
from simplexmesh.mesh.homology import Cut, cut_open

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SEARCH_BUDGET = 600_000
"""Number of vertices times number of base points of the first search."""

REFINEMENTS = 2
"""Further searches, from the vertices of the loops found."""

Found = dict[tuple[int, ...], tuple[float, int, NDArray[np.int64]]]
"""By homology class: length of its shortest loop, the edge that closes the loop, and the parents in its tree."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed path along the edges of a surface.

    Attributes
    ----------
    vertices : (k,) array of int
        In order.
    length : float
        In the unit of the surface.
    center : (3,) array of float
        The mean of its points, weighted by length.
    """

    vertices: Indices
    length: float
    center: Array


def tunnel_loops(vertices: Array, faces: Indices) -> tuple[Loop, ...]:
    """Return the shortest tunnel loops of a closed surface, one for each tunnel, the shortest first.

    A tunnel loop bounds no part of the surface and links no curve inside it; a film that spans it outside closes the
    tunnel. Its length is the girth of the tunnel at the narrowest place.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
        Closed, connected, counter-clockwise seen from outside.

    Returns
    -------
    tuple of Loop
        As many as the genus, or fewer: the loop of a knotted tunnel may not be found.

    Raises
    ------
    TopologyError
        When the surface has a border or is not consistently oriented.

    References
    ----------
    T. K. Dey, K. Li, J. Sun and D. Cohen-Steiner, *Computing geometry-aware handle and tunnel loops in 3D models*, ACM
    TOG 27(3), 2008. There a volume grid distinguishes handles from tunnels; here linking numbers do.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> donut = sm.torus(48, 24, tube_radius=0.4).triangulated()
    >>> (loop,) = tunnel_loops(donut.vertices, donut.faces)
    >>> 1.0 < loop.length / (0.6 * 2 * np.pi) < 1.4  # along edges, in zigzags
    True
    """
    return loops_of(cut_open(vertices, faces))


def loops_of(cut: Cut) -> tuple[Loop, ...]:
    """Return the shortest tunnel loops of a surface that is already cut open, the shortest first.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4).triangulated()
    >>> loops_of(cut_open(ball.vertices, ball.faces))
    ()
    """
    n_pairs = len(cut.generators)
    if not n_pairs:
        return ()
    inside = cut.linking - np.eye(n_pairs, dtype=np.int64)  # linking numbers with dual cycles pushed below the surface
    used = np.unique(cut.faces)
    bases = used[np.unique(np.linspace(0, len(used) - 1, max(SEARCH_BUDGET // len(used), 20)).astype(int))]
    found: Found = {}
    chosen: list[tuple[float, int, Indices]] = []
    for _ in range(1 + REFINEMENTS):
        for base in bases.tolist():
            _search_from(cut, base, inside, found)
        chosen = _independent(found, n_pairs // 2)
        bases = np.unique(np.concatenate([cut.loop(edge, parent) for _, edge, parent in chosen] or [bases[:0]]))
    return tuple(measured(cut.vertices, cut.loop(edge, parent)) for _, edge, parent in chosen)


def _search_from(cut: Cut, base: int, inside: Indices, found: Found) -> None:
    """Record the shortest tunnel loop through a vertex in each homology class, unless a shorter one is known."""
    distance, parent = dijkstra(cut.graph, indices=base, return_predecessors=True)
    parent = np.maximum(parent.astype(np.int64), -1)
    potential = _potential(cut, parent)
    one, other = cut.edges.T
    homology = potential[one] + cut.forms - potential[other]
    length = distance[one] + cut.lengths + distance[other]
    rows = np.flatnonzero(homology.any(axis=1))
    rows = rows[~(homology[rows] @ inside).any(axis=1)]
    rows = rows[np.argsort(length[rows], kind="stable")]
    sign = np.sign(homology[rows, (homology[rows] != 0).argmax(axis=1)])
    classes, first = np.unique(homology[rows] * sign[:, None], axis=0, return_index=True)
    for key, row in zip(map(tuple, classes.tolist()), rows[first].tolist(), strict=True):
        if key not in found or length[row] < found[key][0]:
            found[key] = (float(length[row]), row, parent)


def _potential(cut: Cut, parent: Indices) -> Indices:
    """Return the sums (v, 2 g) of the forms along the paths from the root of a tree."""
    out = np.zeros((len(parent), cut.forms.shape[1]), np.int64)
    for mine, other in ((1, 0), (0, 1)):
        on = np.flatnonzero(parent[cut.edges[:, mine]] == cut.edges[:, other])
        sign = 1 if mine == 1 else -1
        order = on[np.argsort(-cut.lengths[on], kind="stable")]  # of two edges between the same ends the shorter
        out[cut.edges[order, mine]] = sign * cut.forms[order]
    up = np.where(parent < 0, np.arange(len(parent)), parent)
    while (up[up] != up).any():
        out = out + out[up]
        up = up[up]
    return out


def _independent(found: Found, most: int) -> list[tuple[float, int, Indices]]:
    """Return the shortest loops whose homology classes are linearly independent."""
    classes: list[tuple[int, ...]] = []
    for key in sorted(found, key=lambda key: found[key][0]):
        if len(classes) < most and np.linalg.matrix_rank(np.array([*classes, key])) > len(classes):
            classes.append(key)
    return [found[key] for key in classes]


def measured(vertices: Array, loop: Indices) -> Loop:
    """Return the `Loop` of a closed path of vertices, with its length and center.

    Examples
    --------
    >>> measured(np.eye(3), np.array([0, 1, 2])).center.round(2).tolist()
    [0.33, 0.33, 0.33]
    """
    points = vertices[loop]
    ahead = np.roll(points, -1, axis=0)
    steps = norm(ahead - points)
    center = (0.5 * (points + ahead) * steps[:, None]).sum(axis=0) / steps.sum()
    return Loop(loop, float(steps.sum()), center)
