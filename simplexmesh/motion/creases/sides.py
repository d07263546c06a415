"""The surface cut along creases into parts, of which each has data of its own."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csr_array, eye_array, kron
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh._base.vectors import norm, normalized, triangle_vectors
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.paths import Path, on_paths
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.targets.parted import PartedPoints
from simplexmesh.motion.targets.protocol import BuiltInTarget
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.motion.topology.face_regions import dilated

SETTLED = 8
"""Rings around creases in which vertices move and have sides: others are where the smooth model had them, tips too."""

FEWEST = 30
"""Points of a part from which it is fitted on its own."""

HELD, TIED = 0.003, 100.0
"""Weights of moves, and of differences of moves within a corner; the distance to a side has weight one."""


def crossed_edges(mesh: SimplexMesh, paths: Sequence[Path]) -> Mask:
    """Return the edges (e,) of a mesh along paths."""
    n, ends = mesh.n_vertices, np.sort(mesh.connectivity.edge_vertices.astype(np.int64), axis=1)
    steps = np.sort(np.concatenate([np.zeros((0, 2), np.int64), *(path.steps for path in paths)]), axis=1)
    return np.asarray(np.isin(ends @ [n, 1], steps @ [n, 1]))


def parts(mesh: SimplexMesh, paths: Sequence[Path]) -> Indices:
    """Return the part (f,) of each face of a mesh that is cut along paths.

    Parts are what is connected near paths, of which those that end freely are cut straight on, so that their sides are
    two parts as well. Faces farther away are of the nearest part.
    """
    c = mesh.connectivity
    beside = c.edge_faces[~crossed_edges(mesh, paths)]
    graph = _linked(beside[~_on_both_sides_ahead(mesh, paths, beside)], mesh.n_faces)
    near = np.unique(c.vertex_faces[dilated(on_paths(paths, mesh.n_vertices), mesh.neighbors, SETTLED)])
    labels = connected_components(graph[near][:, near], directed=False)[1]
    source = dijkstra(graph, indices=near, return_predecessors=True, unweighted=True, min_only=True)[2]
    bodies = connected_components(graph, directed=False)[1]  # those without paths
    return np.where(source < 0, labels.max() + 1 + bodies, labels[np.searchsorted(near, source)])


def _linked(beside: Indices32, count: int) -> csr_array:
    """Return the graph of faces of which pairs (m, 2) are beside each other."""
    pairs = np.concatenate([beside, beside[:, ::-1]])
    return csr_array((np.ones(len(pairs), bool), pairs.T), shape=(count, count))


def _on_both_sides_ahead(mesh: SimplexMesh, paths: Sequence[Path], beside: Indices32) -> Mask:
    """Return which pairs of faces (m, 2), near a free end of a path, lie on both sides of the way straight on."""
    c, graph, out = mesh.connectivity, _linked(beside, mesh.n_faces), np.zeros(len(beside), bool)
    centers = face_centroids(mesh.vertices, c.face_vertices, c.face_offsets)
    met = np.bincount(np.concatenate([path.steps.ravel() for path in paths]), minlength=mesh.n_vertices)
    for run in (run for path in paths if not path.closed for run in (path.vertices, path.vertices[::-1])):
        if met[end := run[-1]] == 1:
            on = mesh.vertices[end] - mesh.vertices[run[-4:][0]]
            steps = dijkstra(graph, indices=c.vertex_faces[end], unweighted=True, limit=2 * SETTLED, min_only=True)
            ways = centers[beside] - mesh.vertices[end]
            left = ways @ np.cross(mesh.normals[end], on) > 0
            near = np.isfinite(steps[beside]).all(axis=1)
            out |= near & (left[:, 0] != left[:, 1]) & (ways @ on > 0).any(axis=1)
    return out


class Sided(BuiltInTarget):
    """Points of which each vertex of a mesh sees those of its own part of the surface.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh, its creases in place; others with the same connectivity may move.
    paths : sequence of Path
        Its creases.
    points : (m, 3) array of float
        The data.
    whole : Target
        The target of all data, for parts with few points.
    rounded : float
        Points nearer to a crease belong to no part.

    Attributes
    ----------
    is_known : bool
        Whether the errors of points are: then fits are as wide as faces are flat, and what is whole rounds all of them.
    """

    def __init__(self, mesh: SimplexMesh, paths: Sequence[Path], points: Array, whole: Any, rounded: float) -> None:
        c = mesh.connectivity
        self.whole, self.face_parts = whole, parts(mesh, paths)
        self.bounds, errors = np.asarray(whole.bounds), whole.errors(points)
        self.is_known = errors is not None
        of_vertex = self.face_parts[c.vertex_faces]
        part = np.where(of_vertex[:, 1] == of_vertex[:, 2], of_vertex[:, 1], of_vertex[:, 0])  # that of most faces
        owner = np.repeat(np.arange(len(c.face_sizes)), c.face_sizes)
        surface = mesh.triangulated(method="fan")
        _, _, triangle = Triangles(surface).closest(points)
        outward = normalized(triangle_vectors(surface.vertices, surface.faces[triangle]))
        of_point = self.face_parts[owner[triangle]]
        ends = np.concatenate([mesh.vertices[path.steps] for path in paths])
        between = np.linspace(0, 1, 6)[:, None, None]
        lines = cKDTree(((1 - between) * ends[:, 0] + between * ends[:, 1]).reshape(-1, 3))
        clear = (lines.query(points)[0] > rounded) & outward.any(axis=1)  # triangles without area have no side
        own = [np.flatnonzero(clear & (of_point == k)) for k in range(int(self.face_parts.max()) + 1)]
        fitted = [k for k, rows in enumerate(own) if len(rows) >= FEWEST]
        self._number = np.full(len(own), -1)  # of a part among those fitted
        self._number[fitted] = np.arange(len(fitted))
        self._seen = self._number[part]
        self._parts = PartedPoints(points, outward, [own[k] for k in fitted], errors) if fitted else None

    @property
    def border(self) -> Any:
        """The border of all data."""
        return self.whole.border

    def see_all(self, chosen: Mask) -> None:
        """Let some vertices (n,) see the data of all parts."""
        self._seen = np.where(chosen, -1, self._seen)

    def excerpt(self, rows: Indices) -> Sided:
        """Return the target of the vertices in some rows (k,)."""
        out = copy(self)
        out._seen = self._seen[rows]
        return out

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the signed distance of each vertex along its normal to the surface of its part, or NaN."""
        out, own = np.full(len(vertices), np.nan), self._seen >= 0
        if self._parts is not None and own.any():
            out[own] = self._parts.gap_to(self._seen[own], vertices[own], normals[own], reach)
        if not own.all():
            out[~own] = self.whole.gap(vertices[~own], normals[~own], reach)
        return out

    def nearest(self, mesh: SimplexMesh, chosen: Mask) -> Array:
        """Return vertices (n, 3) of which some (n,) are moved onto their part where that is within an edge."""
        out, rows = mesh.vertices.copy(), np.flatnonzero(chosen & (self._seen >= 0))
        if self._parts is not None:
            normals, gaps = self._parts.facing(self._seen[rows], out[rows], mean_edge(mesh))
            out[rows] += np.nan_to_num(gaps)[:, None] * normals
        return out

    def met(self, mesh: SimplexMesh, paths: Sequence[Path], resolution: float) -> Array:
        """Return vertices with those of paths moved to where the surfaces of the parts there meet.

        Least squares of the distances to the tangent planes of all parts around a vertex, and of second differences
        along paths: noise would make them wavy, most where sides meet at a small angle. These weigh as much as smooths
        a path over about the resolution of its line. None moves by more than that, or an edge.
        """
        edge = mean_edge(mesh)
        farthest = max(edge, resolution)
        rows = np.unique(np.concatenate([path.vertices for path in paths]))
        around, at = np.sort(self._number[self.face_parts[mesh.connectivity.vertex_faces[rows]]]), mesh.vertices[rows]
        around[:, 1:][around[:, 1:] == around[:, :-1]] = -1  # each part once
        A, b = np.zeros((len(rows), 3, 3)), np.zeros((len(rows), 3))
        for part, target in [(part, self._parts) for part in around.T if self._parts is not None]:
            normals, gaps = target.facing(part, at, farthest)
            known = (part >= 0) & ~np.isnan(gaps)
            A[known] += (normals[:, :, None] * normals[:, None, :])[known]
            b[known] += (gaps[:, None] * normals)[known]
        chains = [(path, np.searchsorted(rows, path.vertices)) for path in paths]
        bends = _differences([np.append(c, c[:2]) if p.closed else c for p, c in chains], [1, -2, 1], len(rows))
        ties = _differences([c for p, c in chains if p.line < 0], [1, -1], len(rows))
        smooth = (resolution / edge) ** 4 * (bends.T @ bends)
        stiff = kron(smooth + TIED * (ties.T @ ties) + HELD * eye_array(len(rows)), eye_array(3))
        index = np.arange(len(rows) + 1)
        system = bsr_array((A, index[:-1], index), shape=stiff.shape) + stiff
        move = spsolve(system.tocsc(), (b - smooth @ at).ravel()).reshape(-1, 3)
        move *= np.minimum(1.0, farthest / np.maximum(norm(move), 1e-300))[:, None]
        out = mesh.vertices.copy()
        out[rows] += move
        return out


def _differences(chains: Sequence[Indices], weights: Sequence[float], count: int) -> csr_array:
    """Return the matrix (m, count) of weighted sums of that many rows in a sequence, along chains of rows."""
    some = [np.lib.stride_tricks.sliding_window_view(c, len(weights)) for c in chains if len(c) >= len(weights)]
    columns = np.concatenate([np.zeros((0, len(weights)), np.int64), *some])
    rows, values = np.repeat(np.arange(len(columns)), len(weights)), np.tile(np.asarray(weights, float), len(columns))
    return csr_array((values, (rows, columns.ravel())), shape=(len(columns), count))
