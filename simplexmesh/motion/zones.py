"""Sets of faces: their connected pieces, and outlines that can be cut along."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from simplexmesh.mesh.connectivity import Connectivity

Mask = NDArray[np.bool_]

MOST_ROUNDS = 20
"""Rounds in which the outline of a zone may be shifted both ways; after them it only grows."""


def connected(connectivity: Connectivity, zone: Mask) -> list[Mask]:
    """Return the pieces of a set of faces that hang together by edges, as masks (f,).

    Examples
    --------
    >>> import simplexmesh as sm
    >>> tube = sm.cylinder(9, 4)
    >>> [int(piece.sum()) for piece in connected(tube.connectivity, tube.connectivity.face_is_hole)]
    [1, 1]
    """
    between = connectivity.edge_faces
    inside = between[zone[between[:, 0]] & zone[between[:, 1]]]
    n = len(zone)
    graph = coo_array((np.ones(len(inside), bool), inside.T), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    return [np.asarray((label == name) & zone) for name in np.unique(label[zone])]


def without_islands(connectivity: Connectivity, zone: Mask, fewest: int) -> Mask:
    """Return the zone with the pieces of the rest added that have fewer than so many faces, holes not counted."""
    out = zone.copy()
    for piece in connected(connectivity, ~zone):
        if np.count_nonzero(piece & ~connectivity.face_is_hole) < fewest:
            out |= piece
    return out


def with_holes_beside(connectivity: Connectivity, zone: Mask) -> Mask:
    """Return the zone with just those holes that share an edge with a face of it."""
    faces = zone & ~connectivity.face_is_hole
    beside = np.zeros(len(zone), bool)
    one, other = connectivity.edge_faces.T
    beside[one[faces[other]]] = beside[other[faces[one]]] = True
    return np.asarray(faces | (beside & connectivity.face_is_hole))


def cuttable(connectivity: Connectivity, zone: Mask) -> Mask | None:
    """Return a zone as similar as can be whose outlines can all be cut along (T3), or None when there is none.

    Where an outline comes beside itself outside of the zone, faces are taken in; where it does so inside, the zone
    being one face wide there, faces are given up. Holes beside the zone belong to it.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> c = sm.sphere(4).connectivity
    >>> zone = np.zeros(c.n_faces, bool)
    >>> zone[c.vertex_faces[0]] = True
    >>> int(cuttable(c, zone).sum())
    3
    >>> zone[c.vertex_faces[0][:2]] = False
    >>> cuttable(c, zone) is None
    True
    """
    fixed = _shifted(connectivity, zone, giving_up=True)
    if fixed is None and np.count_nonzero(zone & ~connectivity.face_is_hole) >= 3:
        fixed = _shifted(connectivity, zone, giving_up=False)
    return fixed


def _shifted(connectivity: Connectivity, zone: Mask, *, giving_up: bool) -> Mask | None:
    """Return a zone that can be cut off, by taking faces in and, for so many rounds, giving some up."""
    solid = ~connectivity.face_is_hole
    for attempt in range(MOST_ROUNDS + len(zone)):
        zone = with_holes_beside(connectivity, zone)
        if not zone.any() or not (~zone & solid).any():
            return None
        inside, outside = _narrow(connectivity, zone)
        if not inside.any() and not outside.any():
            return zone
        if outside.any():
            zone = zone | outside
        elif giving_up and attempt < MOST_ROUNDS:
            zone = zone & ~(inside & solid)
        else:
            zone = zone | _around(connectivity, zone)
    return None


def _around(connectivity: Connectivity, zone: Mask) -> Mask:
    """Return the faces that lie beside two or more of a zone, or all beside it where there are none."""
    pairs = connectivity.edge_faces
    count = np.zeros(len(zone), np.int64)
    for mine, other in ((0, 1), (1, 0)):
        np.add.at(count, pairs[zone[pairs[:, other]], mine], 1)
    beside = (count > 0) & ~zone
    between = beside & (count > 1)
    return between if between.any() else beside


def _narrow(connectivity: Connectivity, zone: Mask) -> tuple[Mask, Mask]:
    """Return the faces in the zone, and those outside of it, where an outline could not be cut along.

    Faces that an outline comes to twice on one side, and all on a side where it has less than three. An edge between
    two vertices of an outline that is not part of it makes one or the other.
    """
    twin, face = connectivity.twin.reshape(-1), connectivity.face.reshape(-1)
    border = np.flatnonzero(zone[face] & ~zone[face[twin]])
    ends = twin[border] // 3
    links = coo_array((np.ones(len(border), bool), (border // 3, ends)), shape=(len(twin) // 3,) * 2)
    _, loop = connected_components(links, directed=False)
    narrow = []
    for darts, faces_in in ((border, 2), (twin[border], 1)):
        starts = zone[connectivity.vertex_faces[darts // 3]].sum(axis=1) == faces_in
        marked = np.zeros(len(zone), bool)
        along = np.stack([loop[darts // 3], face[darts]], axis=1)
        again, times = np.unique(along[starts], axis=0, return_counts=True)
        marked[again[times > 1, 1]] = True
        few = np.bincount(loop[darts[starts] // 3], minlength=int(loop.max()) + 1) < 3
        marked[face[darts[few[loop[darts // 3]]]]] = True
        narrow.append(marked)
    return narrow[0], narrow[1]
