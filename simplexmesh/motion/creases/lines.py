"""Sharp edges of data near a model, as lines: those of a surface through the data at the data's own resolution."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, vertex_normals
from simplexmesh.data.cutting.dividing import divided
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.joining import joined, without_loops
from simplexmesh.motion.creases.line import CreaseLine
from simplexmesh.motion.start.solid_mesh import decimated, relaxed
from simplexmesh.surface.features.feature_lines import feature_lines

POINTS_PER_VERTEX = 5.0
"""Of the surface, at least: fewer leave noise, more blur the edges."""

NOISE = 0.08
"""In edges of the surface: more noise than that, in means of the points of a vertex, is averaged over more points."""


def crease_lines(mesh: SimplexMesh, points: Array, noise: float) -> tuple[list[CreaseLine], TriangleMesh]:
    """Return the sharp edges of points (n, 3) near a closed mesh, the longest first, and the surface they are on."""
    surface, side = TriangleMesh(*surface_through(mesh, points, noise)), resolution(mesh.area / len(points), noise)
    found = without_loops(feature_lines(surface), side)
    lines = [CreaseLine(line.points, line.closed, float(line.angle.mean())) for line in found.lines]
    return joined(lines, side), surface


def resolution(area: float, noise: float) -> float:
    """Return the mean edge of the surface through points that have an area each."""
    spacing = np.sqrt(2 / np.sqrt(3) * area)
    return float(spacing * np.sqrt(max(POINTS_PER_VERTEX, noise / (NOISE * spacing))))


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
