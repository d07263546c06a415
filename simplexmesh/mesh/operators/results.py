"""Results of editing: the new mesh with its vertex and face maps, and the outcome of a batch of edits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from simplexmesh._base.arrays import Indices32, Mask
from simplexmesh.mesh.operators import _kernels_edit as kernels
from simplexmesh.mesh.simplex_mesh import SimplexMesh

REASONS = {
    kernels.TOUCHED: "touched by an earlier edit",
    kernels.OPPOSITE_TRIANGLE: "opposite face is a triangle",
    kernels.SHARED: "a face is adjacent to both sides",
    kernels.SAME_EDGE: "the two edges are the same",
    kernels.NO_FACE: "no face in common",
    kernels.BESIDE_TRIANGLE: "a side is a triangle",
    kernels.SAME_OPPOSITE: "opposite faces are the same",
    kernels.NEIGHBORS: "opposite faces are adjacent",
    kernels.HOLE: "the face is a hole",
    kernels.BESIDE_HOLE: "a neighbor is a hole",
    kernels.ON_CONTOUR: "it would break a contour",
}


@dataclass(frozen=True, eq=False, repr=False)
class Edited:
    """An edited mesh, with maps from the mesh before.

    Attributes
    ----------
    mesh : SimplexMesh
        The new mesh.
    vertex_map : (n,) array of int
        The new number of each vertex of the mesh before; -1 for removed ones.
    face_map : (f,) array of int
        The same for each face, holes included; of two merged faces the larger one is kept, the other removed.
    """

    mesh: SimplexMesh
    vertex_map: Indices32
    face_map: Indices32

    def __repr__(self) -> str:
        source = f"of {len(self.vertex_map)} vertices"
        more = [f", {_summary(each.name, getattr(self, each.name))}" for each in fields(self)[3:]]
        return f"{type(self).__name__}({self.mesh!r} {source}{''.join(more)})"


def _summary(name: str, value: Any) -> str:
    """Return a short text for a field of a result; arrays are given by their length."""
    if isinstance(value, float):
        return f"{name} {value:.4g}"
    if isinstance(value, tuple | np.ndarray) and not (name == "faces" and len(value) == 2):
        return f"{len(value)} {name}"
    return f"{name} {value!r}"


@dataclass(frozen=True, eq=False, repr=False)
class Batch:
    """The outcome of a batch of edits.

    Attributes
    ----------
    done : (m,) array of bool
        Whether each edit was applied.
    reasons : mapping of str to int
        The reasons why others were not, with their counts.
    status, witness : (m,) array of int
        For each edit, 0 or a key of `REASONS`, and the face that made it illegal, -1 if there is none.
    """

    done: Mask
    reasons: Mapping[str, int]
    status: Indices32
    witness: Indices32

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the reasons as a plain mapping."""
        return Batch, (self.done, dict(self.reasons), self.status, self.witness)

    def __repr__(self) -> str:
        refused = "".join(f", {count} not: {reason}" for reason, count in self.reasons.items())
        return f"Batch({np.count_nonzero(self.done)} of {len(self.done)} done{refused})"
