"""Kernels that fit a coarse mesh to samples of a surface: closest points on the fans of nearby faces, least squares.

The closest point of a sample is a weighted mean of two vertices and a centroid, so its displacement is linear in the
vertices. Closest points on triangles: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh.numerics._kernels_vectors import Vector, dot, minus, row

MAX_STEPS = 12
MAX_MISSES = 32
CLOSER = 1 - 1e-9


class Faces(NamedTuple):
    """The faces of a mesh as flat arrays over corners, ordered as in `Connectivity`."""

    vertices: Indices32  # (3n,)
    offsets: Indices32  # (f + 1,)
    ahead: Indices32  # (3n,) the next vertex of each corner
    owner: Indices32  # (3n,) the face of each corner
    across: Indices32  # (3n,) the corner whose edge to its next vertex is the opposite of this corner's
    hole: Mask  # (f,)


class Locations(NamedTuple):
    """Points on the fans or on the rims, those closest to samples."""

    corner: Indices32  # (s,) the corner of the fan triangle or rim edge
    weights: Array  # (s, 3) barycentric: of the corner, of the next vertex, of the centroid


@njit(cache=True)
def set_location(locations: Locations, s: int, corner: int, ahead: float, inside: float) -> None:
    """Set location `s`, given the weights of the next vertex and the centroid."""
    locations.corner[s] = corner
    locations.weights[s, 0], locations.weights[s, 1], locations.weights[s, 2] = 1 - ahead - inside, ahead, inside


@njit(cache=True, error_model="numpy")
def centroids(vertices: Array, faces: Faces, out: Array) -> None:
    """Write the mean of each face's vertices to `out` (f, 3)."""
    for f in range(faces.offsets.size - 1):
        first, last = faces.offsets[f], faces.offsets[f + 1]
        for k in range(3):
            total = 0.0
            for c in range(first, last):
                total += vertices[faces.vertices[c], k]
            out[f, k] = total / (last - first)


@njit(cache=True, error_model="numpy")
def closest_on_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> tuple[float, float, float]:
    """Return the squared distance of `p` from a triangle, and the weights of `b` and `c` at the closest point."""
    ab, ac, ap, bp, cp = minus(b, a), minus(c, a), minus(p, a), minus(p, b), minus(p, c)
    d1, d2, d3, d4, d5, d6 = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v = w = 0.0
    if d1 <= 0 and d2 <= 0:
        pass
    elif d3 >= 0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0 and d5 <= d6:
        w = 1.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        v = d1 / (d1 - d3) if d1 > d3 else 0.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        w = d2 / (d2 - d6) if d2 > d6 else 0.0
    elif va <= 0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / (d4 - d3 + d5 - d6) if d4 - d3 + d5 - d6 > 0 else 0.0
        v = 1 - w
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    rest = ap[0] - v * ab[0] - w * ac[0], ap[1] - v * ab[1] - w * ac[1], ap[2] - v * ab[2] - w * ac[2]
    return dot(rest, rest), v, w


@njit(cache=True, error_model="numpy")
def are_covered(points: Array, triangles: Indices, corners: Array, near: Indices, limit: Array) -> Mask:
    """Return which triangles, given by their corners (p, 3, 3), one of those `near` (p, 3) is near at all corners."""
    out = np.zeros(limit.size, np.bool_)
    for i in range(limit.size):
        for t in near[i]:
            a, b, c = row(points, triangles[t, 0]), row(points, triangles[t, 1]), row(points, triangles[t, 2])
            largest = 0.0
            for j in range(3):
                largest = max(largest, closest_on_triangle(row(corners[i], j), a, b, c)[0])
            out[i] |= largest <= limit[i] ** 2
    return out


@njit(cache=True, error_model="numpy")
def barycentric(points: Array, triangles: Indices, found: Indices, at: Array) -> Array:
    """Return the barycentric coordinates (p, 3) of points on triangles `found` (p,)."""
    out = np.empty(at.shape)
    for i in range(found.size):
        one, two, three = triangles[found[i]]
        _, v, w = closest_on_triangle(row(at, i), row(points, one), row(points, two), row(points, three))
        out[i, 0], out[i, 1], out[i, 2] = 1 - v - w, v, w
    return out


@njit(cache=True, error_model="numpy")
def closest_on_fan(
    vertices: Array, centroid: Array, faces: Faces, f: int, p: Vector, best: float
) -> tuple[float, int, float, float]:
    """Return the squared distance of `p` from a fan, the corner, -1 unless that is below `best`, and two weights."""
    m, found, ahead, inside = row(centroid, f), -1, 0.0, 0.0
    for c in range(faces.offsets[f], faces.offsets[f + 1]):
        squared, v, w = closest_on_triangle(p, row(vertices, faces.vertices[c]), row(vertices, faces.ahead[c]), m)
        if squared < best * CLOSER:
            best, found, ahead, inside = squared, c, v, w
    return best, found, ahead, inside


@njit(cache=True, error_model="numpy")
def locate(
    vertices: Array, centroid: Array, faces: Faces, samples: Array, start: Indices32, locations: Locations
) -> None:
    """Find the closest points of samples, walking from face `start` across edges while the distance decreases."""
    for s in range(samples.shape[0]):
        face, best = start[s], np.inf
        for _ in range(MAX_STEPS):
            best, c, ahead, inside = closest_on_fan(vertices, centroid, faces, face, row(samples, s), best)
            if c < 0:
                break
            start[s] = face
            set_location(locations, s, c, ahead, inside)
            if inside > 0:
                break
            face = faces.owner[faces.across[c]]
            if faces.hole[face]:
                break


@njit(cache=True, error_model="numpy")
def locate_on_rim(vertices: Array, faces: Faces, samples: Array, locations: Locations) -> None:
    """Find the closest points of rim samples, walking along the hole both ways until `MAX_MISSES` edges are farther."""
    for s in range(samples.shape[0]):
        at, best = locations.corner[s], np.inf
        first, end = faces.offsets[faces.owner[at]], faces.offsets[faces.owner[at] + 1]
        for step in (1, -1):
            c, misses = at, 0
            for _ in range(end - first):
                a = row(vertices, faces.vertices[c])
                edge, away = minus(row(vertices, faces.ahead[c]), a), minus(row(samples, s), a)
                squared = dot(edge, edge)
                t = min(max(dot(away, edge) / squared, 0.0), 1.0) if squared > 0 else 0.0
                rest = away[0] - t * edge[0], away[1] - t * edge[1], away[2] - t * edge[2]
                if dot(rest, rest) < best * CLOSER:
                    best = dot(rest, rest)
                    set_location(locations, s, c, t, 0.0)
                    misses = 0
                misses += 1
                if misses > MAX_MISSES:
                    break
                c = first + (c - first + step) % (end - first)


class Terms(NamedTuple):
    """The terms of the least-squares problem: distances of samples, smoothness, flatness of faces."""

    samples: Array  # (s, 3)
    direction: Array  # (s, 3) unit vectors
    along: Array  # (s,) weight of the squared distance along the direction
    across: Array  # (s,) weight of the squared distance perpendicular to it
    neighbors: Indices32  # (n, 3)
    share: Array  # (n, 3) weights of the neighbors in their mean; on a rim of the two on it
    smooth: Array  # (n, 3, 3) matrix weights of the squared distance to that mean
    flat: Array  # (f, 3) face normal times the square root of the weight of squared distances to the face's plane


@njit(cache=True, error_model="numpy")
def add_sample_gradient(
    v: Array, centroid: Array, faces: Faces, locations: Locations, t: Terms, offset: float, out: Array, inner: Array
) -> None:
    """Add half the gradient of the sample terms, for vertices to `out`, for centroids to `inner`."""
    p = np.empty(3)
    for s in range(t.samples.shape[0]):
        c, w = locations.corner[s], locations.weights[s]
        a, b, f = faces.vertices[c], faces.ahead[c], faces.owner[c]
        dot = 0.0
        for k in range(3):
            p[k] = w[0] * v[a, k] + w[1] * v[b, k] + w[2] * centroid[f, k] - offset * t.samples[s, k]
            dot += p[k] * t.direction[s, k]
        for k in range(3):
            force = t.across[s] * p[k] + (t.along[s] - t.across[s]) * dot * t.direction[s, k]
            out[a, k] += w[0] * force
            out[b, k] += w[1] * force
            inner[f, k] += w[2] * force


@njit(cache=True, error_model="numpy")
def add_face_gradient(v: Array, centroid: Array, faces: Faces, t: Terms, out: Array, inner: Array) -> None:
    """Add the gradient `inner` for centroids, distributed to the vertices, and half that of the flatness terms."""
    for f in range(faces.offsets.size - 1):
        size = faces.offsets[f + 1] - faces.offsets[f]
        for c in range(faces.offsets[f], faces.offsets[f + 1]):
            i = faces.vertices[c]
            dot = 0.0
            for k in range(3):
                dot += t.flat[f, k] * (v[i, k] - centroid[f, k])
            for k in range(3):
                out[i, k] += inner[f, k] / size + dot * t.flat[f, k]


@njit(cache=True, error_model="numpy")
def add_vertex_gradient(v: Array, t: Terms, out: Array) -> None:
    """Add half the gradient of the smoothness terms."""
    p = np.empty(3)
    for i in range(v.shape[0]):
        one, two, three = t.neighbors[i, 0], t.neighbors[i, 1], t.neighbors[i, 2]
        for k in range(3):
            p[k] = v[i, k] - t.share[i, 0] * v[one, k] - t.share[i, 1] * v[two, k] - t.share[i, 2] * v[three, k]
        for k in range(3):
            force = t.smooth[i, k, 0] * p[0] + t.smooth[i, k, 1] * p[1] + t.smooth[i, k, 2] * p[2]
            out[i, k] += force
            out[one, k] -= t.share[i, 0] * force
            out[two, k] -= t.share[i, 1] * force
            out[three, k] -= t.share[i, 2] * force


@njit(cache=True, error_model="numpy")
def half_gradient(
    v: Array, centroid: Array, faces: Faces, locations: Locations, t: Terms, offset: float, out: Array
) -> None:
    """Write half the gradient at `v` to `out`: of the full quadratic with offset 1, of its homogeneous part with 0."""
    out[:] = 0.0
    centroids(v, faces, centroid)
    inner = np.zeros(centroid.shape)
    add_sample_gradient(v, centroid, faces, locations, t, offset, out, inner)
    add_face_gradient(v, centroid, faces, t, out, inner)
    add_vertex_gradient(v, t, out)


@njit(cache=True, error_model="numpy")
def conjugate_gradients(vertices: Array, faces: Faces, locations: Locations, t: Terms, iterations: int) -> Array:
    """Return the vertices after some iterations of the conjugate gradient method on the least-squares problem."""
    centroid = np.empty((faces.offsets.size - 1, 3))
    move = np.zeros_like(vertices)
    residual, image = np.empty_like(vertices), np.empty_like(vertices)
    half_gradient(vertices, centroid, faces, locations, t, 1.0, residual)
    residual = -residual
    direction = residual.copy()
    squared = (residual * residual).sum()
    for _ in range(iterations):
        if squared == 0:
            break
        half_gradient(direction, centroid, faces, locations, t, 0.0, image)
        step = squared / (direction * image).sum()
        move += step * direction
        residual -= step * image
        now = (residual * residual).sum()
        direction = residual + now / squared * direction
        squared = now
    return vertices + move
