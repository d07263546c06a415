"""Vertices that strayed: the places of a model that are farther from the data than its start was there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.errors import DivergedError, counted, warn
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.stages import Stage, mean_edge
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

    A vertex strayed when it is farther from the data than the start is at the place nearest to it, by an edge.
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

    def places(self, mesh: SimplexMesh) -> Array:
        """Return (n, 3) the place of the start nearest to each vertex."""
        return self._surface.closest(mesh.vertices)[1]

    def away(self, mesh: SimplexMesh) -> Array:
        """Return (n,) the distance of each vertex from the data."""
        return np.asarray(self._tree.query(mesh.vertices, workers=-1)[0])

    def among(self, mesh: SimplexMesh, edges: float = 1.0) -> Mask:
        """Return the vertices (n,) that strayed by more than a number of edges."""
        away, limit = self.away(mesh), edges * self.edge
        out = away > limit
        if out.any():
            there = self._surface.closest(mesh.vertices[out])[1]
            out[out] = away[out] > self._tree.query(there)[0] + limit
        return np.asarray(out)

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
    strayed = strays.among(run.mesh)
    if not strayed.any():
        return
    tangles = restored(Tangles(run.mesh), strays, strayed, run.target, run.stages[0])
    run.restored = int((tangles.mesh.vertices != run.mesh.vertices).any(axis=1).sum())
    run.strayed, run.mesh, run.tangled = int(strays.among(tangles.mesh).sum()), tangles.mesh, tangles.count
    if run.strayed:
        count = counted(run.strayed, "vertex is", "vertices are")
        warn(f"{count} farther from the data than the start was there; more vertices or another start may help")


def restored(tangles: Tangles, strays: Strays, strayed: Mask, target: Target, stage: Stage) -> Tangles:
    """Return a mesh with parts that strayed put back: as films fitted again, as films, or on the start."""
    for rings in (1, 2, 4, 8):
        mesh = tangles.mesh
        zone = strays.around(mesh, strayed, rings)
        film = filmed(mesh, zone)
        for way in ("fitted", "film", "untangled", "start"):
            moved = film
            if way == "fitted":
                moved = _fitted(film, zone, target, stage)
            elif way == "untangled":
                moved, _ = untangled(film, target, reach=strays.edge, rounds=3)
            elif way == "start":
                moved = mesh.moved(np.where(zone[:, None], strays.places(mesh), mesh.vertices))
            zone = zone | (moved.vertices != mesh.vertices).any(axis=1)
            tangles = _improved(tangles, moved, zone, strays)
            strayed = strays.among(tangles.mesh)
            if not strayed.any():
                return tangles
    return tangles


def _fitted(mesh: SimplexMesh, zone: Mask, target: Target, stage: Stage) -> SimplexMesh:
    """Return the mesh with a zone fitted to the data again, stiffly and from as far as in the first stage."""
    free = zone.astype(float)
    model = DeformableModel(
        mesh, target, rigidity=stage.rigidity, reach=stage.reach, alpha=0.4 * free, beta=0.2 * free, damping=1.0
    )
    try:
        for _ in model.run(40, warnings=False):
            pass
    except DivergedError:  # the film itself is the next attempt
        return mesh
    return model.mesh


def _improved(tangles: Tangles, moved: SimplexMesh, zone: Mask, strays: Strays) -> Tangles:
    """Return the mesh with positions from `moved` in the regions that are nearer to the data and no more tangled."""
    other = tangles.with_positions(moved, zone)
    region = tangles.regions(other, zone | other.vertices)
    fewer = np.bincount(region, strays.among(other.mesh)) < np.bincount(region, strays.among(tangles.mesh))
    nearer = np.bincount(region, strays.away(other.mesh) ** 2) < np.bincount(region, strays.away(tangles.mesh) ** 2)
    clean = np.bincount(region, other.vertices) <= np.bincount(region, tangles.vertices)
    mixed = tangles.with_positions(moved, zone & (fewer & nearer & clean)[region])
    return mixed if mixed.count <= tangles.count else tangles
