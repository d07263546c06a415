"""Triangles made fit for a dual: flaws dropped, half-edges matched, orientation made consistent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot
from simplexmesh.errors import TopologyError
from simplexmesh.mesh import _kernels

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def without_slim(faces: Indices) -> tuple[Indices, list[str]]:
    """Return the triangles without those that repeat a corner, and what was dropped.

    Examples
    --------
    >>> without_slim(np.array([[0, 1, 2], [2, 2, 3]]))
    (array([[0, 1, 2]]), ['dropped 1 triangles with a repeated corner'])
    """
    a, b, c = faces.T
    slim = (a == b) | (b == c) | (c == a)
    if not slim.any():
        return faces, []
    return faces[~slim], [f"dropped {int(slim.sum())} triangles with a repeated corner"]


def without_copies(faces: Indices) -> tuple[Indices, list[str]]:
    """Return the triangles without second copies, whatever the order of their corners, and what was dropped.

    Examples
    --------
    >>> without_copies(np.array([[0, 1, 2], [1, 0, 2]]))
    (array([[0, 1, 2]]), ['dropped 1 copies of a triangle'])
    """
    corners = np.sort(faces, axis=1)
    order = np.lexsort(corners.T)
    again = np.zeros(len(faces), bool)
    again[order[1:]] = (np.diff(corners[order], axis=0) == 0).all(axis=1)
    if not again.any():
        return faces, []
    return faces[~again], [f"dropped {int(again.sum())} copies of a triangle"]


def matched(faces: Indices) -> tuple[Indices, Indices, list[str]]:
    """Return triangles without flaws, their half-edges as `half_edge_mates` gives them, and what was dropped.

    Copies are looked for only where there is a sign of one: a crowded edge, or a triangle with one neighbor thrice.

    Raises
    ------
    TopologyError
        When no triangle is left, or more than two share an edge.

    Examples
    --------
    >>> matched(np.array([[0, 1, 2], [2, 1, 3], [2, 1, 0]]))[2]
    ['dropped 1 copies of a triangle']
    """
    faces, said = without_slim(faces)
    if not len(faces):
        raise TopologyError("triangles must have a face with three different corners, not none")
    mates, crowded = _kernels.half_edge_mates(faces)
    a, b, c = (mates // 3).reshape(-1, 3).T
    if crowded >= 0 or ((a == b) & (b == c) & (a >= 0)).any():
        faces, copies = without_copies(faces)
        return faces, half_edge_mates(faces), said + copies
    return faces, mates.reshape(-1, 3), said


def half_edge_mates(faces: Indices) -> Indices:
    """Return for half-edge `j` of each triangle, from corner `j` to corner `j + 1`, the other one on its edge.

    Parameters
    ----------
    faces : (t, 3) array of int
        Corners of triangles.

    Returns
    -------
    (t, 3) array of int
        Half-edge `3 * u + k` of triangle `u`, or -1 on a border.

    Raises
    ------
    TopologyError
        Where more than two triangles share an edge.

    Examples
    --------
    >>> half_edge_mates(np.array([[0, 1, 2], [2, 1, 3]]))
    array([[-1,  3, -1],
           [ 1, -1, -1]])
    """
    mates, crowded = _kernels.half_edge_mates(faces)
    if crowded >= 0:
        a, b = faces[crowded // 3, [crowded % 3, (crowded + 1) % 3]]
        on_edge = np.flatnonzero((faces == a).any(axis=1) & (faces == b).any(axis=1))
        raise TopologyError(
            f"at most two triangles may share an edge; the edge of corners {min(a, b)} and {max(a, b)} has "
            f"{len(on_edge)}: {', '.join(map(str, on_edge[:4]))}{', ...' if len(on_edge) > 4 else ''}"
        )
    return mates.reshape(-1, 3)


def to_turn(faces: Indices, mates: Indices) -> NDArray[np.bool_]:
    """Return which triangles to turn over so that all agree with their neighbors; fewest in each component.

    Each triangle stands twice in a graph, as it is and turned over, linked to those of its neighbors that agree with
    it; a component of the surface has a consistent orientation exactly when it makes two components of that graph.
    """
    n = len(faces)
    inside = mates >= 0
    agrees = faces != faces.ravel()[mates]  # the two half-edges of an edge start at different corners
    if agrees[inside].all():
        return np.zeros(n, bool)
    other = mates // 3
    kept = np.where(inside, np.where(agrees, other, other + n), -1)
    turned = np.where(inside, np.where(agrees, other + n, other), -1)
    labels = _kernels.component_labels(np.concatenate([kept, turned]).astype(np.int32))
    mirrored = labels[:n] == labels[n:]
    if mirrored.any():
        t = int(mirrored.argmax())
        raise TopologyError(
            f"triangles must have two sides; the surface of triangle {t}, with corners {faces[t].tolist()}, has one"
        )
    size = np.bincount(labels[:n], minlength=int(labels.max()) + 1)
    as_is, over = size[labels[:n]], size[labels[n:]]
    return (as_is < over) | ((as_is == over) & (labels[:n] > labels[n:]))


def _inside_out(vertices: Array, faces: Indices, mates: Indices) -> NDArray[np.bool_]:
    """Return which triangles belong to a closed component with negative volume."""
    labels = _kernels.component_labels(np.where(mates >= 0, mates // 3, -1).astype(np.int32))
    a, b, c = (vertices - vertices[faces].mean(axis=(0, 1)))[faces].transpose(1, 0, 2)
    volume = np.bincount(labels, dot(a, cross(b, c)))
    is_open = np.bincount(labels, (mates < 0).any(axis=1)) > 0
    return ((volume < 0) & ~is_open)[labels]


def _turned(faces: Indices, mates: Indices, over: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    """Return the triangles and half-edges with some turned over, by swapping their last two corners."""
    faces = faces.copy()
    faces[over] = faces[over][:, [0, 2, 1]]
    mates = mates.copy()
    mates[over] = mates[over][:, [2, 1, 0]]
    renamed = np.where(over[mates // 3], 3 * (mates // 3) + 2 - mates % 3, mates)
    return faces, np.where(mates < 0, -1, renamed)


def oriented(vertices: Array, faces: Indices, mates: Indices, *, outward: bool) -> tuple[Indices, Indices, list[str]]:
    """Return triangles that agree with their neighbors, their half-edges, and what was turned.

    Parameters
    ----------
    vertices : (v, 3) array of float
        Positions.
    faces, mates : (t, 3) arrays of int
        Triangles, and their half-edges as `half_edge_mates` returns them.
    outward : bool
        Also turn closed components that enclose a negative volume.

    Raises
    ------
    TopologyError
        For a surface with one side.

    Examples
    --------
    >>> faces = np.array([[0, 1, 2], [1, 2, 3]])
    >>> oriented(np.eye(4)[:, :3], faces, half_edge_mates(faces), outward=True)[2]
    ['turned over 1 triangles']
    """
    said = []
    over = to_turn(faces, mates)
    if over.any():
        faces, mates = _turned(faces, mates, over)
        said.append(f"turned over {int(over.sum())} triangles")
    if outward and (over := _inside_out(vertices, faces, mates)).any():
        faces, mates = _turned(faces, mates, over)
        said.append(f"turned {int(over.sum())} triangles of closed components outward")
    return faces, mates, said
