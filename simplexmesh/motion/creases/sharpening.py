"""Models with the creases of their data: their edges brought onto them, each side moved to its own data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import DivergedError, warn
from simplexmesh._base.vectors import dot
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.face_geometry import face_normals
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.creases.blurred import are_sharp, blur_of
from simplexmesh.motion.creases.lines import CreaseLine, crease_lines, resolution
from simplexmesh.motion.creases.paths import Path, on_paths, respaced, traced
from simplexmesh.motion.creases.sides import Sided
from simplexmesh.motion.creases.unfolding import unfolded
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import untangled, with_membrane
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.motion.targets.triangles import surface_distance
from simplexmesh.motion.topology.face_regions import dilated
from simplexmesh.surface.features.lines.network import FeatureLine

BESIDE = 0.7
"""In mean edges: data as near to a line tells whether it is a crease."""

IMPROVED = 0.5
"""Share of the squared deviation beyond noise, over all lines, that may be left with creases; else these are folds."""

MOST = 0.5
"""Share of the length of all lines that must look like creases; else the body is smooth, with narrow folds."""

CERTAIN = 4.0
"""Standard errors of the squared deviation that are no chance."""

ASTRIDE = 2.0
"""In standard deviations of the noise: points nearer to a crease may belong to either side."""

SETTLED = 8
"""Rings around creases in which vertices move: others are where the smooth model had them, tips of cones too."""

ROUNDED = 2.0
"""In standard deviations of the blur: an isosurface is round as near to a crease."""


@dataclass(frozen=True)
class Sharpened:
    """A model with creases, the target that it was moved to, and the paths of creases along its edges.

    `laid` is the model before paths were released around folds, and `traced` (k,) are the lines that had a path in it.
    """

    mesh: SimplexMesh
    target: Sided
    paths: list[Path]
    laid: SimplexMesh
    traced: Mask

    def creases(self) -> tuple[FeatureLine, ...]:
        """Return the creases as lines, the longest first, with the angles between the faces on both sides."""
        c, vertices = self.mesh.connectivity, self.mesh.vertices
        normals = face_normals(vertices, c.face_vertices, c.face_offsets)
        out = []
        for path in self.paths:
            darts = 3 * path.steps[:, 0] + (c.neighbors[path.steps[:, 0]] == path.steps[:, 1:]).argmax(axis=1)
            left, right = (normals[c.face.reshape(-1)[side]] for side in (darts, c.twin.reshape(-1)[darts]))
            turned = np.arccos(np.clip(dot(left, right), -1.0, 1.0))
            around = (turned[-1], turned) if path.closed else (turned[0], np.append(turned, turned[-1]))
            angle = 0.5 * (np.append(*around)[: len(path.vertices)] + around[1][: len(path.vertices)])
            places, ends = checks.frozen(vertices[path.vertices]), np.stack([path.vertices, path.vertices], axis=1)
            out.append(FeatureLine(places, checks.frozen(ends), path.closed, "C0", checks.frozen(angle)))
        return tuple(sorted(out, key=lambda line: -line.length))


def sharpened(mesh: SimplexMesh, points: Array, before: Array, target: Any) -> Sharpened | None:
    """Return a closed mesh near points (n, 3), `before` (n,) away, with creases along its edges, or None without any.

    Creases are the sharp edges of a surface through the points if the mesh rounds most of them by more than the noise
    explains, and does not round these any more once they are its own.
    """
    noise, edge = float(getattr(target, "noise", 0.0)), mean_edge(mesh)
    if not (before > 3 * noise + 0.1 * edge).any():
        return None
    lines = crease_lines(mesh, points, noise)
    beside = _beside(lines, points, edge)
    first = np.array([_mean_square(before[near]) for near in beside])
    certain = CERTAIN * noise**2 * np.sqrt(2 / np.array([max(len(near), 1) for near in beside]))
    rounded = first - noise**2 > certain

    def worse(found: Sharpened) -> Mask | None:
        laid, now = (_away(points, each) for each in (found.laid, found.mesh))
        left = np.array([_mean_square(laid[near]) for near in beside]) - noise**2
        weights = np.where(rounded, [line.length for line in lines], 0.0)
        if not weights @ left < IMPROVED * (weights @ (first - noise**2)):
            return None
        return np.array([_mean_square(now[near]) for near in beside]) > first

    if not _are_most(rounded, lines):
        return None
    wide = resolution(mesh.area / len(points), noise)
    return _laid(Scene(mesh, lines, points, target, ASTRIDE * noise, wide), np.ones(len(lines), bool), worse)


def sharpened_volume(mesh: SimplexMesh, points: Array, away: Array, target: Isosurface) -> Sharpened | None:
    """Return a closed mesh near points of an isosurface with the sharp edges of the object, or None if it has none.

    `away` (n,) are the distances of the points. Creases are lines on the isosurface that are sharp but for the blur of
    the volume, if most of them are; the sides beyond that blur tell where they meet.
    """
    blur = blur_of(target, mesh)
    if np.isinf(blur):
        return None
    noise = float(np.median(away))
    lines = crease_lines(mesh, points, noise)
    if not lines:
        return None
    chosen = are_sharp(lines, mesh, target, blur)
    if not _are_most(chosen, lines):
        return None
    scene = Scene(mesh, lines, points, target, ROUNDED * blur, resolution(mesh.area / len(points), noise))
    return _laid(scene, chosen, lambda _: np.zeros(len(lines), bool))


def _are_most(chosen: Mask, lines: Sequence[CreaseLine]) -> bool:
    """Return whether some lines are enough of the length of all for a body with creases."""
    lengths = np.array([line.length for line in lines])
    return bool(lengths[chosen].sum() > MOST * lengths.sum())


def _away(points: Array, mesh: SimplexMesh) -> Array:
    """Return the distances (n,) of points from a mesh."""
    return np.asarray(surface_distance(points, *fan(mesh.vertices, mesh.connectivity)))


def _beside(lines: Sequence[CreaseLine], points: Array, edge: float) -> list[Indices]:
    """Return the rows of the points beside each line."""
    tree = cKDTree(points)
    balls = [tree.query_ball_point(line.samples(0.2 * edge)[0], BESIDE * edge) for line in lines]
    return [np.array(sorted(set(chain.from_iterable(ball))), np.int64) for ball in balls]


def _mean_square(away: Array) -> float:
    """Return the mean squared distance of some points; 0 of none."""
    return float((away**2).mean()) if len(away) else 0.0


@dataclass(frozen=True)
class Scene:
    """A smooth mesh, lines to be laid on it, and data: points nearer to a crease than `rounded` belong to no side.

    The lines were found on a surface whose triangles have edges of `resolution`.
    """

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
    def tree(self) -> cKDTree:
        """The tree of the points."""
        return cKDTree(self.points)

    def strays(self, found: Sharpened) -> Mask:
        """Return the lines (k,) nearest to points, and vertices, that were nearer by an edge without creases."""
        lost = self.points[_away(self.points, found.mesh) > _away(self.points, self.mesh) + self.edge]
        before, now = (self.tree.query(mesh.vertices, workers=-1)[0] for mesh in (self.mesh, found.mesh))
        lost = np.concatenate([lost, found.mesh.vertices[now > before + max(self.edge, self.resolution)]])
        samples = [line.samples(self.edge)[0] for line in self.lines]
        of = np.repeat(np.arange(len(self.lines)), [len(line) for line in samples])
        nearest = of[cKDTree(np.concatenate(samples)).query(lost)[1]]
        return np.bincount(nearest, minlength=len(self.lines)) > 0


def _laid(scene: Scene, chosen: Mask, worse: Callable[[Sharpened], Mask | None]) -> Sharpened | None:
    """Return the mesh with creases on chosen lines (k,) less those it is worse with; None, with a warning, if it folds.

    The function returns the lines that go out, or None if the body is smooth.
    """
    for last in (False, False, True):
        found = _moved_onto(scene, np.flatnonzero(chosen))
        if found is None:
            return None
        bad = worse(found)
        if bad is None:
            return None
        strays = scene.strays(found)
        bad = found.traced & (bad | strays)
        if found.paths and not (strays if last else bad).any() and not tangled_vertices(found.mesh).any():
            return found
        chosen = found.traced & ~bad
        if not chosen.any() and not strays.any():  # the model is worse with every one of them
            return None
        if not bad.any() or not chosen.any():
            break
    warn("the model stays smooth: with the sharp edges of the data its faces would fold; more vertices may help")
    return None


def _moved_onto(scene: Scene, chosen: Indices) -> Sharpened | None:
    """Return the mesh with paths laid on chosen lines, and then where sides meet; None if no line has a path."""
    mesh, edge, reach = scene.mesh, scene.edge, max(scene.edge, scene.resolution)
    paths = [replace(path, line=int(chosen[path.line])) for path in traced(mesh, [scene.lines[k] for k in chosen])]
    if not paths:
        return None
    creased = on_paths(paths, mesh.n_vertices)
    vertices = mesh.vertices.copy()
    for path in paths:
        vertices[path.vertices] = path.places
    now = mesh.moved(vertices).with_data(crease=creased.astype(np.uint8))
    now = with_membrane(now, dilated(creased, mesh.neighbors, 2) & ~creased)
    sided = Sided(now, paths, scene.points, scene.target, scene.rounded)
    try:
        now = _settled(now, sided, creased, 40, edge)
        now = now.moved(sided.met(now, paths, reach))
        sided = Sided(now, paths, scene.points, scene.target, scene.rounded)  # points near lines may change sides
        for _ in range(2):
            now = now.moved(respaced(now, paths))
            now = now.moved(sided.met(now, paths, reach))
            now = _settled(now, sided, creased, 20, edge)
        for rings in (1, 2, 3):
            tangled = tangled_vertices(now)
            if not tangled.any():
                break
            other = unfolded(now, dilated(tangled, mesh.neighbors, rings) & ~creased)
            now = other if tangled_vertices(other).sum() < tangled.sum() else now
        out, creased = _released(now, sided, creased, edge)
    except DivergedError as error:
        warn(f"the model stays smooth: {error}")
        return None
    found = np.isin(np.arange(len(scene.lines)), [path.line for path in paths])
    return Sharpened(out, sided, [piece for path in paths for piece in path.pieces(creased)], now, found)


def _released(mesh: SimplexMesh, target: Sided, creased: Mask, edge: float) -> tuple[SimplexMesh, Mask]:
    """Return the mesh untangled, and its vertices (n,) still on creases: no edge of it can be one where it tangles."""
    for rings in (2, 4, 8):
        tangled = tangled_vertices(mesh)
        if not tangled.any():
            break
        near = dilated(tangled, mesh.neighbors, rings)
        target.see_all(near)
        creased = creased & ~near
        out, _ = untangled(mesh.with_data(crease=creased.astype(np.uint8)), target, reach=2 * edge)
        creased &= (out.vertices == mesh.vertices).all(axis=1)
        mesh = out.with_data(crease=creased.astype(np.uint8))
    return mesh, creased


def _settled(mesh: SimplexMesh, target: Sided, creased: Mask, iterations: int, edge: float) -> SimplexMesh:
    """Return the mesh with the vertices around creases moved to their data, evenly spread; they and others stay."""
    held = creased | ~dilated(creased, mesh.neighbors, SETTLED)
    free = np.where(held, 0.0, 0.4)
    even = np.full((mesh.n_vertices, 3), 1 / 3)
    model = DeformableModel(
        mesh, target, alpha=free, beta=free, damping=np.where(held, 1.0, 0.6), reach=2 * edge, metric=even,
        constraint="mean_curvature",
    )  # fmt: skip
    for _ in model.run(iterations, warnings=False):
        pass
    return model.mesh
