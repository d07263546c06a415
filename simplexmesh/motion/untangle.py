"""Folds and self-intersections undone where they are, the rest of the mesh left alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from simplexmesh.errors import DivergedError
from simplexmesh.mesh.check import misoriented
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.self_intersection import self_intersections
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.state import Target

Mask = NDArray[np.bool_]

PATIENCE = 3
"""So often tangles are smoothed before those that resist are taken back to the start, where there is one."""

RETURNS, SPARED = 4, 2
"""How often what was smoothed is let back to the data, and rings around what that would tangle again left out."""


@dataclass(frozen=True, eq=False)
class Tangles:
    """A mesh and where it is tangled.

    Attributes
    ----------
    mesh : SimplexMesh
    pairs : (m, 2) array of int
        The faces that cross; a face whose own triangles do is paired with itself.
    vertices : (n,) array of bool
        Whether a vertex is turned against its faces, or on a face that is folded or crosses.
    """

    mesh: SimplexMesh

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """(m, 2) the faces that cross."""
        return self_intersections(self.mesh.vertices, self.mesh.connectivity)

    @cached_property
    def vertices(self) -> Mask:
        """(n,) whether a vertex is tangled."""
        crossing = np.zeros(len(self.mesh.connectivity.face_sizes), bool)
        crossing[self.pairs.ravel()] = True
        return np.asarray(folded_vertices(self.mesh) | crossing[self.mesh.connectivity.vertex_faces].any(axis=1))

    @property
    def count(self) -> int:
        """The number of tangled vertices."""
        return int(self.vertices.sum())

    def improved(self, moved: SimplexMesh, free: Mask) -> Tangles:
        """Return this mesh with those of its free places as in `moved` where fewer vertices are tangled then.

        Parameters
        ----------
        moved : SimplexMesh
            The same mesh elsewhere.
        free : (n,) array of bool
        """
        other = self._with(moved, free)
        place = self._places(other, free | other.vertices)
        fewer = (np.bincount(place, other.vertices) < np.bincount(place, self.vertices))[place]
        mixed = other if fewer[free].all() else self._with(moved, free & fewer)
        return mixed if mixed.count < self.count else self

    def _with(self, moved: SimplexMesh, free: Mask) -> Tangles:
        """Return this mesh with some vertices as in another."""
        return Tangles(self.mesh.moved(np.where(free[:, None], moved.vertices, self.mesh.vertices)))

    def _places(self, other: Tangles, marked: Mask) -> NDArray[np.int32]:
        """Return (n,) a number for each place: marked vertices joined by edges, or by a crossing now or then."""
        c = self.mesh.connectivity
        edges = c.edge_vertices[marked[c.edge_vertices].all(axis=1)]
        first = c.face_vertices[c.face_offsets[:-1]]
        rows, columns = np.concatenate([edges, first[self.pairs], first[other.pairs]]).T
        graph = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(c.n_vertices, c.n_vertices))
        return np.asarray(connected_components(graph, directed=False)[1])


def tangled_vertices(mesh: SimplexMesh) -> Mask:
    """Return (n,) whether a vertex is turned against its faces, or on a face that is folded or meets another face.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> bool(tangled_vertices(sm.sphere(4)).any())
    False
    """
    return Tangles(mesh).vertices


def folded_vertices(mesh: SimplexMesh) -> Mask:
    """Return (n,) whether a vertex is turned or on a folded face: most tangles begin so, and it is found much sooner.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> bool(folded_vertices(sm.sphere(4)).any())
    False
    """
    inverted, folded = misoriented(mesh.vertices, mesh.connectivity)
    return np.asarray(inverted | folded[mesh.connectivity.vertex_faces].any(axis=1))


def grown(marked: Mask, connectivity: Connectivity, rings: int) -> Mask:
    """Return the marked vertices and all within so many edges of one."""
    for _ in range(rings):
        marked = np.asarray(marked | marked[connectivity.neighbors].any(axis=1))
    return marked


def untangled(
    mesh: SimplexMesh, target: Target, *, reach: float, start: SimplexMesh | None = None, rounds: int = 10
) -> tuple[SimplexMesh, int]:
    """Return the mesh with its folds and self-intersections smoothed away, and how many vertices are still tangled.

    Tangled vertices and their surroundings, wider in every round, first relax without data under orientation
    continuity, then return to the data under a mean-curvature constraint, stiffer in every round. All other vertices
    stay, and so do places where that helps nothing. Those that resist are taken back, in part and with their
    surroundings, to where they were at the start. In the end all that was moved returns to the data, suppler, where
    that tangles nothing again.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    reach : float
        How far the data is looked for.
    start : SimplexMesh, optional
        The same mesh before it moved, near the data and not tangled.
    rounds : int
        How often to try.

    Returns
    -------
    mesh : SimplexMesh
        The best found.
    remaining : int
        Number of its tangled vertices.
    """
    tangles = _smoothed(Tangles(mesh), target, reach, range(min(PATIENCE, rounds)))
    tangles = _taken_back(tangles, start)
    if rounds > PATIENCE and tangles.count:
        tangles = _taken_back(_smoothed(tangles, target, reach, range(PATIENCE, rounds)), start)
    if tangles.mesh is not mesh:
        tangles = _returned(tangles, mesh, target, reach)
    return tangles.mesh, tangles.count


def _smoothed(tangles: Tangles, target: Target, reach: float, attempts: Iterable[int]) -> Tangles:
    """Return the mesh with its tangled places relaxed without data, then back on it, stiffer with each attempt."""
    for attempt in attempts:
        if not tangles.count:
            break
        marked = grown(tangles.vertices, tangles.mesh.connectivity, 2 + attempt)
        free = marked.astype(float)
        relaxing = DeformableModel(tangles.mesh, alpha=0.5 * free, damping=1.0, constraint="orientation")
        try:
            for _ in relaxing.run(5 + 5 * attempt):
                pass
            returning = DeformableModel(
                relaxing.mesh,
                target,
                alpha=0.4 * free,
                beta=0.2 / (1 + attempt) * free,
                damping=1.0,
                reach=reach,
                rigidity=3 + attempt,
                seeking=0.2 / (1 + attempt),
            )
            for _ in returning.run(20):
                pass
        except DivergedError:  # a mesh too coarse for its topology has no smooth shape: the best so far stays
            break
        tangles = tangles.improved(returning.mesh, marked)
    return tangles


def _taken_back(tangles: Tangles, start: SimplexMesh | None) -> Tangles:
    """Return the mesh with its tangled places drawn back to the start, wider each time, where that helps."""
    for rings in range(2, 9):
        if start is None or not tangles.count:
            break
        mesh = tangles.mesh
        share = grown(tangles.vertices, mesh.connectivity, rings).astype(float)
        for _ in range(rings):
            share = 0.25 * (share + share[mesh.neighbors].sum(axis=1))
        back = mesh.moved(mesh.vertices + share[:, None] * (start.vertices - mesh.vertices))
        tangles = tangles.improved(back, share > 0)
    return tangles


def _returned(tangles: Tangles, before: SimplexMesh, target: Target, reach: float) -> Tangles:
    """Return the mesh with the places that have moved since before let back to the data, less what that tangles."""
    c = tangles.mesh.connectivity
    marked = grown((tangles.mesh.vertices != before.vertices).any(axis=1), c, 1)
    for _ in range(RETURNS):
        free = marked.astype(float)
        model = DeformableModel(tangles.mesh, target, alpha=0.4 * free, beta=0.4 * free, damping=1.0, reach=reach)
        try:
            for _ in model.run(10):
                pass
        except DivergedError:
            break
        there = tangles._with(model.mesh, marked)
        place = tangles._places(there, marked | there.vertices)
        more = (np.bincount(place, there.vertices) > np.bincount(place, tangles.vertices))[place]
        back = tangles._with(model.mesh, marked & ~more) if more.any() else there
        if back.count <= tangles.count:
            tangles = back
        marked = marked & more & ~grown(there.vertices, c, SPARED)
        if not marked.any():
            break
    return tangles
