"""The surfaces of parts in triangles of about one size, as programs make them, or as scanners do."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

from tests.surface.features.scoring import components, lengths


def halves(faces):
    """The ends (3 t, 2) of the half-edges, 3 t + j opposite corner j, and the two half-edges (e, 2) of each edge."""
    ends = faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    low, high = np.minimum(*ends.T), np.maximum(*ends.T)
    return ends, np.argsort(low * (faces.max() + 1) + high).reshape(-1, 2)


def face_normals(vertices, faces):
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return normals / np.sqrt(np.maximum(dots(normals, normals), 1e-300))[:, None]


def dots(a, b):
    return np.einsum("...i,...i", a, b)


class Remesher:
    """Triangles that are split, collapsed, flipped and relaxed, many at a time, until edges have the wanted size."""

    def __init__(self, vertices, faces, labels, size, project, rng):
        self.vertices, self.faces, self.labels = vertices, faces, labels
        self.size, self.project, self.rng = size, project, rng

    def measure(self):
        """Ends, half-edges, edges, lengths over wanted lengths, and whether labels differ at each edge."""
        ends, half = halves(self.faces)
        edges = ends[half[:, 0]]
        at = self.vertices[edges]
        ratio = lengths(at) / self.size(0.5 * (at[:, 0] + at[:, 1]))
        crease = self.labels[half[:, 0] // 3] != self.labels[half[:, 1] // 3]
        return ends, half, edges, ratio, crease

    def apart(self, half, rank):
        """Edges of finite rank that come first in both their triangles."""
        ranks = np.empty(3 * len(self.faces))
        ranks[half] = rank[:, None]
        least = ranks.reshape(-1, 3).min(axis=1)
        return np.isfinite(rank) & (least[half // 3] == rank[:, None]).all(axis=1)

    def split(self, longest=4 / 3):
        """Bisect edges that are too long; whether there were any."""
        _, half, edges, ratio, _ = self.measure()
        noise = 1 + 1e-3 * self.rng.random(len(ratio))
        chosen = self.apart(half, np.where(ratio > longest, -ratio * noise, np.inf))
        new = len(self.vertices) + np.arange(chosen.sum())
        self.vertices = np.concatenate([self.vertices, self.vertices[edges[chosen]].mean(axis=1)])
        for h in half[chosen].T:
            t, j = h // 3, h % 3
            c, a, b = (self.faces[t, (j + k) % 3] for k in range(3))
            self.faces[t] = np.stack([c, a, new], axis=1)
            self.faces = np.concatenate([self.faces, np.stack([c, new, b], axis=1)])
            self.labels = np.concatenate([self.labels, self.labels[t]])
        return chosen.any()

    def corners(self, edges, crease):
        """Vertices with a number of crease edges other than none and two, which stay."""
        count = np.bincount(edges[crease].ravel(), minlength=len(self.vertices))
        return count, (count != 0) & (count != 2)

    def collapse(self, shortest=0.8, longest=4 / 3):
        """Move ends of edges that are too short into the other ends."""
        _, _, edges, ratio, crease = self.measure()
        count, corner = self.corners(edges, crease)
        swap = self.rng.random(len(edges)) < 0.5
        free = (count[edges] == 0) | (~corner[edges] & crease[:, None])
        swap = np.where(free[:, 0] & free[:, 1], swap, free[:, 1])
        rank = np.where((ratio < shortest) & free.any(axis=1), ratio * (1 + 1e-3 * self.rng.random(len(edges))), np.inf)
        first = np.full(len(self.vertices), np.inf)
        np.minimum.at(first, edges, rank[:, None])
        around = first[self.faces].min(axis=1)
        np.minimum.at(first, self.faces, around[:, None])
        chosen = np.isfinite(rank) & (first[edges] == rank[:, None]).all(axis=1)
        gone, kept = np.where(swap[:, None], edges[:, ::-1], edges)[chosen].T
        common = self.neighbors(edges)
        gone, kept = (each[common[gone].multiply(common[kept]).sum(axis=1) == 2] for each in (gone, kept))
        target = np.arange(len(self.vertices))
        target[gone] = kept
        moved = target[self.faces]
        whose = np.where(moved != self.faces, self.faces, -1).max(axis=1)
        rows = np.flatnonzero((whose >= 0) & (moved != np.roll(moved, 1, axis=1)).all(axis=1))
        turned = dots(self.normals(moved[rows]), self.normals(self.faces[rows])) < 0.5
        target[whose[rows[turned]]] = whose[rows[turned]]
        around = np.stack([moved[rows], np.roll(moved[rows], 1, axis=1)], axis=-1).reshape(-1, 2)
        wide = lengths(self.vertices[around]) > longest * self.size(self.vertices[around].mean(axis=1))
        wide = whose[rows[wide.reshape(-1, 3).any(axis=1)]]
        target[wide] = wide
        faces = target[self.faces]
        keep = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        used, faces = np.unique(faces[keep], return_inverse=True)
        self.vertices, self.faces, self.labels = self.vertices[used], faces.reshape(-1, 3), self.labels[keep]

    def normals(self, faces):
        return face_normals(self.vertices, faces)

    def neighbors(self, edges):
        n = len(self.vertices)
        both = np.concatenate([edges, edges[:, ::-1]])
        return csr_array((np.ones(len(both)), tuple(both.T)), shape=(n, n))

    def flip(self):
        """Flip edges between whose triangles the angles opposite add up to more than 180 degrees."""
        _, half, edges, _, crease = self.measure()
        (a, b), corners = edges.T, self.faces.ravel()[half]
        to_a, to_b = (self.vertices[v][:, None] - self.vertices[corners] for v in (a, b))
        dot = dots(to_a, to_b)
        cross = np.sqrt(np.maximum(dots(to_a, to_a) * dots(to_b, to_b) - dot**2, 1e-300))
        cotangents = (dot / cross) @ [1, 1]
        c, d = corners.T
        one, two = np.stack([c, a, d], axis=1), np.stack([d, b, c], axis=1)
        rows = np.flatnonzero((cotangents < -1e-6) & ~crease & (c != d))
        normal = self.normals(self.faces[half[rows, 0] // 3]) + self.normals(self.faces[half[rows, 1] // 3])
        fine = (dots(self.normals(one[rows]), normal) > 0.5) & (dots(self.normals(two[rows]), normal) > 0.5)
        n = len(self.vertices)
        rows = rows[fine & ~np.isin(np.sort(corners[rows], axis=1) @ [n, 1], np.sort(edges, axis=1) @ [n, 1])]
        rank = np.full(len(edges), np.inf)
        rank[rows] = cotangents[rows] * (1 + 1e-6 * self.rng.random(len(rows)))
        rows = np.flatnonzero(self.apart(half, rank))
        rows = rows[np.unique(np.sort(corners[rows], axis=1) @ [n, 1], return_index=True)[1]]
        self.faces[half[rows, 0] // 3], self.faces[half[rows, 1] // 3] = one[rows], two[rows]
        return len(rows)

    def relax(self, step=1.0, jitter=0.0):
        """Move vertices to the mean of their neighbors, those on creases along these, and back onto the surfaces."""
        _, _, edges, _, crease = self.measure()
        count, corner = self.corners(edges, crease)
        both = np.concatenate([edges, edges[:, ::-1]])
        use = np.concatenate([crease, crease]) | (count[both[:, 0]] == 0)
        total = np.bincount(both[use, 0], minlength=len(self.vertices))
        mean = np.stack([np.bincount(both[use, 0], x[both[use, 1]], len(total)) for x in self.vertices.T], axis=1)
        mean = np.where(corner[:, None], self.vertices, mean / np.maximum(total, 1)[:, None])
        moved = self.vertices + step * (mean - self.vertices)
        if jitter:
            moves = jitter * self.size(moved)[:, None] * self.rng.normal(size=moved.shape)
            moved[count == 0] += moves[count == 0]
        moved = self.project(moved, self.faces, self.labels)
        before = self.normals(self.faces)
        for _ in range(5):
            bad = dots(face_normals(moved, self.faces), before) < 0.5
            if not bad.any():
                break
            moved[self.faces[bad]] = self.vertices[self.faces[bad]]
        self.vertices = moved


def remeshed(reference, edge, rng, *, even):
    """Vertices, triangles and their surfaces, with vertices on all creases; of random density unless `even`."""
    vertices, faces, _ = reference.fine
    waves, phases = rng.normal(size=(3, 4)) * 4 / np.ptp(vertices, axis=0).max(), rng.uniform(0, 7, 4)

    def size(points):
        return 1.1 * edge * (1 if even else np.exp(0.3 * np.sin(points @ waves + phases).sum(axis=1)))

    if not even:  # as many triangles as evenly
        corners = vertices[faces]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        edge *= np.sqrt(np.average((1.1 * edge / size(corners.mean(axis=1))) ** 2, weights=areas))
    mesh = Remesher(*reference.built(64), size, reference.projected, rng)
    for _ in range(5):
        for _ in range(4):
            mesh.collapse(0.2, np.inf)  # almost coinciding vertices, of needles that splits would not rid us of
        for _ in range(40):
            if not mesh.split():
                break
            mesh.flip()
        mesh.vertices = reference.projected(mesh.vertices, mesh.faces, mesh.labels)
        for _ in range(4):
            mesh.collapse()
        for _ in range(2):
            mesh.flip()
            mesh.relax()
    if not even:
        mesh.relax(jitter=0.15)
        mesh.flip()
    return mesh.vertices, mesh.faces, mesh.labels


def scanned(reference, edge, rng):
    """Vertices and triangles of level zero of the distance on a turned grid, moved to the surface, not to creases."""
    turn, step = Rotation.random(random_state=rng).as_matrix(), 1.06 * edge
    local = reference.fine[0] @ turn
    low = local.min(axis=0) - step * (4 + rng.random(3))
    blocks = np.ceil((np.ptp(local, axis=0) / step + 9) / 4).astype(int)

    def signed(nodes):
        return reference.signed((low + step * (nodes + 0.5)) @ turn.T)

    away = signed(4 * np.indices(blocks).reshape(3, -1).T + 1.5).reshape(blocks)
    for axis in range(3):
        away = np.repeat(away, 4, axis=axis)
    near = np.stack(np.nonzero(np.abs(away) < 5.5 * step), axis=1)
    away[tuple(near.T)] = signed(near)
    points, faces, _, _ = marching_cubes(away, 0.0)
    points, faces = reference.nearest((low + step * (points + 0.5)) @ turn.T)[1], faces.astype(np.int64)
    body = components(len(points), np.concatenate([faces[:, :2], faces[:, 1:]]))[faces[:, 0]]
    faces = faces[body == np.bincount(body).argmax()]  # without single nodes across an acute crease
    mesh = Remesher(
        points,
        faces,
        np.zeros(len(faces), np.int64),
        size=lambda points: np.full(len(points), edge),
        project=lambda points, *_: reference.nearest(points)[1],
        rng=rng,
    )
    for _ in range(4):
        mesh.collapse(0.5, 2)
        mesh.flip()
        mesh.relax(step=0.5)
    return mesh.vertices, mesh.faces
