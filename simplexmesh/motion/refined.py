"""Results of `refine` and `redistribute`: the mesh, vertex and face maps, and a record of each round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.face_edits import Maps, composed_maps, mapped_zone
from simplexmesh.motion.relaxation import Relaxation

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Round:
    """One round of refinement.

    Attributes
    ----------
    above : int
        Number of faces with a score above the threshold, before the round.
    highest : float
        The highest score, before the round.
    cut, ringed : int
        Numbers of faces divided in two (T2), and divided into a ring of faces (T6).
    n_vertices : int
        Number of vertices after the round.
    merged : int
        Number of pairs of faces merged (T1), by `redistribute` only.
    swapped : int
        Number of edges swapped (T7) to even out face sizes; not counted in zones.
    """

    above: int
    highest: float
    cut: int
    ringed: int
    n_vertices: int
    merged: int = 0
    swapped: int = 0


@dataclass(frozen=True, eq=False)
class Refined(Edited):
    """A refined mesh, with vertex and face maps and the record of the rounds.

    Attributes
    ----------
    rounds : tuple of Round
        One per round.
    converged : bool
        Whether no face that may be divided scored above the threshold at the last evaluation; of `redistribute`,
        whether the number of vertices is within 1 % of that requested.
    interrupted : bool
        Whether the refinement was interrupted (Ctrl-C); `mesh` is then the last complete state.
    """

    rounds: tuple[Round, ...] = ()
    converged: bool = False
    interrupted: bool = False

    @property
    def inserted(self) -> int:
        """Number of vertices added; negative when some were removed."""
        return self.mesh.n_vertices - int(self.vertex_map.size)

    def __repr__(self) -> str:
        end = "interrupted" if self.interrupted else "converged" if self.converged else "not converged"
        change = f"{abs(self.inserted)} vertices {'added' if self.inserted >= 0 else 'removed'}"
        return f"Refined({self.mesh!r}, {change} in {len(self.rounds)} rounds, {end})"


@dataclass
class Refinement:
    """A refinement in progress: the present mesh and zone, the accumulated maps, and the rounds done.

    After each round the mesh is relaxed, then `watch` is called. An interrupt during the motion leaves the state before
    the round.
    """

    mesh: SimplexMesh
    relaxation: Relaxation
    zone: Mask | None = None
    watch: Callable[[Round, SimplexMesh], None] | None = None
    rounds: list[Round] = field(default_factory=list)
    converged: bool = False
    interrupted: bool = False

    def __post_init__(self) -> None:
        c = self.mesh.connectivity
        self.maps: Maps = np.arange(c.n_vertices, dtype=np.int32), np.arange(c.face_sizes.size, dtype=np.int32)

    def apply(self, step: Refined) -> None:
        """Relax the mesh of one round of edits and make it the present one."""
        zone = None if self.zone is None else mapped_zone(self.zone, step)
        mesh = self.relaxation.relaxed(step.mesh, zone)
        self.mesh, self.zone, self.maps = mesh, zone, composed_maps(self.maps, step)
        self.rounds += step.rounds
        if self.watch is not None:
            self.watch(self.rounds[-1], mesh)

    def finish(self) -> None:
        """Relax the mesh for the last time."""
        self.mesh = self.relaxation.relaxed(self.mesh, self.zone, final=True)

    def result(self) -> Refined:
        """Return the result record."""
        maps = _check.frozen(self.maps[0]), _check.frozen(self.maps[1])
        return Refined(self.mesh, *maps, tuple(self.rounds), self.converged, self.interrupted)
