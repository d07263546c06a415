"""Sharp edges of data near a model, as lines: those of a surface through the data at the data's own resolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm, vertex_normals
from simplexmesh.data.cutting.dividing import divided
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.start.solid_mesh import decimated, relaxed
from simplexmesh.surface.features.feature_lines import feature_lines
from simplexmesh.surface.features.lines.network import FeatureNetwork

POINTS_PER_VERTEX = 5.0
"""Of the surface, at least: fewer leave noise, more blur the edges."""

NOISE = 0.08
"""In edges of the surface: more noise than that, in means of the points of a vertex, is averaged over more points."""


class CreaseLine(NamedTuple):
    """A line in space: points (k, 3) in order, whether the last is joined to the first, and the mean angle there."""

    points: Array
    closed: bool
    angle: float

    @property
    def length(self) -> float:
        """The length."""
        return float(norm(np.diff(self.closing, axis=0)).sum())

    @property
    def closing(self) -> Array:
        """The points, of a closed line with the first repeated."""
        return np.concatenate([self.points, self.points[:1]]) if self.closed else self.points

    def samples(self, step: float) -> tuple[Array, Array]:
        """Return points (m, 3) at most a step apart, the ends among them, and their distances (m,) from the start."""
        line = self.closing
        far = np.append(0.0, np.cumsum(norm(np.diff(line, axis=0))))
        along = np.linspace(0.0, far[-1], max(2, int(np.ceil(far[-1] / step)) + 1))
        return at_distances(line, far, along), along


def at_distances(points: Array, far: Array, along: Array) -> Array:
    """Return the places (m, 3) at distances along a polyline (k, 3), whose points are `far` (k,) along it."""
    return np.column_stack([np.interp(along, far, points[:, j]) for j in range(3)])


def crease_lines(mesh: SimplexMesh, points: Array, noise: float) -> list[CreaseLine]:
    """Return the sharp edges of points (n, 3) near a closed mesh, which has rounded them, the longest first."""
    vertices, faces = surface_through(mesh, points, noise)
    side = resolution(mesh.area / len(points), noise)
    found = _without_loops(feature_lines(TriangleMesh(vertices, faces)), side, max(mean_edge(mesh), side))
    return [CreaseLine(line.points, line.closed, float(line.angle.mean())) for line in found.lines]


def resolution(area: float, noise: float) -> float:
    """Return the mean edge of the surface through points that have an area each."""
    spacing = np.sqrt(2 / np.sqrt(3) * area)
    return float(spacing * np.sqrt(max(POINTS_PER_VERTEX, noise / (NOISE * spacing))))


def _without_loops(found: FeatureNetwork, side: float, face: float) -> FeatureNetwork:
    """Return lines without loops of less than a hexagon, nor those that sharper ones lead around within as much.

    The hexagon is of the side of faces of the model; of twice that of the surface if the sharper ones are near.
    """
    lines = [CreaseLine(line.points, line.closed, float(line.angle.mean())) for line in found.lines]
    lengths = np.array([line.length for line in lines])
    ends = np.array([line.points[[0, -1]] for line in lines]).reshape(-1, 3)
    nodes = np.unique(ends, axis=0, return_inverse=True)[1].reshape(-1, 2)
    middles = 2 * len(lines) + np.arange(len(lines))  # nodes too: several lines may lead from one node to another
    loops = np.array([line.closed for line in lines], bool) | (nodes[:, 0] == nodes[:, 1])
    kept = ~loops | (lengths > 6 * side)
    samples = [line.samples(0.2 * side)[0] for line in lines]
    around = 6 * max(2 * side, face)
    for k in np.argsort([line.angle for line in lines]):
        if lengths[k] > around or loops[k]:
            continue
        kept[k] = False
        halves, ways = np.repeat(lengths[kept] / 2, 2), (nodes[kept].ravel(), np.repeat(middles[kept], 2))
        graph = csr_array((halves, ways), shape=(3 * len(lines),) * 2)
        far = dijkstra(graph, directed=False, indices=nodes[k, 0], limit=around - lengths[k])[nodes[k, 1]]
        kept[k] = np.isinf(far) or (far + lengths[k] > 6 * face and not _is_beside(k, samples, kept, side))
    return found if kept.all() else found.without(*np.flatnonzero(~kept).tolist())


def _is_beside(number: int, samples: Sequence[Array], kept: Mask, side: float) -> bool:
    """Return whether all of a line, given by points on it as the others, is nearer than a side to kept ones."""
    others = np.concatenate([points for points, inside in zip(samples, kept, strict=True) if inside])
    return bool(cKDTree(others).query(samples[number])[0].max() < side)


def surface_through(mesh: SimplexMesh, points: Array, noise: float) -> tuple[Array, Indices]:
    """Return an even triangulation near a mesh, each vertex moved along its normal to the mean of the points around it.

    So its triangles straddle the sharp edges of the data as those of a scan do, and round them no more than that.
    """
    rough = mesh.triangulated(method="dual")
    side = resolution(rough.area / len(points), noise)
    surface = divided(rough, side)
    wanted = int(4 / np.sqrt(3) * rough.area / side**2)
    vertices, faces = relaxed(*decimated(surface.vertices, surface.faces, wanted))
    for last in (False, False, True):
        normals = vertex_normals(vertices, faces)
        nearest = cKDTree(vertices).query(points, workers=-1)[1]
        heights = dot(points - vertices[nearest], normals[nearest])
        count = np.bincount(nearest, minlength=len(vertices))
        mean = np.bincount(nearest, heights, len(vertices)) / np.maximum(count, 1)
        vertices = vertices + mean[:, None] * normals
        if not last:
            vertices, faces = relaxed(vertices, faces)
    return vertices, faces
