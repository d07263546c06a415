"""What editing answers: the new mesh and where everything went, and which edits of a batch were done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_edit as kernels
from simplexmesh.mesh.simplex_mesh import SimplexMesh

REASONS = {
    kernels.TOUCHED: "touched by an edit before",
    kernels.OPPOSITE_TRIANGLE: "opposite face is a triangle",
    kernels.SHARED: "a face is adjacent to both sides",
    kernels.SAME_EDGE: "the two edges are one",
    kernels.NO_FACE: "no face in common",
    kernels.BESIDE_TRIANGLE: "a side is a triangle",
    kernels.SAME_OPPOSITE: "opposite faces are one",
    kernels.NEIGHBORS: "opposite faces are adjacent",
    kernels.HOLE: "the face is a hole",
    kernels.BESIDE_HOLE: "a neighbor is a hole",
}


@dataclass(frozen=True, eq=False, repr=False)
class Edited:
    """A mesh after operators, and where everything went.

    Attributes
    ----------
    mesh : SimplexMesh
        The new mesh.
    vertex_map : (n,) array of int
        For each vertex of the mesh before, its number now; -1 when it is gone.
    face_map : (f,) array of int
        The same for each face, holes included; of two merged faces the larger one is kept, the other one gone.
    """

    mesh: SimplexMesh
    vertex_map: NDArray[np.int32]
    face_map: NDArray[np.int32]

    def __repr__(self) -> str:
        came = f"of {len(self.vertex_map)} vertices"
        more = [f", {_told(each.name, getattr(self, each.name))}" for each in fields(self)[3:]]
        return f"{type(self).__name__}({self.mesh!r} {came}{''.join(more)})"


def _told(name: str, value: Any) -> str:
    """Return a part of a result in a word or two, not with all its numbers."""
    if isinstance(value, float):
        return f"{name} {value:.4g}"
    if isinstance(value, tuple | np.ndarray) and not (name == "faces" and len(value) == 2):
        return f"{len(value)} {name}"
    return f"{name} {value!r}"


@dataclass(frozen=True, eq=False, repr=False)
class Batch:
    """What became of the edits of a batch.

    Attributes
    ----------
    done : (m,) array of bool
        Which were done.
    reasons : mapping of str to int
        Why the others were not, and how many for each reason.
    status, witness : (m,) array of int
        The same one by one: a key of `REASONS`, 0 when done, and the face in the way, -1 without one.
    """

    done: NDArray[np.bool_]
    reasons: Mapping[str, int]
    status: NDArray[np.int32]
    witness: NDArray[np.int32]

    def __repr__(self) -> str:
        why = "".join(f", {count} not: {reason}" for reason, count in self.reasons.items())
        return f"Batch({np.count_nonzero(self.done)} of {len(self.done)} done{why})"
