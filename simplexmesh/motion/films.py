"""Films: parts of a mesh being wrapped that lie on no data. Which of them meet, and around which tunnels they hang."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.walls import Walls, independent
from simplexmesh.motion.wrap import Wrapping, grown
from simplexmesh.motion.zones import connected, without_islands

Indices = NDArray[np.int64]

FEWEST_LINKS = 4
"""Vertices that must meet between two films."""

LEAST_SHARE = 0.5
"""Of the smaller film's vertices, at least so many must meet the other one."""

LOOSE = 3
"""Faces on data that a film may enclose: more are a bar of the data that it hangs around."""

MANY = 10
"""Of more films joined to each other, the sums of some are not looked at."""

WIDENED = 4
"""Times a film is tried, one ring of faces wider each, to tell how its edges run."""

NEARLY = 0.8
"""Of a line near data, so many vertices have some near."""


@dataclass(frozen=True, eq=False)
class Meeting:
    """Two films that meet back to back.

    Attributes
    ----------
    one, other : (k,) array of int
        The faces of each where they meet.
    films : tuple of two arrays of int
        All faces of each film.
    share : float
        How many of the smaller film's vertices meet the other film.
    """

    one: Indices
    other: Indices
    films: tuple[Indices, Indices]
    share: float

    @property
    def faces(self) -> int:
        """Of the smaller part that meets."""
        return min(len(self.one), len(self.other))


def free_share(wrapping: Wrapping) -> NDArray[np.float64]:
    """Return (f,) how many of each face's vertices are free, 0 to 1."""
    c = wrapping.mesh.connectivity
    of_corner = np.repeat(np.arange(len(c.face_sizes)), c.face_sizes)
    return np.asarray(np.bincount(of_corner, wrapping.free[c.face_vertices]) / c.face_sizes)


def meeting_films(wrapping: Wrapping, share: float = LEAST_SHARE) -> list[Meeting]:
    """Return pairs of films that meet back to back across no data, those that meet most first.

    A film is a connected set of faces that do not sit on data. The two are different films: two sides of one flap meet
    as well, but no tunnel is there.

    Parameters
    ----------
    wrapping : Wrapping
    share : float
        Of the smaller film's vertices, at least so many must meet the other one, and half of them any other.
    """
    c = wrapping.mesh.connectivity
    sizes = c.face_sizes
    of_corner = np.repeat(np.arange(len(sizes)), sizes)
    free = free_share(wrapping)
    film, loose = np.full(len(sizes), -1), np.full(len(sizes), -1)
    for k, piece in enumerate(connected(c, free > 0.5)):
        film[piece] = k
    for k, piece in enumerate(connected(c, free > 0.0)):
        loose[piece] = k
    on = film[c.vertex_faces].max(axis=1)
    ahead = np.where((wrapping.meets >= 0) & (on >= 0), on[wrapping.meets], -1)
    ahead = np.where(ahead == on, -1, ahead)
    links = np.stack([on, ahead], axis=1)[ahead >= 0]
    if not len(links):
        return []
    pairs, counts = np.unique(np.sort(links, axis=1), axis=0, return_counts=True)
    whole = np.bincount(on[on >= 0], minlength=film.max() + 1)
    meeting = np.bincount(links[:, 0], minlength=len(whole)) + np.bincount(links[:, 1], minlength=len(whole))
    out = []
    for k in np.argsort(-counts, kind="stable"):
        a, b = pairs[k].tolist()
        if wrapping.samples.walls is None and loose[film == a][0] == loose[film == b][0]:
            continue  # one film, all but cut in two where it is narrow
        small = a if whole[a] < whole[b] else b
        if counts[k] < max(FEWEST_LINKS, share * whole[small]) or meeting[small] < LEAST_SHARE * whole[small]:
            continue
        sides, spans, alone, rings = [], True, True, False
        for mine, other in ((a, b), (b, a)):
            linked = (on == mine) & (ahead == other)
            part = np.bincount(of_corner, linked[c.face_vertices], minlength=len(sizes)) / sizes
            inside = (film == mine) & (part >= 0.5)
            if not inside.any():
                inside = (film == mine) & (part == np.where(film == mine, part, 0).max())
            piece = max(connected(c, inside), key=np.count_nonzero)
            inside = without_islands(c, piece, int(np.count_nonzero(~piece)) // 2)
            rings |= bool(np.count_nonzero(inside & (film == -1)) > LOOSE)
            spans &= bool((linked & ~wrapping.close).any())
            around = on[grown(on == mine, wrapping.mesh.neighbors, 3)]
            alone &= not ((around >= 0) & (around != a) & (around != b)).any()
            sides.append(np.flatnonzero(inside))
        if (spans or alone) and not rings:  # else a scrap on the wall beside a film, or a ring around what sits on data
            films = np.flatnonzero(film == a), np.flatnonzero(film == b)
            out.append(Meeting(sides[0], sides[1], films, float(counts[k] / whole[small])))
    return out


class Joined:
    """Which films were joined so far, by how they run around the data's tunnels.

    Films that hang together by handles already get no more between them: that would be a handle through one film.

    Attributes
    ----------
    windings : list of (2 g,) arrays of int
        One for each handle, none a sum of others.
    """

    def __init__(self) -> None:
        self.windings: list[Indices] = []
        self._groups: list[list[Indices]] = []

    def asked(self, wrapping: Wrapping, walls: Walls, meeting: Meeting) -> tuple[Indices, list[Indices]] | None:
        """Return the winding of a handle between films that meet, and those of the films; None when there is none.

        All edges of one film together tell how it hangs: between them and where the films meet there is nothing but
        film. Where a film's do not, the edge of the part that meets does, if it is near data.
        """
        places = wrapping.mesh.vertices
        found = [_total(wrapping, walls, film) for film in meeting.films]
        totals = [total for total in found if total is not None]
        groups = [self._group(total) for total in totals]
        if len(groups) == 2 and groups[0] == groups[1] != -1:
            return None
        for total in totals:
            if independent(self.windings, total):
                return total, totals
        for film in sorted((meeting.one, meeting.other), key=len, reverse=True):
            lines = edges_of(wrapping.mesh, film)
            if lines and wrapping.close[lines[0]].mean() > NEARLY:
                winding = walls.winding(places[lines[0]], wrapping.edge)
                if winding is not None and independent(self.windings, winding):
                    return winding, [winding, -winding]
        return None

    def note(self, winding: Indices, films: list[Indices]) -> None:
        """Write down a handle between films."""
        self.windings.append(winding)
        groups = {self._group(film) for film in films} - {-1}
        new = [film for film in films if film.any() and self._group(film) == -1]
        merged = [one for k in sorted(groups) for one in self._groups[k]] + new
        self._groups = [group for k, group in enumerate(self._groups) if k not in groups] + [merged]

    def _group(self, total: Indices) -> int:
        """Return which films joined before those with such edges are, -1 for others."""
        if total.any():
            for k, group in enumerate(self._groups):
                if tuple(total.tolist()) in _sums(group):
                    return k
        return -1


def _total(wrapping: Wrapping, walls: Walls, film: Indices) -> Indices | None:
    """Return how all edges of a film together run around the data's tunnels, None when they do not tell.

    The film is widened until its edges are near data: in the middle of a tunnel they are as near to all its sides.
    """
    mesh = wrapping.mesh
    pairs = mesh.connectivity.edge_faces
    inside = np.zeros(len(mesh.connectivity.face_sizes), bool)
    inside[film] = True
    for _ in range(WIDENED):
        lines = edges_of(mesh, np.flatnonzero(inside))
        if lines and all(wrapping.close[line].mean() > NEARLY for line in lines):
            windings = [walls.winding(mesh.vertices[line], wrapping.edge) for line in lines]
            told = [winding for winding in windings if winding is not None]
            if len(told) == len(windings):
                return np.asarray(np.sum(told, axis=0))
        inside[pairs[inside[pairs].any(axis=1)].ravel()] = True
    return None


def _sums(group: list[Indices]) -> set[tuple[int, ...]]:
    """Return the sums of some of the windings, of all or one of them where they are many."""
    if len(group) > MANY:
        return {tuple(one.tolist()) for one in [*group, np.sum(group, axis=0)]}
    out = {(0,) * len(group[0])} if group else set()
    for one in group:
        out |= {tuple(np.add(before, one).tolist()) for before in out}
    return out


def edges_of(mesh: SimplexMesh, film: Indices) -> list[Indices]:
    """Return the closed lines between a set of faces and the others, by their vertices in order, the longest first."""
    c = mesh.connectivity
    inside = np.zeros(len(c.face_sizes), bool)
    inside[film] = True
    twin, face = c.twin.ravel(), c.face.ravel()
    border = inside[face] & ~inside[face[twin]]
    ahead = {int(a): int(b) for a, b in zip(np.flatnonzero(border) // 3, twin[border] // 3, strict=True)}
    lines = []
    while ahead:
        start, vertex = next(iter(ahead.items()))
        line = [start]
        del ahead[start]
        while vertex in ahead:
            line.append(vertex)
            vertex = ahead.pop(vertex)
        lines.append(np.array(line, np.int64))
    return sorted(lines, key=len, reverse=True)


def closest_faces(mesh: SimplexMesh, one: Indices, other: Indices) -> tuple[int, int]:
    """Return the two faces, one of each set, whose centroids are closest."""
    c = mesh.connectivity
    middles = face_centroids(mesh.vertices, c.face_vertices, c.face_offsets)
    apart = np.linalg.norm(middles[one][:, None] - middles[other][None], axis=2)
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return int(one[i]), int(other[j])


def all_but_edge(mesh: SimplexMesh, film: Indices, part: Indices) -> Indices:
    """Return a film without the faces along its edge, to be opened as one, or a part of it when it has several edges.

    What is left of a film around an opening retracts slowly.
    """
    c = mesh.connectivity
    if len(edges_of(mesh, film)) > 1:
        return part
    inside = np.zeros(len(c.face_sizes), bool)
    inside[film] = True
    pairs = c.edge_faces
    inner = inside.copy()
    inner[pairs[inside[pairs].sum(axis=1) == 1].ravel()] = False
    if not inner.any():
        return part
    piece = max(connected(c, inner), key=np.count_nonzero)
    piece = without_islands(c, piece, int(np.count_nonzero(~piece)) // 2)
    return part if np.count_nonzero(piece & ~inside) > LOOSE else np.flatnonzero(piece)
