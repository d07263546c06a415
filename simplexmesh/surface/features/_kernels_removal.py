"""Removal of vertices from a triangulation under tolerances, in the order of quadrics (Garland and Heckbert 1997)."""
# mypy: allow-untyped-defs

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array
from simplexmesh.mesh.triangles._kernels_half_edges import area_normal, cosine, following, keeps_topology, previous
from simplexmesh.numerics._kernels_heap import new_heap, put
from simplexmesh.numerics._kernels_vectors import cross_product, dot, norm, row
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


class Order(NamedTuple):
    """Which vertices go first, and until when."""

    longest: float  # square of the length that no edge exceeds
    evenness: float  # share of squared lengths in costs
    surplus: float  # triangles that may go, of which each edge on a line counts for two
    weights: Array  # (v,) of costs


@njit(cache=True, error_model="numpy")
def _star_normal(tri, h):
    """Return the vector area of the triangles around the start of a half-edge, and whether it is on a border."""
    x = y = z = 0.0
    border, k = False, h
    while True:
        if is_cap(tri, k):
            border = True
        else:
            a, b, c = tri.corners[k], tri.corners[following(k)], tri.corners[previous(k)]
            n = normal_of(tri, a, b, c)
            x, y, z = x + n[0], y + n[1], z + n[2]
        k = tri.mates[previous(k)]
        if k == h:
            return (x, y, z), border


@njit(cache=True, error_model="numpy")
def _on_lines(tri, h):
    """Return how many edges on lines the start of a half-edge has."""
    count, k = 0, h
    while True:
        count += tri.sharp[k]
        k = tri.mates[previous(k)]
        if k == h:
            return count


@njit(cache=True, error_model="numpy")
def _keeps_lines(tri, h):
    """Return whether a vertex drawn along a half-edge is on no line, or goes along one that neither ends nor closes."""
    count, g = _on_lines(tri, h), tri.mates[h]
    if count == 0:
        return True
    around = tri.sharp[following(h)] or tri.sharp[previous(h)] or tri.sharp[following(g)] or tri.sharp[previous(g)]
    return count == 2 and tri.sharp[h] and not around


@njit(cache=True, error_model="numpy")
def _is_removable(tri, spheres, h, longest, seen, change):
    """Return whether the start of a half-edge may be drawn to its end, and fill the change."""
    g, v = tri.mates[h], tri.corners[following(h)]
    if v >= tri.caps or tri.frozen[v] or not _keeps_lines(tri, h):
        return False
    normal, border = _star_normal(tri, h)
    if border and not (is_cap(tri, h) or is_cap(tri, g)):
        return False
    change.size[0] = 0
    k = tri.mates[previous(h)]
    while following(g) != k:
        q, r = tri.corners[following(k)], tri.corners[previous(k)]
        if tri.frozen[q] or tri.frozen[r]:
            return False
        if not is_cap(tri, k):
            if squared_length(tri, v, q) > longest or squared_length(tri, v, r) > longest:
                return False
            if not cosine(normal_of(tri, v, q, r), normal) > MIN_COSINE:
                return False
        i, start = change.size[0], 3 * (k // 3)
        for j in range(3):
            change.corners[i, j] = v if start + j == k else tri.corners[start + j]
        change.triangles[i] = k // 3
        change.size[0] += 1
        k = tri.mates[previous(k)]
    touched = keeps_topology(tri.corners, tri.mates, h, seen)
    touched = touched and claims(tri, spheres, h // 3, change) and claims(tri, spheres, g // 3, change)
    for i in range(change.size[0]):
        touched = touched and claims(tri, spheres, change.triangles[i], change)
    return touched


@njit(cache=True, error_model="numpy")
def _remove(tri, spheres, h, change, edges):
    """Draw the start of a half-edge to its end, as the change says, and update a half-edge of each vertex there."""
    g, v = tri.mates[h], tri.corners[following(h)]
    chain = unlist(spheres, g // 3, unlist(spheres, h // 3, -1))
    for i in range(change.size[0]):
        chain = unlist(spheres, change.triangles[i], chain)
    hand_over(spheres, chain)
    k = h
    while True:
        tri.corners[k] = v
        k = tri.mates[previous(k)]
        if k == h:
            break
    for side in (h, g):
        one, other = tri.mates[following(side)], tri.mates[previous(side)]
        tri.mates[one], tri.mates[other] = other, one
        tri.sharp[one] = tri.sharp[other] = tri.sharp[one] or tri.sharp[other]
        for j in range(3):
            tri.corners[3 * (side // 3) + j] = REMOVED
            tri.sharp[3 * (side // 3) + j] = False
    for i in range(change.size[0]):
        for k in range(3 * change.triangles[i], 3 * change.triangles[i] + 3):
            edges[tri.corners[k]] = k


@njit(cache=True, error_model="numpy")
def fill_quadrics(tri, quadrics):
    """Add up, for each vertex, area times squared distance from the planes of its triangles: (v, 11), the area last.

    Borders count by planes across them, with their squared lengths as areas.
    """
    for t in range(len(tri.corners) // 3):
        a, b, c = tri.corners[3 * t], tri.corners[3 * t + 1], tri.corners[3 * t + 2]
        if c >= tri.caps:
            inner = tri.mates[3 * t]
            p, q, r = row(tri.vertices, a), row(tri.vertices, b), row(tri.vertices, tri.corners[previous(inner)])
            n = area_normal(p, q, r)
            along = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            n = cross_product(n, along)
            weight = dot(along, along)
        else:
            p, n = row(tri.vertices, a), normal_of(tri, a, b, c)
            weight = norm(n) / 6.0
        length = norm(n)
        if not length > 0.0:
            continue
        n = n[0] / length, n[1] / length, n[2] / length
        off = -dot(n, p)
        for j in range(3):
            v = tri.corners[3 * t + j]
            if v < tri.caps:
                _add_plane(quadrics[v], n, off, weight)


@njit(cache=True, error_model="numpy")
def _add_plane(quadric, n, off, weight):
    quadric[0] += weight * n[0] * n[0]
    quadric[1] += weight * n[1] * n[1]
    quadric[2] += weight * n[2] * n[2]
    quadric[3] += weight * n[0] * n[1]
    quadric[4] += weight * n[0] * n[2]
    quadric[5] += weight * n[1] * n[2]
    quadric[6] += weight * n[0] * off
    quadric[7] += weight * n[1] * off
    quadric[8] += weight * n[2] * off
    quadric[9] += weight * off * off
    quadric[10] += weight


@njit(cache=True, error_model="numpy")
def _cost(tri, quadrics, u, v, evenness):
    """Return the mean squared distance of vertex v from the planes around u, and a share of that from u."""
    q, (x, y, z) = quadrics[u], row(tri.vertices, v)
    error = q[0] * x * x + q[1] * y * y + q[2] * z * z + 2.0 * (q[3] * x * y + q[4] * x * z + q[5] * y * z)
    error += 2.0 * (q[6] * x + q[7] * y + q[8] * z) + q[9]
    return max(error, 0.0) / max(q[10], 1e-300) + evenness * squared_length(tri, u, v)


@njit(cache=True, error_model="numpy")
def _candidates(tri, quadrics, first, order, found, costs):
    """List the half-edges from where `first` starts, the cheapest first; return how many, 0 if that may not go."""
    u, count, k = tri.corners[first], 0, first
    while True:
        v = tri.corners[following(k)]
        if tri.frozen[u] or count == len(found):
            return 0
        if v < tri.caps:
            cost, place = order.weights[u] * _cost(tri, quadrics, u, v, order.evenness), count
            while place > 0 and costs[place - 1] > cost:
                costs[place], found[place] = costs[place - 1], found[place - 1]
                place -= 1
            costs[place], found[place] = cost, k
            count += 1
        k = tri.mates[previous(k)]
        if k == first:
            return count


@njit(cache=True, error_model="numpy")
def remove_vertices(tri, spheres, quadrics, edges, change, order):
    """Remove vertices, the cheapest first, while all spheres touch the surface; return how many.

    `edges` (v,) has a half-edge that starts at each vertex, or -1. A vertex is drawn to the neighbor where that costs
    least of those where it may; one that may not go is tried again when a neighbor of it has gone.
    """
    heap, seen = new_heap(tri.caps), np.full(len(tri.vertices), -1)
    found, costs = np.zeros(len(change.triangles), np.int64), np.zeros(len(change.triangles))
    for v in range(tri.caps):
        if edges[v] >= 0 and _candidates(tri, quadrics, edges[v], order, found, costs):
            put(heap, v, costs[0])
    removed, surplus = 0, order.surplus
    while heap.size[0] and surplus > 0:
        u = np.int64(heap.item[0])
        put(heap, u, np.inf)
        for i in range(_candidates(tri, quadrics, edges[u], order, found, costs)):
            h = found[i]
            if _is_removable(tri, spheres, h, order.longest, seen, change):
                v = tri.corners[following(h)]
                surplus -= 4 if tri.sharp[h] else 2
                _remove(tri, spheres, h, change, edges)
                for j in range(quadrics.shape[1]):
                    quadrics[v, j] += quadrics[u, j]
                removed += 1
                for k in change.corners[: change.size[0]].flat:
                    if k < tri.caps:
                        count = _candidates(tri, quadrics, edges[k], order, found, costs)
                        put(heap, k, costs[0] if count else np.inf)
                break
    return removed
