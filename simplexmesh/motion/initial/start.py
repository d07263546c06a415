"""What the automatic start gives."""

from __future__ import annotations

from dataclasses import dataclass

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.initial.indicator import Indicator
from simplexmesh.motion.initial.report import StartReport


@dataclass(frozen=True, eq=False)
class Start:
    """A mesh to start the motion from, and what was learned on the way.

    Attributes
    ----------
    mesh : SimplexMesh
        Closed, normals outward, a few cells from the data.
    report : StartReport
        What was found and decided.
    indicator : Indicator or None
        For points: a field on a grid, positive inside, whose gradient points inwards. None for volumes.
    """

    mesh: SimplexMesh
    report: StartReport
    indicator: Indicator | None = None
