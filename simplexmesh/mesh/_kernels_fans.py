"""Kernels that test the faces of a mesh, as fans about their centroids, for crossings while its vertices move.

Most pairs of nearby fans are separated by a plane, which remains valid while they travel less than their gap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_crossing import triangles_cross, winds_once
from simplexmesh.mesh._kernels_fitting import Faces
from simplexmesh.mesh._kernels_vectors import Vector, difference, dot, unit

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

MAX_PLANES = 8
"""Largest number of separating planes tried between two fans."""

Box = tuple[float, float, float, float, float, float]


class MovingMesh(NamedTuple):
    """A mesh whose vertices move, with what is needed to test its faces for crossings."""

    points: Array  # (n + f, 3) vertices, then the centroids of the faces
    normals: Array  # (n, 3) of the vertices
    target_normals: Array  # (f, 3) unit normals that the faces should have, zero where unknown
    neighbors: Indices  # (n, 3)
    vertex_faces: Indices  # (n, 3)
    faces: Faces
    offsets: NDArray[np.int64]  # (f + 1,)
    near: Indices  # the faces that each face may cross, itself included while untangling (CSR with `offsets`)
    valid_until: Array  # for each of these, the summed travel of the two up to which a plane separates them
    travel: Array  # (f,) upper bound on the distance that the points of a face have moved so far
    epsilon: float  # distances below count as zero; well above rounding
    crossed: NDArray[np.bool_]  # (f,) whether a face crosses one of them
    free: NDArray[np.bool_]  # (n,) whether a vertex may move


@njit(cache=True)
def shared_vertices(g: MovingMesh, f: int, other: int) -> tuple[int, int, int]:
    """Return the number of vertices that two faces share, and the first and last of them."""
    count, first, last = 0, -1, -1
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        if g.vertex_faces[v, 0] == other or g.vertex_faces[v, 1] == other or g.vertex_faces[v, 2] == other:
            first = v if count == 0 else first
            last = v
            count += 1
    return count, first, last


@njit(cache=True, error_model="numpy")
def extent_along(g: MovingMesh, f: int, n: Vector, origin: int, one: int, two: int) -> tuple[float, float]:
    """Return the interval of a fan's projection on a vector, relative to point `origin`, two vertices excluded."""
    least = most = dot(n, difference(g.points, g.normals.shape[0] + f, origin))
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        if v != one and v != two:
            height = dot(n, difference(g.points, v, origin))
            least, most = min(least, height), max(most, height)
    return least, most


@njit(cache=True, error_model="numpy")
def lowest_along(g: MovingMesh, f: int, n: Vector, origin: int) -> int:
    """Return the vertex or center of a fan with the smallest projection on a vector (its support point)."""
    found = g.normals.shape[0] + f
    least = dot(n, difference(g.points, found, origin))
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        height = dot(n, difference(g.points, v, origin))
        if height < least:
            least, found = height, np.int64(v)
    return found


@njit(cache=True, error_model="numpy")
def disjoint_gap(g: MovingMesh, f: int, other: int) -> float:
    """Return a lower bound on the distance of two fans without common vertices, -1 if none is found.

    E. G. Gilbert, *An iterative procedure for computing the minimum of a quadratic form on a convex set*, 1966: the
    smallest vector of the Minkowski difference, approached by steps towards its support points.
    """
    here = g.normals.shape[0] + f
    d = difference(g.points, g.normals.shape[0] + other, here)
    for _ in range(MAX_PLANES):
        one = lowest_along(g, f, (-d[0], -d[1], -d[2]), here)
        two = lowest_along(g, other, d, here)
        w = difference(g.points, two, one)
        ahead, size = dot(d, w), np.sqrt(dot(d, d))
        if ahead > g.epsilon * size:
            return ahead / size
        e = w[0] - d[0], w[1] - d[1], w[2] - d[2]
        part = min(-dot(d, e) / dot(e, e), 1.0)
        d = d[0] + part * e[0], d[1] + part * e[1], d[2] + part * e[2]
    return -1.0


@njit(cache=True, error_model="numpy")
def gap_between(g: MovingMesh, f: int, other: int) -> float:
    """Return a lower bound on the distance of two fans, 0 if a plane through a shared edge separates them, or -1."""
    count, one, two = shared_vertices(g, f, other)
    if count == 0:
        return disjoint_gap(g, f, other)
    if count == 2:
        d, e = difference(g.points, g.normals.shape[0] + other, g.normals.shape[0] + f), difference(g.points, two, one)
        part = dot(d, e) / dot(e, e)
        d = unit((d[0] - part * e[0], d[1] - part * e[1], d[2] - part * e[2]))
        below = extent_along(g, f, d, one, one, two)[1] < -g.epsilon
        if below and extent_along(g, other, d, one, one, two)[0] > g.epsilon:
            return 0.0
    return -1.0


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
def fan_winds_once(g: MovingMesh, f: int) -> bool:
    """Return whether a fan winds around its center once, so that it does not cross itself."""
    first, last = g.faces.offsets[f], g.faces.offsets[f + 1]
    return winds_once(g.points, g.faces.vertices, g.faces.ahead, first, last, g.normals.shape[0] + f, np.empty((3, 3)))


@njit(cache=True)
def pair_crossings(g: MovingMesh, f: int, at: int) -> int:
    """Return the number of crossing pairs of triangles of a fan and the fan `near[at]`, possibly itself."""
    other = g.near[at]
    if f == other:
        return 0 if fan_winds_once(g, f) else fan_crossings(g, f, f)
    gap = gap_between(g, f, other)
    if gap >= 0:
        g.valid_until[at] = g.travel[f] + g.travel[other] + gap - g.epsilon
        return 0
    size = g.faces.offsets[f + 1] - g.faces.offsets[f]
    other_size = g.faces.offsets[other + 1] - g.faces.offsets[other]
    # the box of the smaller fan excludes most triangles of the larger one
    return fan_crossings(g, f, other) if size <= other_size else fan_crossings(g, other, f)


@njit(cache=True)
def crossings(g: MovingMesh, i: int, most: int) -> int:
    """Return the number of crossing pairs of triangles, one on a face of vertex `i`, the other on a face near that.

    Counting stops above `most`. Separated pairs are tested again only after they have traveled as far as their gap.
    """
    found = 0
    for j in range(3):
        f = g.vertex_faces[i, j]
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            if g.travel[f] + g.travel[other] < g.valid_until[at]:
                continue
            twice = False
            for m in range(3):
                twice |= g.vertex_faces[i, m] == other and other < f
            if not twice:
                found += pair_crossings(g, f, at)
                if found > most:
                    return found
    return found


@njit(cache=True)
def mark_crossed(g: MovingMesh) -> None:
    """Mark the faces that cross a nearby face."""
    for f in range(g.crossed.size):
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            if other >= f and pair_crossings(g, f, at) > 0:
                g.crossed[f] = g.crossed[other] = True


@njit(cache=True)
def touches_crossed(g: MovingMesh, i: int) -> bool:
    """Return whether a face of vertex `i` was marked as crossing another one."""
    return g.crossed[g.vertex_faces[i, 0]] or g.crossed[g.vertex_faces[i, 1]] or g.crossed[g.vertex_faces[i, 2]]
