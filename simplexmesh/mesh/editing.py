"""The editable mesh: a private copy on which many operators are done, each at its own cost, and undone again."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.errors import TopologyError
from simplexmesh.mesh import _kernels_batch, _kernels_faces, seams
from simplexmesh.mesh import _kernels_edit as kernels
from simplexmesh.mesh.editable import EditableDarts
from simplexmesh.mesh.edited import REASONS, Batch
from simplexmesh.mesh.seams import Seam
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def _told(status: NDArray[np.int32], witness: NDArray[np.int32]) -> Batch:
    """Return what became of a batch, with the reasons counted."""
    counts = np.bincount(status, minlength=max(REASONS) + 1)
    reasons = {text: int(counts[code]) for code, text in REASONS.items() if counts[code]}
    return Batch(status == kernels.DONE, MappingProxyType(reasons), status, witness)


class EditableMesh(EditableDarts):
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
        super().__init__(mesh)
        self._seams: list[Seam] = []

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
        return _told(status, witness)

    # ---- T5, T6

    def remove_faces(self, faces: ArrayLike) -> Batch:
        """T5 on many faces, each by T1 on its edges, all of them or none; see `remove_face`."""
        return self._apply_to_faces(kernels.REMOVE_FACE, faces)

    def refine_faces(self, faces: ArrayLike) -> Batch:
        """T6 on many faces, each by T2; the face in the middle keeps the number. See `refine_face`.

        Neighbors may be refined together: a face has the corners then that it has gained from its neighbors.
        """
        return self._apply_to_faces(kernels.REFINE_FACE, faces)

    def _apply_to_faces(self, kind: int, faces: ArrayLike) -> Batch:
        """Do T6 or T5 on faces in order, leaving out what is illegal, gone, refined or merged by this batch."""
        given = np.asarray(faces)
        chosen = _check.indices("faces", given if given.size else np.zeros(0, np.int64), (None,), self._used[1])
        # each is done once at most; refined, it may have gained a vertex at each edge before
        refining = kind == kernels.REFINE_FACE
        edits = int(self._darts.face_size[np.unique(chosen)].sum()) * (2 if refining else 1)
        self._reserve(edits, *((2 * edits, edits) if refining else ()))
        status, witness = np.empty(len(chosen), np.int32), np.empty(len(chosen), np.int32)
        touched = np.zeros(self._used[1], bool)
        _kernels_faces.apply(self._darts, kind, chosen.astype(np.int32), touched, status, witness)
        return _told(status, witness)

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
        a, b = self.face(face_a, "face_a"), self.face(face_b, "face_b")
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
