"""The result of the automatic initialization."""

from __future__ import annotations

from dataclasses import dataclass

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.initial.indicator import Indicator
from simplexmesh.motion.initial.report import StartReport


@dataclass(frozen=True, eq=False)
class Start:
    """An initial mesh for the motion, with its report.

    Attributes
    ----------
    mesh : SimplexMesh
        Closed, normals outward, a few cells from the data.
    report : StartReport
        What the initialization found and decided.
    indicator : Indicator or None
        For points: indicator function on a grid, positive inside, with inward gradient. None for volumes.
    """

    mesh: SimplexMesh
    report: StartReport
    indicator: Indicator | None = None
