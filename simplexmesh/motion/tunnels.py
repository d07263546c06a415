"""From a sphere to the right number of tunnels: wrap, open films that meet in pairs, join them, and wrap on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.films import (
    LEAST_SHARE,
    Joined,
    all_but_edge,
    closest_faces,
    edges_of,
    free_share,
    meeting_films,
)
from simplexmesh.motion.handles import HandleProposal, add_handles, judged, proposed
from simplexmesh.motion.holes import open_holes, refusal
from simplexmesh.motion.walls import independent
from simplexmesh.motion.wrap import Samples, Wrapping
from simplexmesh.motion.zones import connected, without_islands

Indices = NDArray[np.int64]

TURN, AT_MOST = 16, 640
"""Iterations between two looks at which films meet, and at most."""

AFTER = 24
"""Turns left at least after a handle that the data knows of: all else of its films retracts."""

RESTING, STILL = 5, 0.03
"""The mesh rests when in so many turns no larger part of the free vertices, or of 50, sat down or rose."""

CALM = 48
"""Iterations without pressing at the end."""

APART, DIFFERENCE, ANGLE = 1.5, 0.6, float(np.radians(60.0))
"""How far the two openings may be from each other's place, size and plane; they need not be in their final place."""

SMALL = 12
"""A film of no more faces that cannot be cut off is joined by one of them."""

AROUND, FINER = 18.0, 8.0
"""Edges around a tunnel that a film fits through; how many times more vertices it may have on the way for that."""

GROWN, SOME = 1.3, 20
"""With all handles there, the free vertices become fewer: no more than so many times the fewest, and so many."""

DEEP = 40.0
"""How far apart openings over one known tunnel may be, in radii."""

LEAST_KNOWN = 0.1
"""Of the smaller film's vertices, so many must meet the other one where the data tells that a tunnel is there."""


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
    tunneling = _Tunneling(start, samples, _check.integer("vertices", vertices, 20), accept, watch)
    tunneling.run()
    tunneling.calm()
    return Tunneled(tunneling.wrapping.mesh, (*tunneling.joined, *tunneling.refused))


class _Tunneling:
    """A mesh on its way to the tunnels of the data: it wraps for a turn, then films that meet are joined."""

    def __init__(
        self,
        start: SimplexMesh,
        samples: Samples,
        vertices: int,
        accept: Callable[[HandleProposal], Any] | None,
        watch: Callable[[SimplexMesh, int], None] | None,
    ) -> None:
        edge = Wrapping(start, samples, vertices).edge
        self.samples, self.vertices = samples, vertices
        self.wrapping = Wrapping(start, samples, _enough(vertices, edge, samples))
        self.asked = None if accept is None else _Once(accept)
        self.look = None if watch is None else lambda mesh: watch(mesh, len(self.joined))
        self.joined: list[HandleProposal] = []
        self.refused: list[HandleProposal] = []
        self.known = Joined()
        self.left = AT_MOST // TURN
        self.counts: list[int] = []  # free vertices after each turn since the last handle
        self.in_parts = False
        self.fewest, self.best = np.inf, self.wrapping.mesh

    def run(self) -> None:
        """Wrap until all handles are there and the mesh rests, or there is no more time."""
        while self.left and self._turn():
            pass

    def calm(self) -> None:
        """Let go of the films, at the number of vertices that was wanted."""
        for _ in range(CALM // TURN):
            self.wrapping.aim(self.vertices)
            self.wrapping.run(TURN, press=False, watch=self.look)

    def _turn(self) -> bool:
        """Wrap for a turn and join what meets; return whether to go on."""
        self.left -= 1
        self.wrapping.run(TURN, watch=self.look)
        self.counts.append(int(self.wrapping.free.sum()))
        self.refused = []
        enough = self.samples.genus is not None and self.wrapping.mesh.genus >= self.samples.genus
        self.wrapping.complete = enough and self.in_parts
        if self._swells():
            self.wrapping.took(self.best)
            return False
        if not enough:
            self._join_what_meets()
        if self.asked is not None and self.asked.refused:
            self.left = min(self.left, RESTING)  # films that stay are not pressed for ever
        return (self.left > 0 and not self._rests()) or self._join_across()

    def _swells(self) -> bool:
        """Return whether something was turned inside out and grows, with all handles there; note the best so far."""
        if self.wrapping.complete and self.counts[-1] <= self.fewest:
            self.fewest, self.best = self.counts[-1], self.wrapping.mesh
        return self.wrapping.complete and self.counts[-1] > GROWN * self.fewest + SOME

    def _rests(self) -> bool:
        recent = self.counts[-RESTING:]
        return len(recent) == RESTING and max(recent) - min(recent) <= STILL * max(max(recent), 50)

    def _join_what_meets(self) -> None:
        """Join the first two films that meet and may be joined; faces have new numbers then."""
        wrapping, walls = self.wrapping, self.samples.walls
        for meeting in meeting_films(wrapping, LEAST_SHARE if walls is None else LEAST_KNOWN):
            found = None if walls is None else self.known.asked(wrapping, walls, meeting)
            if walls is not None and found is None:
                continue
            if meeting.share < LEAST_SHARE:
                parts = zip(meeting.films, (meeting.one, meeting.other), strict=True)
                one, other = (all_but_edge(wrapping.mesh, *sides) for sides in parts)
                mesh, proposal = _joined(wrapping.mesh, one, other, self.asked, (DEEP, 1.0, float(np.pi)))
            else:
                mesh, proposal = _joined(wrapping.mesh, meeting.one, meeting.other, self.asked)
            if not proposal.accepted:
                self.refused.append(proposal)
                continue
            if found is not None:
                self.known.note(*found)
            self.in_parts |= meeting.share < LEAST_SHARE
            winding = None if found is None else found[0]
            self._take(mesh, replace(proposal, winding=winding), left=0 if walls is None else AFTER)
            return

    def _join_across(self) -> bool:
        """Join two films over one tunnel that the data knows of; return whether there were any."""
        mesh, across = _across(self.wrapping, self.asked, self.known)
        if across is None:
            return False
        self._take(mesh, across, left=2 * RESTING)
        return True

    def _take(self, mesh: SimplexMesh, proposal: HandleProposal, *, left: int) -> None:
        self.joined.append(proposal)
        self.wrapping.took(mesh)
        self.counts.clear()
        self.left = max(self.left, left)


def _enough(vertices: int, edge: float, samples: Samples) -> int:
    """Return how many vertices films need to fit through the tunnels known, those apart that would need too many."""
    if samples.walls is None:
        return vertices
    needed = [vertices * (edge * AROUND / loop.length) ** 2 for loop in samples.walls.tunnels]
    return int(max([n for n in needed if n <= FINER * vertices] + [vertices]))


def _across(
    wrapping: Wrapping, accept: Callable[[HandleProposal], Any] | None, known: Joined
) -> tuple[SimplexMesh, HandleProposal | None]:
    """Join two films over one tunnel of data that knows its tunnels, however deep it is; `known` learns of it."""
    walls = wrapping.samples.walls
    if walls is None:
        return wrapping.mesh, None
    c = wrapping.mesh.connectivity
    seen: list[tuple[Indices, Indices]] = []
    for piece in sorted(connected(c, free_share(wrapping) > 0.5), key=np.count_nonzero, reverse=True):
        film = np.flatnonzero(without_islands(c, piece, int(np.count_nonzero(~piece)) // 2))
        lines = edges_of(wrapping.mesh, film)
        winding = walls.winding(wrapping.mesh.vertices[lines[0]], wrapping.edge) if lines else None
        if winding is None or not independent(known.windings, winding):
            continue
        for other, before in seen:
            if (before != winding).any() and (before != -winding).any():
                continue
            mesh, proposal = _joined(wrapping.mesh, other, film, accept, (DEEP, 1.0, float(np.pi)))
            if proposal.accepted:
                known.note(winding, [winding, -winding])
                return mesh, replace(proposal, winding=winding)
        seen.append((film, winding))
    return wrapping.mesh, None


class _Once:
    """Asks about each handle once: a pair of films refused meets again and again."""

    def __init__(self, accept: Callable[[HandleProposal], Any]) -> None:
        self._accept = accept
        self.refused: list[tuple[HandleProposal, str]] = []

    def __call__(self, proposal: HandleProposal) -> bool | str:
        middle = proposal.centers.mean(axis=0)
        for before, why in self.refused:
            if np.linalg.norm(before.centers.mean(axis=0) - middle) < before.radii.max() + before.distance:
                return why
        reason = refusal(self._accept(proposal))
        if reason:
            self.refused.append((proposal, reason))
        return reason or True


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
        pair = closest_faces(mesh, one, other)
        return mesh, replace(proposed(mesh, *pair, None), reason="a film cannot be cut off in one piece")
    pair = closest_faces(mesh, one, other)  # what cannot be cut off is too small: single faces stand for it
    proposal = judged(proposed(mesh, *pair, None), *limits)
    if proposal.reason:
        return mesh, proposal
    out = add_handles(mesh, pairs=[pair], accept=accept)
    return out.mesh, out.proposals[0]
