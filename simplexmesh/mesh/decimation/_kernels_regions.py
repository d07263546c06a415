"""Kernels of regions, the parts of a surface that faces represent: their moments and their planarity energy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices, Indices32
from simplexmesh.mesh.operators._kernels_edit import Darts, next_dart
from simplexmesh.numerics._kernels_vectors import Vector, cross_product, minus, norm, row

AREA, CENTROID, MOMENTS, VECTOR_AREA, RIM_LENGTH, RIM_MOMENTS = 0, 1, 4, 10, 13, 17
ROW_SIZE = 23
"""A region is a row: its area, centroid (3), central second moments (xx, yy, zz, xy, xz, yz) and vector area (3), then
length, centroid and second moments of its part of a rim."""


class Weights(NamedTuple):
    """Weights of the cost, and limits beyond which edges are not removed."""

    normals: float  # weight of the deviation of normals, see `energy`
    extent: float  # weight of the squared extent of a region, for compact faces of even size where the surface is flat
    rim: float  # weight of the deviation of a rim from a line
    imbalance: float  # weight of the increase in the squared deviations of face sizes from 6
    turn: float  # smallest cosine of the rotation of a dual triangle
    bend: float  # smallest cosine between the normals of neighboring dual triangles
    quality: float  # smallest quality of a dual triangle, 1 for a regular one
    min_size: int  # smallest number of vertices of a face
    max_size: int  # largest number of vertices of a face
    min_component: int  # smallest number of vertices of a component
    necks: bool  # whether three faces may form a ring around more than a vertex
    max_deviation: float  # largest rms distance of a region from its plane, and of a rim from its line


class Corners(NamedTuple):
    """The faces as corners of the dual triangulation, and the sizes of the components."""

    points: Array  # (f, 3) centroids of the regions
    regions: Array  # (f, 23)
    energy: Array  # (f,) of the regions
    max_extent: Array  # (f,) largest rms extent of a region; a face with 0 is fixed, with its vertices
    merged_into: Indices32  # (f,) the face into which each one was merged, itself if it was not
    component: Indices32  # (n,) of each vertex
    n_left: Indices  # number of vertices left in each component


@njit(cache=True, error_model="numpy")
def add_outer(m: Array, at: int, weight: float, v: Vector) -> None:
    """Add the weighted outer product of a vector with itself to the symmetric matrix that starts at `at`."""
    x, y, z = v
    m[at] += weight * x * x
    m[at + 1] += weight * y * y
    m[at + 2] += weight * z * z
    m[at + 3] += weight * x * y
    m[at + 4] += weight * x * z
    m[at + 5] += weight * y * z


@njit(cache=True, error_model="numpy")
def merge_moments(one: Array, other: Array, at: int, out: Array) -> None:
    """Write the union's measure, centroid and second moments, from `at` on, to `out` (parallel axis theorem)."""
    total = one[at] + other[at]
    share = other[at] / total if total > 0 else 0.5
    out[at] = total
    for k in range(at + 1, at + 4):
        out[k] = one[k] + share * (other[k] - one[k])
    for k in range(at + 4, at + 10):
        out[k] = one[k] + other[k]
    apart = other[at + 1] - one[at + 1], other[at + 2] - one[at + 2], other[at + 3] - one[at + 3]
    add_outer(out, at + 4, (total - other[at]) * share, apart)


@njit(cache=True, error_model="numpy")
def merge(one: Array, other: Array, out: Array) -> None:
    """Write the union of two regions to `out`, which must be neither of them."""
    merge_moments(one, other, AREA, out)
    for k in range(VECTOR_AREA, VECTOR_AREA + 3):
        out[k] = one[k] + other[k]
    merge_moments(one, other, RIM_LENGTH, out)


@njit(cache=True, error_model="numpy")
def eigenvalue(m: Array, at: int, which: int) -> float:
    """Return the smallest (0) or largest (1) eigenvalue of the matrix at `at` (O. K. Smith, Comm. ACM 4 (1961) 168)."""
    mean = (m[at] + m[at + 1] + m[at + 2]) / 3
    a, b, c, xy, xz, yz = m[at] - mean, m[at + 1] - mean, m[at + 2] - mean, m[at + 3], m[at + 4], m[at + 5]
    size = np.sqrt((a * a + b * b + c * c + 2 * (xy * xy + xz * xz + yz * yz)) / 6)
    if not size > 0:
        return max(mean, 0.0)
    det = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    angle = np.arccos(min(max(det / (2 * size**3), -1.0), 1.0)) / 3
    return max(mean + 2 * size * np.cos(angle + (1 - which) * 2 * np.pi / 3), 0.0)


@njit(cache=True, error_model="numpy")
def line_residual(m: Array) -> float:
    """Return the integral over a region's rim of the squared distance to its best-fitting line."""
    return max(m[RIM_MOMENTS] + m[RIM_MOMENTS + 1] + m[RIM_MOMENTS + 2] - eigenvalue(m, RIM_MOMENTS, 1), 0.0)


@njit(cache=True, error_model="numpy")
def energy(m: Array, w: Weights) -> float:
    """Return the integral of squared distances to a plane, and weighted: to the centroid, of normals, rim to a line."""
    vector = norm((m[VECTOR_AREA], m[VECTOR_AREA + 1], m[VECTOR_AREA + 2]))
    total = eigenvalue(m, MOMENTS, 0) + w.normals * m[AREA] * max(m[AREA] - vector, 0.0)
    total += w.extent * (m[MOMENTS] + m[MOMENTS + 1] + m[MOMENTS + 2])
    if m[RIM_LENGTH] > 0:
        total += w.rim * np.sqrt(m[AREA]) * line_residual(m)
    return total


@njit(cache=True, error_model="numpy")
def exceeds_limits(m: Array, max_deviation: float, max_extent: float) -> bool:
    """Return whether a region's rms distance to its plane, its rim's to a line, or to its centroid is too large."""
    if not m[MOMENTS] + m[MOMENTS + 1] + m[MOMENTS + 2] <= max_extent**2 * m[AREA]:
        return True
    if not eigenvalue(m, MOMENTS, 0) <= max_deviation**2 * m[AREA]:
        return True
    return m[RIM_LENGTH] > 0 and not line_residual(m) <= max_deviation**2 * m[RIM_LENGTH]


@njit(cache=True, error_model="numpy")
def add_triangle(m: Array, a: Vector, b: Vector) -> None:
    """Add a fan triangle to area, vector area and moments, given by two corners relative to its apex."""
    n = cross_product(a, b)
    both, area = (a[0] + b[0], a[1] + b[1], a[2] + b[2]), norm(n) / 2
    m[AREA] += area
    for v in (a, b, both):
        add_outer(m, MOMENTS, area / 12, v)
    for k in range(3):
        m[VECTOR_AREA + k] += n[k] / 2
        m[CENTROID + k] += area * both[k] / 3


@njit(cache=True, error_model="numpy")
def set_segment(m: Array, a: Vector, b: Vector) -> None:
    """Set the rim of a face to one of its edges."""
    edge = minus(b, a)
    m[RIM_LENGTH] = norm(edge)
    for k in range(3):
        m[RIM_LENGTH + 1 + k] = (a[k] + b[k]) / 2
    add_outer(m, RIM_MOMENTS, m[RIM_LENGTH] / 12, edge)


@njit(cache=True, error_model="numpy")
def set_region(d: Darts, f: int, m: Array) -> None:
    """Set a region of zeros to a face, its fan about its centroid, and to the first of its rim edges."""
    walk = d.face_dart[f]
    x = y = z = 0.0
    for _ in range(d.face_size[f]):
        p = row(d.values, walk // 3)
        x, y, z = x + p[0], y + p[1], z + p[2]
        walk = next_dart(d.twin, walk)
    apex = x / d.face_size[f], y / d.face_size[f], z / d.face_size[f]
    for _ in range(d.face_size[f]):
        a, b = row(d.values, walk // 3), row(d.values, d.twin[walk] // 3)
        add_triangle(m, minus(a, apex), minus(b, apex))
        if d.face_hole[d.face[d.twin[walk]]] and m[RIM_LENGTH] == 0:
            set_segment(m, a, b)
        walk = next_dart(d.twin, walk)
    for k in range(3):
        m[CENTROID + k] /= m[AREA] if m[AREA] > 0 else 1.0
    add_outer(m, MOMENTS, -m[AREA], (m[CENTROID], m[CENTROID + 1], m[CENTROID + 2]))
    for k in range(3):
        m[CENTROID + k] += apex[k]


@njit(cache=True, error_model="numpy")
def corners_of(d: Darts, component: Indices32, max_extent: Array, w: Weights) -> Corners:
    """Return the faces as corners, each the region of its own face; those of holes are zero."""
    n_faces, n_left = d.face_dart.size, np.zeros(component.max() + 1, np.int64)
    regions, energies = np.zeros((n_faces, ROW_SIZE)), np.zeros(n_faces)
    for f in range(n_faces):
        if d.face_dart[f] >= 0 and not d.face_hole[f]:
            set_region(d, f, regions[f])
            energies[f] = energy(regions[f], w)
    for label in component:
        n_left[label] += 1
    points = regions[:, CENTROID : CENTROID + 3].copy()
    into = np.arange(n_faces).astype(np.int32)
    return Corners(points, regions, energies, max_extent.copy(), into, component, n_left)
