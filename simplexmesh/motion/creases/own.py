"""Models of triangles with sharp edges, made from these triangles: coarsened along the edges, and opened there."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.progress import Progress
from simplexmesh.data.cutting.dividing import divided
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangles.topology import vertex_fans
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.creases.cut import CutSurface, cut_along
from simplexmesh.motion.creases.evidence import evidence
from simplexmesh.motion.creases.line import CreaseLine
from simplexmesh.motion.creases.lines import resolution
from simplexmesh.motion.creases.opening import OpenedTriangles
from simplexmesh.motion.creases.paths import on_paths
from simplexmesh.motion.creases.sharpening import MOST, PERTURBATION, Sharpened
from simplexmesh.motion.creases.unfolding import untangled_by_rings
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import Tangles, untangled
from simplexmesh.motion.targets.triangles import Triangles, surface_distance
from simplexmesh.motion.topology.face_regions import dilated
from simplexmesh.surface.features.coarsened import EVENNESS
from simplexmesh.surface.features.feature_lines import feature_lines
from simplexmesh.surface.features.lines.network import FeatureNetwork

FINER = 1.5
"""Longest edge of the triangles that are coarsened, in roots of the area of a vertex of the model."""

ATTEMPTS, DEARER, AROUND = 3, 4.0, 1.5
"""How often a model that folds is made again, with vertices that many times as dear within some edges of the folds."""

NARROW = 0.25
"""In mean edges: parts no wider are joined to one beside them if faces fold there."""

MOST_OFF = 0.1
"""Share by which the number of vertices may differ from the one asked for."""

HOPELESS = 1 / 3
"""Share of vertices on folded faces above which no other attempt is made: of sixty parts none above 0.28 was taken."""

MOST_TANGLED = 0.01
"""Share of vertices on folded faces up to which a model is taken."""

FARTHEST = 0.03
"""Mean distance of the points from a model, in roots of the area of a vertex, up to which it is taken."""

MOST_TRIANGLES = 200_000
"""Of the surface, and when it is divided: each attempt takes seconds for each hundred thousand."""


def model_along(target: Triangles, points: Array, count: int, report: Progress) -> tuple[Sharpened, int] | None:
    """Return a mesh of about `count` vertices along the sharp edges of a closed surface, and how many are tangled.

    None without edges, if its `points` (n, 3) speak against them or are far from the mesh, if it touches itself or is
    noisier than the mesh is to be near, if the edges need more vertices, or many faces fold.
    """
    network = sharp_edges(TriangleMesh(target.vertices, target.faces, {}, target.unit))
    if network is None:
        return None
    edge, side = float(np.sqrt(network.mesh.area / count)), resolution(network.mesh.area / len(points), 0.0)
    lines = [CreaseLine(line.points, line.closed, 0.0) for line in network.lines]
    noisy = 4 * network.noise > EVENNESS * edge
    if noisy or not lines or evidence(lines, divided(network.mesh, side), points, side).together() <= 0:
        return None
    cut = cut_along(network, FINER * edge)
    if cut.corners > count / 2 or cut.surface.n_faces > MOST_TRIANGLES:
        return None
    found = _least_tangled(cut, count, target, sum(line.length for line in lines), report)
    if found is None or abs(found.mesh.n_vertices / count - 1) > MOST_OFF:
        return None
    found, tangled = _released(found)
    away = surface_distance(points, *fan(found.mesh.vertices, found.mesh.connectivity))
    if found.share < MOST or tangled > MOST_TANGLED * count or away.mean() > FARTHEST * edge:
        return None
    return found, tangled


def sharp_edges(surface: TriangleMesh) -> FeatureNetwork | None:
    """Return the sharp edges of a closed surface; None if it touches itself or has too many triangles."""
    surface = surface.welded(report=False)
    return None if surface.n_faces > MOST_TRIANGLES or _touches_itself(surface) else feature_lines(surface)


def _touches_itself(surface: TriangleMesh) -> bool:
    """Return whether more than two triangles share an edge of a surface, or those at a vertex are not one fan."""
    try:
        mates = half_edge_mates(surface.faces.astype(np.int64))
    except TopologyError:
        return True
    return int(vertex_fans(surface.faces, mates).max()) + 1 > len(np.unique(surface.faces))


def _least_tangled(cut: CutSurface, count: int, target: Triangles, length: float, report: Progress) -> Sharpened | None:
    """Return a model along the lines of a surface, of so much length, or None where that is hopeless."""
    weights, vertices = np.ones(cut.surface.n_vertices), cut.surface.vertices
    best, fewest = None, count
    for attempt in range(ATTEMPTS):
        report(0.1 + 0.8 * attempt / ATTEMPTS, "along its sharp edges")
        coarse, middles = cut.coarsened(count - cut.corners, weights)
        opened = OpenedTriangles(coarse, middles)
        creased = on_paths(opened.paths, opened.count)
        mesh = opened.mesh().with_data(crease=creased.astype(np.uint8))
        rows = np.flatnonzero(~creased)
        if mesh.n_vertices <= (1 + MOST_OFF) * count:  # else it is not taken
            parts = Parts(cut)
            mesh = _unfolded(mesh, rows, parts, parts.of(coarse)[rows])
        tangled = tangled_vertices(mesh)
        if best is None or tangled.sum() < fewest:
            best, fewest = Sharpened(mesh, target, opened.paths, length), int(tangled.sum())
        if fewest > HOPELESS * count:
            return None
        if not fewest:
            break
        away = cKDTree(mesh.vertices[tangled]).query(vertices, distance_upper_bound=AROUND * mean_edge(mesh))[0]
        weights[np.isfinite(away)] *= DEARER
        cut = cut.without_strips(np.isfinite(away), NARROW * mean_edge(mesh))
    return best


def _released(found: Sharpened) -> tuple[Sharpened, int]:
    """Return a model with less on its lines, moved as smooth ones are, where it is tangled, and how much still is."""
    mesh, creased = found.mesh, on_paths(found.paths, found.mesh.n_vertices)
    tangled = tangled_vertices(mesh)
    best, fewest = found, int(tangled.sum())
    for rings in (0, 1, 2, 4):
        if not fewest:
            break
        creased = creased & ~dilated(tangled, mesh.neighbors, rings)
        mesh = mesh.with_data(crease=creased.astype(np.uint8))
        mesh = untangled(Tangles(mesh), found.target, reach=2 * mean_edge(mesh), rounds=3).mesh
        tangled = tangled_vertices(mesh)
        if tangled.sum() < fewest:
            pieces = [piece for path in found.paths for piece in path.pieces(creased)]
            best, fewest = Sharpened(mesh, found.target, pieces, found.sought), int(tangled.sum())
    return best, fewest


class Parts:
    """The parts of a surface that is cut, each as one to be near to."""

    def __init__(self, cut: CutSurface) -> None:
        surface, self._of = cut.surface, cut.parts
        self._whole = Triangles(surface)
        masks = [self._of == k for k in range(self._of.max() + 1)]
        self._surfaces = [Triangles(TriangleMesh(surface.vertices, surface.faces[mask])) for mask in masks]

    def of(self, coarse: CutSurface) -> Indices:
        """Return the part (t,) that triangles of a coarser surface are of: that of most of the same part of it."""
        nearest = self._of[self._whole.closest(coarse.surface.vertices[coarse.surface.faces].mean(axis=1))[2]]
        votes = np.zeros((coarse.parts.max() + 1, len(self._surfaces)), np.int64)
        np.add.at(votes, (coarse.parts, nearest), 1)
        return np.asarray(votes.argmax(axis=1)[coarse.parts])

    def nearest(self, points: Array, part: Indices) -> Array:
        """Return the places (n, 3) on parts (n,) nearest to points (n, 3)."""
        out = points.copy()
        for k in np.unique(part).tolist():
            out[part == k] = self._surfaces[k].closest(points[part == k])[1]
        return out


def _unfolded(mesh: SimplexMesh, rows: Indices, parts: Parts, part: Indices) -> SimplexMesh:
    """Return a mesh with some vertices (k,) on the parts (k,) that they are of, moved on these so that faces unfold."""

    def laid(mesh: SimplexMesh) -> SimplexMesh:
        vertices = mesh.vertices + PERTURBATION * mean_edge(mesh) * np.random.default_rng(0).normal(
            size=(mesh.n_vertices, 3)
        )
        vertices[rows] = parts.nearest(vertices[rows], part)
        return mesh.moved(vertices)

    return untangled_by_rings(laid(mesh), np.isin(np.arange(mesh.n_vertices), rows), laid, even=False)
