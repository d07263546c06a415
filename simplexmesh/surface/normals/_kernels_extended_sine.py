"""ExtendedSineFitting: the normal for which the normal curvatures around a vertex have no first harmonic."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_matrices import solve
from simplexmesh.surface._kernels_fan import FLAT
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

PROBE = 1e-6
"""Tilt of the normal for finite differences."""

MAX_STEP = 0.7
"""Tangent of the largest tilt in one step."""


class Solver(NamedTuple):
    """Which solver, the angle below which the normal's error is small enough, and the most steps."""

    newton: bool
    tolerance: float
    iterations: int


class Ring(NamedTuple):
    """Vectors to the neighbors over their squared lengths, the mean distance, and work arrays of the fit."""

    edges: Array
    distance: float
    matrix: Array
    right: Array


@njit(cache=True, error_model="numpy")
def _ring(points, i, near):
    """Return the ring of point i, without neighbors that coincide with it."""
    edges, count, total = np.empty((near.shape[0], 3)), 0, 0.0
    for j in near:
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        square = x * x + y * y + z * z
        if square > 0.0:
            edges[count, 0], edges[count, 1], edges[count, 2] = x / square, y / square, z / square
            count += 1
            total += math.sqrt(square)
    return Ring(edges[:count], total / max(count, 1), np.zeros((5, 5)), np.zeros(5))


@njit(cache=True, error_model="numpy")
def _fitted(ring, normal):
    """Fit k = a cos 2t + b sin 2t + c + d cos t + e sin t into `right` (3.41); return False where it is singular."""
    matrix, right, seen = ring.matrix, ring.right, 0
    nx, ny, nz = normal[0], normal[1], normal[2]
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    matrix[:] = 0.0
    right[:] = 0.0
    for m in range(ring.edges.shape[0]):
        x, y, z = ring.edges[m, 0], ring.edges[m, 1], ring.edges[m, 2]
        u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
        flat = u * u + v * v
        if flat <= FLAT * (x * x + y * y + z * z):
            continue
        seen += 1
        length = math.sqrt(flat)
        u, v = u / length, v / length
        c, s, k = u * u - v * v, 2.0 * u * v, -2.0 * (nx * x + ny * y + nz * z)
        matrix[0, 0] += c * c
        matrix[1, 0] += c * s
        matrix[1, 1] += s * s
        matrix[2, 0] += c
        matrix[2, 1] += s
        matrix[3, 0] += c * u
        matrix[3, 1] += s * u
        matrix[3, 2] += u
        matrix[3, 3] += u * u
        matrix[4, 0] += c * v
        matrix[4, 1] += s * v
        matrix[4, 2] += v
        matrix[4, 3] += u * v
        matrix[4, 4] += v * v
        right[0] += k * c
        right[1] += k * s
        right[2] += k
        right[3] += k * u
        right[4] += k * v
    matrix[2, 2] = seen
    return seen >= 5 and solve(matrix, right, 5)


@njit(cache=True, error_model="numpy")
def _first_harmonic(ring, normal, base, out):
    """Fill d T + e (N x T) in the first two rows of `base`; return sqrt(d^2 + e^2), or -1 where there is no fit."""
    if not _fitted(ring, normal):
        return -1.0
    d, e = ring.right[3], ring.right[4]
    ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
    x, y, z = d * ux + e * vx, d * uy + e * vy, d * uz + e * vz
    out[0] = x * base[0, 0] + y * base[0, 1] + z * base[0, 2]
    out[1] = x * base[1, 0] + y * base[1, 1] + z * base[1, 2]
    return math.sqrt(d * d + e * e)


@njit(cache=True, error_model="numpy")
def _tilt(base, s, t, out):
    """Fill the unit vector along base_2 + s base_0 + t base_1."""
    for axis in range(3):
        out[axis] = base[2, axis] + s * base[0, axis] + t * base[1, axis]
    out /= math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])


@njit(cache=True, error_model="numpy")
def _set_jacobian(ring, normal, base, now, jacobian):
    """Fill the frame of a normal, its first harmonic `now`, and the Jacobian of that; return False without a fit."""
    ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
    base[0, 0], base[0, 1], base[0, 2] = ux, uy, uz
    base[1, 0], base[1, 1], base[1, 2] = vx, vy, vz
    base[2] = normal
    trial, then = np.zeros(3), np.zeros(2)
    size = _first_harmonic(ring, normal, base, now)
    for axis in range(2):
        _tilt(base, PROBE * (1 - axis), PROBE * axis, trial)
        if size < 0.0 or _first_harmonic(ring, trial, base, then) < 0.0:
            return False
        jacobian[0, axis], jacobian[1, axis] = (then[0] - now[0]) / PROBE, (then[1] - now[1]) / PROBE
    return True


@njit(cache=True, error_model="numpy")
def _by_newton(ring, normal, solver):
    """Tilt the normal until the first harmonic vanishes (Broyden 1965); return fits, negative without convergence."""
    base, jacobian, now, then = np.zeros((3, 3)), np.zeros((2, 2)), np.zeros(2), np.zeros(2)
    size, fits, s, t = _first_harmonic(ring, normal, base, now), 1, 0.0, 0.0
    for _ in range(solver.iterations):
        if size < 0.0:
            return -fits
        if 0.5 * ring.distance * size <= solver.tolerance:
            return fits
        if fits == 1:
            fits += 3
            if not _set_jacobian(ring, normal, base, now, jacobian):
                return -fits
        det = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
        ds = (jacobian[0, 1] * now[1] - jacobian[1, 1] * now[0]) / det
        dt = (jacobian[1, 0] * now[0] - jacobian[0, 0] * now[1]) / det
        shrink = min(1.0, MAX_STEP / math.sqrt(ds * ds + dt * dt))
        ds, dt = shrink * ds, shrink * dt
        square = ds * ds + dt * dt
        if not square > 0.0:  # also NaN
            return -fits
        s, t = s + ds, t + dt
        _tilt(base, s, t, normal)
        size = _first_harmonic(ring, normal, base, then)
        fits += 1
        for row in range(2):
            error = (then[row] - now[row] - jacobian[row, 0] * ds - jacobian[row, 1] * dt) / square
            jacobian[row, 0] += error * ds
            jacobian[row, 1] += error * dt
        now[:] = then
    return -fits


@njit(cache=True, error_model="numpy")
def _misfit(ring, normal, tangent, angle, out):
    """Rotate the normal away from a tangent by an angle, and return the squared first harmonic there."""
    for axis in range(3):
        out[axis] = math.cos(angle) * normal[axis] - math.sin(angle) * tangent[axis]
    return ring.right[3] ** 2 + ring.right[4] ** 2 if _fitted(ring, out) else math.inf


@njit(cache=True, error_model="numpy")
def _by_ternary_search(ring, normal, solver):
    """Tilt the normal along (d, e) by the angle that minimizes d^2 + e^2, repeatedly; return fits as `_by_newton`."""
    trial, tangent, right, fits = np.zeros(3), np.zeros(3), ring.right, 0
    for _ in range(solver.iterations):
        fits += 1
        if not _fitted(ring, normal):
            return -fits
        size = math.sqrt(right[3] ** 2 + right[4] ** 2)
        if 0.5 * ring.distance * size <= solver.tolerance:
            return fits
        x, y = right[3] / size, right[4] / size
        mean = right[0] * (x * x - y * y) + 2.0 * right[1] * x * y + right[2]
        left_k, right_k = mean - size, mean + size  # curvatures at azimuth atan2(e, d), and opposite to it
        square = 2.0 * max(abs(left_k), abs(right_k)) ** 2
        high = math.atan((left_k - right_k) / (math.sqrt(square - left_k**2) + math.sqrt(square - right_k**2)))
        low = 0.0
        ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
        tangent[0], tangent[1], tangent[2] = x * ux + y * vx, x * uy + y * vy, x * uz + y * vz
        while abs(high - low) > 1e-12:
            one, other = low + (high - low) / 3, low + 2 * (high - low) / 3
            fits += 2
            if _misfit(ring, normal, tangent, one, trial) <= _misfit(ring, normal, tangent, other, trial):
                high = other
            else:
                low = one
        _misfit(ring, normal, tangent, 0.5 * (low + high), trial)
        normal[:] = trial / math.sqrt(trial[0] ** 2 + trial[1] ** 2 + trial[2] ** 2)
    return -fits


@by_rows(fastmath=FAST)
def extended_sine(begin, end, centers, rows, points, start_normals, solver, normals, fits, reasons):
    """Fill the corrected normal per row, and the number of fits, negative without convergence."""
    for row in range(begin, end):
        near, normal = rows.members[rows.offsets[row] : rows.offsets[row + 1]], np.zeros(3)
        normal[:] = start_normals[row]
        reasons[row] = FEW if near.shape[0] < 5 else DEGENERATE
        if near.shape[0] < 5 or not normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2 > 0.5:
            continue
        ring = _ring(points, centers[row], near)
        fits[row] = _by_newton(ring, normal, solver) if solver.newton else _by_ternary_search(ring, normal, solver)
        along = 0.0
        for axis in range(3):
            along += normal[axis] * start_normals[row, axis]
        if fits[row] > 0 and along > 0.0:
            normals[row] = normal
            reasons[row] = FOUND
