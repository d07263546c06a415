"""Naive reference of decimation: faces as lists of their triangles, all edges searched for the cheapest each time."""

from __future__ import annotations

import igl
import numpy as np

from tests.mesh.operators.reference import Loops


def shaken(mesh, seed, size=0.15):
    """The mesh with random displacements of a fraction of the mean edge, so that no two costs are equal."""
    rng = np.random.default_rng(seed)
    a, b = mesh.vertices[mesh.connectivity.edge_vertices.T]
    length = np.linalg.norm(a - b, axis=1).mean()
    return mesh.moved(mesh.vertices + size * length * rng.uniform(-1, 1, mesh.vertices.shape))


class Region:
    """Triangles (t, 3, 3) and segments (s, 2, 3) of a rim."""

    def __init__(self, triangles, segments=()):
        self.triangles, self.segments = np.reshape(triangles, (-1, 3, 3)), np.reshape(segments, (-1, 2, 3))

    def __add__(self, other):
        return Region(
            np.concatenate([self.triangles, other.triangles]), np.concatenate([self.segments, other.segments])
        )

    def surface(self):
        """Area, centroid, central second moments, and vector area."""
        a, b, c = self.triangles.transpose(1, 0, 2)
        vectors = np.cross(b - a, c - a) / 2
        areas = np.linalg.norm(vectors, axis=1)
        centroid = areas @ self.triangles.mean(axis=1) / areas.sum()
        p = self.triangles - centroid
        total = p.sum(axis=1)
        squares = np.einsum("t,tki,tkj->ij", areas, p, p) + np.einsum("t,ti,tj->ij", areas, total, total)
        return areas.sum(), centroid, squares / 12, vectors.sum(axis=0)

    def rim(self):
        """Length, centroid, and central second moments."""
        lengths = np.linalg.norm(self.segments[:, 1] - self.segments[:, 0], axis=1)
        centroid = lengths @ self.segments.mean(axis=1) / max(lengths.sum(), 1e-300)
        p = self.segments - centroid
        total = p.sum(axis=1)
        squares = np.einsum("s,ski,skj->ij", lengths, p, p) + np.einsum("s,si,sj->ij", lengths, total, total)
        return lengths.sum(), centroid, squares / 6

    def plane_residual(self):
        return np.linalg.eigvalsh(self.surface()[2])[0]

    def line_residual(self):
        return np.linalg.eigvalsh(self.rim()[2])[:2].sum()

    def energy(self, w):
        area, _, squares, vector = self.surface()
        total = (
            self.plane_residual() + w.normals * area * (area - np.linalg.norm(vector)) + w.extent * np.trace(squares)
        )
        return total + w.rim * np.sqrt(area) * self.line_residual()

    def exceeds_limits(self, max_deviation, max_extent):
        area, _, squares, _ = self.surface()
        if np.trace(squares) > max_extent**2 * area or self.plane_residual() > max_deviation**2 * area:
            return True
        return len(self.segments) > 0 and self.line_residual() > max_deviation**2 * self.rim()[0]


def regions_of(mesh):
    """The region of each face, holes excluded."""
    c, v = mesh.connectivity, mesh.vertices
    out = {}
    for f, loop in enumerate(np.split(c.face_vertices, c.face_offsets[1:-1])):
        if c.face_is_hole[f]:
            continue
        corners = v[loop]
        ahead = np.roll(corners, -1, axis=0)
        centroid = np.broadcast_to(corners.mean(axis=0), corners.shape)
        darts = c.face_darts[c.face_offsets[f] : c.face_offsets[f + 1]]
        open_ = np.flatnonzero(c.face_is_hole[c.face.reshape(-1)[c.twin.reshape(-1)[darts]]])[:1]
        segments = np.stack([corners, ahead], axis=1)[open_]
        out[f] = Region(np.stack([corners, ahead, centroid], axis=1), segments)
    return out


class Decimation:
    """A mesh whose edges are removed one by one, as `collapse_cheapest` does."""

    def __init__(self, mesh, weights, max_extent):
        c = mesh.connectivity
        self.loops, self.w = Loops(c), weights
        self.regions, self.max_extent = regions_of(mesh), dict(enumerate(max_extent.tolist()))
        self.points = {f: region.surface()[1] for f, region in self.regions.items()}
        self.component, self.n_left = c.components, np.bincount(c.components)
        self.costs = {}

    def solid(self, *faces):
        return not self.loops.holes & set(faces)

    def merged(self, a, b):
        """The cost of an edge, and the new region."""
        left, right, near, far = self.loops.around(a, b)
        if not self.solid(left, right):
            return np.inf, None
        one, other = self.regions[left], self.regions[right]
        cost = max((one + other).energy(self.w) - one.energy(self.w) - other.energy(self.w), 0)
        size = {f: len(loop) for f, loop in self.loops.faces.items()}
        before = [size[left] - 6, size[right] - 6] + [size[f] - 6 for f in (near, far) if self.solid(f)]
        after = [size[left] + size[right] - 10] + [size[f] - 7 for f in (near, far) if self.solid(f)]
        increase = sum(x * x for x in after) - sum(x * x for x in before)
        return cost * (1 + self.w.imbalance * max(increase, 0)), one + other

    def is_excluded(self, a, b):
        left, right, near, far = self.loops.around(a, b)
        size = {f: len(loop) for f, loop in self.loops.faces.items()}
        if any(size[f] <= self.w.min_size for f in (near, far) if self.solid(f)):
            return True
        if any(self.max_extent[f] == 0 for f in (left, right, near, far) if self.solid(f)):
            return True
        if not self.w.min_size <= size[left] + size[right] - 4 <= self.w.max_size:
            return True
        if self.n_left[self.component[a]] - 2 < self.w.min_component or self.loops.refuse_remove(a, b):
            return True
        beside = [
            [f for f in size if f not in (left, right, near, far) and self.solid(f) and self.loops.adjacent(f, g)]
            for g in (left, right)
        ]
        return any(self.loops.adjacent(f, g) for f in beside[0] for g in beside[1])

    def triangle(self, v):
        """The corners of the dual triangle of a vertex, counter-clockwise, as faces."""
        here = [f for f, loop in self.loops.faces.items() if v in loop]
        f = here[0]
        loop = self.loops.faces[f]
        before = loop[loop.index(v) - 1]
        right = self.loops.left_of(v, before)
        return [f, *(g for g in here[1:] if g != right), right]

    def normal(self, triangle, moved, corner):
        a, b, c = (corner if f in moved else self.points[f] for f in triangle)
        n = np.cross(b - a, c - a)
        sides = sum(((x - y) ** 2).sum() for x, y in ((a, b), (b, c), (c, a)))
        return n, 2 * np.sqrt(3) * np.linalg.norm(n) / sides

    def degrades(self, a, b, corner):
        left, right, _, _ = self.loops.around(a, b)
        for v in {*self.loops.faces[left], *self.loops.faces[right]} - {a, b}:
            here = self.triangle(v)
            here = here[next(i for i, f in enumerate(here) if f in (left, right)) :] + here
            face, one, other = here[:3]
            solid = [f for f in (one, other) if self.solid(f)]
            if len(solid) == 1:
                there = self.points[solid[0]]
                if (there - self.points[face]) @ (there - corner) <= 0:
                    return True
            if len(solid) < 2:
                continue
            old, was = self.normal((face, one, other), (), None)
            new, quality = self.normal((face, one, other), (left, right), corner)
            if old @ new <= self.w.turn * np.linalg.norm(old) * np.linalg.norm(new):
                return True
            if quality < self.w.quality and quality < was:
                return True
            if self.folds_back(v, one, other, new):
                return True
        return False

    def folds_back(self, v, one, other, new):
        """Whether the triangle across the edge between two faces folds back."""
        shared = set(self.loops.faces[one]) & set(self.loops.faces[other])
        u = next(x for x in shared if x != v and {(x, v), (v, x)} & self.loops.edges(one))
        third = next(f for f in self.triangle(u) if f not in (one, other))
        if not self.solid(third):
            return False
        n, _ = self.normal((third, other, one), (), None)
        return n @ new < self.w.bend * np.linalg.norm(n) * np.linalg.norm(new)

    def update_costs(self, edges):
        for a, b in edges:
            self.costs[frozenset((a, b))] = self.merged(min(a, b), max(a, b))[0]

    def run(self, count):
        """Remove up to `count` edges; return the number removed."""
        done, last = 0, -1
        while done < count:
            self.costs = {edge: cost for edge, cost in self.costs.items() if cost < np.inf}
            if not self.costs:
                if done == last:
                    break
                last = done
                self.update_costs({tuple(sorted(e)) for f in self.loops.faces for e in self.loops.edges(f)})
                continue
            edge = min(self.costs, key=self.costs.get)
            del self.costs[edge]
            a, b = sorted(edge)
            if self.is_excluded(a, b):
                continue
            left, right, _, _ = self.loops.around(a, b)
            region = self.merged(a, b)[1]
            if region.exceeds_limits(self.w.max_deviation, min(self.max_extent[left], self.max_extent[right])):
                continue
            if not self.degrades(a, b, region.surface()[1]):
                self.collapse(a, b, region)
                done += 1
        return done

    def collapse(self, a, b, region):
        left, right, _, _ = self.loops.around(a, b)
        self.n_left[self.component[a]] -= 2
        self.costs = {edge: cost for edge, cost in self.costs.items() if not edge & {a, b}}
        self.loops.remove(a, b)
        kept = left if left in self.loops.faces else right
        self.regions[kept], self.points[kept] = region, region.surface()[1]
        self.max_extent[kept] = min(self.max_extent[left], self.max_extent[right])
        self.update_costs(self.loops.edges(kept))

    def may_swap(self, a, b):
        """Whether T7 on an edge is legal, reduces the imbalance, and keeps the shape of the dual."""
        faces = left, right, near, far = self.loops.around(a, b)
        if not self.solid(*faces) or any(self.max_extent[f] == 0 for f in faces) or self.loops.refuse_swap(a, b):
            return False
        size = [len(self.loops.faces[f]) for f in faces]
        change = size[0] + size[1] - size[2] - size[3]
        fourth = [sum((x + step - 6) ** 4 for x, step in zip(size, steps, strict=True)) for steps in (SAME, SWAPPED)]
        if change < 2 or (change == 2 and fourth[1] >= fourth[0]):
            return False
        new, old = [(left, far, near), (right, near, far)], [(near, left, right), (far, right, left)]
        normals = [[self.normal(t, (), None) for t in triangles] for triangles in (new, old)]
        worst = [min(quality for _, quality in part) for part in normals]
        if worst[0] < self.w.quality and worst[0] < worst[1]:
            return False
        return all(
            n @ m > self.w.turn * np.linalg.norm(n) * np.linalg.norm(m) for n, _ in normals[0] for m, _ in normals[1]
        )


SAME, SWAPPED = (0, 0, 0, 0), (-1, -1, 1, 1)


def densely(points, triangles, pieces=13):
    """Regular samples (b, t, 3) of triangles, b = (pieces + 1) (pieces + 2) / 2 each, corners and edges included."""
    parts = [(i, j, pieces - i - j) for i in range(pieces + 1) for j in range(pieces + 1 - i)]
    return np.einsum("bi,tik->btk", np.array(parts) / pieces, points[triangles])


def apart(points, triangles, other_points, other_triangles):
    """Largest distance of 105 points of each triangle (t,) from other triangles, by libigl."""
    samples = densely(points, triangles)
    flat = np.ascontiguousarray(samples.reshape(-1, 3))
    there = np.array(other_points, float), np.array(other_triangles, np.int64)
    squared = igl.point_mesh_squared_distance(flat, *there)[0]
    return np.sqrt(squared.reshape(samples.shape[:2]).max(axis=0))
