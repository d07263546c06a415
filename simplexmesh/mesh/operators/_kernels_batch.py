"""Kernels of the editable mesh: batches of edits, undo, and regularization of face sizes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices32
from simplexmesh.mesh.operators._kernels_contours import breaks_contour
from simplexmesh.mesh.operators._kernels_edit import (
    DONE,
    EDITS,
    FACES,
    INSERT,
    ON_CONTOUR,
    REMOVE,
    SWAP,
    TOUCHED,
    VERTICES,
    Darts,
    insert,
    next_dart,
    refuse_insert,
    refuse_remove,
    refuse_swap,
    relink,
    remove,
    rotate,
    rotate_edge,
    swap,
    undo_swap,
    unlink,
)


@njit(cache=True)
def apply(
    d: Darts, kind: int, first: Indices32, second: Indices32, at: Array, status: Indices32, witness: Indices32
) -> None:
    """Apply edits of one kind in order; a dart whose twin has changed since the batch began counts as touched."""
    twins = np.empty((first.size, 2), np.int32)
    for i in range(first.size):
        twins[i, 0], twins[i, 1] = d.twin[first[i]], d.twin[second[i]]
    for i in range(first.size):
        one, other = first[i], second[i]
        intact = (
            d.alive[one // 3] and d.alive[other // 3] and d.twin[one] == twins[i, 0] and d.twin[other] == twins[i, 1]
        )
        status[i], witness[i] = TOUCHED, -1
        if not intact:
            continue
        if d.contour.size > 0 and breaks_contour(d, kind, one, other):
            status[i], witness[i] = ON_CONTOUR, d.face[one]
        elif kind == REMOVE:
            status[i], witness[i] = refuse_remove(d, one)
            if status[i] == DONE:
                remove(d, one)
        elif kind == INSERT:
            status[i], witness[i] = refuse_insert(d, one, other)
            if status[i] == DONE:
                insert(d, one, other, at[i, 0], at[i, 1], -1)
        else:
            status[i], witness[i] = refuse_swap(d, one)
            if status[i] == DONE:
                swap(d, one)


@njit(cache=True)
def undo(d: Darts, count: int) -> int:
    """Undo up to `count` edits, the last first, stopping at a cut or a join; return their number."""
    for done in range(count):
        row = d.used[EDITS] - 1
        kind, dart, side = d.log[row, 0], d.log[row, 1], d.log[row, 2]
        kept, other, labels = d.log[row, 3], d.log[row, 4], d.log[row, 5]
        if kind == REMOVE:
            relink(d, dart, side, kept, other)
            d.face_hole[kept], d.face_hole[other] = labels % 2 == 1, labels >= 2
        elif kind == INSERT:
            unlink(d, dart, side)
            d.used[VERTICES] -= 2
            d.used[FACES] -= 1
        elif kind == SWAP:
            undo_swap(d, dart, row)
        else:
            return done
        d.used[EDITS] = row
    return count


@njit(cache=True)
def incomplete_edge(twin: Indices32, face: Indices32, face_darts: Indices32, offsets: Indices32) -> int:
    """Return a dart whose two faces are the same or share another edge; -1 when the mesh is complete."""
    stamp = np.full(offsets.size - 1, -1, np.int32)
    for f in range(offsets.size - 1):
        stamp[f] = f
        for i in range(offsets[f], offsets[f + 1]):
            across = face[twin[face_darts[i]]]
            if stamp[across] == f:
                return face_darts[i]
            stamp[across] = f
    return -1


@njit(cache=True, _nrt=False)
def imbalance(d: Darts, dart: int) -> int:
    """Return the sizes of the faces beside an edge minus those at its ends; at most 1 if a swap improves nothing."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    if d.face_hole[left] or d.face_hole[right]:
        return -1
    beside, across = d.face_size[left], d.face_size[right]
    near, far = d.face_size[d.face[rotate(dart)]], d.face_size[d.face[rotate(back)]]
    c = beside + across - near - far
    if c != 2:
        return c
    before = (beside - 6.0) ** 4 + (across - 6.0) ** 4 + (near - 6.0) ** 4 + (far - 6.0) ** 4
    after = (beside - 7.0) ** 4 + (across - 7.0) ** 4 + (near - 5.0) ** 4 + (far - 5.0) ** 4
    return 2 if after < before else 1


@njit(cache=True, _nrt=False)
def enqueue(dart: int, c: int, head: Indices32, after: Indices32, before: Indices32, queued: NDArray[np.uint8]) -> None:
    """Move a dart to the bucket of imbalance `c`, or out of the queue if that is below 2."""
    if queued[dart] == c:
        return
    if queued[dart] > 0:
        if before[dart] >= 0:
            after[before[dart]] = after[dart]
        else:
            head[queued[dart]] = after[dart]
        if after[dart] >= 0:
            before[after[dart]] = before[dart]
    queued[dart] = 0
    if c >= 2:
        after[dart], before[dart] = head[c], -1
        if head[c] >= 0:
            before[head[c]] = dart
        head[c] = dart
        queued[dart] = c


@njit(cache=True, _nrt=False)
def enqueue_edges(
    d: Darts, vertex: int, head: Indices32, after: Indices32, before: Indices32, queued: NDArray[np.uint8]
) -> int:
    """Enqueue the edges of a vertex, each by its smaller dart, and return their largest imbalance."""
    largest = 0
    for dart in range(3 * vertex, 3 * vertex + 3):
        back = d.twin[dart]
        c = min(imbalance(d, dart), head.size - 1)
        c = c if c >= 2 else 0
        largest = max(largest, c)
        enqueue(min(dart, back), c, head, after, before, queued)
        enqueue(max(dart, back), 0, head, after, before, queued)
    return largest


@njit(cache=True)
def even_out(d: Darts, limit: int) -> int:
    """Apply T7 to edges with an imbalance of 2 or more, the largest first, at most `limit` times; return how often."""
    head = np.full(256, -1, np.int32)
    after, before = np.empty(d.twin.size, np.int32), np.empty(d.twin.size, np.int32)
    queued = np.zeros(d.twin.size, np.uint8)
    top = 0
    for vertex in range(d.used[VERTICES]):
        if d.alive[vertex]:
            top = max(top, enqueue_edges(d, vertex, head, after, before, queued))
    swaps = 0
    while True:
        while top >= 2 and head[top] < 0:
            top -= 1
        if top < 2 or swaps == limit:
            return swaps
        edge = head[top]
        enqueue(edge, 0, head, after, before, queued)
        c = min(imbalance(d, edge), head.size - 1)
        if c != top:  # a hole at its end has grown
            enqueue(edge, c if c >= 2 else 0, head, after, before, queued)
            continue
        if refuse_swap(d, edge)[0] != DONE or (d.contour.size > 0 and breaks_contour(d, SWAP, edge, edge)):
            continue
        back = d.twin[edge]
        faces = (d.face[edge], d.face[back], d.face[rotate(edge)], d.face[rotate(back)])
        rotate_edge(d, edge)
        swaps += 1
        for f in faces:
            if d.face_hole[f]:  # skipped as it may be long: it has grown, which raises no imbalance
                continue
            start = d.face_dart[f]
            walk = start
            while True:
                top = max(top, enqueue_edges(d, walk // 3, head, after, before, queued))
                walk = next_dart(d.twin, walk)
                if walk == start:
                    break
