"""A motion in stages, from stiff and far-sighted to supple and near-sighted, that can be watched and interrupted."""

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
        How many edges far curvature is averaged.
    reach : float
        How far the data is looked for, in its unit.
    iterations : int
        How many at most.
    alpha, beta : float
        Weight of the internal force and of the data.
    adaptation : float
        Strength with which metric parameters follow curvature.
    """

    rigidity: int
    reach: float
    iterations: int
    alpha: float = 0.4
    beta: float = 0.2
    adaptation: float = 0.0


@dataclass
class Course:
    """What came out of a motion in stages: the mesh, its history, and whether it came to rest or was interrupted."""

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
) -> Course:
    """Move a mesh through stages and return where it came to rest.

    A stage ends early when the mesh rests: over 10 iterations the energy changed by less than `tolerance` of itself, or
    no vertex moved by more than a thousandth of the mean edge at once.
    An interrupt (Ctrl-C) ends the motion with the last whole state.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    stages : sequence of Stage
    tolerance : float
        See above.
    watch : callable, optional
        Called with the share of the iterations done.

    Returns
    -------
    Course

    Raises
    ------
    DivergedError
        With the last good mesh.
    """
    course = Course(mesh)
    total, before = sum(stage.iterations for stage in stages), 0
    for stage in stages:
        course.converged = False
        recent: list[State] = []
        still = 1e-3 * mean_edge(course.mesh)
        model = None
        try:
            model = DeformableModel(
                course.mesh, target, rigidity=stage.rigidity, reach=stage.reach, alpha=stage.alpha, beta=stage.beta,
                adaptation=stage.adaptation,
            )  # fmt: skip
            for state in model.run(stage.iterations):
                course.history.append(state)
                recent.append(state)
                if watch is not None:
                    watch((before + state.iteration) / total)
                if _resting(recent, tolerance, still):
                    course.converged = True
                    break
        except KeyboardInterrupt:
            course.interrupted = True
        if model is not None:
            course.mesh = model.mesh
        before += stage.iterations
        if course.interrupted:
            break
    return course


def _resting(states: list[State], tolerance: float, still: float) -> bool:
    """Return whether the mesh has settled: the last ten iterations moved little, or saved no more energy."""
    if len(states) < 20 or len(states) % 10:
        return False
    if max(state.move for state in states[-10:]) <= still:
        return True
    now, then = (float(np.mean([state.energy for state in part])) for part in (states[-10:], states[-20:-10]))
    return abs(now - then) <= tolerance * max(then, 1e-300)
