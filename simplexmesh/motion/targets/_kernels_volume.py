"""Search for isosurface crossings along vertex normals through a volume, with sub-voxel precision."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

from numba import prange

from simplexmesh._kernels_both import FAST, Both
from simplexmesh._kernels_njit import njit


@njit(cache=True, error_model="numpy", fastmath=FAST)
def trilinear(values, strides, shape, x, y, z, outside):
    """Return the trilinear interpolant at a continuous index; samples beyond the volume have the value `outside`."""
    nx, ny, nz = shape
    if not (x > -1.0 and y > -1.0 and z > -1.0 and x < nx and y < ny and z < nz):
        return outside
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = x - i, y - j, z - k
    if i >= 0 and j >= 0 and k >= 0 and i < nx - 1 and j < ny - 1 and k < nz - 1:
        at = i * strides[0] + j * strides[1] + k * strides[2]
        a, b, c = strides[0], strides[1], strides[2]
        f00 = values[at] * (1.0 - u) + values[at + a] * u
        f10 = values[at + b] * (1.0 - u) + values[at + a + b] * u
        f01 = values[at + c] * (1.0 - u) + values[at + a + c] * u
        f11 = values[at + b + c] * (1.0 - u) + values[at + a + b + c] * u
        return (f00 * (1.0 - v) + f10 * v) * (1.0 - w) + (f01 * (1.0 - v) + f11 * v) * w
    total = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                p, q, r = i + di, j + dj, k + dk
                weight = (u if di else 1.0 - u) * (v if dj else 1.0 - v) * (w if dk else 1.0 - w)
                inside = 0 <= p < nx and 0 <= q < ny and 0 <= r < nz
                sample = values[p * strides[0] + q * strides[1] + r * strides[2]] if inside else outside
                total += weight * sample
    return total


@njit(cache=True, error_model="numpy", fastmath=FAST)
def crossing_times(shape, px, py, pz, dx, dy, dz):
    """Return the parameter interval in which a line is within one voxel of the volume; empty if it misses."""
    first, last = -math.inf, math.inf
    for p, d, count in ((px, dx, shape[0]), (py, dy, shape[1]), (pz, dz, shape[2])):
        if d == 0.0:
            if not -1.0 < p < count:
                last = -math.inf
            continue
        one, other = (-1.0 - p) / d, (count - p) / d
        first = max(first, min(one, other))
        last = min(last, max(one, other))
    return first, last


@partial(Both, pays_from=1000)  # about 200 nanoseconds per vertex
def isosurface_gaps(vertices, normals, values, strides, shape, to_index, level, sign, outside, reach, pace, out):
    """Fill the signed distance along each normal to the nearest crossing from inside (`sign * value` above) to outside.

    Inside vertices search outwards and outside vertices inwards, so the first crossing has the right polarity. `pace`
    is the step in voxels. NaN without a crossing within `reach`. Samples beyond the volume are background, so the
    search covers just the part of the line within the volume, with one step to either side.
    """
    for i in prange(vertices.shape[0]):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        a, b, c = normals[i, 0], normals[i, 1], normals[i, 2]
        px = to_index[0, 0] * x + to_index[0, 1] * y + to_index[0, 2] * z + to_index[0, 3]
        py = to_index[1, 0] * x + to_index[1, 1] * y + to_index[1, 2] * z + to_index[1, 3]
        pz = to_index[2, 0] * x + to_index[2, 1] * y + to_index[2, 2] * z + to_index[2, 3]
        dx = to_index[0, 0] * a + to_index[0, 1] * b + to_index[0, 2] * c
        dy = to_index[1, 0] * a + to_index[1, 1] * b + to_index[1, 2] * c
        dz = to_index[2, 0] * a + to_index[2, 1] * b + to_index[2, 2] * c
        fastest = max(abs(dx), abs(dy), abs(dz))
        out[i] = math.nan
        if not 0.0 < fastest < math.inf:
            continue
        here = sign * (trilinear(values, strides, shape, px, py, pz, outside) - level)
        step = pace / fastest if here > 0.0 else -pace / fastest
        near, far = 0.0, 0.0
        f_near = f_far = here
        first, last = crossing_times(shape, px, py, pz, dx, dy, dz)
        if step < 0.0:
            first, last = -last, -first
        stride = abs(step)
        if not (first <= last and last > 0.0 and first < reach):
            continue
        skipped = math.floor(max(first, 0.0) / stride)
        near = skipped * step
        steps = math.ceil(min(reach, last + stride) / stride)
        found = False
        for k in range(skipped + 1, steps + 1):
            far = min(k * abs(step), reach) * math.copysign(1.0, step)
            f_far = sign * (
                trilinear(values, strides, shape, px + far * dx, py + far * dy, pz + far * dz, outside) - level
            )
            if (f_far > 0.0) != (here > 0.0):
                found = True
                break
            near, f_near = far, f_far
        if not found:
            continue
        middle, fine, last = near, 1e-6 * abs(f_near - f_far), 0
        for _ in range(40):  # regula falsi (Illinois variant): 4 or 5 iterations, more across a kink
            middle = near + (far - near) * f_near / (f_near - f_far)
            f_middle = sign * (
                trilinear(values, strides, shape, px + middle * dx, py + middle * dy, pz + middle * dz, outside) - level
            )
            if abs(f_middle) <= fine:
                break
            if (f_middle > 0.0) == (here > 0.0):
                near, f_near = middle, f_middle
                f_far *= 0.5 if last == 1 else 1.0
                last = 1
            else:
                far, f_far = middle, f_middle
                f_near *= 0.5 if last == 2 else 1.0
                last = 2
        out[i] = middle
