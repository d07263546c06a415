"""The short loops of a closed surface: one around each handle, one around each tunnel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from simplexmesh._vec import norm
from simplexmesh.mesh.homology import Cut, cut_open

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

WORK = 600_000
"""Vertices times places from which loops are looked for in the first round."""

ROUNDS = 2
"""Rounds of looking again from the loops found."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed way over the edges of a surface.

    Attributes
    ----------
    vertices : (k,) array of int
        In order.
    length : float
        In the unit of the surface.
    center : (3,) array of float
        The mean of its points, by length.
    """

    vertices: Indices
    length: float
    center: Array


def tunnel_loops(vertices: Array, faces: Indices) -> tuple[Loop, ...]:
    """Return the shortest loops around the tunnels of a closed surface, one for each, the shortest first.

    Such a loop bounds no part of the surface, and winds around no curve inside: outside, a film could span it. That
    film is what closes the tunnel, and the loop's length is the tunnel's girth where it is narrowest.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
        Closed, in one piece, counter-clockwise seen from outside.

    Returns
    -------
    tuple of Loop
        As many as the genus. A tunnel that is knotted may have none that was found.

    Raises
    ------
    TopologyError
        When the surface has a border, or triangles turned differently.

    References
    ----------
    T. K. Dey, K. Li, J. Sun and D. Cohen-Steiner, *Computing geometry-aware handle and tunnel loops in 3D models*, ACM
    TOG 27(3), 2008. There a filled grid tells handles from tunnels; here linking numbers do.

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
    """Return the shortest loops around the tunnels of a surface that is cut open already, the shortest first.

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
    inward = cut.linking - np.eye(n_pairs, dtype=np.int64)  # how loops wind around ways below the surface
    used = np.unique(cut.faces)
    bases = used[np.unique(np.linspace(0, len(used) - 1, max(WORK // len(used), 20)).astype(int))]
    found: dict[tuple[int, ...], tuple[float, int, Indices]] = {}
    chosen: list[tuple[float, int, Indices]] = []
    for _ in range(1 + ROUNDS):
        for base in bases.tolist():
            _look_from(cut, base, inward, found)
        chosen = _independent(found, n_pairs // 2)
        bases = np.unique(np.concatenate([cut.loop(edge, parent) for _, edge, parent in chosen] or [bases[:0]]))
    return tuple(measured(cut.vertices, cut.loop(edge, parent)) for _, edge, parent in chosen)


def _look_from(cut: Cut, base: int, inward: Indices, found: dict[tuple[int, ...], tuple[float, int, Indices]]) -> None:
    """Write down the shortest loop of each kind that begins at a vertex, where none shorter is known."""
    far, parent = dijkstra(cut.graph, indices=base, return_predecessors=True)
    parent = np.maximum(parent.astype(np.int64), -1)
    potential = _potential(cut, parent)
    one, other = cut.edges.T
    kind = potential[one] + cut.forms - potential[other]
    length = far[one] + cut.lengths + far[other]
    rows = np.flatnonzero(kind.any(axis=1))
    rows = rows[~(kind[rows] @ inward).any(axis=1)]
    rows = rows[np.argsort(length[rows], kind="stable")]
    lead = np.sign(kind[rows, (kind[rows] != 0).argmax(axis=1)])
    kinds, first = np.unique(kind[rows] * lead[:, None], axis=0, return_index=True)
    for name, row in zip(map(tuple, kinds.tolist()), rows[first].tolist(), strict=True):
        if name not in found or length[row] < found[name][0]:
            found[name] = (float(length[row]), row, parent)


def _potential(cut: Cut, parent: Indices) -> Indices:
    """Return (v, 2 g) the sums of the forms along the ways from the root of a tree."""
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


def _independent(
    found: dict[tuple[int, ...], tuple[float, int, Indices]], most: int
) -> list[tuple[float, int, Indices]]:
    """Return the shortest loops of which none is a sum of others."""
    kinds: list[tuple[int, ...]] = []
    for name in sorted(found, key=lambda name: found[name][0]):
        if len(kinds) < most and np.linalg.matrix_rank(np.array([*kinds, name])) > len(kinds):
            kinds.append(name)
    return [found[name] for name in kinds]


def measured(vertices: Array, loop: Indices) -> Loop:
    """Return a closed way over vertices with its length and center.

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
