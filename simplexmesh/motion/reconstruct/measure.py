"""The end of a reconstruction: what strayed from the data is put back, distances measured, a poor model warned of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import counted, warn
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import Tangles, untangled, with_membrane
from simplexmesh.motion.reconstruct.outer_side import border_width
from simplexmesh.motion.reconstruct.result import LEAST_BARE, Distance, Summary
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.reconstruct.walls import walls_message
from simplexmesh.motion.start.primitives import PRIMITIVES
from simplexmesh.motion.start.report import FAR
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.motion.targets.triangles import Triangles, inside_surface
from simplexmesh.motion.topology.face_regions import dilated
from simplexmesh.motion.topology.handles import HandleProposal
from simplexmesh.numerics.plane_fits import spacing_of

MOST_UNSEEN, MOST_MISSED = 0.25, 0.05
"""Fractions of the model without data nearby, and of the data without model nearby, above which a warning is given."""

MOST_LOST = 0.01
"""Share of the data that a model may stray from without a warning; of walls thicker than their noise it is 0."""

MOST_DOUBLED = 0.25
"""Share of a start that may be one sheet or two sides, above which a warning is given: thicker plates have less."""

CLEARLY_OPEN = 0.2
"""Width of the border of data, in its diagonals, from which a model without holes is warned of."""


@dataclass(frozen=True)
class Strays:
    """The start of a motion and the tree of the points of its data, which tell where a mesh has strayed.

    A vertex strayed when it, or the center of one of its faces, is farther from the data than the start is at the place
    nearest to it, by `edge`; the mesh strayed from a point of the data that the start was nearer to, by as much.
    """

    start: SimplexMesh
    tree: cKDTree
    edge: float

    @cached_property
    def _surface(self) -> Triangles:
        return Triangles(self.start.triangulated(method="fan"))

    def places(self, vertices: Array) -> Array:
        """Return (n, 3) the place of the start nearest to each of the vertices (n, 3)."""
        return self._surface.closest(vertices)[1]

    def among(self, mesh: SimplexMesh, edges: float = 1.0) -> Mask:
        """Return the vertices (n,) that strayed by more than a number of edges."""
        c, limit = mesh.connectivity, edges * self.edge
        places = np.concatenate([mesh.vertices, face_centroids(mesh.vertices, c.face_vertices, c.face_offsets)])
        away = np.asarray(self.tree.query(places, workers=-1)[0])
        out = away > limit
        out[mesh.n_vertices :] &= ~c.face_is_hole
        if out.any():
            out[out] = away[out] > self.tree.query(self.places(places[out]))[0] + limit
        return np.asarray(out[: mesh.n_vertices] | out[mesh.n_vertices :][c.vertex_faces].any(axis=1))

    def lost(self, mesh: SimplexMesh, zone: Mask) -> Indices:
        """Return the vertices nearest to the points in a zone (n,) that the mesh strayed from, one for each point."""
        points = self.tree.data
        nearest = cKDTree(mesh.vertices).query(points, workers=-1)[1]
        here = zone[nearest]
        surfaces = Triangles(mesh.triangulated(method="fan")), self._surface
        now, then = (surface.closest(points[here])[0] for surface in surfaces)
        return np.asarray(nearest[here][now > then + self.edge])

    def left(self, points: Array, away: Array) -> Mask:
        """Return the points (m,) that a mesh, `away` (m,) from them, strayed from."""
        out = away > self.edge
        out[out] = away[out] > self._surface.closest(points[out])[0] + self.edge
        return out

    def around(self, mesh: SimplexMesh, strayed: Mask, rings: int) -> Mask:
        """Return the vertices (n,) that strayed, those linked to them by others half as far off, and rings of more."""
        loose, grown = self.among(mesh, 0.5), strayed
        while (more := dilated(grown, mesh.neighbors, 1) & (loose | strayed)).sum() > grown.sum():
            grown = more
        return dilated(grown, mesh.neighbors, rings)


def restore(run: Run) -> None:
    """Put back places of a model begun near the data that strayed, if that tangles nothing; warn of the rest."""
    if run.options.init in PRIMITIVES or not run.stages[-1].iterations:
        return
    scatter = max(spacing_of(run.tree), getattr(run.target, "noise", 0.0))  # of the distances of places to the data
    strays = Strays(run.start, run.tree, max(mean_edge(run.mesh), 2 * scatter))
    if strays.among(run.mesh).any():
        tangles = restored(Tangles(run.mesh), strays, run.target)
        run.restored = int((tangles.mesh.vertices != run.mesh.vertices).any(axis=1).sum())
        run.strayed, run.mesh, run.tangled = int(strays.among(tangles.mesh).sum()), tangles.mesh, tangles.count
    if run.strayed:
        count = counted(run.strayed, "vertex is", "vertices are")
        warn(f"{count} farther from the data than the start was there; more vertices or another start may help")
    run.lost = lost_message(run.points, strays.left(run.points, run.away(run.points)))


def lost_message(points: Array, lost: Mask) -> str:
    """Return a message about points of the data that a model strayed from; empty if they are few."""
    if lost.mean() <= MOST_LOST:
        return ""
    return (
        f"the model strayed from {lost.mean():.0%} of the data, as near {place(points[lost][0])}, that its start was "
        "near to; more points, or normals if they have none, may keep it"
    )


def place(point: Sequence[float]) -> str:
    """Return a place as text, digits enough for coordinates far from the origin."""
    return f"({', '.join(f'{value:.7g}' for value in point)})"


def restored(tangles: Tangles, strays: Strays, target: Target) -> Tangles:
    """Return a mesh with parts that strayed put back: as films, or where these stray as films laid on the start."""
    for rings in (1, 4):
        for laid in (False, True):
            mesh = tangles.mesh
            strayed = strays.among(mesh)
            if not strayed.any():
                return tangles
            zone = strays.around(mesh, strayed, rings)
            film = with_membrane(mesh, zone)
            if laid:
                film = film.moved(strays.places(film.vertices))
            mended = untangled(tangles.with_positions(film, zone), target, reach=strays.edge, rounds=3)
            tangles = _improved(tangles, mended.mesh, strays)
    return tangles


def _improved(tangles: Tangles, moved: SimplexMesh, strays: Strays) -> Tangles:
    """Return the mesh with positions from `moved` in regions that then stray less, and neither lose data nor tangle."""
    zone = (moved.vertices != tangles.mesh.vertices).any(axis=1)
    other = tangles.with_positions(moved, zone)
    region = tangles.regions(other, zone | other.vertices)
    good = np.bincount(region, strays.among(other.mesh)) < np.bincount(region, strays.among(tangles.mesh))
    good &= np.bincount(region, other.vertices) <= np.bincount(region, tangles.vertices)
    good[region[strays.lost(other.mesh, zone)]] = False
    mixed = tangles.with_positions(moved, zone & good[region])
    return mixed if mixed.count <= tangles.count else tangles


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
    missed = float(((missing > limit) & ~enclosed).mean())
    _warn_of_poor_fit(run, off, missed)
    walls = not mesh.n_holes and not run.data.layered  # of volumes, cavities that were filled are told
    if walls and (message := walls_message(points, missing, mesh)):
        warn(message + "; components='all' keeps inner bodies and walls of cavities" * run.alone)
    elif run.alone and missed <= MOST_MISSED:
        warn("smaller bodies are left out; components='all' keeps them")
    _warn_of_topology(run, lid=lid)
    run.report(1.0, "done")


def _warn_of_poor_fit(run: Run, unseen: float, missed: float) -> None:
    """Warn when the motion ended early, much of the model has no data nearby, or much of the data no model nearby."""
    if run.diverged:
        warn(f"a part of the motion ended early ({run.diverged}): more data may tell better where the surface is")
    if unseen > MOST_UNSEEN:
        warn(f"{unseen:.0%} of the model is far from any data")
    if missed > MOST_MISSED:
        dropped = run.found is not None and run.data.components != "all" and run.found.components_dropped
        left_out = run.alone or dropped
        hint = "components='all' keeps all its pieces" if left_out else "more vertices or another start may reach it"
        warn(f"{missed:.0%} of the data is far from the model; {hint}")
    elif run.lost:
        warn(run.lost)


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
        messages.append(
            f"{run.tangled} vertices are on faces that are folded or cross others; more vertices or another start "
            "may help"
        )
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
