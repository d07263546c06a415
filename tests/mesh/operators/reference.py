"""Naive reference of the operators: a mesh as face loops of vertices, every query by exhaustive search."""

from __future__ import annotations

import numpy as np


class Loops:
    """Faces as lists of vertices, counter-clockwise; `holes` are the keys of those that are holes."""

    def __init__(self, connectivity):
        c = connectivity
        loops = np.split(c.face_vertices, c.face_offsets[1:-1])
        self.faces = {f: loop.tolist() for f, loop in enumerate(loops)}
        self.holes = set(np.flatnonzero(c.face_is_hole).tolist())
        self.n = c.n_vertices
        self.next_face = len(loops)

    def canonical(self, number=None):
        """The loops as a set, each from its smallest vertex on, with its label; vertices renumbered."""
        out = set()
        for f, loop in self.faces.items():
            named = loop if number is None else [int(number[v]) for v in loop]
            at = named.index(min(named))
            out.add((f in self.holes, *named[at:], *named[:at]))
        return out

    def vertices(self):
        return sorted({v for loop in self.faces.values() for v in loop})

    def left_of(self, a, b):
        return next(
            (f for f, loop in self.faces.items() if a in loop and loop[(loop.index(a) + 1) % len(loop)] == b), None
        )

    def edges(self, f):
        loop = self.faces[f]
        return set(zip(loop, loop[1:] + loop[:1], strict=True))

    def adjacent(self, f, g):
        return any((b, a) in self.edges(g) for a, b in self.edges(f))

    def around(self, a, b):
        """The faces on the left and the right of an edge, and those at its two ends."""
        left, right = self.left_of(a, b), self.left_of(b, a)
        near, far = (next(f for f in self.faces if f not in (left, right) and v in self.faces[f]) for v in (a, b))
        return left, right, near, far

    def refuse_remove(self, a, b):
        left, right, near, far = self.around(a, b)
        if 3 in (len(self.faces[near]), len(self.faces[far])):
            return 2
        others = set(self.faces) - {left, right, near, far}
        return 3 if any(self.adjacent(f, left) and self.adjacent(f, right) for f in others) else 0

    def refuse_swap(self, a, b):
        left, right, near, far = self.around(a, b)
        if 3 in (len(self.faces[left]), len(self.faces[right])):
            return 6
        return 8 if self.adjacent(near, far) else 0

    def remove(self, a, b):
        left, right, near, far = self.around(a, b)
        one, other = self.faces[left], self.faces.pop(right)
        i, j = one.index(b), other.index(a)
        one = one[i:] + one[:i]  # b ... a
        other = other[j:] + other[:j]  # a ... b
        self.faces[left] = one[1:-1] + other[1:-1]
        self.faces[near].remove(a)
        self.faces[far].remove(b)
        if right in self.holes:
            self.holes = self.holes - {right} | {left}

    def insert(self, u, v, w, x):
        """Insert a vertex on u-v and one on w-x, edges of the face on their left."""
        f, beside, opposite = self.left_of(u, v), self.left_of(v, u), self.left_of(x, w)
        p, q = self.n, self.n + 1
        self.n += 2
        for g, start, new in ((beside, v, p), (opposite, x, q)):
            self.faces[g].insert(self.faces[g].index(start) + 1, new)
        loop = self.faces[f]
        i = loop.index(v)
        loop = loop[i:] + loop[:i]  # v ... u
        j = loop.index(w)
        self.faces[f] = [p, *loop[: j + 1], q]
        self.faces[self.next_face] = [q, *loop[j + 1 :], p]
        if f in self.holes:
            self.holes.add(self.next_face)
        self.next_face += 1

    def swap(self, a, b):
        left, right, near, far = self.around(a, b)
        self.faces[left].remove(b)
        self.faces[right].remove(a)
        self.faces[near].insert(self.faces[near].index(a), b)
        self.faces[far].insert(self.faces[far].index(b), a)


def refine_face(edit, face):
    """T6 on an editable mesh, a T2 at a time."""
    around = edit.around(face)
    m, first = len(around), edit.n_slots
    centroid = edit.values(around // 3).mean(axis=0)
    edit.insert_edges(around[-1:], around[:1])
    inner = 3 * first + 1  # from the middle of the edge before to that of the edge after the corner just cut
    for k in range(1, m):
        vertex = edit.n_slots
        edit.insert_edges([inner], [around[k] if k < m - 1 else 3 * first + 1])
        inner = 3 * vertex + 1
    middles = np.array([first + 1, *range(first + 3, first + 2 * m - 2, 2), first])
    inside = np.array([*range(first + 2, first + 2 * m - 1, 2), first + 2 * m - 1])
    edit.set_values(inside, (edit.values(middles) + centroid) / 2)


def remove_face(edit, face):
    """T5 on an editable mesh, a T1 at a time; return the status of the one refused, 0 for none."""
    beside = [edit.faces_beside(int(dart))[1] for dart in edit.around(face)]
    for done, other in enumerate(beside):
        (shared,) = [dart for dart in edit.around(other).tolist() if edit.faces_beside(dart)[1] == face]
        batch = edit.remove_edges([shared])
        if not batch.done.all():
            edit.undo(done)
            return int(batch.status[0])
        if edit._darts.face_dart[face] < 0:  # it merged into the other, the larger one
            face = other
    return 0
