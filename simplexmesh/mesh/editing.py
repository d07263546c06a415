"""The editable mesh: a private copy on which many operators are done, each at its own cost, and undone again."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.errors import TopologyError
from simplexmesh.mesh import _kernels_batch, seams
from simplexmesh.mesh import _kernels_edit as kernels
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.edited import REASONS, Batch, Edited
from simplexmesh.mesh.seams import Seam
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Indices = NDArray[np.int64]


def _grown(values: NDArray, rows: int) -> NDArray:  # type: ignore[type-arg]
    """Return the array with room for at least so many rows, at least doubled when it had not."""
    if rows <= len(values):
        return values
    out = np.zeros((max(rows, 2 * len(values)), *values.shape[1:]), values.dtype)
    out[: len(values)] = values
    return out


class EditableMesh:
    """A copy of a mesh that can be edited in place, remembers every edit, and takes them back.

    An edit costs what the faces around it have vertices, whatever the size of the mesh; only making the copy and taking
    the result cost as much as the mesh. Darts and faces are named as in the mesh given, vertices and faces that are
    added get the numbers after them, and those that are gone leave theirs unused, until `result`.

    Parameters
    ----------
    mesh : SimplexMesh
        Complete: two faces share at most one edge, and no face has both sides of one.

    Raises
    ------
    TopologyError
        When the mesh is not complete.

    References
    ----------
    H. Delingette, thesis, 1994, section 2.6.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> edit = EditableMesh(sphere(4))
    >>> batch = edit.swap_edges([0, 2, 500])
    >>> int(batch.done.sum()), dict(batch.reasons)
    (2, {'touched by an edit before': 1})
    >>> edit.remove_edges([700]).done
    array([ True])
    >>> edit.result().mesh
    SimplexMesh(318 vertices, 161 faces, genus 0, 0 holes)
    >>> edit.undo()
    3
    >>> bool((edit.result().mesh.connectivity.twin == sphere(4).connectivity.twin).all())
    True
    """

    def __init__(self, mesh: SimplexMesh) -> None:
        if not isinstance(mesh, SimplexMesh):
            raise TypeError(f"mesh must be a SimplexMesh, not {type(mesh).__name__}")
        c = mesh.connectivity
        twin, face = c.twin.reshape(-1), c.face.reshape(-1)
        if (dart := _kernels_batch.incomplete_edge(twin, face, c.face_darts, c.face_offsets)) >= 0:
            raise TopologyError(
                f"mesh is not complete: faces {face[dart]} and {face[twin[dart]]}, on both sides of edge "
                f"{dart // 3}-{twin[dart] // 3}, are one or share another edge"
            )
        n, n_faces = c.n_vertices, len(c.face_sizes)
        self._mesh = mesh
        self._smooth = [name for name, values in mesh.data.items() if values.dtype.kind == "f"]
        columns = [mesh.vertices, *(mesh.data[name].reshape(n, -1) for name in self._smooth)]
        self._seams: list[Seam] = []
        self._darts = kernels.Darts(
            twin.copy(),
            face.copy(),
            np.ones(n, bool),
            np.concatenate(columns, axis=1, dtype=np.float64),
            np.arange(n, dtype=np.int32),
            c.face_darts[c.face_offsets[:-1]],
            c.face_sizes.copy(),
            c.face_is_hole.copy(),
            np.zeros((16, 6), np.int32),
            np.zeros((16, 2, sum(column.shape[1] for column in columns))),
            np.array([n, n_faces, 0]),
        )

    def __repr__(self) -> str:
        n, f = int(self._darts.alive[: self._used[0]].sum()), int((self._darts.face_dart[: self._used[1]] >= 0).sum())
        return f"EditableMesh({n} vertices, {f} faces with holes, {self.n_edits} edits)"

    @property
    def _used(self) -> list[int]:
        return self._darts.used.tolist()

    @property
    def n_edits(self) -> int:
        """How many edits can be undone."""
        return self._used[2]

    def _reserve(self, edits: int, vertices: int = 0, faces: int = 0) -> None:
        """Make room for so many more."""
        n, f, rows = self._used
        d = self._darts
        per_vertex, per_dart, per_face = n + vertices, 3 * (n + vertices), f + faces
        self._darts = kernels.Darts(
            _grown(d.twin, per_dart),
            _grown(d.face, per_dart),
            _grown(d.alive, per_vertex),
            _grown(d.values, per_vertex),
            _grown(d.origin, per_vertex),
            _grown(d.face_dart, per_face),
            _grown(d.face_size, per_face),
            _grown(d.face_hole, per_face),
            _grown(d.log, rows + edits),
            _grown(d.log_values, rows + edits),
            d.used,
        )

    # ---- what is there

    def around(self, face: int) -> Indices:
        """Return the darts around a face, counter-clockwise, from the one that it is remembered by."""
        start = int(self._darts.face_dart[self._face("face", face)])
        out, dart = [start], kernels.follow.py_func(self._darts.twin, start)
        while dart != start:
            out.append(int(dart))
            dart = kernels.follow.py_func(self._darts.twin, dart)
        return np.array(out)

    def faces_beside(self, dart: int) -> tuple[int, int]:
        """Return the faces on the left and on the right of a dart."""
        return int(self._darts.face[dart]), int(self._darts.face[self._darts.twin[dart]])

    def ends(self, dart: int) -> tuple[int, int]:
        """Return the two ends of the edge of a dart."""
        return dart // 3, int(self._darts.twin[dart]) // 3

    def is_hole(self, face: int) -> bool:
        """Return whether a face is a hole."""
        return bool(self._darts.face_hole[self._face("face", face)])

    @property
    def n_slots(self) -> int:
        """The number that the next new vertex gets."""
        return self._used[0]

    @property
    def last_kept(self) -> int:
        """The face that the last T1 merged into, or the last T2 divided."""
        return int(self._darts.log[self.n_edits - 1, 3])

    def values(self, vertices: Indices) -> NDArray[np.float64]:
        """Return the positions of vertices, and after them their other interpolated numbers."""
        return self._darts.values[vertices]

    def set_values(self, vertices: Indices, values: NDArray[np.float64]) -> None:
        """Change the positions of vertices and their other interpolated numbers; undoing does not know of it."""
        self._darts.values[vertices] = values

    def _face(self, name: str, face: int) -> int:
        f = _check.integer(name, face, 0, self._used[1] - 1)
        if self._darts.face_dart[f] < 0:
            raise TopologyError(f"{name} {f} is gone, by an edit before")
        return f

    def dart(self, name: str, edge: int | Sequence[int]) -> int:
        """Return the dart of an edge named by a dart or by its two ends, checked."""
        if isinstance(edge, int | np.integer):
            dart = _check.integer(name, edge, 0, 3 * self._used[0] - 1)
            ends = [dart // 3]
        else:
            ends = _check.indices(name, edge, (2,), self._used[0]).tolist()
            found = [d for d in range(3 * ends[0], 3 * ends[0] + 3) if self._darts.twin[d] // 3 == ends[1]]
            if not found:
                raise TopologyError(f"{name} must be two neighboring vertices; {ends[0]} and {ends[1]} are not")
            dart = found[0]
        for end in ends:
            if not self._darts.alive[end]:
                raise TopologyError(f"{name} ends at vertex {end}, which is gone by an edit before")
        return dart

    # ---- T1, T2, T7

    def remove_edges(self, darts: ArrayLike) -> Batch:
        """T1 on many edges, each named by one of its darts; see `remove_edge`."""
        return self._apply(kernels.REMOVE, darts, darts, 0.5)

    def insert_edges(self, darts: ArrayLike, others: ArrayLike, at: ArrayLike = 0.5) -> Batch:
        """T2 on many pairs of darts, which must have the same left face; `at` (m, 2) tells where on each dart."""
        return self._apply(kernels.INSERT, darts, others, at)

    def swap_edges(self, darts: ArrayLike) -> Batch:
        """T7 on many edges, each named by one of its darts; see `swap_edge`."""
        return self._apply(kernels.SWAP, darts, darts, 0.5)

    def _apply(self, kind: int, darts: ArrayLike, others: ArrayLike, at: ArrayLike) -> Batch:
        """Do many edits of a kind in order, leaving out what is illegal or touches an edge already changed."""
        count = 3 * self._used[0]
        given = [np.asarray(values) for values in (darts, others)]
        first, second = (
            _check.indices(name, values if values.size else np.zeros(0, np.int64), (None,), count)
            for name, values in zip(("darts", "others"), given, strict=True)
        )
        if len(first) != len(second):
            raise ValueError(f"others must have {len(first)} darts, as many as darts, not {len(second)}")
        m = len(first)
        parts = np.broadcast_to(np.asarray(at, np.float64), (m, 2))
        if not ((parts > 0) & (parts < 1)).all():
            raise ValueError("at must be between 0 and 1, both left out")
        self._reserve(m, *((2 * m, m) if kind == kernels.INSERT else ()))
        status, witness = np.empty(m, np.int32), np.empty(m, np.int32)
        kinds = np.full(m, kind, np.int32)
        darts32 = first.astype(np.int32), second.astype(np.int32)
        _kernels_batch.apply(self._darts, kinds, *darts32, np.ascontiguousarray(parts), status, witness)
        counts = np.bincount(status, minlength=len(REASONS) + 1)
        reasons = {text: int(counts[code]) for code, text in REASONS.items() if counts[code]}
        return Batch(status == kernels.DONE, MappingProxyType(reasons), status, witness)

    # ---- T3, T4

    def cut(self, darts: ArrayLike, *, holes: bool = False) -> tuple[int, int]:
        """T3 along a closed path of darts, and return the faces that close its left and its right side."""
        path = _check.indices("darts", darts, (None,), 3 * self._used[0])
        d = self._darts
        reason = "one of its vertices is gone" if not d.alive[path // 3].all() else seams.refusal_of_path(d.twin, path)
        seam = seams.along(d.twin, path)
        if reason := reason or seams.refusal_to_cut(seam, d.face):
            raise TopologyError(f"contour cannot be cut: {reason}")
        self._reserve(1, faces=2)
        left, right, row = self._used[1], self._used[1] + 1, self.n_edits
        seams.open_faces(self._darts, seam, left, right)
        d = self._darts
        d.face_hole[[left, right]] = holes
        d.used[:] += (0, 2, 1)
        d.log[row] = (kernels.CUT, len(self._seams), 0, left, right, 0)
        self._seams.append(seam)
        return left, right

    def join(self, face_a: int, face_b: int) -> Seam:
        """T4 on two faces, and return the seam between them."""
        d = self._darts
        a, b = self._face("face_a", face_a), self._face("face_b", face_b)
        around_a, around_b = self.around(a), self.around(b)
        where = f"faces {a} and {b} cannot be joined"
        if reason := seams.refusal_to_join(d, a, b, around_a):
            raise TopologyError(f"{where}: {reason}")
        ends = d.values[around_a // 3, :3], d.values[around_b // 3, :3]
        apart = ((ends[0][:, None] - ends[1][None]) ** 2).sum(axis=-1)
        start_a, start_b = np.unravel_index(int(apart.argmin()), apart.shape)
        seam = seams.between(around_a, around_b, int(start_a), int(start_b))
        if reason := seams.refusal_to_sew(d, seam):
            raise TopologyError(f"{where}: {reason}")
        self._reserve(1)
        row = self.n_edits
        seams.sew_faces(self._darts, seam, a, b)
        self._darts.log[row] = (kernels.JOIN, len(self._seams), 0, b, a, 0)  # their labels stay where they are
        self._darts.used[2] += 1
        self._seams.append(seam)
        return seam

    def even_out(self, limit: int = 2**62) -> int:
        """T7 on the most unequal edge, again and again; return how often. The log is lost. See `regularize`."""
        self._darts.used[2] = 0
        self._seams.clear()
        return int(_kernels_batch.even_out(self._darts, limit))

    # ---- the log and the result

    def undo(self, count: int | None = None) -> int:
        """Take back the last `count` edits, all by default, and return how many were; T5 and T6 are several each."""
        left = self.n_edits if count is None else min(_check.integer("count", count, 0), self.n_edits)
        total = left
        while left:
            left -= _kernels_batch.undo(self._darts, left)
            if not left:
                break
            row = self.n_edits - 1
            kind, _, _, one, other, _ = self._darts.log[row].tolist()
            seam = self._seams.pop()
            if kind == kernels.CUT:
                seams.sew_faces(self._darts, seam, one, other)
                self._darts.used[1] -= 2
            else:
                seams.open_faces(self._darts, seam, one, other)
            self._darts.used[2] = row
            left -= 1
        return total

    def result(self) -> Edited:
        """Return the mesh as it is now, vertices in their order with the gaps closed, and where everything went."""
        d, (n, n_faces, _) = self._darts, self._used
        alive = d.alive[:n]
        number = np.where(alive, np.cumsum(alive) - 1, -1).astype(np.int32)
        old = d.twin[: 3 * n].reshape(-1, 3)[alive]
        faces = d.face_dart[:n_faces]
        moved = np.where(faces >= 0, 3 * number[faces // 3] + faces % 3, -1)
        connectivity = Connectivity(3 * number[old // 3] + old % 3, moved[d.face_hole[:n_faces] & (faces >= 0)])
        face_map = np.where(moved >= 0, connectivity.face.reshape(-1)[moved], -1).astype(np.int32)
        n_before, f_before = self._mesh.n_vertices, len(self._mesh.connectivity.face_sizes)
        mesh = self._with_data(d.values[:n][alive], d.origin[:n][alive], connectivity)
        return Edited(mesh, _check.frozen(number[:n_before]), _check.frozen(face_map[:f_before]))

    def _with_data(
        self, values: NDArray[np.float64], origin: NDArray[np.int32], connectivity: Connectivity
    ) -> SimplexMesh:
        """Return the mesh with the data of its vertices: interpolated numbers, the rest from where they came."""
        at = 3
        data = {}
        for name, before in self._mesh.data.items():
            if name in self._smooth:
                width = before[0].size
                data[name] = values[:, at : at + width].reshape(-1, *before.shape[1:]).astype(before.dtype)
                at += width
            else:
                data[name] = before[origin]
        return SimplexMesh(values[:, :3], connectivity, data)
