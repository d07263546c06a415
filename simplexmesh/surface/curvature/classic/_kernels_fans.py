"""Curvatures from neighbors: one pass over rows, whose fans the chosen estimator reduces to forms."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_matrices import principal
from simplexmesh.surface._kernels_fan import fill_fan
from simplexmesh.surface.curvature.classic._kernels_euler import langer, sine, taubin
from simplexmesh.surface.curvature.classic._kernels_fitted import circles, quadric
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

ESTIMATORS = ("sine", "taubin", "langer", "langer_exact", "quadric", "chen_schmitt")
SINE, TAUBIN, LANGER, LANGER_EXACT, QUADRIC, CHEN_SCHMITT = range(6)


class Choice(NamedTuple):
    """An estimator, its least number of neighbors, and the options of those that have them."""

    estimator: int
    least: int = 3
    terms: int = 3
    least_swing: bool = False
    weighted: bool = True
    normalized: bool = False


class Curvatures(NamedTuple):
    """Results of c rows: k1, k2; the direction of k1; the normal, which quadrics correct; reasons."""

    k1: Array
    k2: Array
    d1: Array
    normals: Array
    reasons: NDArray[np.uint8]


@by_rows()
def curvatures(begin, end, centers, rows, points, normals, choice, out):
    """Fill the curvatures of each row over the given normal: each fan is reduced to a form by the chosen estimator."""
    most = 1
    for row in range(begin, end):
        most = max(most, rows.offsets[row + 1] - rows.offsets[row])
    fan, sections, factor = np.empty((most, 4)), np.empty((most, 5)), np.empty((choice.terms + 1, choice.terms + 1))
    opposed = np.empty((most, 2), np.int64), np.empty(most)
    for row in range(begin, end):
        normal = normals[row, 0], normals[row, 1], normals[row, 2]
        out.reasons[row] = DEGENERATE
        if rows.offsets[row + 1] - rows.offsets[row] < choice.least:
            out.reasons[row] = FEW
            continue
        if normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2] < 0.5:
            continue
        count, d, e = fill_fan(row, centers[row], rows, points, normal, fan), 0.0, 0.0
        if choice.estimator == SINE:
            p, q, r = sine(fan, count, choice.least_swing)
        elif choice.estimator == TAUBIN:
            p, q, r = taubin(fan, count, rows.closed[row])
        elif choice.estimator == QUADRIC:
            p, q, r, d, e = quadric(fan, count, choice.terms, choice.least, factor)
        elif choice.estimator == CHEN_SCHMITT:
            p, q, r = circles(fan, count, choice.weighted, choice.normalized, factor, opposed)
        else:
            p, q, r = langer(fan, count, choice.estimator == LANGER_EXACT, sections)
        if not math.isnan(p):
            _write(row, normal, (p, q, r), d, e, out)


@njit(cache=True, error_model="numpy")
def _write(row, normal, form, d, e, out):
    """Write the curvatures of a form on the tangents (1, 0, d) and (-d e, 1 + d^2, e) over a normal, normalized."""
    nx, ny, nz = normal
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    first, g = 1.0 + d * d, 1.0 + d * d + e * e
    root = math.sqrt(g)
    mean, amplitude, cosine, sine = principal(form[0], form[1], form[2])
    out.k1[row], out.k2[row] = mean + amplitude, mean - amplitude
    cosine, sine = cosine / math.sqrt(first), sine / math.sqrt(first * g)
    u, v, w = cosine - sine * d * e, sine * first, cosine * d + sine * e
    out.d1[row, 0], out.d1[row, 1] = u * ux + v * vx + w * nx, u * uy + v * vy + w * ny
    out.d1[row, 2] = u * uz + v * vz + w * nz
    out.normals[row, 0], out.normals[row, 1] = (nx - d * ux - e * vx) / root, (ny - d * uy - e * vy) / root
    out.normals[row, 2] = (nz - d * uz - e * vz) / root
    out.reasons[row] = FOUND
