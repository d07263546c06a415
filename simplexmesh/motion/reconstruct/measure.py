"""The last step of a reconstruction: distances between model and data, and warnings about a poor model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.errors import warn
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.stages import mean_edge
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.reconstruct.inputs import Input
from simplexmesh.motion.reconstruct.open_data import border_width
from simplexmesh.motion.reconstruct.result import LEAST_BARE, Distance, Summary
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance
from simplexmesh.motion.topology.handles import HandleProposal

MOST_POINTS = 200_000
"""Of the data, drawn at random, for distances to the mesh."""

MOST_UNSEEN, MOST_MISSED = 0.25, 0.05
"""Fractions of the model without data nearby, and of the data without model nearby, above which a warning is given."""

FAR = 0.04
"""In diagonals of the data: beyond any noise."""

CLEARLY_OPEN = 0.2
"""Width of the border of data, in its diagonals, from which a model without holes is warned of."""


def drawn_points(data: Input) -> NDArray[np.float64]:
    """Return the points of the data, drawn at random if they are very many."""
    points = data.points
    if len(points) <= MOST_POINTS:
        return points
    return points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]


def measure(run: Run) -> None:
    """Measure the distances both ways, keep that of each vertex to the data on the mesh, and warn of a poor model.

    For a vertex without data along its normal within reach it is the distance to the nearest point of the data.
    """
    run.report(0.95, "measuring")
    mesh, reach, points = run.mesh, run.stages[-1].reach, drawn_points(run.data)
    gaps = run.target.gap(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.normals), reach)
    away, unseen = np.abs(gaps), np.isnan(gaps)
    away[unseen] = cKDTree(points).query(mesh.vertices[unseen], workers=-1)[0]
    surface = mesh.triangulated(method="fan")
    missing = surface_distance(points, surface.vertices, surface.faces)
    enclosed = np.zeros(len(points), bool)
    if not mesh.n_holes:
        far = np.flatnonzero(missing > reach)
        enclosed[far[inside_surface(points[far], surface.vertices, surface.faces)]] = True
    run.distance = Distance(Summary.of(away), Summary.of(missing), Summary.of(missing[enclosed]))
    run.mesh = mesh.with_data(distance=away)
    limit = max(reach, FAR * float(np.linalg.norm(np.ptp(points, axis=0))))
    run.bare = _share_of_area(mesh, away > 2 * reach)
    lid = run.options.closes and has_lid(run.target, mesh, run.bare)
    if lid:
        warn(
            f"where the data is open, the model closes it: {run.bare:.0%} of its area has no data nearby; "
            "holes='auto' leaves it open, holes='none' closes it without this warning"
        )
    off = 0.0 if lid else float((away > limit).mean())
    _warn_of_poor_fit(run, off, float(((missing > limit) & ~enclosed).mean()))
    _warn_of_topology(run)
    run.report(1.0, "done")


def _warn_of_poor_fit(run: Run, unseen: float, missed: float) -> None:
    """Warn when much of the model has no data nearby, or much of the data no model nearby."""
    if unseen > MOST_UNSEEN:
        hint = "" if run.mesh.n_holes else "; where the data is an open surface, give init='plane'"
        warn(f"{unseen:.0%} of the model is far from any data{hint}")
    if missed > MOST_MISSED:
        dropped = run.data.components != "all" and run.found is not None and run.found.components_dropped
        hint = "components='all' keeps all its pieces" if dropped else "more vertices or another start may reach it"
        warn(f"{missed:.0%} of the data is far from the model; {hint}")


def _warn_of_topology(run: Run) -> None:
    """Warn of open data under a closed model, of missing handles, and of tangled vertices."""
    messages = []
    if run.options.holes == "auto":
        messages.append(open_data_message(run.target, run.data.points, run.mesh))
    if run.surface is not None:
        messages.append(genus_message(run.surface, run.mesh, run.topology.handles))
    if run.tangled:
        messages.append(
            f"{run.tangled} vertices are on faces that are folded or cross others; more vertices or another start "
            "may help"
        )
    for message in filter(None, messages):
        warn(message)


def genus_message(surface: SimplexMesh, mesh: SimplexMesh, proposals: Sequence[HandleProposal]) -> str:
    """Return a message about a model that lacks handles of a surface near its data; empty if the user refused any."""
    if mesh.genus == surface.genus or any(not proposal.accepted for proposal in proposals):
        return ""
    return f"the data has genus {surface.genus}, the model has {mesh.genus}; init='auto' finds all its handles"


def _share_of_area(mesh: SimplexMesh, chosen: NDArray[np.bool_]) -> float:
    """Return the share of the area of the surface around vertices."""
    c = mesh.connectivity
    areas = (mesh.face_areas * ~c.face_is_hole / c.face_sizes)[c.face].sum(axis=1)
    return float(areas[chosen].sum() / areas.sum())


def has_lid(target: Target, mesh: SimplexMesh, bare: float) -> bool:
    """Return whether a model closes open data with lids, a share `bare` of its area; volumes end where their grid does.

    Of closed bodies, sampled sparsely or with noise, no area at all is so far from the data.
    """
    return not mesh.n_holes and bare >= LEAST_BARE and hasattr(type(target), "border")


def open_data_message(target: Target, points: NDArray[np.float64], mesh: SimplexMesh) -> str:
    """Return a message about a model without holes of points whose target has a wide border, else an empty one."""
    if mesh.n_holes or border_width(target, points) < CLEARLY_OPEN:
        return ""
    return (
        "the data ends along a wide border, but the model is closed: no zone off the data was found to open "
        f"(edges of {mean_edge(mesh):.3g}); more vertices or init='plane' may"
    )
