"""Removal of folds and self-intersections by local smoothing; the rest of the mesh is not moved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh._base.errors import DivergedError, warn
from simplexmesh.mesh.check import creased_vertices, tangled_with
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangles.self_intersection import self_intersections
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.targets.protocol import BuiltInTarget, Target
from simplexmesh.motion.topology.face_regions import dilated


@dataclass(frozen=True, eq=False)
class Tangles:
    """A mesh and its tangled vertices; of another one, only what moved since is searched."""

    mesh: SimplexMesh
    known: tuple[Array, Indices, Mask] | None = None  # positions (n, 3), and `pairs` and `bent` there

    @cached_property
    def pairs(self) -> Indices:
        """(m, 2) pairs of faces that intersect; a face whose own triangles do is paired with itself."""
        vertices, c = self.mesh.vertices, self.mesh.connectivity
        if self.known is None:
            return self_intersections(vertices, c)
        changed = np.zeros(len(c.face_sizes), bool)
        changed[c.vertex_faces[(vertices != self.known[0]).any(axis=1)]] = True
        kept = self.known[1][~changed[self.known[1]].any(axis=1)]
        return np.unique(np.concatenate([kept, self_intersections(vertices, c, changed)]), axis=0)

    @cached_property
    def bent(self) -> Mask:
        """(n,) mask of the vertices inverted, degenerate, or on a face folded or flat."""
        none = np.zeros((0, 2), np.int64)
        if self.known is None:
            return tangled_with(self.mesh, none)
        c, moved = self.mesh.connectivity, (self.mesh.vertices != self.known[0]).any(axis=1)
        near = _on_faces_of(c, dilated(moved, c.neighbors, 1))  # whose normals changed
        part, rows = excerpt(self.mesh, _on_faces_of(c, near))
        out, here = self.known[2].copy(), near[rows]
        out[rows[here]] = tangled_with(part, none)[here]
        return out

    @cached_property
    def vertices(self) -> Mask:
        """(n,) mask of the tangled vertices."""
        faces = np.zeros(len(self.mesh.connectivity.face_sizes), bool)
        faces[self.pairs.ravel()] = True
        return np.asarray(self.bent | faces[self.mesh.connectivity.vertex_faces].any(axis=1))

    @property
    def count(self) -> int:
        """The number of tangled vertices."""
        return int(self.vertices.sum())

    def improved(self, moved: SimplexMesh, free: Mask) -> Tangles:
        """Return the mesh with positions from `moved` in the regions of `free` where that leaves fewer tangles."""
        other = self.with_positions(moved, free)
        region = self.regions(other, free | other.vertices)
        better = (np.bincount(region, other.vertices) < np.bincount(region, self.vertices))[region]
        mixed = other if better[free].all() else self.with_positions(moved, free & better)
        return mixed if mixed.count < self.count else self

    def with_positions(self, moved: SimplexMesh, free: Mask) -> Tangles:
        """Return the mesh with the positions of some vertices from another."""
        mixed = self.mesh.moved(np.where(free[:, None], moved.vertices, self.mesh.vertices))
        return Tangles(mixed, (self.mesh.vertices, self.pairs, self.bent))

    def regions(self, other: Tangles, marked: Mask) -> Indices32:
        """Return (n,) labels of regions: marked vertices connected by edges or by an intersection in either mesh."""
        c = self.mesh.connectivity
        edges = c.edge_vertices[marked[c.edge_vertices].all(axis=1)]
        first = c.face_vertices[c.face_offsets[:-1]]
        rows, columns = np.concatenate([edges, first[self.pairs], first[other.pairs]]).T
        graph = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(c.n_vertices, c.n_vertices))
        return np.asarray(connected_components(graph, directed=False)[1])


def _on_faces_of(connectivity: Connectivity, marked: Mask) -> Mask:
    """Return the vertices (n,) on faces, but holes, of those marked."""
    faces = np.zeros(len(connectivity.face_sizes), bool)
    faces[connectivity.vertex_faces[marked]] = True
    return np.asarray((faces & ~connectivity.face_is_hole)[connectivity.vertex_faces].any(axis=1))


def excerpt(mesh: SimplexMesh, zone: Mask) -> tuple[SimplexMesh, Indices]:
    """Return a mesh of a zone (n,) and the far ends of edges out of it, which a ring closes, and its rows in `mesh`.

    A motion of few vertices then does not take the time of all.
    """
    c = mesh.connectivity
    inside = np.flatnonzero(zone)
    near = c.neighbors[inside]
    vertex, slot = np.nonzero(~zone[near])
    k, count = len(inside), len(vertex)
    if count < 3 or c.face_is_hole[c.vertex_faces[inside]].any():  # with too few ends for a ring
        return mesh, np.arange(c.n_vertices)
    number = np.zeros(c.n_vertices, np.int64)
    number[inside] = np.arange(k)
    neighbors, ring = number[near], k + np.arange(count)
    neighbors[vertex, slot] = ring
    closing = np.column_stack([vertex, np.roll(ring, 1), np.roll(ring, -1)])
    rows = np.concatenate([inside, near[vertex, slot]])
    connectivity = Connectivity.from_neighbors(np.concatenate([neighbors, closing]))
    return SimplexMesh(mesh.vertices[rows], connectivity, {name: row[rows] for name, row in mesh.data.items()}), rows


def untangled(
    tangles: Tangles, target: Target, *, reach: float, start: SimplexMesh | None = None, rounds: int = 10
) -> Tangles:
    """Return a mesh without folds and intersections, by rounds of smoothing, blends with the start, and a last fit."""
    mesh = tangles.mesh
    for attempt in range(rounds):
        if not tangles.count:
            break
        tangles = _blended_with_start(_smoothed(tangles, target, reach, attempt), start)
    return _refitted(tangles, mesh, target, reach) if tangles.mesh is not mesh else tangles


def with_membrane(mesh: SimplexMesh, zone: Mask) -> SimplexMesh:
    """Return the mesh with a zone (n,), but holes and whole components, at the means of its neighbors."""
    c = mesh.connectivity
    free = zone.copy()
    free[c.face_vertices[np.repeat(c.face_is_hole, c.face_sizes)]] = False
    rows = np.flatnonzero(free)
    if not len(rows):
        return mesh
    row_of = np.full(c.n_vertices, -1)
    row_of[rows] = np.arange(len(rows))
    near = mesh.neighbors[rows]
    inner = free[near]
    here = np.repeat(np.arange(len(rows)), 3)[inner.ravel()]
    ones, diagonal = np.ones(len(here)), np.arange(len(rows))
    links = coo_array((ones, (here, row_of[near[inner]])), shape=(len(rows), len(rows)))
    label = connected_components(links, directed=False)[1]
    held = np.bincount(label, ~inner.all(axis=1))[label] > 0
    if not held.all():  # a film that nothing holds would have no place: a component wholly in the zone stays
        return with_membrane(mesh, np.isin(np.arange(c.n_vertices), rows[held]))
    matrix = coo_array((np.full(len(rows), 3.0), (diagonal, diagonal)), shape=links.shape) - links
    pull = np.where(inner[:, :, None], 0.0, mesh.vertices[near]).sum(axis=1)
    places = mesh.vertices.copy()
    places[rows] = spsolve(matrix.tocsc(), pull)
    return mesh.moved(places)


def _smoothed(tangles: Tangles, target: Target, reach: float, attempt: int) -> Tangles:
    """Return the mesh with its tangled regions relaxed without data, then fitted again, stiffer with each attempt."""
    marked = dilated(tangles.vertices, tangles.mesh.neighbors, 2 + attempt) & ~_creased(tangles.mesh)
    part, rows = excerpt(tangles.mesh, dilated(marked, tangles.mesh.neighbors, 3 + attempt))
    free = marked[rows].astype(float)
    relaxing = DeformableModel(part, alpha=0.5 * free, damping=1.0, constraint="orientation")
    try:
        for _ in relaxing.run(5 + 5 * attempt, warnings=False):
            pass
        refitting = DeformableModel(
            relaxing.mesh,
            _seen_from(target, rows),
            alpha=0.4 * free,
            beta=0.2 / (1 + attempt) * free,
            damping=1.0,
            reach=reach,
            rigidity=3 + attempt,
            seeking=0.2 / (1 + attempt),
        )
        for _ in refitting.run(20, warnings=False):
            pass
    except DivergedError:  # a mesh too coarse for its topology has no smooth shape
        return tangles
    return tangles.improved(_with_rows(tangles.mesh, rows, refitting.mesh), marked)


def _seen_from(target: Any, rows: Indices) -> Any:
    """Return the target of an excerpt: of one that tells vertices by their number, that of these."""
    return target.excerpt(rows) if isinstance(target, BuiltInTarget) and hasattr(target, "excerpt") else target


def _creased(mesh: SimplexMesh) -> Mask:
    """Return the vertices (n,) on creases, which stay there."""
    marks = creased_vertices(mesh)
    return np.zeros(mesh.n_vertices, bool) if marks is None else marks


def _with_rows(mesh: SimplexMesh, rows: Indices, part: SimplexMesh) -> SimplexMesh:
    """Return the mesh with the positions of an excerpt."""
    vertices = mesh.vertices.copy()
    vertices[rows] = part.vertices
    return mesh.moved(vertices)


def _blended_with_start(tangles: Tangles, start: SimplexMesh | None) -> Tangles:
    """Return the mesh with its tangled regions blended with the start, larger each time, where that helps."""
    for rings in range(2, 9):
        if start is None or not tangles.count:
            break
        mesh = tangles.mesh
        share = dilated(tangles.vertices, mesh.neighbors, rings).astype(float)
        for _ in range(rings):
            share = 0.25 * (share + share[mesh.neighbors].sum(axis=1))
        back = mesh.moved(mesh.vertices + share[:, None] * (start.vertices - mesh.vertices))
        tangles = tangles.improved(back, share > 0)
    return tangles


def _refitted(tangles: Tangles, before: SimplexMesh, target: Target, reach: float) -> Tangles:
    """Return the mesh with the vertices moved since `before` fitted to the data again, except where that tangles."""
    neighbors = tangles.mesh.neighbors
    marked = dilated((tangles.mesh.vertices != before.vertices).any(axis=1), neighbors, 1) & ~_creased(before)
    for _ in range(4):
        part, rows = excerpt(tangles.mesh, dilated(marked, neighbors, 1))
        free = marked[rows].astype(float)
        model = DeformableModel(
            part, _seen_from(target, rows), alpha=0.4 * free, beta=0.4 * free, damping=1.0, reach=reach, rigidity=1
        )
        try:
            for _ in model.run(10, warnings=False):
                pass
        except DivergedError as error:
            warn(f"parts that were untangled are not fitted to the data again: {error}")
            break
        fitted = _with_rows(tangles.mesh, rows, model.mesh)
        refitted = tangles.with_positions(fitted, marked)
        region = tangles.regions(refitted, marked | refitted.vertices)
        worse = (np.bincount(region, refitted.vertices) > np.bincount(region, tangles.vertices))[region]
        back = tangles.with_positions(fitted, marked & ~worse) if worse.any() else refitted
        if back.count <= tangles.count:
            tangles = back
        marked = marked & worse & ~dilated(refitted.vertices, neighbors, 2)
        if not marked.any():
            break
    return tangles
