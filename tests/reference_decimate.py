"""Decimation told plainly: corners of the dual as points with 4 x 4 quadrics, the cheapest edge of all each time."""

from __future__ import annotations

import numpy as np

from tests.reference_operators import Loops


def planes_around(mesh, points, on_rim):
    """The quadric of each face: the sum of w h h' over the planes h = (normal, -distance) of the triangles around."""
    c = mesh.connectivity
    out = {f: np.zeros((4, 4)) for f in range(len(c.face_sizes))}
    for v, faces in enumerate(c.face.tolist()):
        solid = [f for f in faces if not c.face_is_hole[f]]
        if len(solid) == 3:
            n = np.cross(points[solid[1]] - points[solid[0]], points[solid[2]] - points[solid[0]])
            weight = np.linalg.norm(n) / 2
        elif len(solid) == 2:
            a, b, d = mesh.vertices[c.neighbors[v]]
            along = points[solid[1]] - points[solid[0]]
            n, weight = np.cross(along, np.cross(b - a, d - a)), on_rim * along @ along
        else:
            continue
        n = n / np.linalg.norm(n)
        plane = np.append(n, -n @ mesh.vertices[v])
        for f in solid:
            out[f] += weight * np.outer(plane, plane)
    return out


class Decimation:
    """A mesh whose edges are removed one by one, as `collapse_cheapest` does."""

    def __init__(self, mesh, points, rim, weights, on_rim):
        c = mesh.connectivity
        self.loops, self.w = Loops(c), weights
        self.points, self.rim = dict(enumerate(points)), dict(enumerate(rim))
        self.quadrics = planes_around(mesh, points, on_rim)
        self.component, self.left = c.components, np.bincount(c.components)
        self.costs = {}

    def solid(self, *faces):
        return not self.loops.holes & set(faces)

    def merged(self, a, b):
        """The cost of an edge, and the new corner."""
        left, right, near, far = self.loops.around(a, b)
        if not self.solid(left, right):
            return np.inf, None
        total = self.quadrics[left] + self.quadrics[right]
        p, q = self.points[left], self.points[right]
        middle = (p + q) / 2
        if self.rim[left] != self.rim[right]:
            middle = p if self.rim[left] else q
        matrix, length = total[:3, :3], np.linalg.norm(q - p)
        trace = np.trace(matrix)
        move = np.linalg.solve(matrix + self.w.stay * trace * np.eye(3), -matrix @ middle - total[:3, 3])
        corner = middle + move * min(1, length / max(np.linalg.norm(move), 1e-300))
        cost = max(np.append(corner, 1) @ total @ np.append(corner, 1), 0) + self.w.spread * trace * length**2
        size = {f: len(loop) for f, loop in self.loops.faces.items()}
        before = [size[left] - 6, size[right] - 6] + [size[f] - 6 for f in (near, far) if self.solid(f)]
        after = [size[left] + size[right] - 10] + [size[f] - 7 for f in (near, far) if self.solid(f)]
        uneven = sum(x * x for x in after) - sum(x * x for x in before)
        return cost * (1 + self.w.sizes * max(uneven, 0)), corner

    def refused(self, a, b):
        left, right, near, far = self.loops.around(a, b)
        size = {f: len(loop) for f, loop in self.loops.faces.items()}
        if any(size[f] <= self.w.least for f in (near, far) if self.solid(f)):
            return True
        if not self.w.least <= size[left] + size[right] - 4 <= self.w.most:
            return True
        if self.left[self.component[a]] - 2 < self.w.piece or self.loops.refuse_remove(a, b):
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

    def folds(self, a, b, corner):
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
            if quality < self.w.shape and quality < was:
                return True
            if self.creased(v, one, other, new):
                return True
        return False

    def creased(self, v, one, other, new):
        """Whether the triangle across the edge between two faces folds back."""
        shared = set(self.loops.faces[one]) & set(self.loops.faces[other])
        u = next(x for x in shared if x != v and {(x, v), (v, x)} & self.loops.edges(one))
        third = next(f for f in self.triangle(u) if f not in (one, other))
        if not self.solid(third):
            return False
        n, _ = self.normal((third, other, one), (), None)
        return n @ new < self.w.bend * np.linalg.norm(n) * np.linalg.norm(new)

    def look(self, edges):
        for a, b in edges:
            self.costs[frozenset((a, b))] = self.merged(min(a, b), max(a, b))[0]

    def run(self, count):
        """Remove up to `count` edges; return how many were."""
        done, last = 0, -1
        while done < count:
            self.costs = {edge: cost for edge, cost in self.costs.items() if cost < np.inf}
            if not self.costs:
                if done == last:
                    break
                last = done
                self.look({tuple(sorted(e)) for f in self.loops.faces for e in self.loops.edges(f)})
                continue
            edge = min(self.costs, key=self.costs.get)
            del self.costs[edge]
            a, b = sorted(edge)
            if self.refused(a, b):
                continue
            corner = self.merged(a, b)[1]
            if not self.folds(a, b, corner):
                self.collapse(a, b, corner)
                done += 1
        return done

    def collapse(self, a, b, corner):
        left, right, _, _ = self.loops.around(a, b)
        self.left[self.component[a]] -= 2
        self.costs = {edge: cost for edge, cost in self.costs.items() if not edge & {a, b}}
        self.loops.remove(a, b)
        kept = left if left in self.loops.faces else right
        self.points[kept] = corner
        self.quadrics[kept] = self.quadrics[left] + self.quadrics[right]
        self.rim[kept] = self.rim[left] or self.rim[right]
        self.look(self.loops.edges(kept))
