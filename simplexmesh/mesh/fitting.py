"""A coarse mesh fitted to the surface it stands for: least squares, as far as no face folds or crosses another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_fitting as kernels
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.guarding import AMONG, ANYHOW, Guard
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

ITERATIONS = 12
ACROSS = 0.02
"""How much of the weight of a sample is that of its distance along the surface."""

EVEN, STAY, FLAT = 0.005, 1e-3, 0.1
"""The weights of a vertex's distance to its neighbors' mean, of its move, and of its distance to the planes of its
faces, in those of its samples."""

SHARP = 0.03
"""The part of a vertex's face normals across which it is not evened out any more: on creases, only along them."""

FAR = 0.01
"""From which part of the largest squared distance on it is looked for more widely."""

ALONG, LOOSELY = 0.1, -0.3
"""Least cosine between a fan triangle and what its face stands for, at the start, and while it is fitted."""


@dataclass(frozen=True)
class Surface:
    """Samples of a surface: its vertices and the centroids of its faces, and again the vertices on its rims.

    Attributes
    ----------
    points, normals : (s, 3) arrays of float
        With unit normals.
    weights : (s,) array of float
        The area that each stands for.
    faces : (s,) array of int
        The face of the surface that each is on.
    rim_points : (r, 3) array of float
        The vertices on holes.
    rim_weights : (r,) array of float
        The length that each stands for.
    rim_faces, rim_holes : (r,) arrays of int
        The face and the hole that each is on.
    """

    points: Array
    normals: Array
    weights: Array
    faces: Indices
    rim_points: Array
    rim_weights: Array
    rim_faces: Indices
    rim_holes: Indices

    @classmethod
    def of(cls, mesh: SimplexMesh) -> Surface:
        """Return the samples of a mesh."""
        c = mesh.connectivity
        loops = c.face_vertices, c.face_offsets
        solid = ~c.face_is_hole
        area = np.where(solid, mesh.face_areas, 0.0)
        own = c.vertex_faces[np.arange(c.n_vertices), solid[c.vertex_faces].argmax(axis=1)]
        on_rim = np.flatnonzero(np.repeat(c.face_is_hole, c.face_sizes))
        here, there = (mesh.vertices[v[on_rim]] for v in (loops[0], face_geometry.following(*loops)))
        twins = c.twin.reshape(-1)[c.face_darts[on_rim]]
        return cls(
            np.concatenate([mesh.vertices, face_geometry.face_centroids(mesh.vertices, *loops)[solid]]),
            np.concatenate([mesh.normals, face_geometry.face_normals(mesh.vertices, *loops)[solid]]),
            np.concatenate([(area / c.face_sizes)[c.vertex_faces].sum(axis=1) / 2, area[solid] / 2]),
            np.concatenate([own, np.flatnonzero(solid)]).astype(np.int32),
            here,
            np.linalg.norm(there - here, axis=1),
            c.face.reshape(-1)[twins],
            np.repeat(np.arange(len(c.face_sizes)), c.face_sizes)[on_rim].astype(np.int32),
        )


def faces_of(c: Connectivity) -> kernels.Faces:
    """Return the faces as the kernels want them."""
    corner = np.empty(c.twin.size, np.int32)
    corner[c.face_darts] = np.arange(c.twin.size)
    owner = np.repeat(np.arange(len(c.face_sizes)), c.face_sizes)
    ahead = face_geometry.following(c.face_vertices, c.face_offsets)
    across = corner[c.twin.reshape(-1)[c.face_darts]]
    flat = [np.ascontiguousarray(v, np.int32) for v in (c.face_vertices, c.face_offsets, ahead, owner, across)]
    return kernels.Faces(flat[0], flat[1], flat[2], flat[3], flat[4], c.face_is_hole)


def tangled_vertices(mesh: SimplexMesh) -> NDArray[np.bool_]:
    """Return (n,) which vertices are wrong: inverted, or on a face that is folded, flat or crosses another."""
    c, found = mesh.connectivity, mesh.check(self_intersections=True).where
    faces = np.zeros(len(c.face_sizes), bool)
    for kind in ("folded", "flat_faces", "crossing"):
        faces[np.ravel(found.get(kind, [])).astype(int)] = True
    out: NDArray[np.bool_] = np.asarray(faces[c.vertex_faces].any(axis=1))
    for kind in ("inverted", "collinear"):
        out[np.asarray(found.get(kind, []), int)] = True
    out[c.edge_vertices[np.asarray(found.get("flat_edges", []), int)].ravel()] = True
    return out


class Fit:
    """A mesh that is being fitted to a surface.

    Parameters
    ----------
    surface : Surface
        What it stands for.
    mesh : SimplexMesh
        The mesh; its vertices are near the surface.
    part_of : (f,) array of int
        For each face of the surface the face of the mesh that it is part of; -1 where it is none.
    along : (g, 3) array of float
        Unit vectors that the faces of the mesh should point along, zero where nothing is known.
    free : (n,) array of bool
        Which vertices of the mesh may move.
    """

    def __init__(
        self, surface: Surface, mesh: SimplexMesh, part_of: Indices, along: Array, free: NDArray[np.bool_]
    ) -> None:
        self._surface = surface
        self.mesh = mesh
        self._part_of = part_of
        self._faces = faces_of(mesh.connectivity)
        self._guard = Guard(mesh, self._faces, along, free)
        self._start = part_of[surface.faces].astype(np.int32)
        n, r = len(surface.points), len(surface.rim_points)
        self._places = kernels.Places(np.zeros(n, np.int32), np.zeros((n, 3)))
        self._rim_places = kernels.Places(np.zeros(r, np.int32), np.zeros((r, 3)))
        self._squared = np.empty(n)
        self._find_rims(part_of)

    def _find_rims(self, part_of: Indices) -> None:
        """Start each sample of a rim on the edge between its face and its hole."""
        s, f = self._surface, self._faces
        n_faces = len(f.hole)
        rims = np.flatnonzero(f.hole[f.owner])
        keys = f.owner[f.across[rims]].astype(np.int64) * n_faces + f.owner[rims]
        order = np.argsort(keys)
        wanted = part_of[s.rim_faces].astype(np.int64) * n_faces + part_of[s.rim_holes]
        if len(rims):
            self._rim_places.corner[:] = rims[order[np.searchsorted(keys[order], wanted).clip(0, len(rims) - 1)]]

    def _locate(self) -> None:
        """Find where the samples belong."""
        f, v = self._faces, self.mesh.vertices
        self._middle = np.empty((len(f.hole), 3))
        kernels.centroids(v, f, self._middle)
        kernels.locate(v, self._middle, f, self._surface.points, self._start, self._places, self._squared)
        kernels.locate_on_rim(v, f, self._surface.rim_points, self._rim_places)

    def distances(self) -> tuple[float, float]:
        """Return the rms and the largest distance of the samples, those on rims to the rims included in the latter."""
        squared, on_rims = self._distances()
        weights = self._surface.weights
        largest = max(float(squared.max()), float(on_rims.max(initial=0)))
        area = max(float(weights.sum()), np.finfo(float).tiny)
        return float(np.sqrt((weights * squared).sum() / area)), float(np.sqrt(largest))

    def _distances(self) -> tuple[Array, Array]:
        """Return the squared distances of the samples, and of those on rims to the rims."""
        self._locate()
        f, far = self._faces, FAR * float(self._squared.max())
        kernels.settle(
            self.mesh.vertices, self._middle, f, self._surface.points, self._start, self._places, self._squared, far
        )
        c, w = self._rim_places
        v = self.mesh.vertices
        there = w[:, :1] * v[f.vertices[c]] + w[:, 1:2] * v[f.ahead[c]]
        return self._squared, ((there - self._surface.rim_points) ** 2).sum(axis=1)

    def advance(self, target: Array, *, loosely: bool = False) -> None:
        """Move the vertices towards a target, as far as faces still point along what they stand for, or roughly so."""
        self.mesh = self.mesh.moved(self._guard.advanced(self.mesh, target, LOOSELY if loosely else 0.0))

    def untangle(self, *, strictly: bool = False) -> None:
        """Move the vertices of faces that fold or cross; strictly, of those that point elsewhere."""
        among, along = (2 * AMONG, ALONG) if strictly else (AMONG, ANYHOW)
        self.mesh = self.mesh.moved(self._guard.untangled(self.mesh, among, along))

    def loosen(self, tangled: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Put tangled vertices (n,) to the mean of their neighbors and untangle again, from where fewer may be left.

        Returns which are; where they are no fewer, everything is as it was.
        """
        c, before, v = self.mesh.connectivity, self.mesh, np.array(self.mesh.vertices)
        inner = tangled & ~c.face_is_hole[c.vertex_faces].any(axis=1)
        v[inner] = v[c.neighbors[inner]].mean(axis=1)
        self.mesh = before.moved(v)
        self.untangle()
        left = tangled_vertices(self.mesh)
        if left.sum() < tangled.sum():
            return left
        self.mesh = before
        return tangled

    def improve(self, rounds: int) -> None:
        """Least squares, again and again, the samples finding their places in between."""
        for _ in range(rounds):
            self._locate()
            one, other = self._places, self._rim_places
            places = kernels.Places(
                np.concatenate([one.corner, other.corner]), np.concatenate([one.weights, other.weights])
            )
            target = kernels.solved(np.array(self.mesh.vertices), self._faces, places, self._terms(), ITERATIONS)
            self.advance(target, loosely=True)

    def _terms(self) -> kernels.Terms:
        s, f, mesh = self._surface, self._faces, self.mesh
        c = mesh.connectivity
        ends = mesh.vertices[f.ahead[self._rim_places.corner]] - mesh.vertices[f.vertices[self._rim_places.corner]]
        along = ends / np.maximum(np.linalg.norm(ends, axis=1, keepdims=True), np.finfo(float).tiny)
        rim_weight = s.rim_weights * np.sqrt(s.weights.sum() / max(mesh.n_faces, 1))
        covered = np.bincount(self._start, s.weights, len(f.hole)) / c.face_sizes
        weight = covered[c.vertex_faces].sum(axis=1)
        neighbors, share = np.array(c.neighbors), np.full((mesh.n_vertices, 3), 1 / 3)
        rims = np.flatnonzero(f.hole[f.owner])
        on_rim = f.ahead[rims]
        behind, ahead = f.vertices[rims], f.ahead[self._next(rims)]
        neighbors[on_rim] = np.stack([behind, ahead, ahead], axis=1)
        share[on_rim] = (0.5, 0.5, 0)
        normals = face_geometry.face_normals(mesh.vertices, f.vertices, f.offsets)
        normals[f.hole] = 0
        return kernels.Terms(
            np.concatenate([s.points, s.rim_points]),
            np.concatenate([s.normals, along]),
            np.concatenate([s.weights, ACROSS * rim_weight]),
            np.concatenate([ACROSS * s.weights, rim_weight]),
            np.ascontiguousarray(neighbors, np.int32),
            share,
            EVEN * weight[:, None, None] * _along_surface(normals[c.vertex_faces]),
            STAY * weight,
            normals * np.sqrt(FLAT * covered)[:, None],
        )

    def _next(self, corners: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the corner after each one around its face."""
        last = self._faces.offsets[self._faces.owner[corners] + 1] - 1
        return np.asarray(np.where(corners == last, self._faces.offsets[self._faces.owner[corners]], corners + 1))


def _along_surface(normals: Array) -> Array:
    """Return matrices (n, 3, 3) that keep of a vector what is along the surface, of the three face normals (n, 3, 3).

    Their mean square has an eigenvalue for each direction, the part of the normals that is across it.
    """
    squares = normals.transpose(0, 2, 1) @ normals
    total = np.maximum(np.trace(squares, axis1=1, axis2=2), np.finfo(float).tiny)
    part, directions = np.linalg.eigh(squares / total[:, None, None])
    kept = 1 / (1 + (part / SHARP) ** 2)
    return np.asarray((directions * kept[:, None, :]) @ directions.transpose(0, 2, 1))
