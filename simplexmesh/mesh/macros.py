"""The operators made of others, on an editable mesh: T5 takes a face away by T1, T6 refines one by T2."""

from __future__ import annotations

import numpy as np

from simplexmesh.errors import TopologyError
from simplexmesh.mesh.edited import REASONS
from simplexmesh.mesh.editing import EditableMesh


def refine_face(edit: EditableMesh, face: int) -> None:
    """T6: put a ring of as many faces as the face has vertices between it and its outline, by T2 that many times.

    Every second vertex of the ring is the middle of an edge, the other one halfway from there to the centroid.

    Raises
    ------
    TopologyError
        When the face is gone or a hole.
    """
    around = edit.around(face)
    if edit.is_hole(face):
        raise TopologyError(f"face {face} cannot be refined: it is a hole")
    m = len(around)
    centroid = edit.values(around // 3).mean(axis=0)
    first = edit.n_slots
    edit.insert_edges(around[-1:], around[:1])
    inner = 3 * first + 1  # from the middle of the edge before to that of the edge after the corner just cut
    for k in range(1, m):
        vertex = edit.n_slots
        edit.insert_edges([inner], [around[k] if k < m - 1 else 3 * first + 1])
        inner = 3 * vertex + 1
    middles = np.array([first + 1, *range(first + 3, first + 2 * m - 2, 2), first])
    inside = np.array([*range(first + 2, first + 2 * m - 1, 2), first + 2 * m - 1])
    edit.set_values(inside, (edit.values(middles) + centroid) / 2)


def remove_face(edit: EditableMesh, face: int) -> None:
    """T5: merge a face with all its neighbors, by T1 on its edges in turn; nothing is done when one is illegal.

    Raises
    ------
    TopologyError
        Naming the edge and the condition.
    """
    around = edit.around(face)
    beside = [edit.faces_beside(int(dart))[1] for dart in around]
    for other in (face, *beside):
        if edit.is_hole(other):
            what = "it" if other == face else f"its neighbor, face {other},"
            raise TopologyError(f"face {face} cannot be removed: {what} is a hole")
    merged = face
    for done, other in enumerate(beside):
        shared = [dart for dart in edit.around(other).tolist() if edit.faces_beside(dart)[1] == merged]
        batch = edit.remove_edges(shared[:1])
        if not batch.done.all():
            edit.undo(done)
            raise TopologyError(
                f"face {face} cannot be removed: between it and its neighbor, face {other}, "
                f"{REASONS[int(batch.status[0])]} (face {int(batch.witness[0])})"
            )
        merged = edit.last_kept
