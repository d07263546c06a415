"""Stages of a coarse-to-fine motion: their parameters, and when one is at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simplexmesh._base.vectors import norm
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.state import State, Target

STILL, LEVEL = 0.01, 0.02
"""Of the mean edge, the longest step, and of the mean energy, its change, of a motion at rest. A tenth and a quarter of
them take up to three times the iterations, in which vertices slide along the data; with twice the step boundaries of
holes stop halfway."""


@dataclass(frozen=True)
class Stage:
    """One stage of a coarse-to-fine motion; the parameters are those of `DeformableModel`."""

    rigidity: int
    reach: float
    iterations: int
    alpha: float = 0.4
    beta: float = 0.2
    adaptation: float = 0.0

    def model(self, mesh: SimplexMesh, target: Target) -> DeformableModel:
        """Return the model that moves a mesh as this stage wants."""
        return DeformableModel(
            mesh, target, rigidity=self.rigidity, reach=self.reach, alpha=self.alpha, beta=self.beta,
            adaptation=self.adaptation,
        )  # fmt: skip


def mean_edge(mesh: SimplexMesh) -> float:
    """Return the mean length of the edges, in the mesh's unit."""
    ends = mesh.vertices[mesh.connectivity.edge_vertices]
    return float(norm(ends[:, 0] - ends[:, 1]).mean())


def is_at_rest(states: Sequence[State], edge: float) -> bool:
    """Return whether in the last ten of a stage's states no vertex moved by much of an `edge`, or the energy rests.

    It also rests where it is that of vertices that are all so near to their goals (``alpha / 2`` is 0.2): on clean data
    it goes on falling as they slide along the surface.
    """
    if len(states) < 20 or len(states) % 10:
        return False
    if max(state.move for state in states[-10:]) <= STILL * edge:
        return True
    now, then = (float(np.mean([state.energy for state in part])) for part in (states[-10:], states[-20:-10]))
    return now <= 0.2 * (STILL * edge) ** 2 or abs(now - then) <= LEVEL * then
