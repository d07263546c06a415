"""Search for isosurface crossings along vertex normals through a volume, with sub-voxel precision."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import FAST, LEAN, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array
from simplexmesh.numerics._kernels_vectors import dot, row


class Field(NamedTuple):
    """A sampled function whose zero level is sought, positive inside: ``sign * (value - level)``."""

    values: NDArray[Any]  # flat: one kernel serves all memory layouts
    step_i: int  # distance in `values` between neighbors along each axis
    step_j: int
    step_k: int
    ni: int  # samples along each axis
    nj: int
    nk: int
    to_index: Array  # (3, 4) from positions to continuous indices
    level: float
    sign: float
    outside: float  # value of samples beyond the volume


@njit(**LEAN, fastmath=FAST)
def field_value(field, place, along, far):
    """Return the trilinear interpolant of the field at ``place + far * along``, a continuous index."""
    x, y, z = place[0] + far * along[0], place[1] + far * along[1], place[2] + far * along[2]
    if not (x > -1.0 and y > -1.0 and z > -1.0 and x < field.ni and y < field.nj and z < field.nk):
        return field.sign * (field.outside - field.level)
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = x - i, y - j, z - k
    values, a, b, c = field.values, field.step_i, field.step_j, field.step_k
    if i >= 0 and j >= 0 and k >= 0 and i < field.ni - 1 and j < field.nj - 1 and k < field.nk - 1:
        at = i * a + j * b + k * c
        f00 = values[at] * (1.0 - u) + values[at + a] * u
        f10 = values[at + b] * (1.0 - u) + values[at + a + b] * u
        f01 = values[at + c] * (1.0 - u) + values[at + a + c] * u
        f11 = values[at + b + c] * (1.0 - u) + values[at + a + b + c] * u
        return field.sign * ((f00 * (1.0 - v) + f10 * v) * (1.0 - w) + (f01 * (1.0 - v) + f11 * v) * w - field.level)
    total = 0.0
    for corner in range(8):
        di, dj, dk = corner & 1, (corner >> 1) & 1, corner >> 2
        p, q, r = i + di, j + dj, k + dk
        weight = (u if di else 1.0 - u) * (v if dj else 1.0 - v) * (w if dk else 1.0 - w)
        known = 0 <= p < field.ni and 0 <= q < field.nj and 0 <= r < field.nk
        total += weight * (values[p * a + q * b + r * c] if known else field.outside)
    return field.sign * (total - field.level)


@njit(**LEAN, fastmath=FAST)
def _passage(ni, nj, nk, place, along):
    """Return the parameter interval in which a line is within one voxel of the volume; empty if it misses."""
    first, last = -math.inf, math.inf
    for p, d, count in ((place[0], along[0], ni), (place[1], along[1], nj), (place[2], along[2], nk)):
        if d == 0.0:
            if not -1.0 < p < count:
                last = -math.inf
            continue
        one, other = (-1.0 - p) / d, (count - p) / d
        first = max(first, min(one, other))
        last = min(last, max(one, other))
    return first, last


@njit(**LEAN, fastmath=FAST)
def _refined(field, place, along, near, far, f_near, f_far):
    """Return where the field is zero between two parameters at which its signs differ."""
    middle, fine, last = near, 1e-6 * abs(f_near - f_far), 0
    inside = f_near > 0.0
    for _ in range(40):  # regula falsi (Illinois variant): 4 or 5 iterations, more across a kink
        middle = near + (far - near) * f_near / (f_near - f_far)
        f_middle = field_value(field, place, along, middle)
        if abs(f_middle) <= fine:
            break
        if (f_middle > 0.0) == inside:
            near, f_near = middle, f_middle
            f_far *= 0.5 if last == 1 else 1.0
            last = 1
        else:
            far, f_far = middle, f_middle
            f_near *= 0.5 if last == 2 else 1.0
            last = 2
    return middle


@njit(**LEAN, fastmath=FAST)
def _value_and_slope(field, place, along, far):
    """Return the value of the field at ``place + far * along`` and its derivative there, NaN if near the border."""
    x, y, z = place[0] + far * along[0], place[1] + far * along[1], place[2] + far * along[2]
    if not (x >= 0.0 and y >= 0.0 and z >= 0.0 and x < field.ni - 1 and y < field.nj - 1 and z < field.nk - 1):
        return math.nan, math.nan
    i, j, k = int(x), int(y), int(z)
    u, v, w = x - i, y - j, z - k
    values, a, b, c = field.values, field.step_i, field.step_j, field.step_k
    at = i * a + j * b + k * c
    f00, f10, f01, f11 = 1.0 * values[at], 1.0 * values[at + b], 1.0 * values[at + c], 1.0 * values[at + b + c]
    d00, d10 = values[at + a] - f00, values[at + a + b] - f10
    d01, d11 = values[at + a + c] - f01, values[at + a + b + c] - f11
    f0, f1 = (f00 + u * d00) * (1.0 - v) + (f10 + u * d10) * v, (f01 + u * d01) * (1.0 - v) + (f11 + u * d11) * v
    di = (d00 * (1.0 - v) + d10 * v) * (1.0 - w) + (d01 * (1.0 - v) + d11 * v) * w
    dj = (f10 + u * d10 - f00 - u * d00) * (1.0 - w) + (f11 + u * d11 - f01 - u * d01) * w
    slope = di * along[0] + dj * along[1] + (f1 - f0) * along[2]
    return field.sign * (f0 * (1.0 - w) + f1 * w - field.level), field.sign * slope


@njit(**LEAN, fastmath=FAST)
def _nearby(field, place, along, most):
    """Return the parameter, up to `most`, of a crossing that three steps of Newton's method find, or NaN."""
    value, slope = _value_and_slope(field, place, along, 0.0)
    way = 1.0 if value > 0.0 else -1.0
    far = 0.0
    for _ in range(3):
        if not slope < 0.0:
            break
        step = -value / slope
        far += step
        if not 0.0 <= way * far <= most:
            break
        if abs(step) <= 1e-4 * most:
            return far
        value, slope = _value_and_slope(field, place, along, far)
    return math.nan


@njit(**LEAN, fastmath=FAST)
def _crossing(field, place, along, reach, pace):
    """Return the signed parameter of the first crossing or NaN: outwards from an inside place, inwards from outside."""
    fastest = max(abs(along[0]), abs(along[1]), abs(along[2]))
    if not 0.0 < fastest < math.inf:
        return math.nan
    nearby = _nearby(field, place, along, min(pace / fastest, reach))
    if nearby == nearby:
        return nearby
    here = field_value(field, place, along, 0.0)
    way, stride = 1.0 if here > 0.0 else -1.0, pace / fastest
    first, last = _passage(field.ni, field.nj, field.nk, place, along)
    if way < 0.0:
        first, last = -last, -first
    if not (first <= last and last > 0.0 and first < reach):
        return math.nan
    skipped = math.floor(max(first, 0.0) / stride)
    near, f_near = way * skipped * stride, here
    for k in range(skipped + 1, math.ceil(min(reach, last + stride) / stride) + 1):
        far = way * min(k * stride, reach)
        f_far = field_value(field, place, along, far)
        if (f_far > 0.0) != (here > 0.0):
            return _refined(field, place, along, near, far, f_near, f_far)
        near, f_near = far, f_far
    return math.nan


@njit(**LEAN, fastmath=FAST)
def _line(T, vertices, normals, i):
    """Return place and normal of a vertex as a continuous index and its change."""
    (x, y, z), (a, b, c) = row(vertices, i), row(normals, i)
    place = (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
    )
    along = (
        T[0, 0] * a + T[0, 1] * b + T[0, 2] * c,
        T[1, 0] * a + T[1, 1] * b + T[1, 2] * c,
        T[2, 0] * a + T[2, 1] * b + T[2, 2] * c,
    )
    return place, along


@by_rows(1000, fastmath=FAST)  # about 200 nanoseconds per vertex
def isosurface_gaps(begin, end, vertices, normals, field, reach, pace, out):
    """Fill the signed distance along each normal to the nearest crossing from inside to outside; NaN beyond `reach`."""
    for i in range(begin, end):
        place, along = _line(field.to_index, vertices, normals, i)
        out[i] = _crossing(field, place, along, reach, pace)


@by_rows(1000, fastmath=FAST)
def replace_far_gaps(begin, end, vertices, normals, field, reach, pace, gaps):
    """Replace gaps that end where all samples of a mask are alike and over a voxel from a crossing by that to it."""
    for i in range(begin, end):
        if gaps[i] == gaps[i]:
            place, along = _line(field.to_index, vertices, normals, i)
            if not abs(field_value(field, place, along, gaps[i])) < 0.5 - 1e-6:
                crossing = _crossing(field, place, along, reach, pace)
                if not abs(crossing - gaps[i]) * math.sqrt(dot(along, along)) <= 1.0:
                    gaps[i] = crossing
