"""Orthonormal tangent frames, inlined into the estimators' kernels."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit


@njit(inline="always")
def tangents(nx, ny, nz):
    """Return two unit tangents u, v with u x v = n (Duff et al. 2017, Building an orthonormal basis, revisited)."""
    sign = math.copysign(1.0, nz)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    return 1.0 + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny
