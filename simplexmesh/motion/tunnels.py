"""Wrapping with changes of genus: pairs of films that meet are opened and joined to handles."""

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
    JoinedFilms,
    boundary_loops,
    closest_faces,
    face_fractions,
    meeting_films,
    without_boundary,
)
from simplexmesh.motion.handles import HandleProposal, add_handles, checked, measured_pair
from simplexmesh.motion.holes import open_holes, refusal
from simplexmesh.motion.tunnel_homology import independent
from simplexmesh.motion.wrap import Samples, Wrapping
from simplexmesh.motion.zones import face_components, without_islands

Indices = NDArray[np.int64]

ITERATIONS, MAX_ITERATIONS = 16, 640
"""Iterations of wrapping per turn, between searches for films that meet, and in total."""

TURNS_AFTER = 24
"""Minimum number of turns after a handle of known homology, for the rest of its films to retract."""

RESTING, STILL = 5, 0.03
"""The mesh is at rest when the number of free vertices varies by less than this fraction, or that of 50, in 5 turns."""

RELAXATION = 48
"""Iterations without pressure at the end."""

DISTANCE, DIFFERENCE, ANGLE = 1.5, 0.6, float(np.radians(60.0))
"""Limits of `add_handles` for two openings, which need not be at their final positions."""

SMALL = 12
"""Maximum number of faces of a film that, when it cannot be cut off, is joined by a single face."""

EDGES_AROUND, MOST_FINER = 18.0, 8.0
"""Number of edges wanted around known tunnels, for films to fit, and the largest factor on the vertices to get it."""

GROWTH, ALLOWANCE = 1.3, 20
"""Limit of the number of free vertices once all handles exist, relative to the fewest so far, plus a constant."""

DEEP = 40.0
"""Maximum distance of openings over one tunnel of known homology, in radii."""

LEAST_KNOWN = 0.1
"""Minimum fraction of the smaller film's vertices that meet the other film over a tunnel of known homology."""


@dataclass(frozen=True, eq=False)
class Tunneled:
    """A mesh wrapped around data, with handles.

    Attributes
    ----------
    mesh : SimplexMesh
    proposals : tuple of HandleProposal
        Pairs of films that met, each accepted or with a reason for refusal; faces are indices at that time.
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
    """Wrap a closed mesh around data and add the handles of the data.

    Parameters
    ----------
    start : SimplexMesh
        A closed mesh that encloses the data.
    samples : Samples
        Points on closed data.
    vertices : int
        Approximate number of vertices of the result.
    accept : callable, optional
        Called with each proposal; returns True to accept, False or a reason to refuse.
    watch : callable, optional
        Called every few iterations with the mesh and the number of handles so far.

    Returns
    -------
    Tunneled

    References
    ----------
    H. Delingette, thesis, 1994, sections 5.4.1 and 5.4.2. There the user brings films over both ends of a tunnel close
    together; here pressure does.
    """
    tunneling = _Tunneling(start, samples, _check.integer("vertices", vertices, 20), accept, watch)
    tunneling.run()
    tunneling.relax()
    return Tunneled(tunneling.wrapping.mesh, (*tunneling.joined, *tunneling.refused))


class _Tunneling:
    """State of `tunneled`: alternates turns of wrapping with joining of films that meet."""

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
        self.wrapping = Wrapping(start, samples, _vertices_for_tunnels(vertices, edge, samples))
        self.accept = None if accept is None else _AcceptOnce(accept)
        self.watch = None if watch is None else lambda mesh: watch(mesh, len(self.joined))
        self.joined: list[HandleProposal] = []
        self.refused: list[HandleProposal] = []
        self.known = JoinedFilms()
        self.turns_left = MAX_ITERATIONS // ITERATIONS
        self.counts: list[int] = []  # free vertices after each turn since the last handle
        self.joined_partially = False
        self.fewest, self.best = np.inf, self.wrapping.mesh

    def run(self) -> None:
        """Alternate wrapping and joining until the mesh is at rest or the turns are used up."""
        while self.turns_left and self._turn():
            pass

    def relax(self) -> None:
        """Iterate without pressure, towards the number of vertices wanted."""
        for _ in range(RELAXATION // ITERATIONS):
            self.wrapping.set_target_count(self.vertices)
            self.wrapping.run(ITERATIONS, press=False, watch=self.watch)

    def _turn(self) -> bool:
        """Wrap for one turn and join films that meet; return whether to continue."""
        self.turns_left -= 1
        self.wrapping.run(ITERATIONS, watch=self.watch)
        self.counts.append(int(self.wrapping.free.sum()))
        self.refused = []
        enough = self.samples.genus is not None and self.wrapping.mesh.genus >= self.samples.genus
        self.wrapping.complete = enough and self.joined_partially
        if self._grows():
            self.wrapping.replace_mesh(self.best)
            return False
        if not enough:
            self._join_meeting_films()
        if self.accept is not None and self.accept.refused:
            self.turns_left = min(self.turns_left, RESTING)  # films that are to stay are not pressed forever
        return (self.turns_left > 0 and not self._at_rest()) or self._join_over_known_tunnel()

    def _grows(self) -> bool:
        """Return whether an inverted part grows once all handles exist; record the best mesh so far."""
        if self.wrapping.complete and self.counts[-1] <= self.fewest:
            self.fewest, self.best = self.counts[-1], self.wrapping.mesh
        return self.wrapping.complete and self.counts[-1] > GROWTH * self.fewest + ALLOWANCE

    def _at_rest(self) -> bool:
        recent = self.counts[-RESTING:]
        return len(recent) == RESTING and max(recent) - min(recent) <= STILL * max(max(recent), 50)

    def _join_meeting_films(self) -> None:
        """Join the first two films that meet and may be joined; this renumbers faces."""
        wrapping, homology = self.wrapping, self.samples.homology
        for meeting in meeting_films(wrapping, LEAST_SHARE if homology is None else LEAST_KNOWN):
            found = None if homology is None else self.known.handle_class(wrapping, homology, meeting)
            if homology is not None and found is None:
                continue
            if meeting.share < LEAST_SHARE:
                parts = zip(meeting.films, (meeting.one, meeting.other), strict=True)
                one, other = (without_boundary(wrapping.mesh, *sides) for sides in parts)
                mesh, proposal = _joined(wrapping.mesh, one, other, self.accept, (DEEP, 1.0, float(np.pi)))
            else:
                mesh, proposal = _joined(wrapping.mesh, meeting.one, meeting.other, self.accept)
            if not proposal.accepted:
                self.refused.append(proposal)
                continue
            if found is not None:
                self.known.add(*found)
            self.joined_partially |= meeting.share < LEAST_SHARE
            winding = None if found is None else found[0]
            self._take(mesh, replace(proposal, winding=winding), left=0 if homology is None else TURNS_AFTER)
            return

    def _join_over_known_tunnel(self) -> bool:
        """Join two films over one tunnel of known homology; return whether there were any."""
        mesh, proposal = _joined_over_known_tunnel(self.wrapping, self.accept, self.known)
        if proposal is None:
            return False
        self._take(mesh, proposal, left=2 * RESTING)
        return True

    def _take(self, mesh: SimplexMesh, proposal: HandleProposal, *, left: int) -> None:
        self.joined.append(proposal)
        self.wrapping.replace_mesh(mesh)
        self.counts.clear()
        self.turns_left = max(self.turns_left, left)


def _vertices_for_tunnels(vertices: int, edge: float, samples: Samples) -> int:
    """Return the number of vertices for films to fit through the known tunnels, except those that need too many."""
    if samples.homology is None:
        return vertices
    needed = [vertices * (edge * EDGES_AROUND / loop.length) ** 2 for loop in samples.homology.tunnels]
    return int(max([n for n in needed if n <= MOST_FINER * vertices] + [vertices]))


def _joined_over_known_tunnel(
    wrapping: Wrapping, accept: Callable[[HandleProposal], Any] | None, known: JoinedFilms
) -> tuple[SimplexMesh, HandleProposal | None]:
    """Join two films over one tunnel of known homology, however deep it is, and add it to `known`."""
    homology = wrapping.samples.homology
    if homology is None:
        return wrapping.mesh, None
    c = wrapping.mesh.connectivity
    seen: list[tuple[Indices, Indices]] = []
    for piece in sorted(face_components(c, face_fractions(c, wrapping.free) > 0.5), key=np.count_nonzero, reverse=True):
        film = np.flatnonzero(without_islands(c, piece, int(np.count_nonzero(~piece)) // 2))
        lines = boundary_loops(wrapping.mesh, film)
        winding = homology.winding(wrapping.mesh.vertices[lines[0]], wrapping.edge) if lines else None
        if winding is None or not independent(known.windings, winding):
            continue
        for other, before in seen:
            if (before != winding).any() and (before != -winding).any():
                continue
            mesh, proposal = _joined(wrapping.mesh, other, film, accept, (DEEP, 1.0, float(np.pi)))
            if proposal.accepted:
                known.add(winding, [winding, -winding])
                return mesh, replace(proposal, winding=winding)
        seen.append((film, winding))
    return wrapping.mesh, None


class _AcceptOnce:
    """Calls `accept` once for each place: a pair of films that is refused meets again every turn."""

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
    limits: tuple[float, float, float] = (DISTANCE, DIFFERENCE, ANGLE),
) -> tuple[SimplexMesh, HandleProposal]:
    """Open two sets of faces, one hole each, and join the holes."""
    distance, difference, angle = limits
    opened = open_holes(mesh, zones=[one, other]).mesh
    if opened.n_holes == 2 and opened.n_components == mesh.n_components:
        out = add_handles(opened, distance=distance, difference=difference, angle=angle, accept=accept)
        (proposal,) = out.proposals
        if proposal.accepted or "edge" not in proposal.reason:
            return out.mesh, proposal
    if opened.n_components > mesh.n_components and min(len(one), len(other)) > SMALL:
        pair = closest_faces(mesh, one, other)
        return mesh, replace(measured_pair(mesh, *pair, None), reason="a film cannot be cut off in one piece")
    pair = closest_faces(mesh, one, other)  # films too small to be cut off are joined by single faces
    proposal = checked(measured_pair(mesh, *pair, None), *limits)
    if proposal.reason:
        return mesh, proposal
    out = add_handles(mesh, pairs=[pair], accept=accept)
    return out.mesh, out.proposals[0]
