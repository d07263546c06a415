"""What a reconstruction changes of the mesh: holes and handles (Delingette 1994, 5.4), then the density of vertices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh.mesh.check import folded_vertices, tangled_vertices
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.face_geometry import face_areas
from simplexmesh.mesh.operators.cut_join import parts
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density.face_edits import divide_faces, divided_boundary, with_even_metric
from simplexmesh.motion.density.redistribute import redistribute_round
from simplexmesh.motion.density.refine import refine_round
from simplexmesh.motion.density.refinement import THRESHOLDS
from simplexmesh.motion.model.contours import wide_border
from simplexmesh.motion.model.state import Stage, mean_edge
from simplexmesh.motion.reconstruct.options import FEWEST_VERTICES, stages_from
from simplexmesh.motion.reconstruct.run import Run, settle
from simplexmesh.motion.start.report import FAR
from simplexmesh.motion.topology.holes import HoleProposal, open_holes
from simplexmesh.motion.topology.wrapping import wrapped

FAR_FROM_BORDER = 6.0
"""In mean edges: holes are opened automatically only within this distance of the border of the data."""

MOST_OF_FACE = 8
"""Vertices of a hole that is no larger than a face; three faces and more, the least that is cut off, leave more."""

WRAPPED, FEWEST_FOR_TUNNELS = 0.5, 1200
"""Fraction of the vertices while wrapping, the fewest that get through the holes of objects."""

THIN = 4.5
"""In mean edges: the large faces on both sides of a thinner body would come to intersect."""


def change_topology(run: Run) -> None:
    """Wrap the mesh around closed data and add its handles, or open holes where the data ends."""
    if run.surface is not None:
        _wrap(run, run.surface)
    elif run.opens:
        _open_holes(run)
        if run.options.holes == "open":
            _open_holes(run, edges=1.0)  # strips beside the border, too narrow before


def _open_holes(run: Run, edges: float = 2.0) -> None:
    """Open holes so many edges from the data and move the boundary to its border, up to three times."""
    wanted: Any = run.options.holes
    stage = replace(run.stages[-3], iterations=60)
    for attempt in range(1 if isinstance(wanted, list) else 3):
        mesh = run.mesh
        choice: dict[str, Any] = {"accept": wanted, "reach": edges * mean_edge(mesh)}
        if wanted in ("auto", "open"):
            choice["accept"] = _near_border(run, mean_edge(mesh))
        elif isinstance(wanted, list):
            choice = {"zones": run.zones}
        out = open_holes(mesh, run.target, fewest=max(3, mesh.n_faces // 100), **choice)
        before = [proposal for proposal in run.topology.holes if proposal.accepted]
        run.topology = replace(run.topology, holes=(*before, *out.proposals))
        if out.mesh is mesh:
            return
        run.mesh, run.fallback = out.mesh, None
        if wanted == "open":
            run.mesh = _as_one_surface(out.mesh, all_parts=run.options.components == "all")
        run.move(stage, until=max(run.done, 0.3 + 0.05 * attempt))


def _as_one_surface(mesh: SimplexMesh, *, all_parts: bool) -> SimplexMesh:
    """Return the largest part of a mesh, or all, with faces for holes smaller than any zone that is cut off."""
    if not all_parts:
        mesh = max((piece.mesh for piece in parts(mesh)), key=lambda piece: piece.area)
    c = mesh.connectivity
    holes = c.hole_darts[c.face_sizes[c.face.reshape(-1)[c.hole_darts]] > MOST_OF_FACE]
    return SimplexMesh(mesh.vertices, Connectivity(c.twin, holes, c.contour_darts), mesh.data, mesh.unit)


def _near_border(run: Run, edge: float) -> Callable[[HoleProposal], bool | str]:
    """Return a predicate that accepts zones near a border of the data; elsewhere the mesh has not reached it yet.

    Of data known to be open it accepts lids too, far from all of it: noise hides borders.
    """
    points = wide_border(run.target, edge)
    tree = cKDTree(points) if len(points) else None
    far = FAR * run.data.diagonal if run.options.holes == "open" else np.inf

    def accept(proposal: HoleProposal) -> bool | str:
        line = proposal.contour
        if line is not None and np.median(run.tree.query(line.mesh.vertices[proposal.vertices])[0]) > far:
            return True
        if tree is None or line is None:
            return "the data has no border wide enough"
        away = float(np.median(tree.query(line.mesh.vertices[line.vertices])[0]))
        return away < FAR_FROM_BORDER * edge or f"the data ends {away:.4g} away"

    return accept


def _wrap(run: Run, surface: SimplexMesh) -> None:
    """Wrap the mesh around a surface near the data, add its handles, and reduce the reach of the fine stage to suit."""
    updates = 0

    def watch(mesh: SimplexMesh) -> None:
        nonlocal updates
        run.mesh, updates = mesh, updates + 1
        run.progress(0.25 * updates / (updates + 40))  # of some 40 updates; their number is not known beforehand

    wanted = run.options.vertices
    if run.options.refine != "none":
        wanted = max(min(max(int(WRAPPED * wanted), FEWEST_FOR_TUNNELS), int(0.85 * wanted)), FEWEST_VERTICES)
    accept = run.options.handles if callable(run.options.handles) else None
    out = wrapped(run.mesh, surface, vertices=wanted, accept=accept, watch=watch)
    run.mesh, run.topology = out.mesh, replace(run.topology, handles=out.proposals)
    if out.replaced:  # from here on as if the automatic start had been asked for
        run.surface, run.fallback = None, surface
        run.stages = stages_from(surface, run.data, run.options, cell=run.found.cell if run.found else None)
        settle(run)
        return
    run.found = None
    fine = replace(run.stages[-2], reach=min(run.stages[-2].reach, 4 * mean_edge(out.mesh)))
    run.stages[-2] = fine
    run.move(Stage(rigidity=3, reach=fine.reach, iterations=40), until=0.4)


def refine_and_fit(run: Run) -> None:
    """Alternate motion and division of faces, by a quarter more vertices a round, as wanted; then move to rest."""
    fine = run.stages[-2]
    if run.refines:
        motion = replace(fine, iterations=21)
        for k in range(16):  # enough for 720 vertices to become 20,000
            run.move(motion, until=0.4 + 0.25 * (k + 1) / 16)
            n = run.mesh.n_vertices
            if run.options.vertices - n < 4:
                break
            _divide(run, min(run.options.vertices - n, n // 4), fine.reach)
            run.fallback = None
            run.count(refined=run.mesh.n_vertices - n)
            if run.mesh.n_vertices == n:
                break
    run.move(fine, until=0.7)


def _divide(run: Run, budget: int, reach: float) -> None:
    """Divide long edges on holes, then faces of high score, and on flat data, where none has one, the largest."""
    most = run.mesh.n_vertices + budget
    run.mesh = with_even_metric(divided_boundary(run.mesh, budget // 6))
    threshold, budget = THRESHOLDS.get(run.options.refine or "", 1e-12), most - run.mesh.n_vertices
    step = refine_round(run.mesh, run.target, reach=reach, threshold=threshold, budget=budget)
    run.mesh = step.mesh
    run.count(swapped=step.rounds[0].swapped)
    if step.inserted < budget // 2 and run.options.refine in ("auto", "open"):
        run.mesh, swaps = _with_largest_divided(run.mesh, budget - step.inserted)
        run.count(swapped=swaps)


def _with_largest_divided(mesh: SimplexMesh, budget: int) -> tuple[SimplexMesh, int]:
    """Return the mesh with its largest faces divided regardless of score, and the number of edges swapped."""
    c = mesh.connectivity
    area = np.where(c.face_is_hole, 0.0, face_areas(mesh.vertices, c.face_vertices, c.face_offsets))
    largest = np.argsort(-area, kind="stable")[: np.count_nonzero(~c.face_is_hole) // 2]
    edit = EditableMesh(mesh)
    divide_faces(edit, mesh, largest, budget, np.ones(len(area), bool))
    swaps = edit.even_out()
    return with_even_metric(edit.result()), swaps


def redistribute(run: Run) -> None:
    """Alternate merging faces of low score for divisions of high ones with motion, if wanted; then untangle.

    If that fails, but succeeds on the mesh before, all is reverted: large faces intersect thin walls.
    """
    fine = run.stages[-2]
    if not fine.iterations or not _is_wanted(run):
        return
    before = run.mesh, run.fallback, run.topology
    _exchange(run, fine)
    if not run.untangle(fine.reach):
        return
    after = run.mesh, run.fallback, run.topology
    run.mesh, run.fallback, run.topology = before
    if run.untangle(fine.reach):
        run.mesh, run.fallback, run.topology = after


def _exchange(run: Run, fine: Stage) -> None:
    """Alternate merging and dividing faces with motion."""
    wanted, find = run.mesh.n_vertices, tangled_vertices
    for k in range(5):  # each takes time for less gain
        tangled = find(run.mesh)
        find = find if tangled.any() else folded_vertices  # cheaper, and enough once nothing intersects
        step = redistribute_round(run.mesh, run.target, reach=fine.reach, vertices=wanted, tangled=tangled)
        (done,) = step.rounds
        run.mesh, run.fallback = step.mesh, None
        run.count(exchanged=done.merged, swapped=done.swapped)
        run.move(replace(fine, iterations=20), until=0.7 + 0.2 * (k + 1) / 5)
        if done.merged < 0.01 * run.mesh.n_faces:
            break


def _is_wanted(run: Run) -> bool:
    """Return whether the vertices of this mesh are to be redistributed."""
    if run.options.placement != "closed":
        return run.options.placement == "adaptive"
    if run.mesh.n_holes or run.found is None or not run.data.layered:
        return not run.mesh.n_holes
    body = run.start
    return bool(2 * body.volume >= THIN * body.area * mean_edge(body))  # twice volume over area is the mean thickness
