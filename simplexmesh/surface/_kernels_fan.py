"""The neighbors of a point in the frame of its normal: the one pass that estimators from neighbors begin with."""
# mypy: allow-untyped-defs

from __future__ import annotations

from simplexmesh._base._kernels_njit import njit
from simplexmesh.numerics._kernels_frames import tangents

FLAT = 1e-24
"""A neighbor whose projection is shorter than this share of its distance, squared, has no azimuth."""

SINGULAR = 1e-10
"""Scatter determinant of directions, per squared count, below which there are fewer than needed."""


@njit(cache=True, error_model="numpy")
def fill_fan(row, center, rows, points, normal, fan):
    """Fill (u, v, height, squared distance) of each neighbor, in a frame u, v, normal; return how many there are."""
    nx, ny, nz = normal
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    px, py, pz = points[center, 0], points[center, 1], points[center, 2]
    start, stop = rows.offsets[row], rows.offsets[row + 1]
    for m in range(stop - start):
        j = rows.members[start + m]
        x, y, z = points[j, 0] - px, points[j, 1] - py, points[j, 2] - pz
        fan[m, 0], fan[m, 1] = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
        fan[m, 2], fan[m, 3] = nx * x + ny * y + nz * z, x * x + y * y + z * z
    return stop - start
