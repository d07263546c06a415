"""The motion between two rounds of edits: a few iterations, folds undone, in all of the mesh or in a zone."""

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

DEFORMING, DRAWING = 0.4, 0.4
"""Weights of the internal force and of the data."""

REST = 40
"""Least number of iterations of the last motion."""


@dataclass(frozen=True)
class Settling:
    """How a mesh moves between rounds of edits.

    Attributes
    ----------
    target : Target
    reach : float
        How far the data is looked for.
    iterations : int
        How many there are in a round; 0 never moves anything.
    adaptation : float
        Strength with which metric parameters follow curvature.
    rigidity : int
        How many edges far curvature is averaged.
    """

    target: Target
    reach: float
    iterations: int
    adaptation: float
    rigidity: int

    @classmethod
    def checked(cls, target: Target, reach: float, *, iterations: int, adaptation: float, rigidity: int) -> Settling:
        """Return it with what a user gave, or say in one sentence what is wrong with that."""
        return cls(
            target,
            reach,
            _check.integer("iterations", iterations, 0),
            _check.number("adaptation", adaptation, 0.0, 0.25),
            _check.integer("rigidity", rigidity, 0, 1000),
        )

    def settled(self, mesh: SimplexMesh, zone: NDArray[np.bool_] | None = None) -> SimplexMesh:
        """Return the mesh after a round's iterations, folds smoothed away; outside a zone of faces nothing moves.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> ball = sm.targets.Triangles(sm.sphere(20).triangulated())
        >>> settling = Settling(ball, reach=0.5, iterations=30, adaptation=0.0, rigidity=1)
        >>> out = settling.settled(sm.sphere(4, radius=0.9))
        >>> bool(abs((out.vertices**2).sum(axis=1) - 1).max() < 0.01)
        True
        """
        return self._moved(mesh, zone, self.iterations, attempts=3) if self.iterations else mesh

    def rested(self, mesh: SimplexMesh, zone: NDArray[np.bool_] | None = None) -> SimplexMesh:
        """Return the mesh after the last motion: longer, and folds attempted more often."""
        return self._moved(mesh, zone, max(self.iterations, REST), attempts=10) if self.iterations else mesh

    def _moved(self, mesh: SimplexMesh, zone: NDArray[np.bool_] | None, iterations: int, attempts: int) -> SimplexMesh:
        free = 1.0 if zone is None else zone[mesh.connectivity.vertex_faces].any(axis=1).astype(float)
        model = DeformableModel(
            mesh,
            self.target,
            rigidity=self.rigidity,
            reach=self.reach,
            alpha=DEFORMING * free,
            beta=DRAWING * free,
            adaptation=self.adaptation,
        )
        for _ in model.run(iterations):
            pass
        if zone is not None:
            return model.mesh
        return untangled(model.mesh, self.target, reach=self.reach, rounds=attempts)[0]


def with_even_metric(step: Edited) -> SimplexMesh:
    """Return the mesh after edits, new vertices with equal metric parameters.

    Interpolated ones would be worthless, as each belongs to one neighbor.
    """
    mesh = step.mesh
    if "metric" not in mesh.data:
        return mesh
    metric = np.full((mesh.n_vertices, 3), 1 / 3)
    kept = step.vertex_map[step.vertex_map >= 0]
    metric[kept] = mesh.data["metric"][kept]
    return mesh.with_data(metric=metric)
