"""Kernels of regions: the part of a surface that a face stands for, as integrals over it, and what it costs to be flat.

A row of 23 numbers is a region: its area, its centroid (3), the integral of the squared distances to it as a matrix
(xx, yy, zz, xy, xz, yz), its vector area (3); then of its part of a rim the length, the middle (3) and such a matrix.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_edit import Darts, follow

Array = NDArray[np.float64]

AREA, MIDDLE, SPREAD, VECTOR, LENGTH, RIM_SPREAD = 0, 1, 4, 10, 13, 17
TERMS = 23


@njit(cache=True, error_model="numpy")
def cross(a: Array, b: Array, c: Array, out: Array) -> float:
    """Put the cross product of b - a and c - a into `out`, and return its length."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    out[0] = uy * vz - uz * vy
    out[1] = uz * vx - ux * vz
    out[2] = ux * vy - uy * vx
    return np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)


@njit(cache=True, error_model="numpy")
def add_square(m: Array, at: int, weight: float, x: float, y: float, z: float) -> None:
    """Add a weighted vector times itself to the matrix whose first number is `at`."""
    m[at] += weight * x * x
    m[at + 1] += weight * y * y
    m[at + 2] += weight * z * z
    m[at + 3] += weight * x * y
    m[at + 4] += weight * x * z
    m[at + 5] += weight * y * z


@njit(cache=True, error_model="numpy")
def merge_part(one: Array, other: Array, at: int, out: Array) -> None:
    """Put size, middle and matrix, from `at` on, of two things together into `out`, by the theorem of parallel axes."""
    total = one[at] + other[at]
    share = other[at] / total if total > 0 else 0.5
    x, y, z = other[at + 1] - one[at + 1], other[at + 2] - one[at + 2], other[at + 3] - one[at + 3]
    out[at] = total
    out[at + 1] = one[at + 1] + share * x
    out[at + 2] = one[at + 2] + share * y
    out[at + 3] = one[at + 3] + share * z
    for k in range(at + 4, at + 10):
        out[k] = one[k] + other[k]
    add_square(out, at + 4, (total - other[at]) * share, x, y, z)


@njit(cache=True, error_model="numpy")
def merge(one: Array, other: Array, out: Array) -> None:
    """Put the region that two make together into `out`, which is neither of them."""
    merge_part(one, other, AREA, out)
    for k in range(VECTOR, VECTOR + 3):
        out[k] = one[k] + other[k]
    merge_part(one, other, LENGTH, out)


@njit(cache=True, error_model="numpy")
def eigenvalue(m: Array, at: int, which: int) -> float:
    """Return the least (0) or the largest (1) eigenvalue of the matrix whose first number is `at`, not below 0.

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
def off_line(m: Array) -> float:
    """Return the squared distance of a region's rim to the line that fits it best, integrated over the rim."""
    return max(m[RIM_SPREAD] + m[RIM_SPREAD + 1] + m[RIM_SPREAD + 2] - eigenvalue(m, RIM_SPREAD, 1), 0.0)


@njit(cache=True, error_model="numpy")
def energy(m: Array, normals: float, spread: float, rim: float) -> float:
    """Return how bad a region is as a flat face, a length to the fourth power that only grows when regions merge.

    The squared distance to the plane that fits best; how far normals are from their mean; how far the region reaches;
    and how far its rim is from a line: integrated, with these weights.
    """
    vector = np.sqrt(m[VECTOR] ** 2 + m[VECTOR + 1] ** 2 + m[VECTOR + 2] ** 2)
    total = eigenvalue(m, SPREAD, 0) + normals * m[AREA] * max(m[AREA] - vector, 0.0)
    total += spread * (m[SPREAD] + m[SPREAD + 1] + m[SPREAD + 2])
    if m[LENGTH] > 0:
        total += rim * np.sqrt(m[AREA]) * off_line(m)
    return total


@njit(cache=True, error_model="numpy")
def strays(m: Array, flat: float, reach: float) -> bool:
    """Return whether a region is farther than `flat`, rms, from the plane that fits best, or its rim from a line.

    Or farther than `reach`, rms, from its centroid.
    """
    if not m[SPREAD] + m[SPREAD + 1] + m[SPREAD + 2] <= reach**2 * m[AREA]:
        return True
    if not eigenvalue(m, SPREAD, 0) <= flat**2 * m[AREA]:
        return True
    return m[LENGTH] > 0 and not off_line(m) <= flat**2 * m[LENGTH]


@njit(cache=True, error_model="numpy")
def add_triangle(m: Array, a: Array, b: Array, c: Array, n: Array) -> None:
    """Add a triangle of a fan to area, vector area and matrix, with `c`, where the middle is told from; `n` is room."""
    area = cross(a, b, c, n) / 2
    ax, ay, az = a[0] - c[0], a[1] - c[1], a[2] - c[2]
    bx, by, bz = b[0] - c[0], b[1] - c[1], b[2] - c[2]
    m[AREA] += area
    add_square(m, SPREAD, area / 12, ax, ay, az)
    add_square(m, SPREAD, area / 12, bx, by, bz)
    add_square(m, SPREAD, area / 12, ax + bx, ay + by, az + bz)
    for k in range(3):
        m[VECTOR + k] += n[k] / 2
        m[MIDDLE + k] += area * (a[k] + b[k] - 2 * c[k]) / 3


@njit(cache=True, error_model="numpy")
def add_segment(m: Array, a: Array, b: Array) -> None:
    """Add the edge of a face on a rim; it has one with each hole, of which the first counts."""
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    m[LENGTH] = np.sqrt(x * x + y * y + z * z)
    for k in range(3):
        m[LENGTH + 1 + k] = (a[k] + b[k]) / 2
    add_square(m, RIM_SPREAD, m[LENGTH] / 12, x, y, z)


@njit(cache=True, error_model="numpy")
def face_regions(d: Darts) -> Array:
    """Return the region (f, 23) of each face, its fan about the mean of its vertices; zero for holes."""
    out = np.zeros((d.face_dart.size, TERMS))
    c, n = np.empty(3), np.empty(3)
    for f in range(d.face_dart.size):
        if d.face_dart[f] < 0 or d.face_hole[f]:
            continue
        m, walk = out[f], d.face_dart[f]
        c[:] = 0.0
        for _ in range(d.face_size[f]):
            for k in range(3):
                c[k] += d.values[walk // 3, k] / d.face_size[f]
            walk = follow(d.twin, walk)
        for _ in range(d.face_size[f]):
            a, b = d.values[walk // 3], d.values[d.twin[walk] // 3]
            add_triangle(m, a, b, c, n)
            if d.face_hole[d.face[d.twin[walk]]] and m[LENGTH] == 0:
                add_segment(m, a, b)
            walk = follow(d.twin, walk)
        for k in range(3):
            m[MIDDLE + k] /= m[AREA] if m[AREA] > 0 else 1.0
        add_square(m, SPREAD, -m[AREA], m[MIDDLE], m[MIDDLE + 1], m[MIDDLE + 2])
        for k in range(3):
            m[MIDDLE + k] += c[k]
    return out


@njit(cache=True)
def energies(regions: Array, normals: float, spread: float, rim: float) -> Array:
    """Return the energy (f,) of each region."""
    out = np.empty(regions.shape[0])
    for f in range(out.size):
        out[f] = energy(regions[f], normals, spread, rim)
    return out
