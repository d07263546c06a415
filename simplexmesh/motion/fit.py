"""A fit in progress: the present mesh, its target, and the record of what was done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Stage, evolved
from simplexmesh.motion.plan import TopologyRecord
from simplexmesh.motion.state import State, Target


@dataclass
class Fit:
    """A fit in progress, changed in place by the steps of `topology_adapt`.

    Attributes
    ----------
    mesh : SimplexMesh
        The present mesh.
    target : Target
        The data that attracts it.
    watch : callable, optional
        Called with the fraction done, 0 to 1.
    history : list of State
        One per iteration.
    record : TopologyRecord
        The changes of topology and refinement.
    converged : bool
        Whether the last motion came to rest.
    interrupted : bool
        Whether the fit was interrupted (Ctrl-C).
    fallback : SimplexMesh, optional
        An untangled mesh of the same connectivity near the data, when one is known.
    """

    mesh: SimplexMesh
    target: Target
    watch: Callable[[float], None] | None = None
    history: list[State] = field(default_factory=list)
    record: TopologyRecord = field(default_factory=TopologyRecord)
    converged: bool = False
    interrupted: bool = False
    fallback: SimplexMesh | None = None

    def move(self, *stages: Stage, share: tuple[float, float] = (0.0, 1.0)) -> None:
        """Move through stages; `share` is the interval of the fraction done that they take.

        Raises
        ------
        KeyboardInterrupt
            When interrupted; the mesh is then the last complete state.
        """
        low, high = share
        watch = self.watch or (lambda part: None)
        motion = evolved(self.mesh, self.target, stages, watch=lambda part: watch(low + part * (high - low)))
        self.mesh, self.converged = motion.mesh, motion.converged
        self.history += motion.history
        if motion.interrupted:
            raise KeyboardInterrupt

    def update_record(self, **changes: Any) -> None:
        """Replace fields of the record."""
        self.record = replace(self.record, **changes)

    def add_to_record(self, **numbers: int) -> None:
        """Add to counts in the record."""
        self.update_record(**{name: getattr(self.record, name) + number for name, number in numbers.items()})
