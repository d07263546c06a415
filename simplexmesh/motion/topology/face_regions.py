"""Sets of faces and vertices: connected components, dilation, and zones whose outlines can be cut along."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from simplexmesh._base.arrays import Indices32, Mask
from simplexmesh.mesh.connectivity import Connectivity

MOST_ROUNDS = 20
"""Rounds in which a zone may gain and lose faces; after them it only grows."""


def face_components(connectivity: Connectivity, zone: Mask) -> list[Mask]:
    """Return the edge-connected components of a set of faces, as masks (f,)."""
    between = connectivity.edge_faces
    inside = between[zone[between[:, 0]] & zone[between[:, 1]]]
    n = len(zone)
    graph = coo_array((np.ones(len(inside), bool), inside.T), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    return [np.asarray((label == name) & zone) for name in np.unique(label[zone])]


def dilated(marked: Mask, neighbors: Indices32, rings: int) -> Mask:
    """Return the mask (n,) of the marked vertices and those within `rings` edges of one."""
    for _ in range(rings):
        marked = marked | marked[neighbors].any(axis=1)
    return marked


def without_islands(connectivity: Connectivity, zone: Mask, fewest: int) -> Mask:
    """Return the zone together with the components of its complement of fewer than `fewest` faces, without holes."""
    out = zone.copy()
    for piece in face_components(connectivity, ~zone):
        if np.count_nonzero(piece & ~connectivity.face_is_hole) < fewest:
            out |= piece
    return out


def with_holes_beside(connectivity: Connectivity, zone: Mask) -> Mask:
    """Return the zone with exactly the holes that share an edge with one of its faces."""
    faces = zone & ~connectivity.face_is_hole
    beside = np.zeros(len(zone), bool)
    one, other = connectivity.edge_faces.T
    beside[one[faces[other]]] = beside[other[faces[one]]] = True
    return np.asarray(faces | (beside & connectivity.face_is_hole))


def cuttable(connectivity: Connectivity, zone: Mask) -> Mask | None:
    """Return the zone, faces added or removed where it is narrow, such that its outlines can be cut along; or None."""
    fixed = _adjusted(connectivity, zone, may_shrink=True)
    if fixed is None and np.count_nonzero(zone & ~connectivity.face_is_hole) >= 3:
        fixed = _adjusted(connectivity, zone, may_shrink=False)
    return fixed


def _adjusted(connectivity: Connectivity, zone: Mask, *, may_shrink: bool) -> Mask | None:
    """Return a zone that can be cut off, by adding faces and, for `MOST_ROUNDS` rounds, removing some."""
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
        elif may_shrink and attempt < MOST_ROUNDS:
            zone = zone & ~(inside & solid)
        else:
            zone = zone | _around(connectivity, zone)
    return None


def _around(connectivity: Connectivity, zone: Mask) -> Mask:
    """Return the faces adjacent to two or more of a zone or, if there are none, all adjacent to it."""
    pairs = connectivity.edge_faces
    beside_zone = [pairs[zone[pairs[:, other]], 1 - other] for other in (0, 1)]
    count = np.bincount(np.concatenate(beside_zone), minlength=len(zone))
    beside = (count > 0) & ~zone
    between = beside & (count > 1)
    return between if between.any() else beside


def _narrow(connectivity: Connectivity, zone: Mask) -> tuple[Mask, Mask]:
    """Return the faces inside and outside that an outline visits twice, or that are fewer than three along it."""
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
