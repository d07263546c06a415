"""Refinement: faces are divided where the mesh is too coarse for its data, until none scores above a threshold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.regularize import Regularized
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.dividing import carried_zone, composed, divided, evened
from simplexmesh.motion.face_score import face_distance, face_score
from simplexmesh.motion.refined import Ledger, Refined, Round
from simplexmesh.motion.settling import Settling, with_even_metric
from simplexmesh.motion.state import Target
from simplexmesh.motion.untangle import tangled_vertices
from simplexmesh.motion.wishes import THRESHOLDS as THRESHOLDS
from simplexmesh.motion.wishes import as_target, default_reach, threshold_of, zone_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


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
    watch: Callable[[Round, SimplexMesh], None] | None = None,
) -> Refined:
    """Divide the faces of a mesh where it is too coarse for its data, in turns with motion, until it is not.

    A face scores area x elongation x curvature x distance to the data, each without unit; see `face_score`. In each
    round those above the threshold are divided, the highest first: across by T2 when they have more than five
    vertices, into a ring by T6 otherwise; sizes of faces are made even by T7; then the mesh moves, its metric
    parameters following curvature. Faces with no data within reach, tangled ones and holes are not divided.

    Parameters
    ----------
    mesh : SimplexMesh
        A mesh that has been fitted already, coarsely.
    target : Target or data
        What draws the mesh; see `simplexmesh.targets`. Data of all kinds that `reconstruct` takes is made into one.
    threshold : {"coarse", "medium", "fine"} or float
        Faces of a higher score are divided; see `THRESHOLDS`.
    vertices : int, optional
        The mesh gets no more than these; at least as many as it has.
    zones : array of int or of bool, optional
        Where refinement is limited to: numbers of faces, a mask of all faces (holes included), or a mask of vertices,
        for the faces that have all of theirs in it. The rest of the mesh neither changes nor moves.
    reach : float, optional
        How far the data is looked for, in its unit. Default: 10 % of the mesh's diagonal.
    rounds, iterations : int
        How many rounds at most, and how many iterations the mesh moves in each.
    adaptation : float
        How strongly vertices gather where the surface bends, 0 to 0.25.
    rigidity : int
        How many edges far curvature is averaged.
    level, label : optional
        Of a volume given as `target`.
    watch : callable, optional
        Called after each round with what was done and the mesh.

    Returns
    -------
    Refined
        The mesh, and where its vertices and faces went; an interrupt (Ctrl-C) returns the last whole state.

    Raises
    ------
    ValueError, TypeError
        One sentence on what is wrong, before any long work.
    TopologyError
        When the mesh is not complete.
    DivergedError
        When the motion left the finite numbers.

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
    _check.instance("mesh", mesh, SimplexMesh)
    limit = threshold_of(threshold)
    most = None if vertices is None else _check.integer("vertices", vertices, 4)
    if most is not None and most < mesh.n_vertices:
        raise ValueError(f"vertices must be at least {mesh.n_vertices}, what the mesh has, not {most}")
    zone = None if zones is None else zone_of(mesh, zones)
    rounds = _check.integer("rounds", rounds, 0)
    if watch is not None and not callable(watch):
        raise TypeError(f"watch must be a function of a Round and the mesh, not {type(watch).__name__}")
    goal, reach = as_target(target, level=level, label=label), default_reach(mesh, reach)
    settling = Settling.checked(goal, reach, iterations=iterations, adaptation=adaptation, rigidity=rigidity)
    ledger = Ledger(mesh, settling, zone, watch)
    try:
        for _ in range(rounds):
            budget = None if most is None else most - ledger.mesh.n_vertices
            step = refine_round(ledger.mesh, goal, reach=reach, threshold=limit, budget=budget, zone=ledger.zone)
            ledger.converged = step.converged
            if not step.inserted:
                break
            ledger.enter(step)
        if ledger.rounds:
            ledger.close()
    except KeyboardInterrupt:
        ledger.interrupted = True
    return ledger.result()


def refine_round(
    mesh: SimplexMesh,
    target: Target,
    *,
    reach: float,
    threshold: float,
    budget: int | None = None,
    zone: Mask | None = None,
) -> Refined:
    """Do one round of edits without motion: divide the faces above a threshold, then make the sizes of faces even.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    reach, threshold : float
        As in `refine`.
    budget : int, optional
        At most so many vertices are added.
    zone : (f,) array of bool, optional
        The faces that may be divided, of all faces with holes.

    Returns
    -------
    Refined
        Of one round. It has converged when no face is above the threshold.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.targets.Triangles(sm.sphere(20).triangulated())
    >>> refine_round(sm.sphere(4), ball, reach=0.5, threshold=1e-6, budget=20)
    Refined(SimplexMesh(340 vertices, 172 faces, genus 0, 0 holes), 20 vertices added in 1 rounds, not converged)
    """
    scores = scored(mesh, target, reach)
    allowed = ~mesh.connectivity.face_is_hole if zone is None else zone & ~mesh.connectivity.face_is_hole
    above = np.flatnonzero(allowed & (scores > threshold))
    above = above[np.argsort(-scores[above], kind="stable")]
    edit = EditableMesh(mesh)
    may_grow = np.ones(scores.size, bool) if zone is None else zone
    most = 20 * len(above) * 2 if budget is None else budget
    cut, ringed = divided(edit, mesh, above, most, may_grow)
    first = edit.result()
    even = evened(first.mesh, None if zone is None else carried_zone(zone, first))
    maps = composed((first.vertex_map, first.face_map), even)
    out = Edited(even.mesh, *(_check.frozen(part) for part in maps))
    told = Round(
        len(above), float(scores[allowed].max(initial=0.0)), cut, ringed, out.mesh.n_vertices,
        swapped=even.swaps if isinstance(even, Regularized) else 0,
    )  # fmt: skip
    return Refined(with_even_metric(out), out.vertex_map, out.face_map, (told,), not len(above))


def scored(mesh: SimplexMesh, target: Target, reach: float) -> Array:
    """Return the score of each face, 0 for tangled ones: dividing those only tangles them more.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.targets.Triangles(sm.sphere(20).triangulated())
    >>> bool((scored(sm.sphere(4), ball, 0.5) > scored(sm.sphere(8), ball, 0.5).max()).all())
    True
    """
    scores = face_score(mesh, face_distance(mesh, target, reach), reach).total
    scores[mesh.connectivity.vertex_faces[tangled_vertices(mesh)].ravel()] = 0.0
    return scores
