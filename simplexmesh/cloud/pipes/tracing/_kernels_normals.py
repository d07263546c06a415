"""Normals of a few points at a time. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit
from simplexmesh.numerics._kernels_local_fits import fit_plane
from simplexmesh.numerics._kernels_vectors import row


@njit(cache=True, error_model="numpy")
def fill_normals(points, near, normals):
    """Fill unit normals (n, 3), of either sign, of planes through neighbors `near` (n, k), the point itself first.

    In one thread, as batches of some dozens of points take less time than to share them out.
    """
    for i in range(len(near)):
        fit_plane(points, near[i], row(points, near[i, 0]), math.inf, normals[i])
