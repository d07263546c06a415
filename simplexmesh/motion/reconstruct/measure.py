"""The end of a reconstruction: distances are measured, a poor model is warned of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.errors import counted, place, warn
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.outer_side import border_width
from simplexmesh.motion.reconstruct.result import LEAST_BARE, Distance, Summary
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.reconstruct.walls import walls_message
from simplexmesh.motion.start.report import FAR
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.motion.targets.triangles import inside_surface
from simplexmesh.motion.topology.handles import HandleProposal
from simplexmesh.numerics.plane_fits import spacing_of

MOST_UNSEEN, MOST_MISSED = 0.25, 0.05
"""Fractions of the model without data nearby, and of the data without model nearby, above which a warning is given."""

MOST_MISSED_TOGETHER, NEIGHBORS, NEAR = 0.01, 16, 4.0
"""The same of data that is no stray points but a limb or another body: so many of it are within so many spacings."""

MOST_FILLED, BEYOND_EDGES, BEYOND_NOISE = 0.002, 0.75, 5.0
"""The same of data inside of the model, as of a tunnel, by more than so many edges and deviations of the noise."""

MOST_DOUBLED = 0.25
"""Share of a start that may be one sheet or two sides, above which a warning is given: thicker plates have less."""

CLEARLY_OPEN = 0.2
"""Width of the border of data, in its diagonals, from which a model without holes is warned of."""


def measure(run: Run) -> None:
    """Measure the distances both ways, keep that of each vertex on the mesh, and warn of a poor model."""
    run.report(0.95, "measuring")
    mesh, reach, points = run.mesh, run.stages[-1].reach, run.points
    gaps = run.target.gap(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.normals), reach)
    away, unseen = np.abs(gaps), np.isnan(gaps)
    if unseen.any():
        away[unseen] = run.tree.query(mesh.vertices[unseen], workers=-1)[0]
    missing = run.away(points)
    limit = max(reach, FAR * run.data.diagonal)
    enclosed = np.zeros(len(points), bool)
    if not mesh.n_holes:
        far = np.flatnonzero(missing > (reach if run.data.layered else limit))  # of points, noise is farther than reach
        enclosed[far[inside_surface(points[far], *fan(mesh.vertices, mesh.connectivity))]] = True
    run.distance = Distance(Summary.of(away), Summary.of(missing), Summary.of(missing[enclosed]))
    run.mesh = mesh.with_data(distance=away)
    run.bare = share_of_area(mesh, away > 2 * reach)
    lid = run.options.holes == "open" and has_lid(run.target, mesh, run.bare)
    off = 0.0 if lid else float((away > limit).mean())
    missed = (missing > limit) & ~enclosed
    dense = together(run.tree, missed)
    told = _warn_of_poor_fit(run, off, missed, dense)
    walls = not mesh.n_holes and not run.data.layered  # of volumes, cavities that were filled are told
    if walls and (message := walls_message(points, missing, mesh)):
        warn(message + "; components='all' keeps inner bodies and walls of cavities" * run.alone)
    elif run.alone and missed.mean() <= MOST_MISSED and dense.mean() <= MOST_MISSED_TOGETHER:
        warn("smaller bodies are left out; components='all' keeps them")
    elif walls and not told and (message := filled_message(run, points, missing)):
        warn(message)
    _warn_of_topology(run, lid=lid)
    run.report(1.0, "done")


def _warn_of_poor_fit(run: Run, unseen: float, missed: Mask, dense: Mask) -> bool:
    """Warn when the motion ended early, much of the model has no data nearby, or much of the data no model nearby.

    Return whether a place was named that the model misses.
    """
    if run.diverged:
        warn(f"a part of the motion ended early ({run.diverged}): more data may tell better where the surface is")
    if unseen > MOST_UNSEEN:
        warn(f"{unseen:.0%} of the model is far from any data")
    if missed.mean() > MOST_MISSED:
        warn(missed_message(run, missed, dense))
    elif run.lost:
        warn(run.lost)
    elif dense.mean() > MOST_MISSED_TOGETHER and not run.data.layered:  # of volumes, they may be specks of noise
        warn(missed_message(run, missed, dense))
    else:
        return False
    return True


def together(tree: cKDTree, chosen: Mask, count: int = NEIGHBORS) -> Mask:
    """Return those of the chosen points (n,) to which so many of them are as close as on a surface, unlike strays."""
    out, near = np.zeros(len(chosen), bool), NEAR * spacing_of(tree) * np.sqrt(count / NEIGHBORS)
    if chosen.sum() >= count:
        points = tree.data[chosen]
        out[chosen] = cKDTree(points).query(points, k=[count], workers=-1)[0][:, 0] < near
    return out


def filled_message(run: Run, points: Array, away: Array) -> str:
    """Return a message about points (n,) side by side inside of a closed model, `away` (n,) from it; maybe empty.

    They are farther than noise and its edges, and more than there are for two vertices, which pits of smooth models
    are not. Nothing is said if the user refused a handle.
    """
    if any(not proposal.accepted for proposal in run.topology.handles):
        return ""
    noise = getattr(run.target, "noise", 0.0)
    limit = max(BEYOND_EDGES * mean_edge(run.mesh), spacing_of(run.tree), BEYOND_NOISE * noise)
    filled = together(run.tree, away > limit, max(NEIGHBORS, 2 * len(points) // run.mesh.n_vertices))
    filled[filled] = inside_surface(points[filled], *fan(run.mesh.vertices, run.mesh.connectivity))
    if filled.mean() <= MOST_FILLED:
        return ""
    deepest = points[filled][away[filled].argmax()]
    return (
        f"{filled.mean():.1%} of the data is deeper than {limit:.3g} inside of the model, most near {place(deepest)}, "
        "as where a tunnel or a gap is filled; more vertices or points may keep it"
    )


def missed_message(run: Run, missed: Mask, dense: Mask) -> str:
    """Return a message about points (n,) far from the model, and a place where they are dense."""
    dropped = run.found is not None and run.data.components != "all" and run.found.components_dropped
    remedy = "components='all' keeps all its pieces"
    if not (run.alone or dropped):
        remedy = "more vertices or another start may reach it"
    where = f", as near {place(run.points[dense][0])}" if dense.any() else ""
    return f"{missed.mean():.0%} of the data is far from the model{where}; {remedy}"


def _warn_of_topology(run: Run, *, lid: bool) -> None:
    """Warn of open data under a model that has a lid or none, of missing handles, and of tangled vertices."""
    messages = []
    if run.options.holes == "open":
        messages.append(openness_message(run.mesh.n_holes, run.bare if lid else 0.0, opens=run.opens))
        messages.append(sides_message(run.found.doubled if run.found else 0.0))
    if run.found and not run.found.is_open and not run.data.oriented:
        messages.append(handles_message(run.mesh.genus, run.found.doubtful))
    if run.options.holes == "auto":
        messages.append(open_data_message(run.target, run.data.points, run.mesh))
    if run.surface is not None:
        messages.append(genus_message(run.surface, run.mesh, run.topology.handles))
    if run.tangled:
        count = counted(run.tangled, "vertex is", "vertices are")
        messages.append(f"{count} on faces that are folded or cross others; more vertices or another start may help")
    elif not run.mesh.n_holes and run.mesh.volume < 0:
        messages.append("the model is inside out; more vertices or another start may help")
    for message in filter(None, messages):
        warn(message)


def openness_message(holes: int, bare: float, *, opens: bool) -> str:
    """Return a message about data found to be open, and a model with holes or bare lids; empty if it is closed."""
    if holes:
        end = "a hole" if holes == 1 else f"{holes} holes"
        return f"the data is an open surface: the model is kept open and ends where it does, at {end}"
    if bare == 0.0:
        return ""
    closes = f"{bare:.0%} of the model's area has no data nearby: the data is open there, or its walls are too thin"
    if opens:
        return f"{closes}; nothing was found to cut off, more vertices may help"
    return f"{closes}; holes='auto' leaves it open, holes='none' closes it without this warning"


def sides_message(doubled: float) -> str:
    """Return a message about a share of a start that may be a noisy sheet or a thin solid; empty if that is small."""
    if doubled <= MOST_DOUBLED:
        return ""
    return (
        f"noise hides whether {doubled:.0%} of the data is one sheet or the two sides of a solid less than three times "
        "as thick as the noise"
    )


def handles_message(genus: int, places: Sequence[tuple[float, ...]]) -> str:
    """Return a message about a genus that noise or spacing may have changed at places; empty without any."""
    if not places:
        return ""
    more = f" and at {counted(len(places) - 1, 'other place', 'other places')}" if places[1:] else ""
    return (
        f"the genus, {genus}, may be wrong: near {place(places[0])}{more} a wall or a gap is hardly thicker than "
        "the noise or the spacing of the points; more points, or normals if they have none, may tell"
    )


def genus_message(surface: SimplexMesh, mesh: SimplexMesh, proposals: Sequence[HandleProposal]) -> str:
    """Return a message about a model that lacks handles of a surface near its data; empty if the user refused any."""
    if mesh.genus == surface.genus or any(not proposal.accepted for proposal in proposals):
        return ""
    return f"the data has genus {surface.genus}, the model has {mesh.genus}; init='auto' finds all its handles"


def share_of_area(mesh: SimplexMesh, chosen: Mask) -> float:
    """Return the share of the area of the surface around vertices."""
    c = mesh.connectivity
    areas = (mesh.face_areas * ~c.face_is_hole / c.face_sizes)[c.face].sum(axis=1)
    return float(areas[chosen].sum() / areas.sum())


def has_lid(target: Target, mesh: SimplexMesh, bare: float) -> bool:
    """Return whether a model closes open data with lids, a share `bare` of its area being far from the data."""
    # of closed bodies no area is, however sparse or noisy their samples; volumes, without `border`, end with their grid
    return not mesh.n_holes and bare >= LEAST_BARE and hasattr(type(target), "border")


def open_data_message(target: Target, points: Array, mesh: SimplexMesh) -> str:
    """Return a message about a model without holes of points whose target has a wide border, else an empty one."""
    if mesh.n_holes or border_width(target, points) < CLEARLY_OPEN:
        return ""
    return (
        "the data ends along a wide border, but the model is closed: no zone off the data was found to open "
        f"(edges of {mean_edge(mesh):.3g}); more vertices may"
    )
