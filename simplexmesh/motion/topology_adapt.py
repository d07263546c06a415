"""Fitting with changes of topology: coarse motion, holes and handles, fine motion alternating with refinement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.face_geometry import face_areas
from simplexmesh.mesh.regularize import regularize
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Stage, mean_edge
from simplexmesh.motion.exchange import exchange
from simplexmesh.motion.face_edits import divide_faces
from simplexmesh.motion.fit import Fit
from simplexmesh.motion.handles import add_handles
from simplexmesh.motion.holes import HoleProposal, open_holes
from simplexmesh.motion.plan import Plan
from simplexmesh.motion.refine import THRESHOLDS, refine_round
from simplexmesh.motion.relaxation import with_even_metric
from simplexmesh.motion.rim_refine import divided_rims
from simplexmesh.motion.state import Target
from simplexmesh.motion.tunnels import tunneled
from simplexmesh.motion.untangle import untangled
from simplexmesh.motion.wrap import Samples

Array = NDArray[np.float64]

FAR_FROM_BORDER = 6.0
"""In mean edges: holes are opened automatically only within this distance of the border of the data."""

WRAPPED, FEWEST_FOR_TUNNELS, FEWEST = 0.5, 1200, 20
"""Fraction of the vertices while wrapping, the fewest that get through the holes of objects, and the fewest of all."""

TYPICAL_UPDATES = 40
"""Typical number of progress updates while wrapping; the actual number is not known beforehand."""

ITERATIONS, MAX_ROUNDS = 21, 16
"""Iterations of motion per round of refinement, and maximum number of rounds."""

NO_THRESHOLD = 1e-12


def staged_fit(
    start: SimplexMesh,
    target: Target,
    stages: Sequence[Stage],
    plan: Plan,
    *,
    samples: Samples | None = None,
    watch: Callable[[float], None] | None = None,
) -> Fit:
    """Fit a mesh in stages and change its topology between them.

    The stiff stages; holes, then handles; the last but one stage, alternating with refinement; redistribution; evening
    of face sizes; the last stage (Delingette 1994, figure 5.6).

    Parameters
    ----------
    start : SimplexMesh
    target : Target
    stages : sequence of Stage
        At least two.
    plan : Plan
        Without changes the mesh keeps its topology, and with an even placement its connectivity.
    samples : Samples, optional
        Points on closed data that the start encloses; the mesh is then wrapped and gains handles.
    watch : callable, optional
        Called with the fraction done, 0 to 1.

    Returns
    -------
    Fit
        At its end.
    """
    fit = Fit(start, target, watch)
    *coarse, fine, last = stages
    try:
        if not plan.changes:
            fit.fallback = start
            fit.move(*coarse, share=(0.0, 0.25))
            mesh, left = untangled(fit.mesh, target, reach=coarse[-1].reach, start=start)
            fit.mesh, fit.fallback = mesh, start if left else mesh
            fit.move(fine, share=(0.25, 0.7))
        else:
            _join_given_pairs(fit, plan)
            wrapped = plan.handles == "auto" or callable(plan.handles)
            if samples is not None and wrapped and isinstance(plan.holes, str):
                fine = _wrap(fit, plan, samples, fine)
            else:
                fit.move(*coarse, share=(0.0, 0.25))
                _open_holes(fit, plan, replace(coarse[-1], iterations=60))
            _refine(fit, plan, fine)
            fit.move(fine, share=(0.65, 0.7))
        if plan.exchanges(fit.mesh) and fine.iterations:
            exchange(fit, fine)
        if plan.refine != "none":
            _even_out(fit)
        fit.move(last, share=(0.9, 1.0))
    except KeyboardInterrupt:
        fit.interrupted = True
    c = fit.mesh.connectivity
    irregular = ((c.face_sizes < 5) | (c.face_sizes > 7)) & ~c.face_is_hole
    fit.update_record(exceptions=tuple(np.flatnonzero(irregular).tolist()))
    return fit


def _open_holes(fit: Fit, plan: Plan, stage: Stage) -> None:
    """Open holes where the data ends and move the rims to its border, up to three times."""
    if plan.holes == "none":
        return
    for attempt in range(3):
        mesh = fit.mesh
        choice: dict[str, Any] = {"fewest": max(3, mesh.n_faces // 100)}
        if plan.holes == "auto":
            choice["accept"] = _near_border(fit.target, mean_edge(mesh))
        elif callable(plan.holes):
            choice["accept"] = plan.holes
        elif attempt:
            return
        else:
            choice["zones"] = plan.holes
        out = open_holes(mesh, fit.target, **choice)
        before = [proposal for proposal in fit.record.holes if proposal.accepted]
        fit.update_record(holes=(*before, *out.proposals))
        if out.mesh is mesh:
            return
        fit.mesh = out.mesh
        fit.move(stage, share=(0.25 + 0.05 * attempt, 0.3 + 0.05 * attempt))


def _near_border(target: Target, edge: float) -> Callable[[HoleProposal], bool | str]:
    """Return a predicate that accepts zones near a border of the data; elsewhere the mesh has not reached it yet."""
    border = getattr(target, "border", None)
    points = np.zeros((0, 3)) if border is None else border.wider(3 * edge)
    tree = cKDTree(points) if len(points) else None

    def accept(proposal: HoleProposal) -> bool | str:
        line = proposal.contour
        if tree is None or line is None:
            return "the data has no border wide enough"
        away = float(np.median(tree.query(line.mesh.vertices[line.vertices])[0]))
        return away < FAR_FROM_BORDER * edge or f"the data ends {away:.4g} away"

    return accept


def _join_given_pairs(fit: Fit, plan: Plan) -> None:
    """Join the pairs of faces given by the user."""
    if isinstance(plan.handles, str) or callable(plan.handles):
        return
    pairs: Any = plan.handles
    out = add_handles(fit.mesh, pairs=pairs)
    fit.mesh = out.mesh
    fit.update_record(handles=out.proposals)


def _wrap(fit: Fit, plan: Plan, samples: Samples, fine: Stage) -> Stage:
    """Wrap the mesh around the data and add its handles; return the fine stage, its reach reduced to suit."""
    updates = 0

    def watch(mesh: SimplexMesh, _: int) -> None:
        nonlocal updates
        fit.mesh, updates = mesh, updates + 1
        if fit.watch is not None:
            fit.watch(0.25 * updates / (updates + TYPICAL_UPDATES))

    wanted = plan.vertices
    if plan.refine != "none":
        wanted = max(min(max(int(WRAPPED * wanted), FEWEST_FOR_TUNNELS), int(0.85 * wanted)), FEWEST)
    out = tunneled(
        fit.mesh,
        samples,
        vertices=wanted,
        accept=plan.handles if callable(plan.handles) else None,
        watch=watch,
    )
    fit.mesh = out.mesh
    fit.update_record(handles=out.proposals)
    surfels = getattr(fit.target, "surfels", None)
    if surfels is not None and not surfels.oriented:  # the wrapped mesh tells the outside
        nearest = cKDTree(out.mesh.vertices)
        surfel_target: Any = fit.target
        fit.target = surfel_target.oriented_by(lambda points: out.mesh.normals[nearest.query(points)[1]])
    near = min(fine.reach, 4 * mean_edge(out.mesh))
    fit.move(Stage(rigidity=3, reach=near, iterations=40), share=(0.25, 0.4))
    return replace(fine, reach=near)


def _refine(fit: Fit, plan: Plan, stage: Stage) -> None:
    """Alternate motion and division of faces, by up to a quarter more vertices a round, as planned."""
    if plan.refine == "none":
        return
    threshold = THRESHOLDS.get(plan.refine, NO_THRESHOLD)
    motion = replace(stage, iterations=ITERATIONS)
    before = fit.mesh.n_vertices
    for k in range(MAX_ROUNDS):
        fit.move(motion, share=(0.4 + 0.25 * k / MAX_ROUNDS, 0.4 + 0.25 * (k + 1) / MAX_ROUNDS))
        n = fit.mesh.n_vertices
        budget = min(plan.vertices - n, n // 4)
        if budget < 4:
            break
        fit.mesh = with_even_metric(divided_rims(fit.mesh, budget // 6))
        budget -= fit.mesh.n_vertices - n
        step = refine_round(fit.mesh, fit.target, reach=stage.reach, threshold=threshold, budget=budget)
        fit.mesh = step.mesh
        fit.add_to_record(swapped=step.rounds[0].swapped)
        if fit.mesh.n_vertices - n < budget // 2 and plan.refine == "auto":  # flat data: no face scores high enough
            fit.mesh, swaps = _with_largest_divided(fit.mesh, budget + n - fit.mesh.n_vertices)
            fit.add_to_record(swapped=swaps)
        if fit.mesh.n_vertices == n:
            break
    fit.update_record(refined=fit.mesh.n_vertices - before)


def _with_largest_divided(mesh: SimplexMesh, budget: int) -> tuple[SimplexMesh, int]:
    """Return the mesh with its largest faces divided regardless of score, and the number of edges swapped."""
    c = mesh.connectivity
    area = np.where(c.face_is_hole, 0.0, face_areas(mesh.vertices, c.face_vertices, c.face_offsets))
    largest = np.argsort(-area, kind="stable")[: np.count_nonzero(~c.face_is_hole) // 2]
    edit = EditableMesh(mesh)
    divide_faces(edit, mesh, largest, budget, np.ones(len(area), bool))
    swaps = edit.even_out()
    return with_even_metric(edit.result()), swaps


def _even_out(fit: Fit) -> None:
    """Swap edges so that faces have five, six or seven vertices, where refinement left others."""
    even = regularize(fit.mesh)
    if even.swaps:
        fit.mesh, fit.fallback = even.mesh, None
        fit.add_to_record(swapped=even.swaps)
