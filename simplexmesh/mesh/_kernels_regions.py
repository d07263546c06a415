"""Kernels of regions, the parts of a surface that faces represent: their moments and their planarity energy.

A region is a row of 23 numbers: its area, centroid (3), central second moments (xx, yy, zz, xy, xz, yz) and vector area
(3); then length, centroid (3) and central second moments (6) of its part of a rim.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_edit import Darts, next_dart

Array = NDArray[np.float64]

AREA, CENTROID, MOMENTS, VECTOR_AREA, RIM_LENGTH, RIM_MOMENTS = 0, 1, 4, 10, 13, 17
ROW_SIZE = 23


@njit(cache=True, error_model="numpy")
def cross(a: Array, b: Array, c: Array, out: Array) -> float:
    """Write the cross product of b - a and c - a to `out`, and return its length."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    out[0] = uy * vz - uz * vy
    out[1] = uz * vx - ux * vz
    out[2] = ux * vy - uy * vx
    return np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)


@njit(cache=True, error_model="numpy")
def add_outer(m: Array, at: int, weight: float, x: float, y: float, z: float) -> None:
    """Add the weighted outer product of a vector with itself to the symmetric matrix that starts at `at`."""
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
    x, y, z = other[at + 1] - one[at + 1], other[at + 2] - one[at + 2], other[at + 3] - one[at + 3]
    out[at] = total
    out[at + 1] = one[at + 1] + share * x
    out[at + 2] = one[at + 2] + share * y
    out[at + 3] = one[at + 3] + share * z
    for k in range(at + 4, at + 10):
        out[k] = one[k] + other[k]
    add_outer(out, at + 4, (total - other[at]) * share, x, y, z)


@njit(cache=True, error_model="numpy")
def merge(one: Array, other: Array, out: Array) -> None:
    """Write the union of two regions to `out`, which must be neither of them."""
    merge_moments(one, other, AREA, out)
    for k in range(VECTOR_AREA, VECTOR_AREA + 3):
        out[k] = one[k] + other[k]
    merge_moments(one, other, RIM_LENGTH, out)


@njit(cache=True, error_model="numpy")
def eigenvalue(m: Array, at: int, which: int) -> float:
    """Return the smallest (0) or largest (1) eigenvalue, at least 0, of the symmetric matrix that starts at `at`.

    O. K. Smith, *Eigenvalues of a symmetric 3 x 3 matrix*, Comm. ACM 4 (1961) 168.
    """
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
def energy(m: Array, normals: float, extent: float, rim: float) -> float:
    """Return the energy of a region as a flat face: a length to the fourth power, which merging does not decrease.

    It is the weighted sum of the integrals over the region of the squared distance to the best-fitting plane (weight
    1), the deviation of the normals from their mean, the squared distance to the centroid, and, over its rim, the
    squared distance to the best-fitting line.
    """
    vector = np.sqrt(m[VECTOR_AREA] ** 2 + m[VECTOR_AREA + 1] ** 2 + m[VECTOR_AREA + 2] ** 2)
    total = eigenvalue(m, MOMENTS, 0) + normals * m[AREA] * max(m[AREA] - vector, 0.0)
    total += extent * (m[MOMENTS] + m[MOMENTS + 1] + m[MOMENTS + 2])
    if m[RIM_LENGTH] > 0:
        total += rim * np.sqrt(m[AREA]) * line_residual(m)
    return total


@njit(cache=True, error_model="numpy")
def exceeds_limits(m: Array, max_deviation: float, max_extent: float) -> bool:
    """Return whether the rms distance of a region to its best plane, or of its rim to its best line, is too large.

    Or whether its rms distance to the centroid is above `max_extent`.
    """
    if not m[MOMENTS] + m[MOMENTS + 1] + m[MOMENTS + 2] <= max_extent**2 * m[AREA]:
        return True
    if not eigenvalue(m, MOMENTS, 0) <= max_deviation**2 * m[AREA]:
        return True
    return m[RIM_LENGTH] > 0 and not line_residual(m) <= max_deviation**2 * m[RIM_LENGTH]


@njit(cache=True, error_model="numpy")
def add_triangle(m: Array, a: Array, b: Array, c: Array, n: Array) -> None:
    """Add a fan triangle to area, vector area and moments, all relative to its apex `c`; `n` (3,) is a workspace."""
    area = cross(a, b, c, n) / 2
    ax, ay, az = a[0] - c[0], a[1] - c[1], a[2] - c[2]
    bx, by, bz = b[0] - c[0], b[1] - c[1], b[2] - c[2]
    m[AREA] += area
    add_outer(m, MOMENTS, area / 12, ax, ay, az)
    add_outer(m, MOMENTS, area / 12, bx, by, bz)
    add_outer(m, MOMENTS, area / 12, ax + bx, ay + by, az + bz)
    for k in range(3):
        m[VECTOR_AREA + k] += n[k] / 2
        m[CENTROID + k] += area * (a[k] + b[k] - 2 * c[k]) / 3


@njit(cache=True, error_model="numpy")
def add_segment(m: Array, a: Array, b: Array) -> None:
    """Set the rim of a face to one of its edges; a face with several rim edges keeps the first only."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    m[RIM_LENGTH] = np.sqrt(x * x + y * y + z * z)
    for k in range(3):
        m[RIM_LENGTH + 1 + k] = (a[k] + b[k]) / 2
    add_outer(m, RIM_MOMENTS, m[RIM_LENGTH] / 12, x, y, z)


@njit(cache=True, error_model="numpy")
def face_regions(d: Darts) -> Array:
    """Return the region (f, 23) of each face, its fan about the centroid of its vertices; zero for holes."""
    out = np.zeros((d.face_dart.size, ROW_SIZE))
    c, n = np.empty(3), np.empty(3)
    for f in range(d.face_dart.size):
        if d.face_dart[f] < 0 or d.face_hole[f]:
            continue
        m, walk = out[f], d.face_dart[f]
        c[:] = 0.0
        for _ in range(d.face_size[f]):
            for k in range(3):
                c[k] += d.values[walk // 3, k] / d.face_size[f]
            walk = next_dart(d.twin, walk)
        for _ in range(d.face_size[f]):
            a, b = d.values[walk // 3], d.values[d.twin[walk] // 3]
            add_triangle(m, a, b, c, n)
            if d.face_hole[d.face[d.twin[walk]]] and m[RIM_LENGTH] == 0:
                add_segment(m, a, b)
            walk = next_dart(d.twin, walk)
        for k in range(3):
            m[CENTROID + k] /= m[AREA] if m[AREA] > 0 else 1.0
        add_outer(m, MOMENTS, -m[AREA], m[CENTROID], m[CENTROID + 1], m[CENTROID + 2])
        for k in range(3):
            m[CENTROID + k] += c[k]
    return out


@njit(cache=True)
def energies(regions: Array, normals: float, extent: float, rim: float) -> Array:
    """Return the energy (f,) of each region."""
    out = np.empty(regions.shape[0])
    for f in range(out.size):
        out[f] = energy(regions[f], normals, extent, rim)
    return out
