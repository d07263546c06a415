"""From a sphere to the right number of tunnels: wrap, open films that meet in pairs, join them, and wrap on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.handles import HandleProposal, add_handles, judged, proposed
from simplexmesh.motion.holes import open_holes, refusal
from simplexmesh.motion.walls import Walls, independent
from simplexmesh.motion.wrap import Samples, Wrapping, grown
from simplexmesh.motion.zones import connected, without_islands

Indices = NDArray[np.int64]

TURN, AT_MOST = 16, 640
"""Iterations between two looks at which films meet, and at most."""

RESTING, STILL = 5, 0.03
"""The mesh rests when in so many turns no larger part of the free vertices, or of 50, sat down or rose."""

CALM = 48
"""Iterations without pressing at the end."""

FEWEST_LINKS = 4
"""Vertices that must meet between two films."""

APART, DIFFERENCE, ANGLE = 1.5, 0.6, float(np.radians(60.0))
"""How far the two openings may be from each other's place, size and plane; they need not be in their final place."""

SMALL = 12
"""A film of no more faces that cannot be cut off is joined by one of them."""

AROUND, FINER = 18.0, 8.0
"""Edges around a tunnel that a film fits through; how many times more vertices it may have on the way for that."""

DEEP = 40.0
"""How far apart openings over one known tunnel may be, in radii."""

LEAST_SHARE = 0.5
"""Of the smaller film's vertices, at least so many must meet the other one."""


@dataclass(frozen=True, eq=False)
class Tunneled:
    """A mesh wrapped around data, with its tunnels.

    Attributes
    ----------
    mesh : SimplexMesh
    proposals : tuple of HandleProposal
        Pairs of films that met, each joined or with the reason why not; faces as they were then.
    """

    mesh: SimplexMesh
    proposals: tuple[HandleProposal, ...]


def tunneled(
    start: SimplexMesh,
    samples: Samples,
    *,
    vertices: int,
    accept: Callable[[HandleProposal], Any] | None = None,
    watch: Callable[[SimplexMesh, int], None] | None = None,
) -> Tunneled:
    """Wrap a closed mesh around data and give it the handles the data has.

    Parameters
    ----------
    start : SimplexMesh
        Around the data.
    samples : Samples
        The data, closed.
    vertices : int
        About how many the mesh will have.
    accept : callable, optional
        Asked about each handle.
    watch : callable, optional
        Sees the mesh every few iterations, and how many handles were added so far.

    Returns
    -------
    Tunneled

    References
    ----------
    H. Delingette, thesis, 1994, sections 5.4.1 and 5.4.2. There the user sees to it that films over both ends of a
    tunnel lie close together; here they are pressed into each other.
    """
    vertices = _check.integer("vertices", vertices, 20)
    wrapping = Wrapping(start, samples, vertices)
    wrapping = Wrapping(start, samples, _enough(vertices, wrapping.edge, samples))
    joined: list[HandleProposal] = []
    refused: list[HandleProposal] = []
    asked = None if accept is None else _Once(accept)
    left = AT_MOST // TURN
    look = None if watch is None else lambda mesh: watch(mesh, len(joined))
    counts: list[int] = []
    around: list[Indices] = []
    while left:
        left -= 1
        wrapping.run(TURN, watch=look)
        counts.append(int(wrapping.free.sum()))
        refused = []
        enough = samples.genus is not None and wrapping.mesh.genus >= samples.genus
        for one, other in () if enough else meeting_films(wrapping):
            winding = None
            if samples.walls is not None:
                winding = film_winding(wrapping, samples.walls, one, other, around)
                if winding is None:
                    continue
            mesh, proposal = _joined(wrapping.mesh, one, other, asked)
            if proposal.accepted:
                around += [] if winding is None else [winding]
                joined.append(replace(proposal, winding=winding))
                wrapping.took(mesh)
                counts.clear()
                break  # faces have new numbers: look again
            refused.append(proposal)
        if asked is not None and asked.refused:
            left = min(left, RESTING)  # films that stay are not pressed for ever
        recent = counts[-RESTING:]
        rests = len(recent) == RESTING and max(recent) - min(recent) <= STILL * max(max(recent), 50)
        if not rests and left:
            continue
        mesh, found = _across(wrapping, asked, around)
        if found is None:
            break
        joined.append(found)
        wrapping.took(mesh)
        counts.clear()
        left = max(left, 2 * RESTING)
    for _ in range(CALM // TURN):
        wrapping.aim(vertices)
        wrapping.run(TURN, press=False, watch=look)
    return Tunneled(wrapping.mesh, (*joined, *refused))


def _enough(vertices: int, edge: float, samples: Samples) -> int:
    """Return how many vertices films need to fit through the tunnels known, those apart that would need too many."""
    if samples.walls is None:
        return vertices
    needed = [vertices * (edge * AROUND / loop.length) ** 2 for loop in samples.walls.tunnels]
    return int(max([n for n in needed if n <= FINER * vertices] + [vertices]))


def _across(
    wrapping: Wrapping, accept: Callable[[HandleProposal], Any] | None, around: list[Indices]
) -> tuple[SimplexMesh, HandleProposal | None]:
    """Join two films over one tunnel of data that knows its tunnels, however deep it is; `around` learns of it."""
    walls = wrapping.samples.walls
    if walls is None:
        return wrapping.mesh, None
    c = wrapping.mesh.connectivity
    seen: list[tuple[Indices, Indices]] = []
    for piece in sorted(connected(c, free_share(wrapping) > 0.5), key=np.count_nonzero, reverse=True):
        film = np.flatnonzero(without_islands(c, piece, int(np.count_nonzero(~piece)) // 2))
        line = _edge_of(wrapping.mesh, film)
        winding = walls.winding(wrapping.mesh.vertices[line], wrapping.edge) if len(line) else None
        if winding is None or not independent(around, winding):
            continue
        for other, before in seen:
            if (before != winding).any() and (before != -winding).any():
                continue
            mesh, proposal = _joined(wrapping.mesh, other, film, accept, (DEEP, 1.0, float(np.pi)))
            if proposal.accepted:
                around.append(winding)
                return mesh, replace(proposal, winding=winding)
        seen.append((film, winding))
    return wrapping.mesh, None


def free_share(wrapping: Wrapping) -> NDArray[np.float64]:
    """Return (f,) how many of each face's vertices are free, 0 to 1."""
    c = wrapping.mesh.connectivity
    of_corner = np.repeat(np.arange(len(c.face_sizes)), c.face_sizes)
    return np.asarray(np.bincount(of_corner, wrapping.free[c.face_vertices]) / c.face_sizes)


def film_winding(
    wrapping: Wrapping, walls: Walls, one: Indices, other: Indices, known: list[Indices]
) -> Indices | None:
    """Return how the edge of a film runs around the data's tunnels, None unless around one that is not yet known."""
    for film in sorted((one, other), key=len, reverse=True):
        line = _edge_of(wrapping.mesh, film)
        winding = walls.winding(wrapping.mesh.vertices[line], wrapping.edge) if len(line) else None
        if winding is not None and independent(known, winding):
            return winding
    return None


def _edge_of(mesh: SimplexMesh, film: Indices) -> Indices:
    """Return the vertices in order on the longest closed line between a set of faces and the others."""
    c = mesh.connectivity
    inside = np.zeros(len(c.face_sizes), bool)
    inside[film] = True
    twin, face = c.twin.ravel(), c.face.ravel()
    border = inside[face] & ~inside[face[twin]]
    ahead = {int(a): int(b) for a, b in zip(np.flatnonzero(border) // 3, twin[border] // 3, strict=True)}
    longest: list[int] = []
    while ahead:
        start, vertex = next(iter(ahead.items()))
        line = [start]
        del ahead[start]
        while vertex in ahead:
            line.append(vertex)
            vertex = ahead.pop(vertex)
        longest = max(longest, line, key=len)
    return np.array(longest, np.int64)


class _Once:
    """Asks about each handle once: a pair of films refused meets again and again."""

    def __init__(self, accept: Callable[[HandleProposal], Any]) -> None:
        self._accept = accept
        self.refused: list[HandleProposal] = []

    def __call__(self, proposal: HandleProposal) -> bool | str:
        middle = proposal.centers.mean(axis=0)
        for before in self.refused:
            if np.linalg.norm(before.centers.mean(axis=0) - middle) < before.radii.max() + before.distance:
                return False
        reason = refusal(self._accept(proposal))
        if reason:
            self.refused.append(proposal)
        return reason or True


def meeting_films(wrapping: Wrapping) -> list[tuple[Indices, Indices]]:
    """Return pairs of sets of faces that meet back to back across no data, those that meet most first.

    A film is a connected set of faces that do not sit on data. The two are parts of different films: two sides of one
    flap meet as well, but no tunnel is there.
    """
    c = wrapping.mesh.connectivity
    sizes = c.face_sizes
    of_corner = np.repeat(np.arange(len(sizes)), sizes)
    film = np.full(len(sizes), -1)
    for k, piece in enumerate(connected(c, free_share(wrapping) > 0.5)):
        film[piece] = k
    on = film[c.vertex_faces].max(axis=1)
    ahead = np.where((wrapping.meets >= 0) & (on >= 0), on[wrapping.meets], -1)
    ahead = np.where(ahead == on, -1, ahead)
    links = np.stack([on, ahead], axis=1)[ahead >= 0]
    if not len(links):
        return []
    pairs, counts = np.unique(np.sort(links, axis=1), axis=0, return_counts=True)
    whole = np.bincount(on[on >= 0], minlength=film.max() + 1)
    out = []
    for k in np.argsort(-counts, kind="stable"):
        a, b = pairs[k].tolist()
        if counts[k] < max(FEWEST_LINKS, LEAST_SHARE * min(whole[a], whole[b])):
            continue
        sides, spans, alone = [], True, True
        for mine, other in ((a, b), (b, a)):
            linked = (on == mine) & (ahead == other)
            share = np.bincount(of_corner, linked[c.face_vertices], minlength=len(sizes)) / sizes
            inside = (film == mine) & (share >= 0.5)
            if not inside.any():
                inside = (film == mine) & (share == np.where(film == mine, share, 0).max())
            piece = max(connected(c, inside), key=np.count_nonzero)
            inside = without_islands(c, piece, int(np.count_nonzero(~piece)) // 2)
            spans &= bool((linked & ~wrapping.close).any())
            around = on[grown(on == mine, wrapping.mesh.neighbors, 3)]
            alone &= not ((around >= 0) & (around != a) & (around != b)).any()
            sides.append(np.flatnonzero(inside))
        if spans or alone:  # else it is a scrap on the wall beside a film
            out.append((sides[0], sides[1]))
    return out


def _joined(
    mesh: SimplexMesh,
    one: Indices,
    other: Indices,
    accept: Callable[[HandleProposal], Any] | None,
    limits: tuple[float, float, float] = (APART, DIFFERENCE, ANGLE),
) -> tuple[SimplexMesh, HandleProposal]:
    """Open two sets of faces, each to one hole, and join the holes."""
    distance, difference, angle = limits
    opened = open_holes(mesh, zones=[one, other], fewest=2).mesh
    if opened.n_holes == 2 and opened.n_components == mesh.n_components:
        out = add_handles(opened, distance=distance, difference=difference, angle=angle, accept=accept)
        (proposal,) = out.proposals
        if proposal.accepted or "edge" not in proposal.reason:
            return out.mesh, proposal
    if opened.n_components > mesh.n_components and min(len(one), len(other)) > SMALL:
        pair = _closest(mesh, one, other)
        return mesh, replace(proposed(mesh, *pair, None), reason="a film cannot be cut off in one piece")
    pair = _closest(mesh, one, other)  # what cannot be cut off is too small: single faces stand for it
    proposal = judged(proposed(mesh, *pair, None), *limits)
    if proposal.reason:
        return mesh, proposal
    out = add_handles(mesh, pairs=[pair], accept=accept)
    return out.mesh, out.proposals[0]


def _closest(mesh: SimplexMesh, one: Indices, other: Indices) -> tuple[int, int]:
    """Return the two faces, one of each set, whose centroids are closest."""
    from simplexmesh.mesh.face_geometry import face_centroids

    c = mesh.connectivity
    middles = face_centroids(mesh.vertices, c.face_vertices, c.face_offsets)
    apart = np.linalg.norm(middles[one][:, None] - middles[other][None], axis=2)
    i, j = np.unravel_index(int(apart.argmin()), apart.shape)
    return int(one[i]), int(other[j])
