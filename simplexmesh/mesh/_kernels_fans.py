"""Kernels that tell which faces of a mesh cross, as fans about their centroids, while its vertices move.

Most fans that are near do not cross, as a plane is between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_crossing import round_once, triangles_cross
from simplexmesh.mesh._kernels_fitting import Faces
from simplexmesh.mesh._kernels_vectors import Vector, difference, dot, unit

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

PLANES = 8
"""How many planes are looked at between two fans at most."""

Box = tuple[float, float, float, float, float, float]


class Guarded(NamedTuple):
    """A mesh whose vertices move."""

    points: Array  # (n + f, 3) vertices, then the centroids of the faces
    normals: Array  # (n, 3) of the vertices
    along: Array  # (f, 3) unit vectors that the faces should point along, zero where nothing is known
    neighbors: Indices  # (n, 3)
    vertex_faces: Indices  # (n, 3)
    faces: Faces
    offsets: NDArray[np.int64]  # (f + 1,)
    near: Indices  # the faces that each face may cross, itself among them
    until: Array  # for each of these, the way that the two may go, added up, before a plane between them is passed
    way: Array  # (f,) how far the vertices of a face went, added up
    clear: float  # a distance that is nothing, but well above rounding
    crossed: NDArray[np.bool_]  # (f,) whether a face crosses one of them
    free: NDArray[np.bool_]  # (n,) whether a vertex may move


@njit(cache=True)
def shared_corners(g: Guarded, f: int, other: int) -> tuple[int, int, int]:
    """Return how many vertices two faces share, and the first and the last of them."""
    count, first, last = 0, -1, -1
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        if g.vertex_faces[v, 0] == other or g.vertex_faces[v, 1] == other or g.vertex_faces[v, 2] == other:
            first = v if count == 0 else first
            last = v
            count += 1
    return count, first, last


@njit(cache=True, error_model="numpy")
def span_along(g: Guarded, f: int, n: Vector, origin: int, one: int, two: int) -> tuple[float, float]:
    """Return from where to where a fan reaches along a vector, from point `origin`, two vertices left out."""
    least = most = dot(n, difference(g.points, g.normals.shape[0] + f, origin))
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        if v != one and v != two:
            height = dot(n, difference(g.points, v, origin))
            least, most = min(least, height), max(most, height)
    return least, most


@njit(cache=True, error_model="numpy")
def first_along(g: Guarded, f: int, n: Vector, origin: int) -> int:
    """Return the vertex or the middle of a fan that comes first along a vector."""
    found = g.normals.shape[0] + f
    least = dot(n, difference(g.points, found, origin))
    for c in range(g.faces.offsets[f], g.faces.offsets[f + 1]):
        v = g.faces.vertices[c]
        height = dot(n, difference(g.points, v, origin))
        if height < least:
            least, found = height, np.int64(v)
    return found


@njit(cache=True, error_model="numpy")
def gap_apart(g: Guarded, f: int, other: int) -> float:
    """Return how wide a gap between two fans is at least, -1 where none is found.

    E. G. Gilbert, *An iterative procedure for computing the minimum of a quadratic form on a convex set*, 1966: from a
    difference of two points, one of each, towards the one that comes first along it, as near to 0 as it gets.
    """
    here = g.normals.shape[0] + f
    d = difference(g.points, g.normals.shape[0] + other, here)
    for _ in range(PLANES):
        one = first_along(g, f, (-d[0], -d[1], -d[2]), here)
        two = first_along(g, other, d, here)
        w = difference(g.points, two, one)
        ahead, size = dot(d, w), np.sqrt(dot(d, d))
        if ahead > g.clear * size:
            return ahead / size
        e = w[0] - d[0], w[1] - d[1], w[2] - d[2]
        part = min(-dot(d, e) / dot(e, e), 1.0)
        d = d[0] + part * e[0], d[1] + part * e[1], d[2] + part * e[2]
    return -1.0


@njit(cache=True, error_model="numpy")
def gap_between(g: Guarded, f: int, other: int) -> float:
    """Return how far apart two fans are at least, -1 where they may cross elsewhere than in an edge they share.

    It is 0 where a plane is found between them that goes through the edge.
    """
    count, one, two = shared_corners(g, f, other)
    if count == 0:
        return gap_apart(g, f, other)
    if count == 2:
        d, e = difference(g.points, g.normals.shape[0] + other, g.normals.shape[0] + f), difference(g.points, two, one)
        part = dot(d, e) / dot(e, e)
        d = unit((d[0] - part * e[0], d[1] - part * e[1], d[2] - part * e[2]))
        if span_along(g, f, d, one, one, two)[1] < -g.clear and span_along(g, other, d, one, one, two)[0] > g.clear:
            return 0.0
    return -1.0


@njit(cache=True)
def fan_box(g: Guarded, f: int) -> Box:
    """Return the lowest and the highest corner of the box around a fan."""
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
    """Return the lowest and the highest corner of the box around a triangle."""
    return (
        min(p[t[0], 0], p[t[1], 0], p[t[2], 0]),
        min(p[t[0], 1], p[t[1], 1], p[t[2], 1]),
        min(p[t[0], 2], p[t[1], 2], p[t[2], 2]),
        max(p[t[0], 0], p[t[1], 0], p[t[2], 0]),
        max(p[t[0], 1], p[t[1], 1], p[t[2], 1]),
        max(p[t[0], 2], p[t[1], 2], p[t[2], 2]),
    )


@njit(cache=True)
def outside(a: Box, b: Box) -> bool:
    """Return whether two boxes are apart."""
    return a[0] > b[3] or a[1] > b[4] or a[2] > b[5] or b[0] > a[3] or b[1] > a[4] or b[2] > a[5]


@njit(cache=True)
def fans_crossing(g: Guarded, f: int, other: int) -> int:
    """Return how many pairs of triangles of two fans cross, or of one fan."""
    n, found, box = g.normals.shape[0], 0, fan_box(g, f)
    for e in range(g.faces.offsets[other], g.faces.offsets[other + 1]):
        t = g.faces.vertices[e], g.faces.ahead[e], np.int32(n + other)
        room = triangle_box(g.points, t)
        if outside(room, box):
            continue
        for c in range(g.faces.offsets[f], e if f == other else g.faces.offsets[f + 1]):
            s = g.faces.vertices[c], g.faces.ahead[c], np.int32(n + f)
            if not outside(triangle_box(g.points, s), room) and triangles_cross(g.points, s, t):
                found += 1
    return found


@njit(cache=True)
def goes_round(g: Guarded, f: int) -> bool:
    """Return whether a fan goes round its middle once, so that it does not cross itself."""
    first, last = g.faces.offsets[f], g.faces.offsets[f + 1]
    return round_once(g.points, g.faces.vertices, g.faces.ahead, first, last, g.normals.shape[0] + f, np.empty((3, 3)))


@njit(cache=True)
def pairs_crossing(g: Guarded, f: int, at: int) -> int:
    """Return how many pairs of triangles cross of the fan of a face and of one near it, or of one fan.

    Most of a large fan is left out by the box of a small one.
    """
    other = g.near[at]
    if f == other:
        return 0 if goes_round(g, f) else fans_crossing(g, f, f)
    gap = gap_between(g, f, other)
    if gap >= 0:
        g.until[at] = g.way[f] + g.way[other] + gap - g.clear
        return 0
    size, beyond = g.faces.offsets[f + 1] - g.faces.offsets[f], g.faces.offsets[other + 1] - g.faces.offsets[other]
    return fans_crossing(g, f, other) if size <= beyond else fans_crossing(g, other, f)


@njit(cache=True)
def crossings(g: Guarded, i: int, most: int) -> int:
    """Return how many pairs of triangles cross where one is on a face of a vertex and the other on a face near it.

    Counting ends above `most`. Where there was a gap, it is looked at again when both went as far.
    """
    found = 0
    for j in range(3):
        f = g.vertex_faces[i, j]
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            if g.way[f] + g.way[other] < g.until[at]:
                continue
            twice = False
            for m in range(3):
                twice |= g.vertex_faces[i, m] == other and other < f
            if not twice:
                found += pairs_crossing(g, f, at)
                if found > most:
                    return found
    return found


@njit(cache=True)
def mark_crossed(g: Guarded) -> None:
    """Find the faces that cross a face near them."""
    for f in range(g.crossed.size):
        for at in range(g.offsets[f], g.offsets[f + 1]):
            other = g.near[at]
            if other >= f and pairs_crossing(g, f, at) > 0:
                g.crossed[f] = g.crossed[other] = True


@njit(cache=True)
def touches_crossed(g: Guarded, i: int) -> bool:
    """Return whether a face of a vertex crosses another one."""
    return g.crossed[g.vertex_faces[i, 0]] or g.crossed[g.vertex_faces[i, 1]] or g.crossed[g.vertex_faces[i, 2]]
