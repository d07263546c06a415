"""Normals of quadrics through a vertex that lie closest to its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.normals._kernels_small import solve
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND


@njit(cache=True, error_model="numpy")
def _slopes(points, i, members, start, stop, frame, table, right):
    """Fit z = a x^2 + b x y + c y^2 + d x + e y in the frame; leave d, e in `right`; return whether they are told."""
    ux, uy, uz, vx, vy, vz, nx, ny, nz = frame
    size = 0.0
    for m in range(start, stop):
        for axis in range(3):
            size += (points[members[m], axis] - points[i, axis]) ** 2
    scale = math.sqrt((stop - start) / size) if size > 0.0 else 0.0
    table[:] = 0.0
    right[:] = 0.0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        u, v = scale * (ux * x + uy * y + uz * z), scale * (vx * x + vy * y + vz * z)
        height = scale * (nx * x + ny * y + nz * z)
        terms = (u * u, u * v, v * v, u, v)
        for p in range(5):
            for q in range(p + 1):
                table[p, q] += terms[p] * terms[q]
            right[p] += terms[p] * height
    return solve(table, right, 5)


@Both
def quadrics(centers, offsets, members, points, start_normals, passes, normals, reasons):
    """Fill the fitted quadric's normal at the center per row, each pass in the frame of the one before."""
    for row in prange(centers.shape[0]):
        start, stop, i = offsets[row], offsets[row + 1], centers[row]
        nx, ny, nz = start_normals[row, 0], start_normals[row, 1], start_normals[row, 2]
        if stop - start < 5:
            reasons[row] = FEW
            continue
        table, right = np.zeros((5, 5)), np.zeros(5)
        told = nx * nx + ny * ny + nz * nz > 0.5
        for _ in range(passes):
            ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
            told = told and _slopes(points, i, members, start, stop, (ux, uy, uz, vx, vy, vz, nx, ny, nz), table, right)
            if not told:
                break
            d, e = right[3], right[4]
            length = math.sqrt(1.0 + d * d + e * e)
            nx, ny, nz = (nx - d * ux - e * vx), (ny - d * uy - e * vy), (nz - d * uz - e * vz)
            nx, ny, nz = nx / length, ny / length, nz / length
        if not told:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = nx, ny, nz
        reasons[row] = FOUND
