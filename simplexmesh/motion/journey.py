"""A mesh on its way to the data: as it is now, how it moves, and what was done to it so far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Stage, evolved
from simplexmesh.motion.plan import TopologyRecord
from simplexmesh.motion.state import State, Target


@dataclass
class Journey:
    """A mesh on its way, and what happened to it so far.

    Attributes
    ----------
    mesh : SimplexMesh
        As it is now.
    target : Target
        What it is drawn to.
    watch : callable, optional
        Called with the share of the way done.
    history : list of State
        One per iteration.
    record : TopologyRecord
        What was changed.
    converged : bool
        Whether the last motion came to rest.
    interrupted : bool
        Whether the way was left unfinished (Ctrl-C).
    refuge : SimplexMesh, optional
        A mesh of the same faces, near the data and not tangled, when one is known.
    """

    mesh: SimplexMesh
    target: Target
    watch: Callable[[float], None] | None = None
    history: list[State] = field(default_factory=list)
    record: TopologyRecord = field(default_factory=TopologyRecord)
    converged: bool = False
    interrupted: bool = False
    refuge: SimplexMesh | None = None

    def move(self, *stages: Stage, share: tuple[float, float] = (0.0, 1.0)) -> None:
        """Move through stages, which are `share` of the whole way.

        Raises
        ------
        KeyboardInterrupt
            When interrupted; the mesh is its last whole state.
        """
        low, high = share
        watch = self.watch or (lambda part: None)
        course = evolved(self.mesh, self.target, stages, watch=lambda part: watch(low + part * (high - low)))
        self.mesh, self.converged = course.mesh, course.converged
        self.history += course.history
        if course.interrupted:
            raise KeyboardInterrupt

    def noted(self, **changes: Any) -> None:
        """Write down what was done."""
        self.record = replace(self.record, **changes)

    def counted(self, **numbers: int) -> None:
        """Add to what was counted."""
        self.noted(**{name: getattr(self.record, name) + number for name, number in numbers.items()})
