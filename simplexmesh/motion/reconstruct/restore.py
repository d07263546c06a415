"""Places of a model that strayed from the data, which its start was near to, are put back."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import counted, place, warn
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import Tangles, untangled, with_membrane
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.start.primitives import PRIMITIVES
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.motion.topology.face_regions import dilated
from simplexmesh.numerics.plane_fits import spacing_of

MOST_LOST = 0.01
"""Share of the data that a model may stray from without a warning; of walls thicker than their noise it is 0."""


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
