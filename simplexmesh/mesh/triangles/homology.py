"""Homology basis of a closed surface by tree-cotree decomposition, with cohomology forms and linking numbers.

D. Eppstein, SODA 2003; J. Erickson and K. Whittlesey, SODA 2005; linking numbers by Z. Arai, NOLTA 4 (2013).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, dijkstra, minimum_spanning_tree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.vectors import cross, norm, normalized, triangle_vectors
from simplexmesh.mesh import manifold


@dataclass(frozen=True, eq=False)
class CutSurface:
    """A connected closed surface with a homology basis of loops, and the dual basis of closed 1-forms.

    An edge (e, 2) has triangles `sides` (e, 2) on its left and right. The `generators` (2 g,), edges in neither the
    tree of shortest paths, with a `parent` (v,) for each vertex, nor the cotree, close the loops. Sums of `forms` (e, 2
    g) along a closed path count its turns along each. The dual cycle of a generator lists the edges that it crosses,
    that first.
    """

    vertices: Array
    faces: Indices
    edges: Indices
    sides: Indices
    lengths: Array
    parent: Indices
    generators: Indices
    forms: Indices
    dual_cycles: list[Indices]

    def loop(self, edge: int, parent: Indices) -> Indices:
        """Return the vertices, in order, of the loop that an edge closes with a tree, without their common tail."""
        paths = []
        for end in self.edges[edge].tolist():
            path = [end]
            while parent[path[-1]] >= 0:
                path.append(int(parent[path[-1]]))
            paths.append(path)
        one, other = paths
        while len(one) > 1 and len(other) > 1 and one[-2] == other[-2]:
            one.pop()
            other.pop()
        return np.array(one[::-1] + other[:-1])

    @cached_property
    def linking(self) -> Indices:
        """(2 g, 2 g) linking number of each basis loop with each dual cycle, pushed off the surface to the outside."""
        area = triangle_vectors(self.vertices, self.faces)
        size, normals, centroids = np.sqrt(norm(area)), normalized(area), self.vertices[self.faces].mean(axis=1)
        out = np.zeros((len(self.generators),) * 2)
        lifted = [self._lifted(cycle, centroids, normals, size) for cycle in self.dual_cycles]
        for i, edge in enumerate(self.generators.tolist()):
            loop = self.vertices[self.loop(edge, self.parent)]
            out[i] = [linking_number(loop, cycle) for cycle in lifted]
        return np.rint(out).astype(np.int64)

    def _lifted(self, cycle: Indices, centroids: Array, normals: Array, size: Array) -> Array:
        """Return the polygon through the triangles along a dual cycle, slightly above the surface."""
        sides = self.sides[cycle]
        faces = [int(sides[0, 0])]  # a cycle starts on the left of its generator
        for left, right in sides.tolist():
            faces.append(right if faces[-1] == left else left)
        face = np.array(faces)
        on_face = centroids[face] + 1e-3 * (size[face])[:, None] * normals[face]
        on_edge = self.vertices[self.edges[cycle]].mean(axis=1)
        up = normalized(normals[face[:-1]] + normals[face[1:]])
        on_edge = on_edge + 1e-3 * np.minimum(size[face[:-1]], size[face[1:]])[:, None] * up
        return np.stack([on_face[:-1], on_edge], axis=1).reshape(-1, 3)


def cut_open(vertices: Array, faces: Indices) -> CutSurface:
    """Return the tree-cotree decomposition of a connected closed surface, by shortest paths from a vertex."""
    faces, mates, _ = manifold.matched(faces)
    if (mates < 0).any():
        raise TopologyError("the surface must be closed, it has a border")
    mates = mates.ravel()
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    if (start != end[mates]).any():
        raise TopologyError("the triangles must be consistently oriented")
    half = np.flatnonzero(np.arange(len(mates)) < mates)
    edges = np.stack([start[half], end[half]], axis=1)
    sides = np.stack([half // 3, mates[half] // 3], axis=1)
    lengths = norm(vertices[edges[:, 1]] - vertices[edges[:, 0]])
    lengths = np.maximum(lengths, 1e-9 * lengths.max())  # a sparse graph has no edges of length zero
    chosen = _least(edges, lengths, len(vertices))
    one, other = np.concatenate([edges[chosen], edges[chosen, ::-1]]).T
    graph = csr_matrix((np.tile(lengths[chosen], 2), (one, other)), shape=(len(vertices), len(vertices)))
    distance, parent = dijkstra(graph, indices=int(faces[0, 0]), return_predecessors=True)
    parent = np.maximum(parent.astype(np.int64), -1)
    in_tree = np.zeros(len(edges), bool)
    for k in (0, 1):
        in_tree[chosen] |= parent[edges[chosen, k]] == edges[chosen, 1 - k]
    loop_lengths = distance[edges].sum(axis=1) + lengths
    above, in_cotree = _cotree(sides, np.where(in_tree, -np.inf, loop_lengths), len(faces))
    generators = np.flatnonzero(~in_tree & ~in_cotree)
    forms = np.zeros((len(edges), len(generators)), np.int64)
    dual_cycles: list[Indices] = []
    for k, edge in enumerate(generators.tolist()):
        cycle, signs = _dual_cycle(edge, sides, above)
        np.add.at(forms[:, k], cycle, signs)
        dual_cycles.append(cycle)
    return CutSurface(vertices, faces, edges, sides, lengths, parent, generators, forms, dual_cycles)


def _least(pairs: Indices, costs: Array, n: int) -> Indices:
    """Return the row of least cost among those of the same two nodes below n, in either order, by nodes."""
    low, high = np.sort(pairs, axis=1).T
    order = np.lexsort((costs, high, low))
    key = low[order] * n + high[order]
    return order[np.concatenate([[True], key[1:] != key[:-1]])]


def _cotree(sides: Indices, loop_lengths: Array, n: int) -> tuple[Indices, Mask]:
    """Return parents, with the edges to them (n, 2), in the maximum spanning tree by loop length, and its edges."""
    free = np.flatnonzero(np.isfinite(loop_lengths) & (sides[:, 0] != sides[:, 1]))
    free = free[_least(sides[free], -loop_lengths[free], n)]
    rank = np.argsort(np.argsort(-loop_lengths[free], kind="stable")) + 1.0
    low, high = np.sort(sides[free], axis=1).T
    tree = minimum_spanning_tree(csr_matrix((rank, (low, high)), shape=(n, n)))
    by_rank = free[np.argsort(rank)]
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


def _dual_cycle(edge: int, sides: Indices, above: Indices) -> tuple[Indices, Indices]:
    """Return the edges, and signs, of the cycle across an edge from left to right and back through the cotree."""
    to_root = []
    for face in sides[edge].tolist():
        path = []
        while above[face, 0] >= 0:
            path.append((face, int(above[face, 1])))
            face = int(above[face, 0])
        to_root.append(path)
    left, right = to_root
    while left and right and left[-1] == right[-1]:
        left.pop()
        right.pop()
    signs = [1 if sides[e, 0] == face else -1 for face, e in right]
    signs += [-1 if sides[e, 0] == face else 1 for face, e in reversed(left)]
    return np.array([edge] + [e for _, e in right] + [e for _, e in reversed(left)]), np.array([1, *signs])


def linking_number(one: Array, other: Array) -> float:
    """Return the linking number of two closed polygons, an integer up to rounding."""
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
