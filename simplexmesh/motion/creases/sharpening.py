"""Models with the creases of their data: their edges brought onto them, each side moved to its own data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
from simplexmesh.motion.creases.lines import Line, crease_lines
from simplexmesh.motion.creases.paths import Path, on_paths, traced
from simplexmesh.motion.creases.sides import Sided
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.model.untangle import filmed, untangled
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.motion.targets.triangles import surface_distance
from simplexmesh.motion.topology.face_regions import dilated
from simplexmesh.surface.features.lines.network import FeatureLine

BESIDE = 0.7
"""In mean edges: data as near to a line tells whether it is a crease."""

IMPROVED = 0.5
"""Share of the squared deviation beyond noise that may be left at a line, for it to be a crease."""

CONFIRMED = 0.5
"""Share of the length of all lines that must be creases; else the body is smooth, with narrow folds."""

ROUNDS = 3
"""Of laying creases, while lines go out."""

CERTAIN = 4.0
"""Standard errors of the squared deviation that are no chance."""


ASTRIDE = 2.0
"""In standard deviations of the noise: points nearer to a crease may belong to either side."""

ROUNDED = 2.0
"""In standard deviations of the blur: an isosurface is round as near to a crease."""

MEDIAN_OF_NORMAL = 0.6745
"""Median distance from the mean, in standard deviations."""

FOLDED = "the model stays smooth: with the sharp edges of the data its faces would fold; more vertices may help"


@dataclass(frozen=True)
class Sharpened:
    """A model with creases, the target that it was moved to, and the paths of creases along its edges."""

    mesh: SimplexMesh
    target: Sided
    paths: list[Path]

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


def sharpened(mesh: SimplexMesh, points: Array, target: Any) -> Sharpened | None:
    """Return a closed mesh near points (n, 3) with their creases along its edges, or None if they have none.

    Creases along which no mesh without folds was found are left out, with a warning.
    The creases are sharp edges of a surface through the points that the mesh rounds by more than the noise explains,
    and that it does not round any more once they are its own.
    """
    noise, edge = float(getattr(target, "noise", 0.0)), mean_edge(mesh)
    before = surface_distance(points, *fan(mesh.vertices, mesh.connectivity))
    if not (before > 3 * noise + 0.1 * edge).any():
        return None
    lines = crease_lines(mesh, points, noise)
    beside = [_beside(line, points, edge) for line in lines]
    first = np.array([_mean_square(before[near]) for near in beside])
    certain = CERTAIN * noise**2 * np.sqrt(2 / np.array([max(len(near), 1) for near in beside]))
    rounded = first - noise**2 > certain
    if not _are_most(rounded, lines):
        return None
    chosen, found = np.ones(len(lines), bool), None
    for _ in range(ROUNDS):
        found = _moved_onto(mesh, lines, np.flatnonzero(chosen), points, target, edge, ASTRIDE * noise)
        if found is None:
            return None
        away = surface_distance(points, *fan(found.mesh.vertices, found.mesh.connectivity))
        now = np.array([_mean_square(away[near]) for near in beside])
        chosen = np.isin(np.arange(len(lines)), [path.line for path in found.paths])
        if not _are_most(chosen & rounded & (now - noise**2 < IMPROVED * (first - noise**2)), lines):
            return None
        worse = chosen & (now > first)
        if not worse.any() and not tangled_vertices(found.mesh).any():
            return found
        chosen &= ~worse
    warn(FOLDED)
    return None


def sharpened_volume(mesh: SimplexMesh, points: Array, target: Isosurface) -> Sharpened | None:
    """Return a closed mesh near the isosurface of a volume with the sharp edges of the object along its edges, or None.

    Creases are lines on the isosurface that are sharp but for the blur of the volume; the sides, beyond that blur,
    tell where they meet.
    """
    blur, edge = blur_of(target, mesh), mean_edge(mesh)
    if np.isinf(blur):
        return None
    noise = float(np.median(surface_distance(points, *fan(mesh.vertices, mesh.connectivity)))) / MEDIAN_OF_NORMAL
    lines = crease_lines(mesh, points, noise)
    if not lines:
        return None
    chosen = are_sharp(lines, mesh, target, blur)
    if not _are_most(chosen, lines):
        return None
    found = _moved_onto(mesh, lines, np.flatnonzero(chosen), points, target, edge, ROUNDED * blur)
    if found is None or tangled_vertices(found.mesh).any():
        warn(FOLDED)
        return None
    return found


def _are_most(chosen: Mask, lines: Sequence[Line]) -> bool:
    """Return whether some lines are enough of the length of all for a body with creases."""
    lengths = np.array([line.length for line in lines])
    return bool(lengths[chosen].sum() > CONFIRMED * lengths.sum())


def _beside(line: Line, points: Array, edge: float) -> Indices:
    """Return the rows of the points beside a line."""
    away, _ = cKDTree(line.samples(0.2 * edge)[0]).query(points, distance_upper_bound=BESIDE * edge)
    return np.flatnonzero(away < np.inf)


def _mean_square(away: Array) -> float:
    """Return the mean squared distance of some points; 0 of none."""
    return float((away**2).mean()) if len(away) else 0.0


def _moved_onto(
    mesh: SimplexMesh, lines: Sequence[Line], chosen: Indices, points: Array, target: Any, edge: float, rounded: float
) -> Sharpened | None:
    """Return the mesh with paths laid on chosen lines, and then where sides meet; None if no line has a path.

    Points nearer than `rounded` to a line belong to no side.
    """
    paths = [replace(path, line=int(chosen[path.line])) for path in traced(mesh, [lines[k] for k in chosen])]
    if not paths:
        return None
    creased = on_paths(paths, mesh.n_vertices)
    vertices = mesh.vertices.copy()
    for path in paths:
        vertices[path.vertices] = path.places
    now = mesh.moved(vertices).with_data(crease=creased.astype(np.uint8))
    now = filmed(now, dilated(creased, mesh.neighbors, 2) & ~creased)
    sided = Sided(now, paths, points, target, rounded)
    try:
        now = _settled(now, sided, creased, 40, edge)
        for _ in range(2):
            now = _settled(now.moved(sided.met(now, paths, edge)), sided, creased, 20, edge)
        for rings in (1, 2):
            tangled = tangled_vertices(now)
            if not tangled.any():
                break
            film = filmed(now, dilated(tangled, mesh.neighbors, rings) & ~creased)
            other = _settled(film, sided, creased, 20, edge)
            now = other if tangled_vertices(other).sum() < tangled.sum() else now
        now, creased = _released(now, sided, creased, edge)
    except DivergedError as error:
        warn(f"the model stays smooth: {error}")
        return None
    return Sharpened(now, sided, [piece for path in paths for piece in path.pieces(creased)])


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
    """Return the mesh with all vertices but those of creases moved to their data, evenly spread."""
    free = np.where(creased, 0.0, 0.4)
    even = np.full((mesh.n_vertices, 3), 1 / 3)
    model = DeformableModel(
        mesh, target, alpha=free, beta=free, damping=np.where(creased, 1.0, 0.6), reach=2 * edge, metric=even,
        constraint="mean_curvature",
    )  # fmt: skip
    for _ in model.run(iterations, warnings=False):
        pass
    return model.mesh
