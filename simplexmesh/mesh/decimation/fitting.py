"""Least-squares fit of a coarse mesh to a surface, constrained to create no folds or crossings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices32, Mask
from simplexmesh._base.vectors import normalized
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.decimation import _kernels_fitting as kernels
from simplexmesh.mesh.decimation.guarding import MUTUAL_COSINE, Guard
from simplexmesh.mesh.simplex_mesh import SimplexMesh

TANGENTIAL = 0.02
"""Weight of the tangential distance of a sample, relative to that of its normal distance."""

SMOOTHNESS, FLATNESS = 0.005, 0.1
"""Weights of a vertex's distance to its neighbors' mean and to the planes of its faces, relative to those of its
samples: half of either brings the faces 3 to 6 % closer, and makes them less even and less flat."""

CREASE = 0.03
"""Eigenvalue of a vertex's face-normal covariance above which it is not smoothed: on creases, only along them."""

FITTING_COSINE = -0.3
"""Smallest cosine between a fan triangle and its face's target normal during the fit."""


@dataclass(frozen=True)
class SurfaceSamples:
    """Samples of a surface: its vertices and face centroids, and separately the vertices on its rims."""

    points: Array  # (s, 3)
    normals: Array  # (s, 3) unit vectors
    weights: Array  # (s,) the area that each represents
    faces: Indices32  # (s,) the face of the surface that each is on
    rim_points: Array  # (r, 3) the vertices on holes
    rim_weights: Array  # (r,) the length that each represents
    rim_faces: Indices32  # (r,) the face and the hole that each is on
    rim_holes: Indices32

    @classmethod
    def of(cls, mesh: SimplexMesh) -> SurfaceSamples:
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
    """Return the faces as arrays for the kernels."""
    corner = np.empty(c.twin.size, np.int32)
    corner[c.face_darts] = np.arange(c.twin.size)
    owner = np.repeat(np.arange(len(c.face_sizes), dtype=np.int32), c.face_sizes)
    ahead, across = face_geometry.following(c.face_vertices, c.face_offsets), corner[c.twin.reshape(-1)[c.face_darts]]
    return kernels.Faces(c.face_vertices, c.face_offsets, ahead, owner, across, c.face_is_hole)


class FittedMesh:
    """A mesh that is fitted to a surface; `mesh` is its current state."""

    def __init__(
        self, surface: SurfaceSamples, mesh: SimplexMesh, part_of: Indices32, target_normals: Array, free: Mask
    ) -> None:
        self._surface = surface
        self.mesh = mesh
        self._faces = faces_of(mesh.connectivity)
        self._guard = Guard(mesh, self._faces, target_normals, free)
        self._start = part_of[surface.faces].astype(np.int32)
        n, r = len(surface.points), len(surface.rim_points)
        self._locations = kernels.Locations(np.zeros(n + r, np.int32), np.zeros((n + r, 3)))
        self._rim_locations = kernels.Locations(self._locations.corner[n:], self._locations.weights[n:])
        self._initialize_rims(part_of)

    def _initialize_rims(self, part_of: Indices32) -> None:
        """Locate each rim sample on the edge between its face and its hole."""
        s, f = self._surface, self._faces
        n_faces = len(f.hole)
        rims = np.flatnonzero(f.hole[f.owner])
        keys = f.owner[f.across[rims]].astype(np.int64) * n_faces + f.owner[rims]
        order = np.argsort(keys)
        wanted = part_of[s.rim_faces].astype(np.int64) * n_faces + part_of[s.rim_holes]
        if len(rims):
            self._rim_locations.corner[:] = rims[order[np.searchsorted(keys[order], wanted).clip(0, len(rims) - 1)]]

    def _locate(self) -> None:
        """Find the closest points of the samples on the mesh, by local search from the previous ones."""
        f, v = self._faces, self.mesh.vertices
        centroids = np.empty((len(f.hole), 3))
        kernels.centroids(v, f, centroids)
        kernels.locate(v, centroids, f, self._surface.points, self._start, self._locations)
        kernels.locate_on_rim(v, f, self._surface.rim_points, self._rim_locations)

    def advance(self, target: Array, *, loosely: bool = False) -> None:
        """Move the vertices towards `target` (n, 3); `loosely`, with a lower bound on cosines to target normals."""
        cosine = FITTING_COSINE if loosely else 0.0
        self.mesh = self.mesh.moved(self._guard.advanced(self.mesh, target, cosine))

    def untangle(self, *, strictly: bool = False) -> None:
        """Move the vertices of faces that fold or cross; `strictly`, also of those far from target normals."""
        mutual, target = (2 * MUTUAL_COSINE, 0.1) if strictly else (MUTUAL_COSINE, -2.0)
        self.mesh = self.mesh.moved(self._guard.untangled(self.mesh, mutual, target))

    def improve(self, rounds: int) -> None:
        """Alternate locating the samples and solving the least-squares problem, as in iterative closest point."""
        for _ in range(rounds):
            self._locate()
            start = np.array(self.mesh.vertices)
            target = kernels.conjugate_gradients(start, self._faces, self._locations, self._terms(), 12)
            self.advance(target, loosely=True)

    def _terms(self) -> kernels.Terms:
        """Return the terms of the least-squares problem at the current positions."""
        s, f, mesh = self._surface, self._faces, self.mesh
        c, corner = mesh.connectivity, self._rim_locations.corner
        edges = mesh.vertices[f.ahead[corner]] - mesh.vertices[f.vertices[corner]]
        rim_weight = s.rim_weights * np.sqrt(s.weights.sum() / max(mesh.n_faces, 1))
        covered = np.bincount(self._start, s.weights, len(f.hole)) / c.face_sizes
        weight = covered[c.vertex_faces].sum(axis=1)
        normals = face_geometry.face_normals(mesh.vertices, f.vertices, f.offsets)
        normals[f.hole] = 0
        return kernels.Terms(
            np.concatenate([s.points, s.rim_points]),
            np.concatenate([s.normals, normalized(edges)]),
            np.concatenate([s.weights, TANGENTIAL * rim_weight]),
            np.concatenate([TANGENTIAL * s.weights, rim_weight]),
            c.neighbors,
            _shares(c),
            SMOOTHNESS * weight[:, None, None] * _tangential_projection(normals[c.vertex_faces]),
            normals * np.sqrt(FLATNESS * covered)[:, None],
        )


def _shares(c: Connectivity) -> Array:
    """Return the weights (n, 3) of the neighbors of each vertex in their mean, on a rim of the two on it."""
    kept = ~np.roll(c.face_is_hole[c.vertex_faces], -1, axis=1)
    return np.asarray(kept / np.maximum(kept.sum(axis=1, keepdims=True), 1))


def _tangential_projection(normals: Array) -> Array:
    """Return matrices (n, 3, 3) that approximately project onto the surface, given three face normals (n, 3, 3)."""
    covariance = normals.transpose(0, 2, 1) @ normals
    total = np.maximum(np.trace(covariance, axis1=1, axis2=2), np.finfo(float).tiny)
    eigenvalues, directions = np.linalg.eigh(covariance / total[:, None, None])
    kept = 1 / (1 + (eigenvalues / CREASE) ** 2)
    return np.asarray((directions * kept[:, None, :]) @ directions.transpose(0, 2, 1))
