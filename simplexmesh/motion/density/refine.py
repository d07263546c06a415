"""Adaptive refinement: division of the faces where a mesh is too coarse for its data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density.face_edits import (
    divide_faces,
    face_distance,
    face_score,
    unresolved_faces,
    with_even_metric,
)
from simplexmesh.motion.density.refinement import THRESHOLDS as THRESHOLDS
from simplexmesh.motion.density.refinement import (
    Refined,
    Refinement,
    Round,
    as_target,
    default_reach,
    threshold_of,
    zone_of,
)
from simplexmesh.motion.targets.protocol import Target


def refine(
    mesh: SimplexMesh,
    target: Any,
    *,
    threshold: str | float = "medium",
    vertices: int | None = None,
    zones: ArrayLike | None = None,
    reach: float | None = None,
    rounds: int = 20,
    iterations: int = 30,
    adaptation: float = 0.05,
    rigidity: int = 1,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    watch: Callable[[Round, SimplexMesh], None] | None = None,
) -> Refined:
    """Divide the faces of a mesh where it is too coarse for its data, alternating with motion.

    A face scores area x elongation x curvature x distance to the data, each without unit; see `face_score`. In each
    round, those above the threshold are divided in two by T2, in descending order of score; face sizes are evened out
    by T7; then the mesh moves, its metric parameters adapted to curvature. Faces with no data within reach, tangled
    ones and holes are not divided.

    Parameters
    ----------
    mesh : SimplexMesh
        A coarse mesh, fitted already.
    target : Target or data
        What attracts the mesh: a target (see `simplexmesh.targets`) or any data that `reconstruct` accepts.
    threshold : {"coarse", "medium", "fine"} or float
        Faces of a higher score are divided; the names stand for 2e-4, 2.5e-5 and 3e-6.
    vertices : int, optional
        Maximum number of vertices of the result; at least that of the mesh.
    zones : array of int or of bool, optional
        The faces that refinement is limited to: indices, a mask of all faces (holes included), or a mask of vertices,
        which selects the faces that have all of theirs in it. The rest of the mesh neither changes nor moves.
    reach : float, optional
        Search distance for data, in its unit. Default: 10 % of the mesh's diagonal.
    rounds, iterations : int
        Maximum number of rounds, and iterations of motion in each.
    adaptation : float
        Strength, 0 to 0.25, with which vertices are concentrated where the surface bends.
    rigidity : int
        Radius, in edges, over which curvature is averaged.
    level, label, inside : optional
        For a volume given as `target`.
    watch : callable, optional
        Called after each round with its `Round` and the mesh.

    Returns
    -------
    Refined
        The mesh, with vertex and face maps; an interrupt (Ctrl-C) returns the last complete state.

    Raises
    ------
    ValueError, TypeError
        For invalid arguments, before any long computation.
    TopologyError
        When the mesh is not complete.
    DivergedError
        When the motion diverges.

    References
    ----------
    H. Delingette, thesis, 1994, section 5.5.2.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((1.0, 1.0, 2.0), 16).triangulated()
    >>> coarse = sm.reconstruct(egg, vertices=100).mesh
    >>> out = sm.refine(coarse, egg, vertices=300)
    >>> 100 < out.mesh.n_vertices <= 300, out.inserted == out.mesh.n_vertices - coarse.n_vertices
    (True, True)
    """
    checks.instance("mesh", mesh, SimplexMesh)
    limit = threshold_of(threshold)
    most = None if vertices is None else checks.integer("vertices", vertices, 4)
    if most is not None and most < mesh.n_vertices:
        raise ValueError(f"vertices must be at least the {mesh.n_vertices} of the mesh, not {most}")
    zone = None if zones is None else zone_of(mesh, zones)
    rounds = checks.integer("rounds", rounds, 0)
    goal, reach = as_target(target, level=level, label=label, inside=inside), default_reach(mesh, reach)
    refinement = Refinement(mesh, goal, reach, iterations, adaptation, rigidity, zone, watch)
    with refinement.interruptible():
        for _ in range(rounds):
            budget = None if most is None else most - refinement.mesh.n_vertices
            step = refine_round(
                refinement.mesh, goal, reach=reach, threshold=limit, budget=budget, zone=refinement.zone
            )
            refinement.converged = step.converged
            if not step.inserted:
                break
            refinement.apply(step)
        if refinement.rounds:
            refinement.finish()
    return refinement.result()


def refine_round(
    mesh: SimplexMesh,
    target: Target,
    *,
    reach: float,
    threshold: float,
    budget: int | None = None,
    zone: Mask | None = None,
) -> Refined:
    """Divide the faces of a zone (f,) above a threshold, without motion, adding at most `budget` vertices."""
    scores = refinement_scores(mesh, target, reach)
    allowed = ~mesh.connectivity.face_is_hole if zone is None else zone & ~mesh.connectivity.face_is_hole
    above = np.flatnonzero(allowed & (scores > threshold))
    above = above[np.argsort(-scores[above], kind="stable")]
    edit = EditableMesh(mesh)
    may_grow = np.ones(scores.size, bool) if zone is None else zone
    most = 2 * len(above) if budget is None else budget
    cut = divide_faces(edit, mesh, above, most, may_grow)
    swaps = edit.even_out(within=None if zone is None else zone & ~mesh.connectivity.face_is_hole)
    out = edit.result()
    highest = float(scores[allowed].max(initial=0.0))
    done = Round(len(above), highest, cut, out.mesh.n_vertices, swapped=swaps)
    return Refined(with_even_metric(out), out.vertex_map, out.face_map, (done,), not len(above))


def refinement_scores(mesh: SimplexMesh, target: Target, reach: float) -> Array:
    """Return the scores of faces (f,), 0 for unresolved ones, and tangled ones, which division would tangle further."""
    scores = face_score(mesh, face_distance(mesh, target, reach)[0], reach).total
    scores[unresolved_faces(mesh, target)] = 0.0
    scores[mesh.connectivity.vertex_faces[tangled_vertices(mesh)].ravel()] = 0.0
    return scores
