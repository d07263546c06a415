"""Films, the parts of a wrapped mesh that are not on data: which of them meet, and which tunnels they span."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.tunnel_homology import TunnelHomology, independent
from simplexmesh.motion.wrap import Wrapping
from simplexmesh.motion.zones import dilated, face_components, without_islands

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

FEWEST_LINKS = 4
"""Minimum number of vertices of two films that meet."""

LEAST_SHARE = 0.5
"""Minimum fraction of the smaller film's vertices that meet the other film."""

MOST_ENCLOSED = 3
"""Maximum number of faces on data that a film encloses; more are a bar of the data that it surrounds."""

MOST_SUMMED = 10
"""Maximum size of a group of joined films for which all partial sums are computed."""

WIDENINGS = 4
"""Attempts at finding the homology class of a film's boundary, one ring of faces wider each."""

NEARLY = 0.8
"""Minimum fraction of the vertices of a line near data that have data nearby."""


@dataclass(frozen=True, eq=False)
class FilmPair:
    """Two films that meet back to back.

    Attributes
    ----------
    one, other : (k,) array of int
        The faces of each film where they meet.
    films : tuple of two arrays of int
        All faces of each film.
    share : float
        Fraction of the smaller film's vertices that meet the other film.
    """

    one: Indices
    other: Indices
    films: tuple[Indices, Indices]
    share: float


def face_fractions(connectivity: Connectivity, marked: Mask) -> NDArray[np.float64]:
    """Return (f,) the fraction of the vertices of each face that are marked."""
    c = connectivity
    return np.asarray(np.add.reduceat(marked[c.face_vertices].astype(float), c.face_offsets[:-1]) / c.face_sizes)


def meeting_films(wrapping: Wrapping, share: float = LEAST_SHARE) -> list[FilmPair]:
    """Return the pairs of different films that meet back to back, by descending number of vertices that meet.

    A film is a connected set of faces that are not on data. The sides of a flap meet too, but belong to one film.

    Parameters
    ----------
    wrapping : Wrapping
    share : float
        Minimum fraction of the smaller film's vertices that meet the other one; half must meet any other film.
    """
    c = wrapping.mesh.connectivity
    sizes = c.face_sizes
    free = face_fractions(c, wrapping.free)
    film, loose = np.full(len(sizes), -1), np.full(len(sizes), -1)
    for k, piece in enumerate(face_components(c, free > 0.5)):
        film[piece] = k
    for k, piece in enumerate(face_components(c, free > 0.0)):
        loose[piece] = k
    on = film[c.vertex_faces].max(axis=1)
    opposite = np.where((wrapping.meets >= 0) & (on >= 0), on[wrapping.meets], -1)
    opposite = np.where(opposite == on, -1, opposite)
    links = np.stack([on, opposite], axis=1)[opposite >= 0]
    if not len(links):
        return []
    pairs, counts = np.unique(np.sort(links, axis=1), axis=0, return_counts=True)
    whole = np.bincount(on[on >= 0], minlength=film.max() + 1)
    meeting = np.bincount(links[:, 0], minlength=len(whole)) + np.bincount(links[:, 1], minlength=len(whole))
    out = []
    for k in np.argsort(-counts, kind="stable"):
        a, b = pairs[k].tolist()
        if wrapping.samples.homology is None and loose[film == a][0] == loose[film == b][0]:
            continue  # one film with a narrow part
        small = a if whole[a] < whole[b] else b
        if counts[k] < max(FEWEST_LINKS, share * whole[small]) or meeting[small] < LEAST_SHARE * whole[small]:
            continue
        sides, spans, isolated, surrounds = [], True, True, False
        for mine, other in ((a, b), (b, a)):
            linked = (on == mine) & (opposite == other)
            inside = _faces_that_meet(c, film == mine, linked)
            surrounds |= bool(np.count_nonzero(inside & (film == -1)) > MOST_ENCLOSED)
            spans &= bool((linked & ~wrapping.near_data).any())
            around = on[dilated(on == mine, wrapping.mesh.neighbors, 3)]
            isolated &= not ((around >= 0) & (around != a) & (around != b)).any()
            sides.append(np.flatnonzero(inside))
        if (spans or isolated) and not surrounds:  # otherwise a remnant beside a film, or a ring around data
            films = np.flatnonzero(film == a), np.flatnonzero(film == b)
            out.append(FilmPair(sides[0], sides[1], films, float(counts[k] / whole[small])))
    return out


def _faces_that_meet(connectivity: Connectivity, film: Mask, linked: Mask) -> Mask:
    """Return the largest component of the faces of a film with mostly linked vertices, without islands."""
    fraction = face_fractions(connectivity, linked)
    inside = film & (fraction >= 0.5)
    if not inside.any():
        inside = film & (fraction == np.where(film, fraction, 0).max())
    piece = max(face_components(connectivity, inside), key=np.count_nonzero)
    return without_islands(connectivity, piece, int(np.count_nonzero(~piece)) // 2)


class JoinedFilms:
    """The films joined so far, identified by the homology classes of their boundaries.

    Films that are connected by handles already get no more between them: that would be a handle through one film.

    Attributes
    ----------
    windings : list of (2 g,) arrays of int
        Homology class of each handle, linearly independent.
    """

    def __init__(self) -> None:
        self.windings: list[Indices] = []
        self._groups: list[list[Indices]] = []

    def handle_class(
        self, wrapping: Wrapping, homology: TunnelHomology, meeting: FilmPair
    ) -> tuple[Indices, list[Indices]] | None:
        """Return the class of a handle to make between films that meet, and those of the films; None to make none.

        It is the class of the whole boundary of either film, which is homologous to that of the part that meets, or
        where both are unknown or dependent, the class of the boundary of the part that meets, if that is near data.
        """
        places = wrapping.mesh.vertices
        found = [_boundary_class(wrapping, homology, film) for film in meeting.films]
        classes = [boundary for boundary in found if boundary is not None]
        groups = [self._group(boundary) for boundary in classes]
        if len(groups) == 2 and groups[0] == groups[1] != -1:
            return None
        for boundary in classes:
            if independent(self.windings, boundary):
                return boundary, classes
        for film in sorted((meeting.one, meeting.other), key=len, reverse=True):
            lines = boundary_loops(wrapping.mesh, film)
            if lines and wrapping.near_data[lines[0]].mean() > NEARLY:
                winding = homology.winding(places[lines[0]], wrapping.edge)
                if winding is not None and independent(self.windings, winding):
                    return winding, [winding, -winding]
        return None

    def add(self, winding: Indices, films: list[Indices]) -> None:
        """Add a handle between films."""
        self.windings.append(winding)
        groups = {self._group(film) for film in films} - {-1}
        new = [film for film in films if film.any() and self._group(film) == -1]
        merged = [one for k in sorted(groups) for one in self._groups[k]] + new
        self._groups = [group for k, group in enumerate(self._groups) if k not in groups] + [merged]

    def _group(self, boundary: Indices) -> int:
        """Return the index of the group of joined films with such a boundary, -1 for none."""
        if boundary.any():
            for k, group in enumerate(self._groups):
                if tuple(boundary.tolist()) in _subset_sums(group):
                    return k
        return -1


def _boundary_class(wrapping: Wrapping, homology: TunnelHomology, film: Indices) -> Indices | None:
    """Return the homology class of the whole boundary of a film, None when it is undetermined.

    The film is widened until its boundary is near data; in the middle of a tunnel it is equally far from all sides.
    """
    mesh = wrapping.mesh
    pairs = mesh.connectivity.edge_faces
    inside = np.zeros(len(mesh.connectivity.face_sizes), bool)
    inside[film] = True
    for _ in range(WIDENINGS):
        lines = boundary_loops(mesh, np.flatnonzero(inside))
        if lines and all(wrapping.near_data[line].mean() > NEARLY for line in lines):
            windings = [homology.winding(mesh.vertices[line], wrapping.edge) for line in lines]
            known = [winding for winding in windings if winding is not None]
            if len(known) == len(windings):
                return np.asarray(np.sum(known, axis=0))
        inside[pairs[inside[pairs].any(axis=1)].ravel()] = True
    return None


def _subset_sums(group: list[Indices]) -> set[tuple[int, ...]]:
    """Return the sums of all subsets of classes; only of single ones and of all where there are many."""
    if len(group) > MOST_SUMMED:
        return {tuple(one.tolist()) for one in [*group, np.sum(group, axis=0)]}
    out = {(0,) * len(group[0])} if group else set()
    for one in group:
        out |= {tuple(np.add(before, one).tolist()) for before in out}
    return out


def boundary_loops(mesh: SimplexMesh, film: Indices) -> list[Indices]:
    """Return the boundary loops of a set of faces by their vertices in order, the longest first."""
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
    """Return the faces of two sets, one of each, with the closest centroids."""
    c = mesh.connectivity
    middles = face_centroids(mesh.vertices, c.face_vertices, c.face_offsets)
    apart = np.linalg.norm(middles[one][:, None] - middles[other][None], axis=2)
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return int(one[i]), int(other[j])


def without_boundary(mesh: SimplexMesh, film: Indices, part: Indices) -> Indices:
    """Return a film without the faces along its boundary or, if it has several boundary loops, `part`.

    Opening nearly all of a film at once saves time, as remnants around an opening retract slowly.
    """
    c = mesh.connectivity
    if len(boundary_loops(mesh, film)) > 1:
        return part
    inside = np.zeros(len(c.face_sizes), bool)
    inside[film] = True
    pairs = c.edge_faces
    inner = inside.copy()
    inner[pairs[inside[pairs].sum(axis=1) == 1].ravel()] = False
    if not inner.any():
        return part
    piece = max(face_components(c, inner), key=np.count_nonzero)
    piece = without_islands(c, piece, int(np.count_nonzero(~piece)) // 2)
    return part if np.count_nonzero(piece & ~inside) > MOST_ENCLOSED else np.flatnonzero(piece)
