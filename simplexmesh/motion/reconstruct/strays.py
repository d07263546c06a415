"""Vertices that strayed: the places of a model that are farther from the data than its start was there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.errors import counted, warn
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.stages import mean_edge
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.model.untangle import Tangles, filmed, untangled
from simplexmesh.motion.reconstruct.measure import drawn_points
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.start.primitives import PRIMITIVES
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.motion.topology.face_regions import dilated

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Strays:
    """The start of a motion and the points of its data, which tell where a mesh has strayed.

    A vertex strayed when it, or the center of one of its faces, is farther from the data than the start is at the place
    nearest to it, by an edge; the mesh strayed from a point of the data that the start was nearer to, by an edge.
    """

    start: SimplexMesh
    points: Array
    edge: float

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

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
        away = np.asarray(self._tree.query(places, workers=-1)[0])
        out = away > limit
        out[mesh.n_vertices :] &= ~c.face_is_hole
        if out.any():
            out[out] = away[out] > self._tree.query(self.places(places[out]))[0] + limit
        return np.asarray(out[: mesh.n_vertices] | out[mesh.n_vertices :][c.vertex_faces].any(axis=1))

    def lost(self, mesh: SimplexMesh, zone: Mask) -> NDArray[np.int64]:
        """Return the vertices nearest to the points in a zone (n,) that the mesh strayed from, one for each point."""
        nearest = cKDTree(mesh.vertices).query(self.points, workers=-1)[1]
        here = zone[nearest]
        surfaces = Triangles(mesh.triangulated(method="fan")), self._surface
        now, then = (surface.closest(self.points[here])[0] for surface in surfaces)
        return np.asarray(nearest[here][now > then + self.edge])

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
    strays = Strays(run.start, drawn_points(run.data), mean_edge(run.mesh))
    if not strays.among(run.mesh).any():
        return
    tangles = restored(Tangles(run.mesh), strays, run.target)
    run.restored = int((tangles.mesh.vertices != run.mesh.vertices).any(axis=1).sum())
    run.strayed, run.mesh, run.tangled = int(strays.among(tangles.mesh).sum()), tangles.mesh, tangles.count
    if run.strayed:
        count = counted(run.strayed, "vertex is", "vertices are")
        warn(f"{count} farther from the data than the start was there; more vertices or another start may help")


def restored(tangles: Tangles, strays: Strays, target: Target) -> Tangles:
    """Return a mesh with parts that strayed put back: as films, or where these stray as films laid on the start."""
    for rings in (1, 4):
        for laid in (False, True):
            mesh = tangles.mesh
            strayed = strays.among(mesh)
            if not strayed.any():
                return tangles
            zone = strays.around(mesh, strayed, rings)
            film = filmed(mesh, zone)
            if laid:
                film = mesh.moved(np.where(zone[:, None], strays.places(film.vertices), mesh.vertices))
            moved, _ = untangled(film, target, reach=strays.edge, rounds=3)
            tangles = _improved(tangles, moved, strays)
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
