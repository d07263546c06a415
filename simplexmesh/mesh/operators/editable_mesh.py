"""The editable mesh: batches of operators applied in place, each at local cost, with undo."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.operators import _kernels_batch, _kernels_faces, seams
from simplexmesh.mesh.operators import _kernels_edit as kernels
from simplexmesh.mesh.operators.dart_storage import EditableDarts
from simplexmesh.mesh.operators.results import REASONS, Batch
from simplexmesh.mesh.operators.seams import Seam
from simplexmesh.mesh.paths import refusal_of_path
from simplexmesh.mesh.simplex_mesh import SimplexMesh

TOO_LARGE = 1 << 20
"""Added to the sizes of holes that T7 must not enlarge, while it evens others: the larger of two gains no vertex."""


def edge_fractions(at: ArrayLike, count: int) -> Array:
    """Return the checked fractions (count, 2) at which new vertices divide pairs of darts, broadcast if need be."""
    given = checks.any_array("at", at)
    if given.ndim < 2:
        both = checks.number("at", at) if given.ndim == 0 else checks.array("at", at, (2,))
        given = np.broadcast_to(both, (count, 2))
    fractions: Array = checks.array("at", given, (count, 2))
    if (wrong := (fractions <= 0) | (fractions >= 1)).any():
        raise ValueError(f"at must be strictly between 0 and 1, not {fractions[wrong][0]:g}")
    return fractions


def _order(numbers: Indices32, in_order: bool) -> slice | NDArray[np.intp]:  # noqa: FBT001
    """Return the order in which a batch is applied: as given, or sorted (stable radix sort by 16 bits, the fastest)."""
    if in_order or len(numbers) < 2:
        return slice(None)
    low = np.argsort((numbers & 0xFFFF).astype(np.uint16), kind="stable")
    return low[np.argsort((numbers[low] >> 16).astype(np.uint16), kind="stable")]


def _batch(status: Indices32, witness: Indices32, order: slice | NDArray[np.intp]) -> Batch:
    """Return the outcome of a batch that was applied in some order, in the order given."""
    counts = np.bincount(status, minlength=max(REASONS) + 1)
    reasons = {text: int(counts[code]) for code, text in REASONS.items() if counts[code]}
    given = np.empty((2, len(status)), np.int32)
    given[:, order] = status, witness
    return Batch(given[0] == kernels.DONE, MappingProxyType(reasons), given[0], given[1])


class EditableMesh(EditableDarts):
    """A copy of a mesh that is edited in place, with a log of the edits for undo.

    The cost of an edit is proportional to the sizes of the faces around it, whatever the size of the mesh; only the
    copy and `result` cost as much as the mesh. Darts and faces are numbered as in the mesh given; new vertices and
    faces are numbered after them, and the numbers of removed ones stay unused until `result`.

    Parameters
    ----------
    mesh : SimplexMesh
        Complete: two faces share at most one edge, and no face is on both sides of one.

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
    (2, {'touched by an earlier edit': 1})
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

    # ---- T1, T2, T7: of two conflicting edits in a batch, the first one is applied

    def remove_edges(self, darts: ArrayLike, *, in_order: bool = False) -> Batch:
        """T1 on many edges, each given by one of its darts; see `remove_edge`.

        This and all batches are applied from the smallest dart to the largest one, for memory locality. With
        `in_order=True` they are applied as given, so that earlier ones have precedence; in random order that takes two
        to four times as long on a million vertices.
        """
        return self._apply(kernels.REMOVE, darts, darts, 0.5, in_order)

    def insert_edges(
        self, darts: ArrayLike, others: ArrayLike, at: ArrayLike = 0.5, *, in_order: bool = False
    ) -> Batch:
        """T2 on many pairs of darts with the same left face; `at` (m, 2) are the fractions along each dart."""
        return self._apply(kernels.INSERT, darts, others, at, in_order)

    def swap_edges(self, darts: ArrayLike, *, in_order: bool = False) -> Batch:
        """T7 on many edges, each given by one of its darts; see `swap_edge`."""
        return self._apply(kernels.SWAP, darts, darts, 0.5, in_order)

    def _apply(self, kind: int, darts: ArrayLike, others: ArrayLike, at: ArrayLike, in_order: bool) -> Batch:  # noqa: FBT001
        """Apply edits of one kind, skipping those that are illegal or touch an edge already changed."""
        both = (("darts", darts), ("others", others))
        first, second = (checks.selection(*each, 3 * self._used[0]).astype(np.int32) for each in both)
        if len(first) != (m := len(second)):
            raise ValueError(f"others must have {len(first)} darts, as many as darts, not {m}")
        order = _order(first, in_order)
        fractions = edge_fractions(at, m)[order]
        self._reserve(m, *((2 * m, m) if kind == kernels.INSERT else ()))
        status, witness = np.empty((2, m), np.int32)
        _kernels_batch.apply(
            self._darts, kind, first[order], second[order], np.ascontiguousarray(fractions), status, witness
        )
        return _batch(status, witness, order)

    # ---- T5, T6

    def remove_faces(self, faces: ArrayLike, *, in_order: bool = False) -> Batch:
        """T5 on many faces, each by T1 on all of its edges or on none; see `remove_face`."""
        return self._apply_to_faces(kernels.REMOVE_FACE, faces, in_order)

    def refine_faces(self, faces: ArrayLike, *, in_order: bool = False) -> Batch:
        """T6 on many faces, each by T2; the face in the middle keeps the number. See `refine_face`.

        Neighbors may be refined in one batch: the later one then includes the vertices gained from the earlier one.
        """
        return self._apply_to_faces(kernels.REFINE_FACE, faces, in_order)

    def _apply_to_faces(self, kind: int, faces: ArrayLike, in_order: bool) -> Batch:  # noqa: FBT001
        """Apply T6 or T5 to faces, skipping those that are illegal or already refined or merged in this batch."""
        chosen = checks.selection("faces", faces, self._used[1]).astype(np.int32)
        # capacity: each face is edited at most once, and may have gained a vertex on each edge by then
        refining = kind == kernels.REFINE_FACE
        edits = int(self._darts.face_size[np.unique(chosen)].sum()) * (2 if refining else 1)
        self._reserve(edits, *((2 * edits, edits) if refining else ()))
        order = _order(chosen, in_order)
        status, witness = np.empty((2, len(chosen)), np.int32)
        touched = np.zeros(self._used[1], bool)
        _kernels_faces.apply(self._darts, kind, chosen[order], touched, status, witness)
        return _batch(status, witness, order)

    # ---- T3, T4

    def cut(self, darts: ArrayLike, *, holes: bool = False) -> tuple[int, int]:
        """T3: cut along a closed path of darts; return the new faces that close its left and its right side."""
        path = checks.indices("darts", darts, (None,), 3 * self._used[0])
        d, vertices = self._darts, path // 3
        if not d.alive[vertices].all():
            raise TopologyError("contour cannot be cut: one of its vertices was removed")
        if (apart := d.twin[path] // 3 != np.roll(vertices, -1)).any():
            i = int(apart.argmax())
            where = f"dart {path[i]} does not lead to the vertex of the next one, {path[(i + 1) % len(path)]}"
            raise TopologyError(f"contour cannot be cut: {where}")
        if reason := refusal_of_path(vertices, d.twin[3 * vertices[:, None] + np.arange(3)] // 3):
            raise TopologyError(f"contour {reason}")
        seam = seams.along(d.twin, path)
        if reason := seams.refusal_to_cut(seam, d.face):
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
        """T4: join two faces; return the seam between them."""
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
        self._darts.log[row] = (kernels.JOIN, len(self._seams), 0, b, a, 0)  # face_hole keeps the labels of both
        self._darts.used[2] += 1
        self._seams.append(seam)
        return seam

    def even_out(self, limit: int = 2**62, *, within: ArrayLike | None = None) -> int:
        """Apply T7 to the most unequal edge repeatedly; return how often. Clears the log. See `regularize`.

        Only the faces `within` change, if a mask (f,) of those of the mesh given is; new faces may.
        """
        limit = checks.integer("limit", limit, 0)
        outside = np.zeros(0, np.int64)
        if within is not None:
            outside = np.flatnonzero(~checks.array("within", within, (len(self._mesh.connectivity.face_sizes),), bool))
        self._darts.used[2] = 0
        self._seams.clear()
        sizes, holes = self._darts.face_size, self._darts.face_hole
        were_holes = holes[outside]
        holes[outside] = True  # which give no edges away,
        sizes[outside] += TOO_LARGE  # and take none
        swaps = int(_kernels_batch.even_out(self._darts, limit))
        sizes[outside] -= TOO_LARGE
        holes[outside] = were_holes
        return swaps

    # ---- the log and the result

    def undo(self, count: int | None = None) -> int:
        """Undo the last `count` edits, by default all; return their number. T5 and T6 count as several each."""
        left = self.n_edits if count is None else min(checks.integer("count", count, 0), self.n_edits)
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
