"""Flips of the edges of a triangulation under tolerances, until triangles bend least, or have the smallest angles."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit
from simplexmesh.mesh.triangles._kernels_half_edges import cosine, flip, following, is_adjacent, previous
from simplexmesh.numerics._kernels_vectors import difference, norm, plus
from simplexmesh.surface.features._kernels_tolerance import (
    MIN_COSINE,
    REMOVED,
    claims,
    hand_over,
    is_cap,
    normal_of,
    squared_length,
    unlist,
)

LEAST_GAIN = 1e-6
"""In radians: flips of less could go on for ever, as rounding errors decide."""

FLAT = 0.985
"""Cosine between triangles of one smooth part: ten degrees."""

SLIVER = 1e-4
"""Of the areas of two triangles, that of one whose normal is of rounding errors."""

MOST_SWEEPS = 100
"""A tenth is enough for surfaces; triangles without area have normals of rounding errors, and would never end."""


@njit(cache=True, error_model="numpy")
def _bend(tri, normal, h):
    """Return the angle between a normal and that of the triangle across a half-edge, 0 on a border."""
    g = tri.mates[h]
    if is_cap(tri, g):
        return 0.0
    other = normal_of(tri, tri.corners[g], tri.corners[following(g)], tri.corners[previous(g)])
    return math.acos(min(1.0, max(-1.0, cosine(normal, other))))


@njit(cache=True, error_model="numpy")
def _gain(tri, h):
    """Return by how much a flip lowers the sum of five angles of two triangles; negative where one turns over."""
    g = tri.mates[h]
    bc, ca, ad, db = following(h), previous(h), following(g), previous(g)
    a, b, c, d = tri.corners[h], tri.corners[bc], tri.corners[ca], tri.corners[db]
    one, two = normal_of(tri, a, b, c), normal_of(tri, b, a, d)
    first, second = normal_of(tri, a, d, c), normal_of(tri, d, b, c)
    mean = plus(one, two, 1.0)
    if not (cosine(first, mean) > MIN_COSINE and cosine(second, mean) > MIN_COSINE):
        return -1.0
    before = math.acos(min(1.0, max(-1.0, cosine(one, two))))
    before += _bend(tri, one, bc) + _bend(tri, one, ca) + _bend(tri, two, ad) + _bend(tri, two, db)
    after = math.acos(min(1.0, max(-1.0, cosine(first, second))))
    after += _bend(tri, second, bc) + _bend(tri, first, ca) + _bend(tri, first, ad) + _bend(tri, second, db)
    return before - after


@njit(cache=True, error_model="numpy")
def _widest(tri, a, b, c):
    """Return the largest angle of a triangle."""
    out = 0.0
    for at, one, two in ((a, b, c), (b, c, a), (c, a, b)):
        to, back = difference(tri.vertices, one, at), difference(tri.vertices, two, at)
        out = max(out, math.acos(min(1.0, max(-1.0, cosine(to, back)))))
    return out


@njit(cache=True, error_model="numpy")
def _evening(tri, h):
    """Return by how much a flip lowers the largest angle of two triangles; negative across or making a sharp edge."""
    g = tri.mates[h]
    a, b, c, d = tri.corners[h], tri.corners[g], tri.corners[previous(h)], tri.corners[previous(g)]
    one, two = normal_of(tri, a, b, c), normal_of(tri, b, a, d)
    first, second = normal_of(tri, a, d, c), normal_of(tri, d, b, c)
    mean = plus(one, two, 1.0)
    if norm(one) < SLIVER * norm(mean):
        one = mean
    if norm(two) < SLIVER * norm(mean):
        two = mean
    if min(cosine(one, two), cosine(first, second), cosine(one, first), cosine(one, second)) < FLAT:
        return -1.0
    return max(_widest(tri, a, b, c), _widest(tri, b, a, d)) - max(_widest(tri, a, d, c), _widest(tri, d, b, c))


@njit(cache=True, error_model="numpy")
def flip_edges(tri, spheres, change, longest, even):
    """Flip edges in place while that gains or evens, spheres touch the surface and new edges are not too long."""
    for _ in range(MOST_SWEEPS):
        flips = 0
        for h in range(len(tri.mates)):
            g = tri.mates[h]
            if tri.corners[h] == REMOVED or g < h or tri.sharp[h] or is_cap(tri, h) or is_cap(tri, g):
                continue
            a, b, c, d = tri.corners[h], tri.corners[g], tri.corners[previous(h)], tri.corners[previous(g)]
            if tri.frozen[a] or tri.frozen[b] or tri.frozen[c] or tri.frozen[d]:
                continue
            if squared_length(tri, c, d) > longest:
                continue
            if is_adjacent(tri.corners, tri.mates, previous(h), d):
                continue
            if not (_evening(tri, h) if even else _gain(tri, h)) > LEAST_GAIN:
                continue
            t, u = h // 3, g // 3
            change.size[0] = 2
            for k, (triangle, corners) in enumerate(((t, (a, d, c)), (u, (d, b, c)))):
                change.triangles[k] = triangle
                for j in range(3):
                    change.corners[k, j] = corners[j]
            if claims(tri, spheres, t, change) and claims(tri, spheres, u, change):
                hand_over(spheres, unlist(spheres, u, unlist(spheres, t, -1)))
                flip(tri.corners, tri.mates, h)
                for k in range(3):
                    tri.sharp[3 * t + k] = tri.sharp[tri.mates[3 * t + k]]
                    tri.sharp[3 * u + k] = tri.sharp[tri.mates[3 * u + k]]
                tri.sharp[3 * t + 1] = tri.sharp[3 * u + 2] = False
                flips += 1
        if not flips:
            break
