"""Coarse-to-fine motion in stages, with progress and interruption."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import norm
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.state import State, Target

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """One stage of a coarse-to-fine motion.

    Attributes
    ----------
    rigidity : int
        Radius, in edges, over which curvature is averaged.
    reach : float
        Search distance for data, in its unit.
    iterations : int
        Maximum number.
    alpha, beta : float
        Weights of the internal and of the data force.
    adaptation : float
        Strength with which metric parameters are adapted to curvature.
    """

    rigidity: int
    reach: float
    iterations: int
    alpha: float = 0.4
    beta: float = 0.2
    adaptation: float = 0.0


@dataclass
class Evolution:
    """Result of a motion in stages: the mesh, its history, and whether it converged or was interrupted."""

    mesh: SimplexMesh
    history: list[State] = field(default_factory=list)
    converged: bool = False
    interrupted: bool = False


def mean_edge(mesh: SimplexMesh) -> float:
    """Return the mean length of the edges, in the mesh's unit."""
    ends = mesh.vertices[mesh.connectivity.edge_vertices]
    return float(norm(ends[:, 0] - ends[:, 1]).mean())


def evolved(
    mesh: SimplexMesh,
    target: Target,
    stages: Sequence[Stage],
    *,
    tolerance: float = 5e-3,
    watch: Callable[[float], None] | None = None,
) -> Evolution:
    """Move a mesh through stages.

    A stage ends early at convergence: the mean energy of 10 iterations changed by a fraction of less than `tolerance`,
    or no vertex moved by more than a thousandth of the mean edge in any of them. An interrupt (Ctrl-C) ends the motion
    with the last complete state.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    stages : sequence of Stage
    tolerance : float
        Relative change of energy at convergence.
    watch : callable, optional
        Called with the fraction of the iterations done, 0 to 1.

    Returns
    -------
    Evolution

    Raises
    ------
    DivergedError
        When the motion diverges; with the last valid mesh.
    """
    out = Evolution(mesh)
    total, before = sum(stage.iterations for stage in stages), 0
    for stage in stages:
        out.converged = False
        recent: list[State] = []
        still = 1e-3 * mean_edge(out.mesh)
        model = None
        try:
            model = DeformableModel(
                out.mesh, target, rigidity=stage.rigidity, reach=stage.reach, alpha=stage.alpha, beta=stage.beta,
                adaptation=stage.adaptation,
            )  # fmt: skip
            for state in model.run(stage.iterations):
                out.history.append(state)
                recent.append(state)
                if watch is not None:
                    watch((before + state.iteration) / total)
                if _converged(recent, tolerance, still):
                    out.converged = True
                    break
        except KeyboardInterrupt:
            out.interrupted = True
        if model is not None:
            out.mesh = model.mesh
        before += stage.iterations
        if out.interrupted:
            break
    return out


def _converged(states: list[State], tolerance: float, still: float) -> bool:
    """Return whether the mesh has converged: little motion or change of mean energy in the last ten iterations."""
    if len(states) < 20 or len(states) % 10:
        return False
    if max(state.move for state in states[-10:]) <= still:
        return True
    now, then = (float(np.mean([state.energy for state in part])) for part in (states[-10:], states[-20:-10]))
    return abs(now - then) <= tolerance * max(then, 1e-300)
