"""Boundary crossings of a labeled region: the midpoints between adjacent voxels inside and outside."""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_rows import by_rows


@by_rows(8)
def fill_crossings(begin, end, mask, starts, places, gradients):
    """Fill midpoint and outward direction of each crossing, minus the region's first moment, as indices."""
    nx, ny, nz = mask.shape
    for i in range(max(begin, 2), min(end, nx - 1)):
        n = starts[i]
        for j in range(1, ny - 1):
            for k in range(1, nz - 1):
                here = mask[i, j, k]
                for axis in range(3):
                    a, b, c = i - (axis == 0), j - (axis == 1), k - (axis == 2)
                    if here == mask[a, b, c]:
                        continue
                    mx, my, mz = 0.5 * (i + a), 0.5 * (j + b), 0.5 * (k + c)
                    gx = gy = gz = 0.0
                    for p in range(max(a - 1, 0), min(i + 2, nx)):
                        for q in range(max(b - 1, 0), min(j + 2, ny)):
                            for r in range(max(c - 1, 0), min(k + 2, nz)):
                                if mask[p, q, r]:
                                    gx -= p - mx
                                    gy -= q - my
                                    gz -= r - mz
                    out = 1.0 if mask[a, b, c] else -1.0
                    along = out * (gx if axis == 0 else gy if axis == 1 else gz)
                    size = np.sqrt(gx * gx + gy * gy + gz * gz)
                    if along < 0.3 * size or size == 0.0:  # thin parts: use the axis of the crossing
                        push = out * max(size, 1.0)
                        gx = push if axis == 0 else gx
                        gy = push if axis == 1 else gy
                        gz = push if axis == 2 else gz
                    places[n, 0], places[n, 1], places[n, 2] = mx, my, mz
                    gradients[n, 0], gradients[n, 1], gradients[n, 2] = gx, gy, gz
                    n += 1
