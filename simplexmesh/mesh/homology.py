"""A surface cut open: a tree of edges, a tree of triangles, and the edges left over, two for each handle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, dijkstra, minimum_spanning_tree

from simplexmesh._vec import cross, norm, normalized
from simplexmesh.errors import TopologyError
from simplexmesh.mesh import manifold

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ABOVE = 1e-3
"""How far curves across triangles are lifted off them, in square roots of their areas."""


@dataclass(frozen=True, eq=False)
class Cut:
    """A closed surface in one piece with a basis of its loops, and what counts how often a curve runs along each.

    Attributes
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
    edges, sides : (e, 2) array of int
        The ends of each edge, and the triangles on its left and right.
    lengths : (e,) array of float
    parent : (v,) array of int
        Towards the root of the tree of edges, -1 there.
    generators : (2 g,) array of int
        The edges left over: with the ways from their ends to the root they are a basis of the loops.
    forms : (e, 2 g) array of int
        What following an edge adds to the count of each loop.
    crossed : list of arrays of int
        For each generator the edges that a closed way over the triangles crosses, the generator first.
    """

    vertices: Array
    faces: Indices
    edges: Indices
    sides: Indices
    lengths: Array
    parent: Indices
    generators: Indices
    forms: Indices
    crossed: list[Indices]

    @cached_property
    def graph(self) -> csr_matrix:
        """Lengths of the edges by their ends, both ways."""
        return _graph(self.edges, self.lengths, len(self.vertices))[0]

    def loop(self, edge: int, parent: Indices) -> Indices:
        """Return the vertices of the loop through an edge and a tree, in order, without the way both ends share."""
        ways = []
        for end in self.edges[edge].tolist():
            way = [end]
            while parent[way[-1]] >= 0:
                way.append(int(parent[way[-1]]))
            ways.append(way)
        one, other = ways
        while len(one) > 1 and len(other) > 1 and one[-2] == other[-2]:
            one.pop()
            other.pop()
        return np.array(one[::-1] + other[:-1])

    @cached_property
    def linking(self) -> Indices:
        """(2 g, 2 g) how often each loop winds around each way over the triangles, lifted off the surface."""
        a, b, c = (self.vertices[self.faces[:, j]] for j in range(3))
        area = cross(b - a, c - a)
        size, normals, middles = np.sqrt(norm(area)), normalized(area), (a + b + c) / 3
        out = np.zeros((len(self.generators),) * 2)
        lifted = [self._lifted(edges, middles, normals, size) for edges in self.crossed]
        for i, edge in enumerate(self.generators.tolist()):
            loop = self.vertices[self.loop(edge, self.parent)]
            out[i] = [linking_number(loop, way) for way in lifted]
        return np.rint(out).astype(np.int64)

    def _lifted(self, crossed: Indices, middles: Array, normals: Array, size: Array) -> Array:
        """Return the closed way over triangles across some edges, a little above the surface."""
        first = self.sides[crossed]
        ahead = [int(first[0, 0])]  # the way starts left of its generator
        for left, right in first.tolist():
            ahead.append(right if ahead[-1] == left else left)
        face = np.array(ahead)
        on_face = middles[face] + ABOVE * (size[face])[:, None] * normals[face]
        on_edge = self.vertices[self.edges[crossed]].mean(axis=1)
        up = normalized(normals[face[:-1]] + normals[face[1:]])
        on_edge = on_edge + ABOVE * np.minimum(size[face[:-1]], size[face[1:]])[:, None] * up
        return np.stack([on_face[:-1], on_edge], axis=1).reshape(-1, 3)


def cut_open(vertices: Array, faces: Indices) -> Cut:
    """Return a closed surface in one piece, cut open along a tree of shortest ways from a vertex.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
        Closed, oriented, in one piece.

    Raises
    ------
    TopologyError
        When the surface has a border, or triangles turned differently.

    References
    ----------
    D. Eppstein, *Dynamic generators of topologically embedded graphs*, SODA 2003 (tree and cotree); J. Erickson and
    K. Whittlesey, *Greedy optimal homotopy and homology generators*, SODA 2005.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> donut = sm.torus(24, 12).triangulated()
    >>> len(cut_open(donut.vertices, donut.faces).generators)
    2
    """
    faces, mates, _ = manifold.matched(faces)
    if (mates < 0).any():
        raise TopologyError("the surface must be closed")
    mates = mates.ravel()
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    if (start != end[mates]).any():
        raise TopologyError("the triangles must all be turned the same way")
    half = np.flatnonzero(np.arange(len(mates)) < mates)
    edges = np.stack([start[half], end[half]], axis=1)
    sides = np.stack([half // 3, mates[half] // 3], axis=1)
    lengths = norm(vertices[edges[:, 1]] - vertices[edges[:, 0]])
    lengths = np.maximum(lengths, 1e-9 * lengths.max())  # a length of 0 is no edge in a sparse matrix
    graph, chosen = _graph(edges, lengths, len(vertices))
    far, parent = dijkstra(graph, indices=int(faces[0, 0]), return_predecessors=True)
    parent = np.maximum(parent.astype(np.int64), -1)
    in_tree = np.zeros(len(edges), bool)
    for way in (0, 1):
        in_tree[chosen] |= parent[edges[chosen, way]] == edges[chosen, 1 - way]
    round_trip = far[edges].sum(axis=1) + lengths
    above, in_cotree = _cotree(sides, np.where(in_tree, -np.inf, round_trip), len(faces))
    generators = np.flatnonzero(~in_tree & ~in_cotree)
    forms = np.zeros((len(edges), len(generators)), np.int64)
    crossed: list[Indices] = []
    for k, edge in enumerate(generators.tolist()):
        over, signs = _way_over(edge, sides, above)
        np.add.at(forms[:, k], over, signs)
        crossed.append(over)
    return Cut(vertices, faces, edges, sides, lengths, parent, generators, forms, crossed)


def _graph(edges: Indices, lengths: Array, n: int) -> tuple[csr_matrix, Indices]:
    """Return the lengths by ends, and the edges that stand for them: the shorter of two between the same vertices."""
    low, high = edges.min(axis=1), edges.max(axis=1)
    order = np.lexsort((lengths, high, low))
    key = low[order] * n + high[order]
    chosen = order[np.concatenate([[True], key[1:] != key[:-1]])]
    pairs = np.concatenate([edges[chosen], edges[chosen, ::-1]])
    return csr_matrix((np.tile(lengths[chosen], 2), (pairs[:, 0], pairs[:, 1])), shape=(n, n)), chosen


def _cotree(sides: Indices, round_trip: Array, n: int) -> tuple[Indices, NDArray[np.bool_]]:
    """Return (n, 2) the parent of each triangle and the edge towards it, and which edges the tree crosses.

    The tree of triangles crosses edges with long loops, so that those left over have short ones.
    """
    free = np.flatnonzero(np.isfinite(round_trip) & (sides[:, 0] != sides[:, 1]))
    low, high = sides[free].min(axis=1), sides[free].max(axis=1)
    order = np.lexsort((-round_trip[free], high, low))
    key = low[order] * n + high[order]
    order = order[np.concatenate([[True], key[1:] != key[:-1]])]
    rank = np.argsort(np.argsort(-round_trip[free[order]], kind="stable")) + 1.0
    tree = minimum_spanning_tree(csr_matrix((rank, (low[order], high[order])), shape=(n, n)))
    by_rank = free[order][np.argsort(rank)]
    _, parent = breadth_first_order(tree, 0, directed=False)
    above = np.full((n, 2), -1)
    rows, columns = tree.nonzero()
    edge = by_rank[np.asarray(tree[rows, columns]).ravel().astype(np.int64) - 1]
    down = parent[columns] == rows
    child, root = np.where(down, columns, rows), np.where(down, rows, columns)
    above[child, 0], above[child, 1] = root, edge
    used = np.zeros(len(sides), bool)
    used[edge] = True
    return above, used


def _way_over(edge: int, sides: Indices, above: Indices) -> tuple[Indices, Indices]:
    """Return the edges of a closed way: across an edge from left to right and back over the tree; and their signs."""
    to_root = []
    for face in sides[edge].tolist():
        way = []
        while above[face, 0] >= 0:
            way.append((face, int(above[face, 1])))
            face = int(above[face, 0])
        to_root.append(way)
    left, right = to_root
    while left and right and left[-1] == right[-1]:
        left.pop()
        right.pop()
    signs = [1 if sides[e, 0] == face else -1 for face, e in right]
    signs += [-1 if sides[e, 0] == face else 1 for face, e in reversed(left)]
    return np.array([edge] + [e for _, e in right] + [e for _, e in reversed(left)]), np.array([1, *signs])


def linking_number(one: Array, other: Array) -> float:
    """Return how often a closed polygon winds around another, a whole number but for rounding.

    Parameters
    ----------
    one : (n, 3) array of float
    other : (m, 3) array of float
        The two must not meet.

    References
    ----------
    Z. Arai, *A rigorous numerical algorithm for computing the linking number of links*, NOLTA 4 (2013).

    Examples
    --------
    >>> turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    >>> ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> round(abs(linking_number(ring, ring[:, [0, 2, 1]] + [1, 0, 0])), 6)
    1.0
    """
    total = 0.0
    ahead, next_one = np.roll(other, -1, axis=0), np.roll(one, -1, axis=0)
    for rows in range(0, len(one), 256):
        p, q = one[rows : rows + 256, None], next_one[rows : rows + 256, None]
        a, b, c, d = other - p, other - q, ahead - q, ahead - p
        la, lb, lc, ld = (norm(x) for x in (a, b, c, d))
        ac = (a * c).sum(axis=-1)
        for x, lx in ((b, lb), (d, ld)):
            volume = (a * cross(x, c)).sum(axis=-1) if x is b else (c * cross(x, a)).sum(axis=-1)
            dots = (a * x).sum(axis=-1) * lc + (x * c).sum(axis=-1) * la + ac * lx
            total += float(np.arctan2(volume, la * lx * lc + dots).sum())
    return total / (2 * np.pi)
