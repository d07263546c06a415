"""Which of the filled cells of a grid is nearest to each. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit

FAR = 2**30


@njit(cache=True, error_model="numpy", parallel=True)
def _along_first(holder, out, square):
    """Fill what the nearest filled cell along the first axis holds, and its squared distance; the earlier of two."""
    nx, ny, nz = holder.shape
    for j in prange(ny):
        last = np.empty(nz, np.int64)
        last[:] = -1
        for i in range(nx):
            for k in range(nz):
                if holder[i, j, k] >= 0:
                    last[k] = i
                out[i, j, k] = holder[last[k], j, k] if last[k] >= 0 else -1
                square[i, j, k] = (i - last[k]) ** 2 if last[k] >= 0 else FAR
        last[:] = -1
        for i in range(nx - 1, -1, -1):
            for k in range(nz):
                if holder[i, j, k] >= 0:
                    last[k] = i
                if last[k] >= 0 and (last[k] - i) ** 2 < square[i, j, k]:
                    out[i, j, k] = holder[last[k], j, k]
                    square[i, j, k] = (last[k] - i) ** 2


@njit(cache=True, error_model="numpy")
def _along_line(held, square, kept, filled, apart):
    """Replace what places of a line hold by what the nearest of them holds, squared distances across it known.

    Those nearest somewhere are the lower envelope of parabolas; `kept`, `filled` and `apart` are room for them.
    """
    last = -1
    for i in range(len(held)):
        if square[i] == FAR:
            continue
        while last >= 1:
            a, b = kept[last] - kept[last - 1], i - kept[last]
            if (a + b) * apart[last] - b * apart[last - 1] - a * square[i] <= a * b * (a + b):
                break
            last -= 1
        last += 1
        kept[last], filled[last], apart[last] = i, held[i], square[i]
    if last < 0:
        return
    here = 0
    for i in range(len(held)):
        while here < last and apart[here + 1] + (kept[here + 1] - i) ** 2 < apart[here] + (kept[here] - i) ** 2:
            here += 1
        held[i], square[i] = filled[here], apart[here] + (kept[here] - i) ** 2


@njit(cache=True, error_model="numpy", parallel=True)
def fill_nearest(holder, out):
    """Fill `out` with what the nearest filled cell of `holder` holds, -1 where it is empty.

    Axis by axis, as C. Maurer, R. Qi, V. Raghavan, A linear time algorithm for computing exact Euclidean distance
    transforms, 2003; of cells as near the same is taken as SciPy's `distance_transform_edt` takes.
    """
    nx, ny, nz = holder.shape
    square = np.empty((nx, ny, nz), np.int32)
    _along_first(holder, out, square)
    for i in prange(nx):
        most = max(ny, nz)
        kept, filled, apart = np.empty(most, np.int64), np.empty(most, np.int32), np.empty(most, np.int64)
        for k in range(nz):
            _along_line(out[i, :, k], square[i, :, k], kept, filled, apart)
        for j in range(ny):
            _along_line(out[i, j], square[i, j], kept, filled, apart)
