"""Isomorphism of meshes, and search for sequences of operators from one mesh to another."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.single_edits import insert_edge, remove_edge, swap_edge
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def sizes(mesh):
    """The number of faces of each size, and the number of holes."""
    c = mesh.connectivity
    return tuple(sorted(zip(c.face_sizes.tolist(), c.face_is_hole.tolist(), strict=True)))


def invariant(mesh):
    """A canonical form of the topology of a connected mesh: the lexicographically smallest of its traversals.

    Walks start at darts with the rarest sizes of faces around them.
    """
    c = mesh.connectivity
    twin, face = c.twin.reshape(-1), c.face.reshape(-1)
    holes = c.face_is_hole[face].tolist()
    turned = np.arange(twin.size).reshape(-1, 3)[:, [1, 2, 0]].reshape(-1)
    size = np.where(c.face_is_hole, -c.face_sizes, c.face_sizes)[face]
    around = list(zip(size, size[twin], size[turned], size[turned[twin]], strict=True))
    number_of = Counter(around)
    rarest = min(number_of, key=lambda sizes: (number_of[sizes], sizes))
    twin = twin.tolist()

    def traversal(start):
        number, order, out = {start // 3: 0}, [start], []
        for dart in order:
            for d in (dart, 3 * (dart // 3) + (dart + 1) % 3, 3 * (dart // 3) + (dart + 2) % 3):
                other = twin[d]
                if other // 3 not in number:
                    number[other // 3] = len(order)
                    order.append(other)
                first = order[number[other // 3]]
                out.append((number[other // 3], (other - first) % 3, holes[d]))
        return tuple(out)

    return min(traversal(dart) for dart, sizes in enumerate(around) if sizes == rarest)


def mirrored(mesh):
    """The mesh with reversed orientation."""
    turned = np.array([0, 2, 1])
    twin = mesh.connectivity.twin[:, turned]
    return SimplexMesh(mesh.vertices, Connectivity(3 * (twin // 3) + turned[twin % 3]))


def shrunk(mesh):
    """The meshes from one T1, with the edge; not those where a face merges with a hole, which T2 does not undo."""
    c = mesh.connectivity
    alike = np.ptp(c.face_is_hole[c.edge_faces].astype(int), axis=1) == 0
    darts = c.edge_darts[alike, 0].tolist()
    legal = [dart for dart in darts if EditableMesh(mesh).remove_edges([dart]).done.all()]
    return [(dart, remove_edge(mesh, dart).mesh) for dart in legal]


def swapped(mesh):
    """The meshes from one T7, with the edge."""
    out = []
    for dart in mesh.connectivity.edge_darts[:, 0].tolist():
        try:
            out.append((dart, swap_edge(mesh, dart).mesh))
        except TopologyError:
            continue
    return out


def holes_parted(mesh):
    """The meshes from one T2 across a hole, which divides it."""
    c = mesh.connectivity
    loops = [np.split(c.face_darts, c.face_offsets[1:-1])[hole].tolist() for hole in np.flatnonzero(c.face_is_hole)]
    return [insert_edge(mesh, *pair).mesh for darts in loops for pair in combinations(darts, 2)]


def holes_merged(mesh):
    """The meshes from one T1 on an edge between two holes."""
    c = mesh.connectivity
    darts = c.edge_darts[c.face_is_hole[c.edge_faces].all(axis=1), 0].tolist()
    return [remove_edge(mesh, dart).mesh for dart in darts if EditableMesh(mesh).remove_edges([dart]).done.all()]


def grown(mesh, *, wanted=None):
    """The meshes from one T2, with the two darts; only those with the face sizes `wanted`."""
    c = mesh.connectivity
    out = []
    for begin, end in zip(c.face_offsets[:-1], c.face_offsets[1:], strict=True):
        darts = c.face_darts[begin:end].tolist()
        for i, one in enumerate(darts):
            for other in darts[:i]:
                made = insert_edge(mesh, one, other).mesh
                if wanted is None or sizes(made) == sizes(wanted):
                    out.append(((one, other), made))
    return out


def unevenness(mesh):
    return int(((mesh.connectivity.face_sizes - 6) ** 2).sum())


def way_down(start, goal, width=12):
    """Meshes from `start` to one isomorphic to `goal` by single T1, found by best-first search for even sizes."""
    level = [[start]]
    while level[0][-1].n_vertices > goal.n_vertices:
        found = {}
        ahead = [(way, made) for way in level for _, made in shrunk(way[-1])]
        ahead.sort(key=lambda each: (sizes(each[1]) != sizes(goal), unevenness(each[1])))
        for way, made in ahead[: 8 * width]:
            found.setdefault(invariant(made), [*way, made])
        level = list(found.values())[:width]
    wanted = invariant(goal)
    return next(way for way in level if invariant(way[-1]) == wanted)


def way_up(start, goals):
    """Meshes from `start` on, isomorphic to `goals`, each by one T2 from the previous one."""
    way = [start]
    for goal in goals:
        wanted = invariant(goal)
        way.append(next(made for _, made in grown(way[-1], wanted=goal) if invariant(made) == wanted))
    return way


def ways_by_swaps(start):
    """The sequence of meshes, each by one T7, to every mesh that T7 reaches, by its invariant."""
    ways, ahead = {invariant(start): [start]}, [start]
    while ahead:
        mesh = ahead.pop(0)
        for _, made in swapped(mesh):
            if (name := invariant(made)) not in ways:
                ways[name] = [*ways[invariant(mesh)], made]
                ahead.append(made)
    return ways
