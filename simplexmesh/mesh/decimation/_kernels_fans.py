"""Kernels that test the faces of a mesh, as fans about their centroids, for crossings while its vertices move."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh.mesh.decimation._kernels_fitting import Faces
from simplexmesh.mesh.triangles._kernels_intersection import triangles_cross

Box = tuple[float, float, float, float, float, float]


class MovingMesh(NamedTuple):
    """A mesh whose vertices move, with what is needed to test its faces for crossings."""

    points: Array  # (n + f, 3) vertices, then the centroids of the faces
    normals: Array  # (n, 3) of the vertices
    target_normals: Array  # (f, 3) unit normals that the faces should have, zero where unknown
    neighbors: Indices32  # (n, 3)
    vertex_faces: Indices32  # (n, 3)
    faces: Faces
    offsets: Indices  # (f + 1,)
    near: Indices32  # the faces that each face may cross, itself included while untangling (CSR with `offsets`)
    crossed: Mask  # (f,) whether a face crosses one of them
    free: Mask  # (n,) whether a vertex may move


@njit(cache=True)
def fan_box(g: MovingMesh, f: int) -> Box:
    """Return the lower and upper corner of a fan's bounding box."""
    v = g.faces.vertices[g.faces.offsets[f]]
    ax, ay, az = g.points[v, 0], g.points[v, 1], g.points[v, 2]
    bx, by, bz = ax, ay, az
    for c in range(g.faces.offsets[f] + 1, g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        x, y, z = g.points[v, 0], g.points[v, 1], g.points[v, 2]
        ax, ay, az, bx, by, bz = min(ax, x), min(ay, y), min(az, z), max(bx, x), max(by, y), max(bz, z)
    return ax, ay, az, bx, by, bz


@njit(cache=True)
def triangle_box(p: Array, t: tuple[int, int, int]) -> Box:
    """Return the lower and upper corner of a triangle's bounding box."""
    return (
        min(p[t[0], 0], p[t[1], 0], p[t[2], 0]),
        min(p[t[0], 1], p[t[1], 1], p[t[2], 1]),
        min(p[t[0], 2], p[t[1], 2], p[t[2], 2]),
        max(p[t[0], 0], p[t[1], 0], p[t[2], 0]),
        max(p[t[0], 1], p[t[1], 1], p[t[2], 1]),
        max(p[t[0], 2], p[t[1], 2], p[t[2], 2]),
    )


@njit(cache=True)
def disjoint(a: Box, b: Box) -> bool:
    """Return whether two boxes are disjoint."""
    return a[0] > b[3] or a[1] > b[4] or a[2] > b[5] or b[0] > a[3] or b[1] > a[4] or b[2] > a[5]


@njit(cache=True)
def fan_crossings(g: MovingMesh, f: int, other: int) -> int:
    """Return the number of crossing pairs of triangles of two fans, or of one fan with itself."""
    n, found, box = g.normals.shape[0], 0, fan_box(g, f)
    for e in range(g.faces.offsets[other], g.faces.offsets[other + 1]):
        t = g.faces.vertices[e], g.faces.ahead[e], np.int32(n + other)
        bounds = triangle_box(g.points, t)
        if disjoint(bounds, box):
            continue
        for c in range(g.faces.offsets[f], e if f == other else g.faces.offsets[f + 1]):
            s = g.faces.vertices[c], g.faces.ahead[c], np.int32(n + f)
            if not disjoint(triangle_box(g.points, s), bounds) and triangles_cross(g.points, s, t):
                found += 1
    return found


@njit(cache=True)
def crossings(g: MovingMesh, i: int, most: int) -> int:
    """Return the number of crossing pairs of triangles, counted until above `most`, on faces of vertex `i`."""
    found = 0
    for j in range(3):
        f = g.vertex_faces[i, j]
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            twice = False
            for m in range(3):
                twice |= g.vertex_faces[i, m] == other and other < f
            if not twice:
                found += fan_crossings(g, f, other)
                if found > most:
                    return found
    return found


@njit(cache=True)
def mark_crossed(g: MovingMesh) -> None:
    """Mark the faces that cross a nearby face."""
    for f in range(g.crossed.size):
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            if other >= f and fan_crossings(g, f, other) > 0:
                g.crossed[f] = g.crossed[other] = True


@njit(cache=True)
def touches_crossed(g: MovingMesh, i: int) -> bool:
    """Return whether a face of vertex `i` was marked as crossing another one."""
    return g.crossed[g.vertex_faces[i, 0]] or g.crossed[g.vertex_faces[i, 1]] or g.crossed[g.vertex_faces[i, 2]]
