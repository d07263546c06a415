"""Models with the creases of their data: their edges brought onto them, each side moved to its own data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.errors import DivergedError, warn
from simplexmesh._base.vectors import dot
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.face_geometry import face_normals
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.creases.blurred import are_sharp, blur_of
from simplexmesh.motion.creases.evidence import evidence
from simplexmesh.motion.creases.line import CreaseLine
from simplexmesh.motion.creases.lines import crease_lines, resolution
from simplexmesh.motion.creases.paths import Path, on_paths, respaced, traced
from simplexmesh.motion.creases.sides import SETTLED, Sided
from simplexmesh.motion.creases.unfolding import untangled_by_rings
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import Tangles, untangled, with_membrane
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.motion.targets.triangles import surface_distance
from simplexmesh.motion.topology.face_regions import dilated
from simplexmesh.surface.features.lines.network import FeatureLine

DECISIVE = 10.0
"""Standard errors by which all points must speak for edges: ridges rounder than can be seen give up to nine."""

CLEAR = 4.0
"""Standard errors by which points must speak for each of several lines that are edges together."""

MOST = 0.5
"""Share of the length of all lines in a volume that must look like creases; of creases that a model must have."""

BETWEEN = 1.5
"""Of the distance between random points: no place of their surface in a thousand is farther from all of them."""

ASTRIDE = 2.0
"""In standard deviations of the noise or the blur: points nearer to a crease may belong to either side."""

PERTURBATION = 1e-9
"""In mean edges: faces that share exact lines touch, and would cross or not by rounding (Edelsbrunner, Mucke 1990)."""


@dataclass(frozen=True)
class Sharpened:
    """A model with creases, its target, their paths along its edges, and the length of the sharp edges of the data."""

    mesh: SimplexMesh
    target: Target
    paths: list[Path]
    sought: float

    @property
    def share(self) -> float:
        """The length of its creases, in that of the sharp edges."""
        return sum(line.length for line in self.creases()) / self.sought

    def creases(self) -> tuple[FeatureLine, ...]:
        """Return the creases as lines, the longest first, with the angles between the faces on both sides."""
        c, vertices = self.mesh.connectivity, self.mesh.vertices
        normals = face_normals(vertices, c.face_vertices, c.face_offsets)
        out = []
        for path in (path for path in self.paths if path.line >= 0):
            darts = 3 * path.steps[:, 0] + (c.neighbors[path.steps[:, 0]] == path.steps[:, 1:]).argmax(axis=1)
            left, right = (normals[c.face.reshape(-1)[side]] for side in (darts, c.twin.reshape(-1)[darts]))
            turned = np.arccos(np.clip(dot(left, right), -1.0, 1.0))
            around = (turned[-1], turned) if path.closed else (turned[0], np.append(turned, turned[-1]))
            angle = 0.5 * (np.append(*around)[: len(path.vertices)] + around[1][: len(path.vertices)])
            places, ends = checks.frozen(vertices[path.vertices]), np.stack([path.vertices, path.vertices], axis=1)
            out.append(FeatureLine(places, checks.frozen(ends), path.closed, "C0", checks.frozen(angle)))
        return tuple(sorted(out, key=lambda line: -line.length))


def sharpened(
    mesh: SimplexMesh, points: Array, before: Array, target: Any, *, least_angle: float = 0.0
) -> Sharpened | None:
    """Return a closed mesh near points (n, 3), `before` (n,) away, with creases along its edges, or None."""
    if not (before > 0.1 * mean_edge(mesh)).any():
        return None
    noise = float(getattr(target, "noise", 0.0))
    side = resolution(mesh.area / len(points), noise)
    lines, through = crease_lines(mesh, points, noise)
    lines = [line for line in lines if line.angle >= least_angle]
    if not lines:
        return None
    told = evidence(lines, through, points, side)
    least = DECISIVE
    if told.together() > DECISIVE:
        least = 0.0  # of a body with edges points need not speak clearly for each
    elif told.together() > 0 and told.together(told.errors > CLEAR) > DECISIVE:  # among some rounds
        least = CLEAR
    chosen = [line for line, sure in zip(lines, told.errors, strict=True) if sure > least]
    if not chosen:
        return None
    return _laid(Scene(mesh, chosen, points, target, ASTRIDE * noise, side))


def sharpened_volume(mesh: SimplexMesh, points: Array, away: Array, target: Isosurface) -> Sharpened | None:
    """Return a closed mesh near points, `away` (n,) from it, of an isosurface with blurred edges, or None."""
    blur = blur_of(target, mesh)
    if np.isinf(blur):
        return None
    noise = float(np.median(away))
    lines, _ = crease_lines(mesh, points, noise)
    if not lines:
        return None
    sharp = are_sharp(lines, mesh, target, blur)
    chosen = [line for line, of_two_sides in zip(lines, sharp, strict=True) if of_two_sides]
    if _length(chosen) <= MOST * _length(lines):
        return None
    return _laid(Scene(mesh, chosen, points, target, ASTRIDE * blur, resolution(mesh.area / len(points), noise)))


def _length(lines: Sequence[CreaseLine]) -> float:
    """Return the length of lines."""
    return sum(line.length for line in lines)


@dataclass(frozen=True)
class Scene:
    """A smooth mesh, lines to be laid on it, and data: points nearer to a crease than `rounded` belong to no side."""

    mesh: SimplexMesh
    lines: Sequence[CreaseLine]
    points: Array
    target: Any
    rounded: float
    resolution: float

    @cached_property
    def edge(self) -> float:
        """The mean edge."""
        return mean_edge(self.mesh)

    @cached_property
    def limit(self) -> float:
        """How much farther from the points a vertex may come to lie: an edge, or what they leave between them."""
        return max(self.edge, BETWEEN * float(np.sqrt(self.mesh.area / len(self.points))))

    @cached_property
    def before(self) -> tuple[Array, Array]:
        """The distances of the points from the mesh, and of its vertices from the points."""
        return self.away(self.mesh)

    def away(self, mesh: SimplexMesh) -> tuple[Array, Array]:
        """Return the distances of the points from a mesh, and of its vertices from the points."""
        of_points = surface_distance(self.points, *fan(mesh.vertices, mesh.connectivity))
        return np.asarray(of_points), self.tree.query(mesh.vertices, workers=-1)[0]

    @cached_property
    def tree(self) -> cKDTree:
        """The tree of the points."""
        return cKDTree(self.points)

    def failed(self, mesh: SimplexMesh) -> Mask:
        """Return the vertices (n,) of a mesh that are tangled, or farther from the data than before by an edge."""
        points, vertices = self.away(mesh)
        out = tangled_vertices(mesh) | (vertices > self.before[1] + self.limit)
        lost = self.points[points > self.before[0] + self.edge]
        out[cKDTree(mesh.vertices).query(lost)[1]] = True
        return out


def _laid(scene: Scene) -> Sharpened | None:
    """Return the mesh with edges on the lines, where that does not fold it; None, with a warning, if that fails."""
    paths = traced(scene.mesh, scene.lines, scene.resolution)
    if not paths:
        warn("the model stays smooth: its edges find no way along the sharp edges of the data; more vertices may help")
        return None
    creased = on_paths(paths, scene.mesh.n_vertices)
    try:
        mesh, sided = _moved_onto(scene, paths, creased)
        mesh, creased = _released(scene, mesh, sided, creased)
    except DivergedError as error:
        warn(f"the model stays smooth: {error}")
        return None
    found = Sharpened(mesh, sided, [piece for path in paths for piece in path.pieces(creased)], _length(scene.lines))
    if not found.paths or tangled_vertices(mesh).any():
        warn("the model stays smooth: with the sharp edges of the data its faces would fold; more vertices may help")
        return None
    if found.share < MOST and scene.edge < scene.resolution:  # then faces are small enough for what is sharp
        lost = 1 - found.share
        warn(f"the model stays smooth: {lost:.0%} of what looks like sharp edges folds it or leaves the data")
        return None
    return found


def _moved_onto(scene: Scene, paths: Sequence[Path], creased: Mask) -> tuple[SimplexMesh, Sided]:
    """Return the mesh with the vertices of paths (n,) on their lines, and then where sides meet."""
    mesh, edge = scene.mesh, scene.edge
    vertices = mesh.vertices.copy()
    for path in paths:
        vertices[path.vertices] = path.places
    now = mesh.moved(vertices).with_data(crease=creased.astype(np.uint8))
    now = with_membrane(now, dilated(creased, mesh.neighbors, 2) & ~creased)
    sided = Sided(now, paths, scene.points, scene.target, scene.rounded)
    now = _settled(now, sided, creased, 40, edge)
    now = now.moved(sided.met(now, paths, scene.resolution))
    sided = Sided(now, paths, scene.points, scene.target, scene.rounded)  # points near lines may change sides
    for _ in range(2):
        now = now.moved(respaced(now, paths))
        now = now.moved(sided.met(now, paths, scene.resolution))
        now = _settled(now, sided, creased, 20, edge)
    now = now.moved(now.vertices + PERTURBATION * edge * np.random.default_rng(0).normal(size=now.vertices.shape))
    folded = now.vertices

    def laid(mesh: SimplexMesh) -> SimplexMesh:
        return mesh.moved(sided.nearest(mesh, (mesh.vertices != folded).any(axis=1)))

    return untangled_by_rings(now, ~creased, laid), sided


def _released(scene: Scene, mesh: SimplexMesh, target: Sided, creased: Mask) -> tuple[SimplexMesh, Mask]:
    """Return the mesh as smooth as before where it failed, and its vertices (n,) still on creases."""
    for rings in (1, 2, 4, 8):
        failed = scene.failed(mesh)
        if not failed.any():
            break
        near = dilated(failed, mesh.neighbors, rings)
        target.see_all(near)
        creased = creased & ~near
        mesh = mesh.moved(np.where(near[:, None], scene.mesh.vertices, mesh.vertices))
        mesh = mesh.with_data(crease=creased.astype(np.uint8))
        mesh = untangled(Tangles(mesh), target, reach=2 * scene.edge).mesh
    return mesh, creased


def _settled(mesh: SimplexMesh, target: Sided, creased: Mask, iterations: int, edge: float) -> SimplexMesh:
    """Return the mesh with the vertices around creases moved to their data, evenly spread; they and others stay."""
    held = creased | ~(dilated(creased, mesh.neighbors, SETTLED) | target.is_known)
    free = np.where(held, 0.0, 0.4)
    even = np.full((mesh.n_vertices, 3), 1 / 3)
    model = DeformableModel(
        mesh, target, alpha=free, beta=free, damping=np.where(held, 1.0, 0.6), reach=2 * edge, metric=even,
        constraint="mean_curvature",
    )  # fmt: skip
    for _ in model.run(iterations, warnings=False):
        pass
    return model.mesh
