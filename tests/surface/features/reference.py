"""Boolean operations on solids, with the exact creases and patches of what they make.

Vertices are moved onto their one, two or three faces by Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

import simplexmesh as sm
from tests.surface.features.remeshing import dots, face_normals, halves
from tests.surface.features.scoring import components, labels_between

SHARP, SMOOTH = 30.0, 5.0
"""Edges between faces at more than SHARP degrees are sharp creases, at more than SMOOTH soft ones, below that none."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A part as steps ("+", "-" or "&", solid), finely tessellated, with the exact creases."""

    name: str
    steps: list

    @cached_property
    def surfaces(self):
        return [(solid, k) for _, solid in self.steps for k in range(solid.n_faces)]

    @cached_property
    def fine(self):
        return self.built(192)

    def built(self, segments):
        """Vertices on the exact surfaces, triangles, and the surface of each triangle."""
        body, first = None, 0
        for sign, solid in self.steps:
            piece = solid.manifold(segments, first)
            body = piece if body is None else {"+": body.__add__, "-": body.__sub__, "&": body.__xor__}[sign](piece)
            first += solid.n_faces
        mesh = body.to_mesh64()
        vertices, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts).astype(np.int64)
        labels = self.same(vertices, faces, np.array(mesh.face_id).astype(np.int64))
        vertices = self.projected(vertices, faces, labels)
        if np.abs(self.signed(vertices)).max() < 1e-9:
            return vertices, faces, labels
        return self.built(segments + 1)  # a vertex was closer to a crease than chords are, and came to lie beyond it

    def signed(self, points):
        """As of one solid."""
        away = np.full(len(points), np.inf)
        for sign, solid in self.steps:
            of = solid.signed(points)
            away = np.minimum(away, of) if sign == "+" else np.maximum(away, -of if sign == "-" else of)
        return away

    def same(self, vertices, faces, labels):
        """Labels with one number for surfaces that continue one another, such as flush planes."""
        pairs = np.unique(np.sort(labels[halves(faces)[1] // 3], axis=1), axis=0)
        pairs = [(i, j) for i, j in pairs if self.coincide(i, j, vertices[faces[labels == j]].reshape(-1, 3))]
        groups = components(len(self.surfaces), pairs)
        return np.array([np.flatnonzero(groups == g)[0] for g in groups])[labels]

    def coincide(self, i, j, points):
        (away, normals), (_, others) = self.distance(i, points), self.distance(j, points)
        return np.abs(away).max() < 1e-9 and np.abs(dots(normals, others)).min() > 1 - 1e-9

    def distance(self, k, points):
        solid, face = self.surfaces[k]
        return solid.distance(face, points)

    def kind(self, k):
        solid, face = self.surfaces[k]
        return solid.kind(face)

    def projected(self, vertices, faces, labels):
        """Vertices moved onto all surfaces that their triangles belong to."""
        on = np.zeros((len(vertices), len(self.surfaces)), bool)
        on[faces, labels[:, None]] = True
        kinds, which = np.unique(np.packbits(on, axis=1), axis=0, return_inverse=True)
        out = vertices.copy()
        for k, bits in enumerate(np.unpackbits(kinds, axis=1)):
            rows = np.flatnonzero(which.ravel() == k)
            for _ in range(8):
                found = [self.distance(s, out[rows]) for s in np.flatnonzero(bits)]
                away, normals = (np.stack(each, axis=1) for each in zip(*found, strict=True))
                if np.abs(away).max() < 1e-13:
                    break
                inverse = normals.swapaxes(1, 2) if len(found) == 1 else np.linalg.pinv(normals, 0.02)
                out[rows] -= (inverse @ away[..., None])[..., 0]
        return out

    def angles(self, vertices, faces, labels):
        """The edges (e, 2), and the exact angle in degrees between the surfaces there."""
        ends, half = halves(faces)
        edges, two = ends[half[:, 0]], half // 3
        crossed = np.flatnonzero(labels[two[:, 0]] != labels[two[:, 1]])
        middle, normals = vertices[edges[crossed]].mean(axis=1), np.zeros((2, len(crossed), 3))
        for side in (0, 1):
            of = two[crossed, side]
            for s in np.unique(labels[of]):
                rows = labels[of] == s
                normals[side, rows] = self.distance(s, middle[rows])[1]
            normals[side] *= np.sign(dots(normals[side], face_normals(vertices, faces[of])))[:, None]
        angles = np.zeros(len(edges))
        angles[crossed] = np.degrees(np.arccos(np.clip(dots(*normals), -1, 1)))
        return edges, angles

    @cached_property
    def creases(self):
        """Sharp and soft creases as segments (k, 2, 3)."""
        edges, angles = self.angles(*self.fine)
        ends = self.fine[0][edges]
        return ends[angles > SHARP], ends[(angles > SMOOTH) & (angles <= SHARP)]

    @cached_property
    def fine_patches(self):
        return self.patches(*self.fine)

    def patches(self, vertices, faces, labels):
        """The smooth pieces between creases (t,)."""
        edges, angles = self.angles(vertices, faces, labels)
        return labels_between(sm.TriangleMesh(vertices, faces), edges[angles > SMOOTH])

    def edge(self, n_faces):
        """The edge length of so many equilateral triangles."""
        vertices, faces, _ = self.fine
        return float(np.sqrt(4 / np.sqrt(3) * sm.TriangleMesh(vertices, faces).area / n_faces))

    def nearest(self, points):
        """Triangles of the fine tessellation, and the points moved onto their exact surfaces."""
        vertices, faces, labels = self.fine
        _, row, near = igl.point_mesh_squared_distance(points, vertices, faces)
        for s in np.unique(labels[row]):
            of = labels[row] == s
            away, normals = self.distance(s, near[of])
            near[of] -= away[:, None] * normals
        return row, near
