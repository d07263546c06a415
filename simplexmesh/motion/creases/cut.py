"""Closed surfaces cut along lines into parts, and coarser ones whose lines are pieces of these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.data.cutting.dividing import bisected
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.motion.creases.line import at_distances
from simplexmesh.surface.features.coarsened import coarsened
from simplexmesh.surface.features.lines.network import FeatureNetwork


@dataclass(frozen=True)
class CutSurface:
    """A closed surface, and its half-edges (t, 3) along which it is cut."""

    surface: TriangleMesh
    sharp: Mask

    @cached_property
    def ends(self) -> Indices:
        """The vertices (3t, 2) that half-edges join."""
        faces = self.surface.faces.astype(np.int64)
        return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)

    @cached_property
    def mates(self) -> Indices:
        """The opposite (3t,) of each half-edge."""
        return half_edge_mates(self.surface.faces.astype(np.int64)).ravel().astype(np.int64)

    @cached_property
    def parts(self) -> Indices:
        """The part (t,) of each triangle."""
        n, smooth = len(self.sharp), np.flatnonzero(~self.sharp)
        graph = csr_array((np.ones(len(smooth), bool), (smooth // 3, self.mates[smooth] // 3)), shape=(n, n))
        return connected_components(graph, directed=False)[1]

    @cached_property
    def chains(self) -> list[Indices]:
        """The half-edges (k,) along each line, between places where other than two edges meet, or around it."""
        start, leaving = self.ends[:, 0], np.flatnonzero(self.sharp)
        degree = np.bincount(start[leaving], minlength=self.surface.n_vertices)
        leaving = leaving[np.argsort(start[leaving], kind="stable")]
        first = np.searchsorted(start[leaving], np.arange(len(degree)))
        free, out = self.sharp.ravel().copy(), []
        for seed in leaving[np.argsort(degree[start[leaving]] == 2, kind="stable")].tolist():
            chain, h = [], seed
            while free[h]:
                back = int(self.mates[h])
                free[h] = free[back] = False
                chain.append(h)
                if degree[start[back]] == 2:
                    one, other = leaving[first[start[back]] : first[start[back]] + 2].tolist()
                    h = other if one == back else one
            if chain:
                out.append(np.array(chain))
        return out

    @property
    def corners(self) -> int:
        """The number of vertices that the corners of three edges of lines and more will have."""
        return int(np.maximum(np.bincount(self.ends[self.sharp.ravel(), 0]) - 2, 0).sum())

    def without_strips(self, near: Mask, width: float) -> CutSurface:
        """Return the surface not cut along the flatter side of narrow parts of which some vertices (n,) are near."""
        vertices, faces = self.surface.vertices, self.surface.faces
        areas = np.bincount(self.parts, 0.5 * norm(self.surface.face_vectors))
        rows = np.flatnonzero(self.sharp)
        of, other = self.parts[rows // 3], self.parts[self.mates[rows] // 3]
        lengths = norm(np.diff(vertices[self.ends[rows]], axis=1)[:, 0])
        narrow = 2 * areas < width * np.bincount(of, lengths, len(areas))
        narrow &= np.bincount(self.parts, near[faces].any(axis=1), len(areas)) > 0
        normals = normalized(self.surface.face_vectors)
        turned = lengths * (1 - dot(normals[rows // 3], normals[self.mates[rows] // 3]))
        pairs, at = np.unique(of * len(areas) + other, return_inverse=True)
        bend = np.bincount(at, turned) / np.bincount(at, lengths)
        joined = set()
        for part in np.flatnonzero(narrow).tolist():
            beside = np.flatnonzero((pairs // len(areas) == part) & (pairs % len(areas) != part))
            if len(beside) > 1:
                joined.add(int(pairs[beside[np.argmin(bend[beside])]]))
        gone = rows[np.isin(of * len(areas) + other, sorted(joined))]
        sharp = self.sharp.ravel().copy()
        sharp[gone] = sharp[self.mates[gone]] = False
        return CutSurface(self.surface, sharp.reshape(-1, 3))

    def coarsened(self, count: int, weights: Array) -> tuple[CutSurface, Array]:
        """Return the surface with fewer triangles, and the places (t, 3, 3) halfway along the lines at its half-edges.

        `count` and `weights` are those of `coarsened`. Its lines have some of the vertices of these.
        """
        n = self.surface.n_vertices
        numbered = TriangleMesh(self.surface.vertices, self.surface.faces, {"number": np.arange(n)}, self.surface.unit)
        coarse = CutSurface(*coarsened(numbered, self.sharp, count, weights))
        number = coarse.surface.data["number"].astype(np.int64)
        left = np.isin(np.arange(n), number)
        keys, middles = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
        for chain in self.chains:
            line = np.append(self.ends[chain, 0], self.ends[chain[-1], 1])
            if line[0] == line[-1]:  # closed: begun at a vertex that is left
                turned = np.roll(line[:-1], -int(np.argmax(left[line[:-1]])))
                line = np.append(turned, turned[0])
            far = np.append(0.0, np.cumsum(norm(np.diff(self.surface.vertices[line], axis=0))))
            stops = np.flatnonzero(left[line])
            keys.append(np.sort(np.stack([line[stops[:-1]], line[stops[1:]]], axis=1), axis=1) @ [n, 1])
            middles.append(at_distances(self.surface.vertices[line], far, 0.5 * (far[stops[:-1]] + far[stops[1:]])))
        known, places = np.concatenate(keys), np.concatenate(middles)
        order, out = np.argsort(known), np.zeros((*coarse.sharp.shape, 3))
        wanted = np.sort(number[coarse.ends[coarse.sharp.ravel()]], axis=1) @ [n, 1]
        out[coarse.sharp] = places[order[np.searchsorted(known[order], wanted)]]
        return coarse, out


def cut_along(network: FeatureNetwork, longest: float) -> CutSurface:
    """Return a closed surface cut along its lines, its edges divided until none is longer than a length."""
    surface, n = network.mesh, network.mesh.n_vertices
    given = CutSurface(surface, np.zeros(surface.faces.shape, bool))
    chains = [np.append(line.vertices, line.vertices[: int(line.closed)]) for line in network.lines]
    steps = np.concatenate([np.stack([chain[:-1], chain[1:]], axis=1) for chain in chains])
    sharp = np.flatnonzero(np.isin(np.sort(given.ends, axis=1) @ [n, 1], np.sort(steps, axis=1) @ [n, 1]))
    across = sharp // 3 * surface.n_faces + given.mates[sharp] // 3
    fine, of = bisected(surface, longest)
    beside = of[half_edge_mates(fine.faces.astype(np.int64)) // 3]
    return CutSurface(fine, np.isin(of[:, None] * surface.n_faces + beside, across))
