"""Kernels that fit a coarse mesh to samples of a surface: where each sample belongs, and the least squares of it all.

Each face is a fan about its centroid. A sample belongs to the closest point of the fan it was told of or of fans next
to it; that point is a weighted mean of two vertices and a centroid, so that the distance is linear in the vertices.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_vectors import Vector, dot, minus, row

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

STEPS = 12
MISSES = 32
CLOSER = 1 - 1e-9


class Faces(NamedTuple):
    """The faces of a mesh, corner after corner, as in `Connectivity`."""

    vertices: Indices  # (3n,)
    offsets: Indices  # (f + 1,)
    ahead: Indices  # (3n,) the vertex after each corner
    owner: Indices  # (3n,) the face of each corner
    across: Indices  # (3n,) the corner on the other side of the edge from each corner to the next
    hole: NDArray[np.bool_]  # (f,)


class Places(NamedTuple):
    """Where samples belong."""

    corner: Indices  # (s,) the corner whose fan triangle, or edge of a rim, it is
    weights: Array  # (s, 3) of the corner, of the one after it, and of the centroid of the face


@njit(cache=True, error_model="numpy")
def centroids(vertices: Array, faces: Faces, out: Array) -> None:
    """Put the mean of each face's vertices into `out` (f, 3)."""
    for f in range(faces.offsets.size - 1):
        first, last = faces.offsets[f], faces.offsets[f + 1]
        for k in range(3):
            total = 0.0
            for c in range(first, last):
                total += vertices[faces.vertices[c], k]
            out[f, k] = total / (last - first)


@njit(cache=True, error_model="numpy")
def closest_on_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> tuple[float, float, float]:
    """Return the squared distance of the point of a triangle closest to `p`, and its weights of `b` and `c`.

    C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
    """
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
def closest_on_fan(
    vertices: Array, middle: Array, faces: Faces, f: int, p: Vector, best: float
) -> tuple[float, int, float, float]:
    """Return of the point of a fan closest to `p` the squared distance, the corner, and the weights but the corner's.

    Where none is closer than `best`, squared, the corner is -1.
    """
    m, found, ahead, inside = row(middle, f), -1, 0.0, 0.0
    for c in range(faces.offsets[f], faces.offsets[f + 1]):
        squared, v, w = closest_on_triangle(p, row(vertices, faces.vertices[c]), row(vertices, faces.ahead[c]), m)
        if squared < best * CLOSER:
            best, found, ahead, inside = squared, c, v, w
    return best, found, ahead, inside


@njit(cache=True, error_model="numpy")
def locate(
    vertices: Array, middle: Array, faces: Faces, samples: Array, start: Indices, places: Places, squared: Array
) -> None:
    """Find where samples belong, each from a face on: to the face across an edge as long as it is closer."""
    for s in range(samples.shape[0]):
        face, best = start[s], np.inf
        for _ in range(STEPS):
            best, c, ahead, inside = closest_on_fan(vertices, middle, faces, face, row(samples, s), best)
            if c < 0:
                break
            start[s], places.corner[s] = face, c
            places.weights[s, 0], places.weights[s, 1], places.weights[s, 2] = 1 - ahead - inside, ahead, inside
            if inside > 0:
                break
            face = faces.owner[faces.across[c]]
            if faces.hole[face]:
                break
        squared[s] = best


@njit(cache=True, error_model="numpy")
def settle(
    vertices: Array,
    middle: Array,
    faces: Faces,
    samples: Array,
    start: Indices,
    places: Places,
    squared: Array,
    above: float,
) -> None:
    """Look for something closer in all faces around, again and again, for samples farther than `above`, squared."""
    for s in range(samples.shape[0]):
        face, before = start[s], np.inf
        while squared[s] > above and squared[s] < before:
            before = squared[s]
            here = face
            for e in range(faces.offsets[here], faces.offsets[here + 1]):
                other = faces.owner[faces.across[e]]
                if faces.hole[other]:
                    continue
                best, c, ahead, inside = closest_on_fan(vertices, middle, faces, other, row(samples, s), squared[s])
                if c >= 0:
                    squared[s], face, places.corner[s] = best, other, c
                    places.weights[s, 0], places.weights[s, 1], places.weights[s, 2] = 1 - ahead - inside, ahead, inside
        start[s] = face


@njit(cache=True, error_model="numpy")
def locate_on_rim(vertices: Array, faces: Faces, samples: Array, places: Places) -> None:
    """Find where samples of a rim belong, each from a corner of a hole on, until it has long not been closer."""
    for s in range(samples.shape[0]):
        at, best = places.corner[s], np.inf
        hole = faces.owner[at]
        first, size = faces.offsets[hole], faces.offsets[hole + 1] - faces.offsets[hole]
        for way in (1, -1):
            c, misses = at, 0
            for _ in range(size):
                a, b = vertices[faces.vertices[c]], vertices[faces.ahead[c]]
                along = squared = 0.0
                for k in range(3):
                    along += (samples[s, k] - a[k]) * (b[k] - a[k])
                    squared += (b[k] - a[k]) ** 2
                t = min(max(along / squared, 0.0), 1.0) if squared > 0 else 0.0
                found = 0.0
                for k in range(3):
                    found += (samples[s, k] - a[k] - t * (b[k] - a[k])) ** 2
                if found < best * CLOSER:
                    best = found
                    places.corner[s] = c
                    places.weights[s, 0], places.weights[s, 1], places.weights[s, 2] = 1 - t, t, 0.0
                    misses = 0
                misses += 1
                if misses > MISSES:
                    break
                c = first + (c - first + way) % size


@njit(cache=True, error_model="numpy")
def interpolated(values: Array, middle: Array, faces: Faces, places: Places, s: int, out: Array) -> None:
    """Put the weighted mean that a sample belongs to into `out`."""
    c = places.corner[s]
    w = places.weights[s]
    a, b, m = values[faces.vertices[c]], values[faces.ahead[c]], middle[faces.owner[c]]
    for k in range(3):
        out[k] = w[0] * a[k] + w[1] * b[k] + w[2] * m[k]


class Terms(NamedTuple):
    """The least squares: samples pull their places along and across a direction, vertices keep to their neighbors."""

    samples: Array  # (s, 3)
    direction: Array  # (s, 3) unit vectors
    along: Array  # (s,) weight of the squared distance along the direction
    across: Array  # (s,) and square to it
    neighbors: Indices  # (n, 3) of each vertex; on a rim the two on it, the second one twice
    share: Array  # (n, 3) of the mean of the neighbors
    even: Array  # (n, 3, 3) weights of the squared distance to that mean
    stay: Array  # (n,) weight of the squared move
    flat: Array  # (f, 3) along the normal of each face, squared the weight of its vertices' distance from its plane


@njit(cache=True, error_model="numpy")
def pulled_by_samples(
    v: Array, middle: Array, faces: Faces, places: Places, t: Terms, offset: float, out: Array, pull: Array
) -> None:
    """Add the part of half the gradient that the samples have: to vertices in `out`, to centroids in `pull`."""
    p = np.empty(3)
    for s in range(t.samples.shape[0]):
        interpolated(v, middle, faces, places, s, p)
        dot = 0.0
        for k in range(3):
            p[k] -= offset * t.samples[s, k]
            dot += p[k] * t.direction[s, k]
        c = places.corner[s]
        a, b, f = faces.vertices[c], faces.ahead[c], faces.owner[c]
        for k in range(3):
            force = t.across[s] * p[k] + (t.along[s] - t.across[s]) * dot * t.direction[s, k]
            out[a, k] += places.weights[s, 0] * force
            out[b, k] += places.weights[s, 1] * force
            pull[f, k] += places.weights[s, 2] * force


@njit(cache=True, error_model="numpy")
def pulled_by_faces(v: Array, middle: Array, faces: Faces, t: Terms, out: Array, pull: Array) -> None:
    """Add what pulls at centroids to vertices, and what flattens faces."""
    for f in range(faces.offsets.size - 1):
        size = faces.offsets[f + 1] - faces.offsets[f]
        for c in range(faces.offsets[f], faces.offsets[f + 1]):
            i = faces.vertices[c]
            dot = 0.0
            for k in range(3):
                dot += t.flat[f, k] * (v[i, k] - middle[f, k])
            for k in range(3):
                out[i, k] += pull[f, k] / size + dot * t.flat[f, k]


@njit(cache=True, error_model="numpy")
def pulled_by_neighbors(v: Array, t: Terms, offset: float, out: Array) -> None:
    """Add what evens out edges, and what keeps vertices where they are."""
    p = np.empty(3)
    for i in range(v.shape[0]):
        one, two, three = t.neighbors[i, 0], t.neighbors[i, 1], t.neighbors[i, 2]
        for k in range(3):
            p[k] = v[i, k] - t.share[i, 0] * v[one, k] - t.share[i, 1] * v[two, k] - t.share[i, 2] * v[three, k]
        for k in range(3):
            force = t.even[i, k, 0] * p[0] + t.even[i, k, 1] * p[1] + t.even[i, k, 2] * p[2]
            out[i, k] += force + (1 - offset) * t.stay[i] * v[i, k]
            out[one, k] -= t.share[i, 0] * force
            out[two, k] -= t.share[i, 1] * force
            out[three, k] -= t.share[i, 2] * force


@njit(cache=True, error_model="numpy")
def pulled(v: Array, middle: Array, faces: Faces, places: Places, t: Terms, offset: float, out: Array) -> None:
    """Put half the gradient at `v` into `out`: of the full quadratic with offset 1, of its homogeneous part with 0."""
    out[:] = 0.0
    centroids(v, faces, middle)
    pull = np.zeros(middle.shape)
    pulled_by_samples(v, middle, faces, places, t, offset, out, pull)
    pulled_by_faces(v, middle, faces, t, out, pull)
    pulled_by_neighbors(v, t, offset, out)


@njit(cache=True, error_model="numpy")
def solved(vertices: Array, faces: Faces, places: Places, t: Terms, iterations: int) -> Array:
    """Return the vertices that are best by so many iterations of conjugate gradients."""
    middle = np.empty((faces.offsets.size - 1, 3))
    move = np.zeros_like(vertices)
    left, image = np.empty_like(vertices), np.empty_like(vertices)
    pulled(vertices, middle, faces, places, t, 1.0, left)
    left = -left
    way = left.copy()
    size = (left * left).sum()
    for _ in range(iterations):
        if size == 0:
            break
        pulled(way, middle, faces, places, t, 0.0, image)
        step = size / (way * image).sum()
        move += step * way
        left -= step * image
        now = (left * left).sum()
        way = left + now / size * way
        size = now
    return vertices + move
