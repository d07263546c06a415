"""What refining a mesh answers: the new mesh, where everything went, and what was done in each round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.dividing import Maps, carried_zone, composed
from simplexmesh.motion.settling import Settling

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Round:
    """One round of refinement.

    Attributes
    ----------
    above : int
        Faces with a score above the threshold, before.
    highest : float
        The highest score, before.
    cut, ringed : int
        How many faces were divided in two (T2), and how many got a ring of new faces (T6).
    n_vertices : int
        Vertices after.
    merged : int
        How many pairs of faces were merged (T1), by `redistribute` only.
    swapped : int
        How many edges were swapped (T7) to even out the sizes of faces; not counted in zones.
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
    """A refined mesh, where everything went, and how it came about.

    Attributes
    ----------
    rounds : tuple of Round
        What was done, round by round.
    converged : bool
        Whether in the end no face that may be divided scored above the threshold; of `redistribute`, whether the number
        of vertices is within 1 % of that asked for.
    interrupted : bool
        Whether the refinement was interrupted (Ctrl-C); `mesh` is then its last whole state.
    """

    rounds: tuple[Round, ...] = ()
    converged: bool = False
    interrupted: bool = False

    @property
    def inserted(self) -> int:
        """How many vertices were added; below 0 when some were taken away."""
        return self.mesh.n_vertices - int(self.vertex_map.size)

    def __repr__(self) -> str:
        end = "interrupted" if self.interrupted else "converged" if self.converged else "not converged"
        change = f"{abs(self.inserted)} vertices {'added' if self.inserted >= 0 else 'taken away'}"
        return f"Refined({self.mesh!r}, {change} in {len(self.rounds)} rounds, {end})"


@dataclass
class Ledger:
    """A refinement under way: the mesh as it is, the zone it is limited to, and all that was done.

    After each round the mesh moves, then `watch` is told. An interrupt during the motion leaves the ledger as it was
    before the round.
    """

    mesh: SimplexMesh
    settling: Settling
    zone: Mask | None = None
    watch: Callable[[Round, SimplexMesh], None] | None = None
    rounds: list[Round] = field(default_factory=list)
    converged: bool = False
    interrupted: bool = False

    def __post_init__(self) -> None:
        c = self.mesh.connectivity
        self.maps: Maps = np.arange(c.n_vertices, dtype=np.int32), np.arange(c.face_sizes.size, dtype=np.int32)

    def enter(self, step: Refined) -> None:
        """Let the mesh of one round of edits settle, and keep it."""
        zone = None if self.zone is None else carried_zone(self.zone, step)
        mesh = self.settling.settled(step.mesh, zone)
        self.mesh, self.zone, self.maps = mesh, zone, composed(self.maps, step)
        self.rounds += step.rounds
        if self.watch is not None:
            self.watch(self.rounds[-1], mesh)

    def close(self) -> None:
        """Let the mesh come to rest."""
        self.mesh = self.settling.rested(self.mesh, self.zone)

    def result(self) -> Refined:
        """Return what came out."""
        maps = _check.frozen(self.maps[0]), _check.frozen(self.maps[1])
        return Refined(self.mesh, *maps, tuple(self.rounds), self.converged, self.interrupted)
