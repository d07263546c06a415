"""Relaxation of a mesh between rounds of edits: a few iterations of motion, then untangling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.state import Target
from simplexmesh.motion.untangle import untangled

ALPHA, BETA = 0.4, 0.4
"""Weights of the internal and of the data force."""

FEWEST_FINAL = 40
"""Minimum number of iterations of the final relaxation."""


@dataclass(frozen=True)
class Relaxation:
    """Parameters of the motion between rounds of edits.

    Attributes
    ----------
    target : Target
    reach : float
        Search distance for data, in its unit.
    iterations : int
        Per round; 0 leaves the mesh where it is.
    adaptation : float
        Strength with which metric parameters are adapted to curvature.
    rigidity : int
        Radius, in edges, over which curvature is averaged.
    """

    target: Target
    reach: float
    iterations: int
    adaptation: float
    rigidity: int

    @classmethod
    def checked(cls, target: Target, reach: float, *, iterations: int, adaptation: float, rigidity: int) -> Relaxation:
        """Return the parameters given by a user, checked."""
        return cls(
            target,
            reach,
            _check.integer("iterations", iterations, 0),
            _check.number("adaptation", adaptation, 0.0, 0.25),
            _check.integer("rigidity", rigidity, 0, 1000),
        )

    def relaxed(self, mesh: SimplexMesh, zone: NDArray[np.bool_] | None = None, *, final: bool = False) -> SimplexMesh:
        """Return the mesh after motion and, where there is no zone, untangling; nothing moves outside a zone of faces.

        The `final` relaxation is longer, with more attempts at untangling.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> ball = sm.targets.Triangles(sm.sphere(20).triangulated())
        >>> relaxation = Relaxation(ball, reach=0.5, iterations=30, adaptation=0.0, rigidity=1)
        >>> out = relaxation.relaxed(sm.sphere(4, radius=0.9))
        >>> bool(abs((out.vertices**2).sum(axis=1) - 1).max() < 0.01)
        True
        """
        if not self.iterations:
            return mesh
        free = 1.0 if zone is None else zone[mesh.connectivity.vertex_faces].any(axis=1).astype(float)
        model = DeformableModel(
            mesh,
            self.target,
            rigidity=self.rigidity,
            reach=self.reach,
            alpha=ALPHA * free,
            beta=BETA * free,
            adaptation=self.adaptation,
        )
        for _ in model.run(max(self.iterations, FEWEST_FINAL) if final else self.iterations):
            pass
        if zone is not None:
            return model.mesh
        return untangled(model.mesh, self.target, reach=self.reach, rounds=10 if final else 3)[0]


def with_even_metric(step: Edited) -> SimplexMesh:
    """Return the mesh after edits, with metric parameters 1/3 at new vertices.

    They cannot be interpolated, as each refers to one neighbor of its vertex.
    """
    mesh = step.mesh
    if "metric" not in mesh.data:
        return mesh
    metric = np.full((mesh.n_vertices, 3), 1 / 3)
    kept = step.vertex_map[step.vertex_map >= 0]
    metric[kept] = mesh.data["metric"][kept]
    return mesh.with_data(metric=metric)
