"""Preparation of triangles for a dual: degenerate ones dropped, half-edges matched, orientation made consistent."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError, counted
from simplexmesh._base.vectors import cross, dot
from simplexmesh.mesh import _kernels


def matched(faces: Indices) -> tuple[Indices, Indices, list[str]]:
    """Return triangles without repeated corners and duplicates, their half-edges, and phrases for repairs, or raise."""
    repairs = []
    a, b, c = faces.T
    if (degenerate := (a == b) | (b == c) | (c == a)).any():
        dropped = counted(int(degenerate.sum()), "triangle", "triangles")
        repairs.append(f"dropped {dropped} with a repeated corner")
        faces = faces[~degenerate]
    if not len(faces):
        raise TopologyError("triangles must have a face with three different corners, not none")
    mates, nonmanifold = _kernels.half_edge_mates(faces)
    a, b, c = (mates // 3).reshape(-1, 3).T
    if nonmanifold < 0 and not ((a == b) & (b == c) & (a >= 0)).any():
        return faces, mates.reshape(-1, 3), repairs
    corners = np.sort(faces, axis=1)  # there may be duplicates
    order = np.lexsort(corners.T)
    duplicate = np.zeros(len(faces), bool)
    duplicate[order[1:]] = (np.diff(corners[order], axis=0) == 0).all(axis=1)
    if duplicate.any():
        repairs.append(f"dropped {counted(int(duplicate.sum()), 'duplicate triangle', 'duplicate triangles')}")
        faces = faces[~duplicate]
    return faces, half_edge_mates(faces), repairs


def half_edge_mates(faces: Indices) -> Indices:
    """Return the opposite (t, 3) of each half-edge, `3 u + k` for corner `k` of triangle `u`; -1 on a border."""
    mates, nonmanifold = _kernels.half_edge_mates(faces)
    if nonmanifold >= 0:
        a, b = faces[nonmanifold // 3, [nonmanifold % 3, (nonmanifold + 1) % 3]]
        on_edge = np.flatnonzero((faces == a).any(axis=1) & (faces == b).any(axis=1))
        raise TopologyError(
            f"at most two triangles may share an edge; the edge of corners {min(a, b)} and {max(a, b)} has "
            f"{len(on_edge)}: {', '.join(map(str, on_edge[:4]))}{', ...' if len(on_edge) > 4 else ''}; "
            "sm.separated takes surfaces apart there"
        )
    return mates.reshape(-1, 3)


def to_flip(faces: Indices, mates: Indices) -> Mask:
    """Return a mask of the triangles to flip for a consistent orientation, the fewest in each component.

    Each triangle is two nodes, as given and flipped, linked to neighbors that agree: in one component if one-sided.
    """
    n = len(faces)
    inside = mates >= 0
    agrees = faces != faces.ravel()[mates]  # the two half-edges of an edge start at different corners
    if agrees[inside].all():
        return np.zeros(n, bool)
    other = mates // 3
    as_given = np.where(inside, np.where(agrees, other, other + n), -1)
    flipped = np.where(inside, np.where(agrees, other + n, other), -1)
    labels = _kernels.component_labels(np.concatenate([as_given, flipped]).astype(np.int32))
    one_sided = labels[:n] == labels[n:]
    if one_sided.any():
        t = int(one_sided.argmax())
        raise TopologyError(
            f"triangles must be orientable; the surface of triangle {t}, with corners {faces[t].tolist()}, is one-sided"
        )
    size = np.bincount(labels[:n], minlength=int(labels.max()) + 1)
    n_given, n_flipped = size[labels[:n]], size[labels[n:]]
    return (n_given < n_flipped) | ((n_given == n_flipped) & (labels[:n] > labels[n:]))


def _inside_out(vertices: Array, faces: Indices, mates: Indices) -> Mask:
    """Return a mask of the triangles in closed components of negative volume."""
    labels = _kernels.component_labels(np.where(mates >= 0, mates // 3, -1).astype(np.int32))
    a, b, c = (vertices - vertices[faces].mean(axis=(0, 1)))[faces].transpose(1, 0, 2)
    volume = np.bincount(labels, dot(a, cross(b, c)))
    is_open = np.bincount(labels, (mates < 0).any(axis=1)) > 0
    return ((volume < 0) & ~is_open)[labels]


def _flipped(faces: Indices, mates: Indices, flip: Mask) -> tuple[Indices, Indices]:
    """Return the triangles and half-edges with those in a mask flipped, by swapping their last two corners."""
    faces = faces.copy()
    faces[flip] = faces[flip][:, [0, 2, 1]]
    mates = mates.copy()
    mates[flip] = mates[flip][:, [2, 1, 0]]
    renumbered = np.where(flip[mates // 3], 3 * (mates // 3) + 2 - mates % 3, mates)
    return faces, np.where(mates < 0, -1, renumbered)


def oriented(vertices: Array, faces: Indices, mates: Indices, *, outward: bool) -> tuple[Indices, Indices, list[str]]:
    """Return triangles, half-edges and phrases for repairs; `outward` flips closed components of negative volume."""
    repairs = []
    flip = to_flip(faces, mates)
    if flip.any():
        faces, mates = _flipped(faces, mates, flip)
        repairs.append(f"flipped {counted(int(flip.sum()), 'triangle', 'triangles')}")
    if outward and (flip := _inside_out(vertices, faces, mates)).any():
        faces, mates = _flipped(faces, mates, flip)
        repairs.append(f"flipped {counted(int(flip.sum()), 'triangle', 'triangles')} of inside-out components")
    return faces, mates, repairs
