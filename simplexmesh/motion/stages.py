"""The coarse-to-fine schedule of a reconstruction: decreasing rigidity and reach."""

from __future__ import annotations

import numpy as np

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Stage, mean_edge
from simplexmesh.motion.subjects import Subject


def stages_for(
    start: SimplexMesh, subject: Subject, iterations: int, rigidity: int, adaptation: float, *, cell: float | None
) -> list[Stage]:
    """Return the stages: three for a start near the data, five for one far from it.

    Parameters
    ----------
    start : SimplexMesh
    subject : Subject
    iterations, rigidity, adaptation
        Those of the fine stage.
    cell : float, optional
        Grid spacing of the automatic start, in the data's unit; None for a start far from the data.

    Returns
    -------
    list of Stage
    """
    radius = 0.5 * float(np.linalg.norm(np.ptp(subject.points, axis=0)))
    edge = mean_edge(start)
    last = max(2 * subject.resolution, edge)
    if cell is not None:
        error = max(subject.resolution, cell, min(1.2 * edge, 1.5 * subject.resolution))  # few vertices are farther off
        near = 1.25 * error if subject.encloses else max(3 * subject.resolution, 2 * edge)
        reach = min(near, 0.2 * radius)
        return [
            Stage(rigidity=max(2, rigidity), reach=reach, iterations=40, beta=0.2),
            Stage(rigidity=rigidity, reach=reach, iterations=iterations, beta=0.4, adaptation=adaptation),
            Stage(rigidity=rigidity, reach=min(last, reach), iterations=iterations // 2, beta=0.4),
        ]
    return [
        Stage(rigidity=max(20, rigidity), reach=2.0 * radius, iterations=150, alpha=0.5, beta=0.03),
        Stage(rigidity=max(10, rigidity), reach=0.8 * radius, iterations=60, alpha=0.5, beta=0.05),
        Stage(rigidity=max(6, rigidity), reach=0.4 * radius, iterations=100, beta=0.1),
        Stage(rigidity=rigidity, reach=0.16 * radius, iterations=iterations, beta=0.3, adaptation=adaptation),
        Stage(rigidity=rigidity, reach=last, iterations=iterations // 2, beta=0.4),
    ]
