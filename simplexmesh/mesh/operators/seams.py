"""Seams: dart surgery for cutting along a cycle of edges (T3) and sewing two faces together (T4), its inverse.

When sewn, the dart onward of each vertex is the twin of the dart back of the next one; when cut, that holds among the
vertices of each side separately, those whose third edge is there. H. Delingette, thesis, 1994, section 2.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Indices, Indices32, Mask
from simplexmesh.mesh.operators._kernels_edit import Darts, adjacent
from simplexmesh.mesh.paths import first_repeated


@dataclass(frozen=True)
class Seam:
    """A closed path of edges, given by its darts."""

    onward: Indices  # (k,) the dart of each vertex to the next one on the path
    back: Indices  # (k,) and to the one before
    left: Mask  # (k,) whether the third edge of the vertex is on the left of the path


def along(twin: Indices32, darts: Indices) -> Seam:
    """Return the seam along a closed path, given by its darts onward."""
    back = np.roll(twin[darts].astype(np.int64), 1)
    return Seam(darts, back, _rotated(_rotated(darts)) == back)


def between(darts_a: Indices, darts_b: Indices, start_a: int, start_b: int) -> Seam:
    """Return the seam that joins two faces, vertices alternating evenly, the second one traversed backward."""
    a_is_small = len(darts_a) <= len(darts_b)
    forward = np.roll(darts_a, -start_a)
    backward = np.roll(np.roll(darts_b, -start_b)[::-1], 1)
    small, large = (forward, backward) if a_is_small else (backward, forward)
    p, q = len(small), len(large)
    before = np.arange(p) * q // p  # number of vertices of the large face before each of the small one
    position = np.concatenate([np.arange(p) + before, np.arange(q) + np.searchsorted(before, np.arange(q), "right")])
    order = np.argsort(position)
    darts = np.concatenate([small, large])[order]
    of_b = np.repeat([not a_is_small, a_is_small], [p, q])[order]
    return Seam(np.where(of_b, _rotated(darts), darts), np.where(of_b, darts, _rotated(darts)), of_b)


def _rotated(darts: Indices) -> Indices:
    """Return the next dart at the same vertex, counter-clockwise."""
    return 3 * (darts // 3) + (darts + 1) % 3


def sewn_faces(seam: Seam, face: Indices32) -> tuple[Indices32, Indices32]:
    """Return the faces on the left and right of each edge of a seam after sewing, given those before."""
    k = len(seam.onward)
    vertices = np.arange(2 * k) % k
    last_left = np.maximum.accumulate(np.where(seam.left[vertices], np.arange(2 * k), -1))[k:]
    next_right = np.minimum.accumulate(np.where(seam.left[vertices], 2 * k, np.arange(2 * k))[::-1])[::-1][1 : k + 1]
    return face[seam.onward[last_left % k]], face[seam.back[next_right % k]]


def refusal_to_cut(seam: Seam, face: Indices32) -> str:
    """Return the reason why T3 along a seam would not leave a complete mesh, "" if it would."""
    sides = (
        ("left", seam.left, seam.onward, face[seam.onward[seam.left]]),
        ("right", ~seam.left, seam.back, face[seam.back[~seam.left]]),
    )
    for side, third, darts, _ in sides:
        if not third.any():
            return f"it is face {face[darts[0]]} itself, so there is nothing to cut off"
        if (count := int(third.sum())) < 3:
            return f"it has {count} edges on its {side}, where a cut needs at least 3"
    for side, _, _, beside in sides:
        if (repeated := first_repeated(beside)) >= 0:
            return (
                f"face {repeated} lies along its {side} in two places, "
                "so the face that closes the cut would share two edges with it"
            )
    return ""


def refusal_to_join(d: Darts, a: int, b: int, around_a: Indices) -> str:
    """Return the reason why T4 on two faces is illegal, whatever the seam, "" if it is legal."""
    if a == b:
        return "they are the same"
    if adjacent(d, a, b):
        return "they share an edge"
    for across in d.face[d.twin[around_a]].tolist():
        if adjacent(d, across, b):
            return f"face {across} shares an edge with both"
    return ""


def refusal_to_sew(d: Darts, seam: Seam) -> str:
    """Return the reason why a seam cannot be sewn, faces that would share a second edge along it, "" if it can."""
    for one, other in zip(*(side.tolist() for side in sewn_faces(seam, d.face)), strict=True):
        if adjacent(d, one, other):
            return f"faces {one} and {other}, which would share an edge there, already share one"
    return ""


def open_faces(d: Darts, seam: Seam, left: int, right: int) -> None:
    """Open a seam, the darts of each side paired separately, and close its sides by two new faces."""
    for new, side in ((left, seam.left), (right, ~seam.left)):
        onward, back = seam.onward[side], seam.back[side]
        ahead = np.roll(back, -1)
        d.twin[onward], d.twin[ahead] = ahead, onward
        mine, other = (back, onward) if new == left else (onward, back)  # of the new face, and of those beside it
        np.subtract.at(d.face_size, d.face[mine], 1)
        d.face_dart[d.face[other]] = other
        d.face[mine] = new
        d.face_dart[new], d.face_size[new] = mine[0], len(mine)


def sew_faces(d: Darts, seam: Seam, a: int, b: int) -> None:
    """Close a seam between two faces, which are thereby removed: its darts are paired along the path."""
    on_left, on_right = sewn_faces(seam, d.face)
    before = np.roll(on_right, 1)
    ahead = np.roll(seam.back, -1)
    d.twin[seam.onward], d.twin[ahead] = ahead, seam.onward
    d.face[seam.onward], d.face[seam.back] = on_left, before
    np.add.at(d.face_size, on_left[~seam.left], 1)
    np.add.at(d.face_size, before[seam.left], 1)
    d.face_dart[[a, b]] = -1
