"""Growable copy of a mesh's darts that edits work on: storage, queries, and conversion back to a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Indices32
from simplexmesh._base.errors import TopologyError, warn
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.operators import _kernels_batch
from simplexmesh.mesh.operators import _kernels_edit as kernels
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.paths import Named, followed, marked_darts, refusal_of_darts
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def _grown(values: NDArray, rows: int) -> NDArray:  # type: ignore[type-arg]
    """Return the array with capacity for `rows` rows, at least doubled when it grows."""
    if rows <= len(values):
        return values
    out = np.zeros((max(rows, 2 * len(values)), *values.shape[1:]), values.dtype)
    out[: len(values)] = values
    return out


class EditableDarts:
    """A growable copy of the darts, faces and vertex data of a complete mesh; see `EditableMesh`."""

    def __init__(self, mesh: SimplexMesh) -> None:
        c = checks.instance("mesh", mesh, SimplexMesh).connectivity
        twin, face = c.twin.reshape(-1), c.face.reshape(-1)
        if (dart := _kernels_batch.incomplete_edge(twin, face, c.face_darts, c.face_offsets)) >= 0:
            raise TopologyError(
                f"mesh is not complete: faces {face[dart]} and {face[twin[dart]]}, on both sides of edge "
                f"{dart // 3}-{twin[dart] // 3}, are the same or share another edge"
            )
        n, n_faces = c.n_vertices, len(c.face_sizes)
        self._mesh = mesh
        self._interpolated = [name for name, values in mesh.data.items() if values.dtype.kind == "f"]
        columns = [mesh.vertices, *(mesh.data[name].reshape(n, mesh.data[name][0].size) for name in self._interpolated)]
        self._darts = kernels.Darts(
            twin.copy(),
            face.copy(),
            np.ones(n, bool),
            np.concatenate(columns, axis=1, dtype=np.float64),
            np.arange(n, dtype=np.int32),
            c.face_darts[c.face_offsets[:-1]],
            c.face_sizes.copy(),
            c.face_is_hole.copy(),
            marked_darts(c.contour_darts, c.twin),
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
        """Number of edits that can be undone."""
        return self._used[2]

    def _reserve(self, edits: int, vertices: int = 0, faces: int = 0) -> None:
        """Ensure capacity for this many more edits, vertices and faces."""
        n, f, rows = self._used
        needed = dict.fromkeys(("alive", "values", "origin"), n + vertices)
        both = ("twin", "face", "contour") if len(self._darts.contour) else ("twin", "face")
        needed |= dict.fromkeys(both, 3 * (n + vertices))
        needed |= dict.fromkeys(("face_dart", "face_size", "face_hole"), f + faces)
        needed |= dict.fromkeys(("log", "log_values"), rows + edits)
        self._darts = self._darts._replace(**{k: _grown(getattr(self._darts, k), m) for k, m in needed.items()})

    # ---- queries

    def around(self, face: int) -> Indices:
        """Return the darts around a face, counter-clockwise, starting at its stored dart."""
        start = int(self._darts.face_dart[self.face(face)])
        out, dart = [start], kernels.next_dart.py_func(self._darts.twin, start)
        while dart != start:
            out.append(int(dart))
            dart = kernels.next_dart.py_func(self._darts.twin, dart)
        return np.array(out)

    def faces_beside(self, dart: int) -> tuple[int, int]:
        """Return the faces on the left and on the right of a dart."""
        d = self.dart("dart", dart)
        return int(self._darts.face[d]), int(self._darts.face[self._darts.twin[d]])

    def ends(self, dart: int) -> tuple[int, int]:
        """Return the two ends of the edge of a dart."""
        d = self.dart("dart", dart)
        return d // 3, int(self._darts.twin[d]) // 3

    @property
    def n_slots(self) -> int:
        """Number of vertices so far, removed ones included; the next new vertex gets this number."""
        return self._used[0]

    def values(self, at: ArrayLike) -> Array:
        """Return the values (m, k) of m vertices: their positions, then their floating-point data."""
        return self._darts.values[checks.selection("at", at, self._used[0])]

    def set_values(self, at: ArrayLike, values: ArrayLike) -> None:
        """Set the values (m, k) of m vertices, positions and floating-point data; this is not undone by `undo`."""
        rows = checks.selection("at", at, self._used[0])
        self._darts.values[rows] = checks.array("values", values, (len(rows), self._darts.values.shape[1]))

    def face(self, face: int, name: str = "face") -> int:
        """Return the number of a face, checked to exist; `name` is what the caller calls it."""
        f = checks.integer(name, face, 0, self._used[1] - 1)
        if self._darts.face_dart[f] < 0:
            raise TopologyError(f"{name} {f} was removed by an earlier edit")
        return f

    def dart(self, name: str, edge: int | Sequence[int]) -> int:
        """Return the dart of an edge given by a dart or its two ends, checked; `name` is the caller's name for it."""
        if checks.any_array(name, edge).ndim == 0:
            if isinstance(edge, bool) or not isinstance(edge, int | np.integer):
                raise TypeError(f"{name} must be a dart or the two ends of an edge, not {type(edge).__name__} {edge!r}")
            dart = checks.integer(name, edge, 0, 3 * self._used[0] - 1)
            ends = [dart // 3]
        else:
            ends = checks.indices(name, edge, (2,), self._used[0]).tolist()
            found = [d for d in range(3 * ends[0], 3 * ends[0] + 3) if self._darts.twin[d] // 3 == ends[1]]
            if not found:
                raise TopologyError(f"{name} must be two neighboring vertices; {ends[0]} and {ends[1]} are not")
            dart = found[0]
        for end in ends:
            if not self._darts.alive[end]:
                raise TopologyError(f"{name} ends at vertex {end}, which was removed by an earlier edit")
        return dart

    # ---- the resulting mesh

    def result(self) -> Edited:
        """Return the edited mesh, its vertices renumbered in order, with the vertex and face maps."""
        d, (n, n_faces, _) = self._darts, self._used
        alive = d.alive[:n]
        number = np.where(alive, np.cumsum(alive) - 1, -1).astype(np.int32)
        old = d.twin[: 3 * n].reshape(-1, 3)[alive]
        faces = d.face_dart[:n_faces]
        moved = np.where(faces >= 0, 3 * number[faces // 3] + faces % 3, -1)
        twin = 3 * number[old // 3] + old % 3
        holes = moved[d.face_hole[:n_faces] & (faces >= 0)]
        connectivity = Connectivity(twin, holes, self._contours(twin, number))
        face_map = np.where(moved >= 0, connectivity.face.reshape(-1)[moved], -1).astype(np.int32)
        n_before, f_before = self._mesh.n_vertices, len(self._mesh.connectivity.face_sizes)
        mesh = self._with_data(d.values[:n][alive], d.origin[:n][alive], connectivity)
        return Edited(mesh, checks.frozen(number[:n_before]), checks.frozen(face_map[:f_before]))

    def _contours(self, twin: Indices32, number: Indices32) -> Named:
        """Return the contours of the edited mesh; those broken by a cut, a join, or an undo within T6 are dropped."""
        out: dict[str, NDArray[Any]] = {}
        if not (before := self._mesh.connectivity.contour_darts):
            return out
        marks = self._darts.contour[: 3 * len(number)].reshape(-1, 3)[number >= 0].reshape(-1)
        for k, (name, darts) in enumerate(before.items(), 1):
            found = followed(marks, twin, k, number[darts // 3])
            reason = "it lost edges to a cut or join" if found is None else refusal_of_darts(found, twin)
            if found is None or reason:
                warn(f"contour {name!r} was dropped: {reason}")
            else:
                out[name] = found
        return out

    def _with_data(self, values: Array, origin: Indices32, connectivity: Connectivity) -> SimplexMesh:
        """Return the mesh with its vertex data: floats interpolated, the rest copied from the vertices of origin."""
        column = 3
        data = {}
        for name, old in self._mesh.data.items():
            if name in self._interpolated:
                width = old[0].size
                data[name] = values[:, column : column + width].reshape(len(values), *old.shape[1:]).astype(old.dtype)
                column += width
            else:
                data[name] = old[origin]
        return SimplexMesh(values[:, :3], connectivity, data, self._mesh.unit)
