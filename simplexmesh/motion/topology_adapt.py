"""A mesh that finds its topology on the way: coarse motion, holes and handles, fine motion in turns with edits."""

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
from simplexmesh.motion.dividing import divided
from simplexmesh.motion.evolve import Stage, mean_edge
from simplexmesh.motion.handles import add_handles
from simplexmesh.motion.holes import HoleProposal, open_holes
from simplexmesh.motion.journey import Journey
from simplexmesh.motion.placing import exchange
from simplexmesh.motion.plan import Plan
from simplexmesh.motion.refine import THRESHOLDS, refine_round
from simplexmesh.motion.rim_refine import divided_rims
from simplexmesh.motion.settling import with_even_metric
from simplexmesh.motion.state import Target
from simplexmesh.motion.tunnels import tunneled
from simplexmesh.motion.untangle import untangled
from simplexmesh.motion.wrap import Samples

Array = NDArray[np.float64]

FAR_FROM_BORDER = 6.0
"""In mean edges: a hole is opened by itself only where the data ends no farther away."""

WRAPPED, FEWEST_FOR_TUNNELS, FEWEST = 0.5, 1200, 20
"""Coarser meshes do not find their way through the holes of objects."""

USUAL_LOOKS = 40
"""How often the mesh is usually seen while it is wrapped; nobody knows beforehand how often it will be."""

TURN, MOST_TURNS = 21, 16
NO_LIMIT = 1e-12


def travelled(
    start: SimplexMesh,
    target: Target,
    stages: Sequence[Stage],
    plan: Plan,
    *,
    samples: Samples | None = None,
    watch: Callable[[float], None] | None = None,
) -> Journey:
    """Move a mesh through stages and let its topology change between them.

    Stiff stages; holes, then handles; the last but one stage, in turns with refinement; faces merged for others; even
    face sizes; the last stage (Delingette 1994, figure 5.6).

    Parameters
    ----------
    start : SimplexMesh
    target : Target
    stages : sequence of Stage
        At least two.
    plan : Plan
        Without changes the mesh keeps its topology, and with an even placement its faces.
    samples : Samples, optional
        The data, when it is closed and the start encloses it: the mesh then finds its handles.
    watch : callable, optional
        Called with the share done.

    Returns
    -------
    Journey
        At its end. Its `refuge` is a mesh of the same faces, near the data and not tangled, when one is known.
    """
    journey = Journey(start, target, watch)
    *coarse, fine, last = stages
    try:
        if not plan.changes:
            journey.refuge = start
            journey.move(*coarse, share=(0.0, 0.25))
            settled, left = untangled(journey.mesh, target, reach=coarse[-1].reach, start=start)
            journey.mesh, journey.refuge = settled, start if left else settled
            journey.move(fine, share=(0.25, 0.7))
        else:
            _given_handles(journey, plan)
            wrapped = plan.handles == "auto" or callable(plan.handles)
            if samples is not None and wrapped and isinstance(plan.holes, str):
                fine = _tunnels(journey, plan, samples, fine)
            else:
                journey.move(*coarse, share=(0.0, 0.25))
                _holes(journey, plan, replace(coarse[-1], iterations=60))
            _refine(journey, plan, fine)
            journey.move(fine, share=(0.65, 0.7))
        if plan.exchanges(journey.mesh) and fine.iterations:
            exchange(journey, fine)
        if plan.refine != "none":
            _even(journey)
        journey.move(last, share=(0.9, 1.0))
    except KeyboardInterrupt:
        journey.interrupted = True
    c = journey.mesh.connectivity
    odd = ((c.face_sizes < 5) | (c.face_sizes > 7)) & ~c.face_is_hole
    journey.noted(exceptions=tuple(np.flatnonzero(odd).tolist()))
    return journey


def _holes(journey: Journey, plan: Plan, settle: Stage) -> None:
    """Open holes where the data ends, let the rims find its border, and again where they overhang."""
    if plan.holes == "none":
        return
    for attempt in range(3):
        mesh = journey.mesh
        choice: dict[str, Any] = {"fewest": max(3, mesh.n_faces // 100)}
        if plan.holes == "auto":
            choice["accept"] = _at_border(journey.target, mean_edge(mesh))
        elif callable(plan.holes):
            choice["accept"] = plan.holes
        elif attempt:
            return
        else:
            choice["zones"] = plan.holes
        out = open_holes(mesh, journey.target, **choice)
        before = [proposal for proposal in journey.record.holes if proposal.accepted]
        journey.noted(holes=(*before, *out.proposals))
        if out.mesh is mesh:
            return
        journey.mesh = out.mesh
        journey.move(settle, share=(0.25 + 0.05 * attempt, 0.3 + 0.05 * attempt))


def _at_border(target: Target, edge: float) -> Callable[[HoleProposal], bool | str]:
    """Return what accepts zones beside a border of the data: elsewhere the mesh has only not arrived yet."""
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


def _given_handles(journey: Journey, plan: Plan) -> None:
    """Join the pairs of faces of the start that the user gave."""
    if isinstance(plan.handles, str) or callable(plan.handles):
        return
    pairs: Any = plan.handles
    out = add_handles(journey.mesh, pairs=pairs)
    journey.mesh = out.mesh
    journey.noted(handles=out.proposals)


def _tunnels(journey: Journey, plan: Plan, samples: Samples, fine: Stage) -> Stage:
    """Wrap the mesh around the data and add the handles it has; return the fine stage for a mesh that near."""
    seen = 0

    def watch(mesh: SimplexMesh, _: int) -> None:
        nonlocal seen
        journey.mesh, seen = mesh, seen + 1
        if journey.watch is not None:
            journey.watch(0.25 * seen / (seen + USUAL_LOOKS))

    wanted = plan.vertices
    if plan.refine != "none":
        wanted = max(min(max(int(WRAPPED * wanted), FEWEST_FOR_TUNNELS), int(0.85 * wanted)), FEWEST)
    out = tunneled(
        journey.mesh,
        samples,
        vertices=wanted,
        accept=plan.handles if callable(plan.handles) else None,
        watch=watch,
    )
    journey.mesh = out.mesh
    journey.noted(handles=out.proposals)
    surfels = getattr(journey.target, "surfels", None)
    if surfels is not None and not surfels.oriented:  # the mesh knows now which way is out
        nearest = cKDTree(out.mesh.vertices)
        turned: Any = journey.target
        journey.target = turned.oriented_by(lambda points: out.mesh.normals[nearest.query(points)[1]])
    near = min(fine.reach, 4 * mean_edge(out.mesh))
    journey.move(Stage(rigidity=3, reach=near, iterations=40), share=(0.25, 0.4))
    return replace(fine, reach=near)


def _refine(journey: Journey, plan: Plan, stage: Stage) -> None:
    """Move and divide faces by turns, a quarter more vertices each time, as far as the plan goes."""
    if plan.refine == "none":
        return
    limit = THRESHOLDS.get(plan.refine, NO_LIMIT)
    turn = replace(stage, iterations=TURN)
    before = journey.mesh.n_vertices
    for k in range(MOST_TURNS):
        journey.move(turn, share=(0.4 + 0.25 * k / MOST_TURNS, 0.4 + 0.25 * (k + 1) / MOST_TURNS))
        n = journey.mesh.n_vertices
        budget = min(plan.vertices - n, n // 4)
        if budget < 4:
            break
        journey.mesh = with_even_metric(divided_rims(journey.mesh, budget // 6))
        budget -= journey.mesh.n_vertices - n
        step = refine_round(journey.mesh, journey.target, reach=stage.reach, threshold=limit, budget=budget)
        journey.mesh = step.mesh
        journey.counted(swapped=step.rounds[0].swapped)
        if journey.mesh.n_vertices - n < budget // 2 and plan.refine == "auto":  # flat: no face asks for more
            journey.mesh, swaps = _evenly(journey.mesh, budget + n - journey.mesh.n_vertices)
            journey.counted(swapped=swaps)
        if journey.mesh.n_vertices == n:
            break
    journey.noted(refined=journey.mesh.n_vertices - before)


def _evenly(mesh: SimplexMesh, budget: int) -> tuple[SimplexMesh, int]:
    """Return the mesh with its largest faces divided, whatever they fit, and how many edges were swapped."""
    c = mesh.connectivity
    area = np.where(c.face_is_hole, 0.0, face_areas(mesh.vertices, c.face_vertices, c.face_offsets))
    largest = np.argsort(-area, kind="stable")[: np.count_nonzero(~c.face_is_hole) // 2]
    edit = EditableMesh(mesh)
    divided(edit, mesh, largest, budget, np.ones(len(area), bool))
    swaps = edit.even_out()
    return with_even_metric(edit.result()), swaps


def _even(journey: Journey) -> None:
    """Swap edges until faces have five, six or seven vertices, where refinement left others."""
    even = regularize(journey.mesh)
    if even.swaps:
        journey.mesh, journey.refuge = even.mesh, None
        journey.counted(swapped=even.swaps)
