"""Kernels of the editable mesh: batches of T5, removal of faces by T1, and of T6, their refinement by T2."""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Indices32, Mask
from simplexmesh.mesh.operators._kernels_batch import undo
from simplexmesh.mesh.operators._kernels_contours import breaks_contour
from simplexmesh.mesh.operators._kernels_edit import (
    BESIDE_HOLE,
    DONE,
    EDITS,
    HOLE,
    ON_CONTOUR,
    REFINE_FACE,
    REMOVE,
    TOUCHED,
    VERTICES,
    Darts,
    insert,
    next_dart,
    refuse_remove,
    remove,
)


@njit(cache=True)
def refine(d: Darts, face: int) -> None:
    """T6: cut off the corners of a face one by one, each by T2 from the previous cut; the middle stays the face.

    Of each pair of new vertices one is the midpoint of an edge, the other halfway from there to the centroid.
    """
    m, k = d.face_size[face], d.values.shape[1]
    centroid = np.zeros(k)
    last = start = np.int64(d.face_dart[face])
    dart = start
    for _ in range(m):
        centroid += d.values[dart // 3]
        last, dart = dart, next_dart(d.twin, dart)
    centroid /= m
    first = d.used[VERTICES]
    ahead = next_dart(d.twin, start)
    insert(d, last, start, 0.5, 0.5, 1)
    inner = 3 * first + 1  # the cut: from the midpoint of the edge before the corner to that of the edge after it
    for step in range(1, m):
        other = ahead if step < m - 1 else 3 * first + 1
        ahead = next_dart(d.twin, ahead)
        insert(d, inner, other, 0.5, 0.5, 1)
        middle = first + 1 if step == 1 else first + 2 * step - 1
        for j in range(k):
            d.values[first + 2 * step, j] = (d.values[middle, j] + centroid[j]) / 2
        inner = 3 * (first + 2 * step) + 1
    for j in range(k):
        d.values[first + 2 * m - 1, j] = (d.values[first, j] + centroid[j]) / 2


@njit(cache=True)
def remove_face(d: Darts, face: int, touched: Mask) -> tuple[int, int]:
    """T5: apply T1 to the edges of a face in turn, or none if one is illegal; return the status and the witness."""
    m = d.face_size[face]
    beside = np.empty(m, np.int64)
    dart = np.int64(d.face_dart[face])
    for i in range(m):
        beside[i] = d.face[d.twin[dart]]
        if d.face_hole[beside[i]]:
            return BESIDE_HOLE, beside[i]
        dart = next_dart(d.twin, dart)
    merged = np.int64(face)
    for i in range(m):
        dart = np.int64(d.face_dart[beside[i]])
        while d.face[d.twin[dart]] != merged:
            dart = next_dart(d.twin, dart)
        status, witness = refuse_remove(d, dart)
        if d.contour.size > 0 and breaks_contour(d, REMOVE, dart, dart):
            status, witness = ON_CONTOUR, merged
        if status != DONE:
            undo(d, i)
            return status, witness
        remove(d, dart)
        merged = np.int64(d.log[d.used[EDITS] - 1, 3])
    touched[face] = True
    for i in range(m):
        touched[beside[i]] = True
    return DONE, -1


@njit(cache=True)
def apply(d: Darts, kind: int, faces: Indices32, touched: Mask, status: Indices32, witness: Indices32) -> None:
    """Apply T6 or T5 to faces in order; a face refined or merged since the batch began counts as touched."""
    for i in range(faces.size):
        face = faces[i]
        status[i], witness[i] = TOUCHED, -1
        if touched[face] or d.face_dart[face] < 0:
            continue
        if d.face_hole[face]:
            status[i], witness[i] = HOLE, face
        elif kind == REFINE_FACE:
            refine(d, face)
            touched[face] = True
            status[i] = DONE
        else:
            status[i], witness[i] = remove_face(d, face, touched)
