"""The changes of topology in a reconstruction (Delingette 1994, 5.4): handles of closed data, holes where it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.border_attraction import wide_border
from simplexmesh.motion.model.stages import Stage, mean_edge
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.reconstruct.options import FEWEST_VERTICES
from simplexmesh.motion.reconstruct.run import Run, settle
from simplexmesh.motion.reconstruct.start import stages_from
from simplexmesh.motion.topology.holes import HoleProposal, open_holes
from simplexmesh.motion.topology.wrapping import wrapped

FAR_FROM_BORDER = 6.0
"""In mean edges: holes are opened automatically only within this distance of the border of the data."""

WRAPPED, FEWEST_FOR_TUNNELS = 0.5, 1200
"""Fraction of the vertices while wrapping, the fewest that get through the holes of objects."""


def change_topology(run: Run) -> None:
    """Wrap the mesh around closed data and add its handles, or open holes where the data ends."""
    if run.surface is not None:
        _wrap(run, run.surface)
    elif run.options.holes != "none":
        _open_holes(run)


def _open_holes(run: Run) -> None:
    """Open holes and move the boundary to the border of the data, up to three times."""
    wanted, stage = run.options.holes, replace(run.stages[-3], iterations=60)
    for attempt in range(1 if isinstance(wanted, list) else 3):
        mesh = run.mesh
        choice: dict[str, Any] = {"accept": wanted}
        if wanted == "auto":
            choice = {"accept": _near_border(run.target, mean_edge(mesh))}
        elif isinstance(wanted, list):
            choice = {"zones": run.zones}
        out = open_holes(mesh, run.target, fewest=max(3, mesh.n_faces // 100), **choice)
        before = [proposal for proposal in run.topology.holes if proposal.accepted]
        run.topology = replace(run.topology, holes=(*before, *out.proposals))
        if out.mesh is mesh:
            return
        run.mesh, run.fallback = out.mesh, None
        run.move(stage, until=0.3 + 0.05 * attempt)


def _near_border(target: Target, edge: float) -> Callable[[HoleProposal], bool | str]:
    """Return a predicate that accepts zones near a border of the data; elsewhere the mesh has not reached it yet."""
    points = wide_border(target, edge)
    tree = cKDTree(points) if len(points) else None

    def accept(proposal: HoleProposal) -> bool | str:
        line = proposal.contour
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
