"""Borders, where half of each ball is missing: how to weigh fits is learned a few rows farther in, where it is not.

Without its outermost rows a mesh has a border like the one it had, but one where the whole mesh knows the answer. Fits
of several sizes and degrees are made there and weighed so that they come nearest to it; at the true border the same
fits are weighed in the same way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.surface.curvature import _kernels_rims as kernels
from simplexmesh.surface.curvature._kernels_adaptive import LEANING, chunks
from simplexmesh.surface.curvature.jets import Jets, fitted
from simplexmesh.surface.curvature.scales import Scales, shuffling
from simplexmesh.surface.curvature.stacked import stacked
from simplexmesh.surface.reasons import FOUND
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

RADII = np.array([4.5, 6.5, 9.0, 11.5])
"""Of the balls of plain fits, in spacings."""

FULL = np.array([70, 140, 210, 280])
"""A ball of more points than this is made smaller, as a half one rarely is; rims are often denser than they look."""

TAKEN_OFF = (2, 3, 4)
"""So many rows are taken off: with fewer, what is known there is hardly better than at the border itself; farther in
the surface is another."""

INSIDE, FAR = 8, 2.0
"""The curvature so many rows farther in is another guess, where that is no farther than this times as many spacings."""

TAUGHT, FEWEST = 80, 40
"""So many vertices of each such border are learned from at most; of all together so many at least."""

DOUBT = 0.1
"""This share of the squared error expected of what is known there is taken for noise in the lessons."""

QUIET = 1e-5
"""With less noise than this, in spacings, the fit alone is exact enough, and what it misses is not alike anywhere."""

MOST = 3.0
"""No curvature is changed by more than so many expected errors."""


class Side(NamedTuple):
    """A mesh without its outermost rows: links between what is left, and who is how many rows from its border."""

    offsets: Indices
    members: Indices
    depths: Indices


def mended(samples: Samples, rows: Indices, scales: Scales, found: Jets) -> Jets:
    """Return what was found around the points `rows`, better where they are on a border.

    Only curvature across the border changes: along it balls are whole. In clouds, where there are too few vertices to
    learn from, and without noise nothing does.
    """
    ring = samples.one_ring
    at = np.flatnonzero(~ring.closed[rows] & (found.reasons == FOUND))
    quiet = scales.noise < QUIET * np.median(scales.spacing)
    if quiet or not len(at) or not ring.closed.any():  # clouds have no rings
        return found
    depths = kernels.depths(ring.offsets, ring.members, ring.closed, max(TAKEN_OFF) + INSIDE)
    whole = Side(ring.offsets, ring.members, depths)
    weights, honesty = _learned(samples, scales, whole)
    guesses, inward = _guesses(samples, scales, whole, rows[at], found.some(at))
    usable = np.isfinite(guesses).all(axis=1)
    at, error = at[usable], found.error[at[usable]]
    wanted = guesses[usable] @ weights
    change = wanted.clip(-MOST * error, MOST * error)
    shape, d1, errors = found.shape.copy(), found.d1.copy(), found.error.copy()
    shape[at], d1[at] = bent(shape[at], d1[at], found.normals[at], inward[usable], 2.0 * change)
    errors[at] = np.hypot(honesty * error, wanted)
    return found._replace(shape=shape, d1=d1, error=errors)


def bent(shape: Array, d1: Array, normals: Array, along: Array, more: Array) -> tuple[Array, Array]:
    """Return (n, 2) principal curvatures and first directions of a surface whose curvature along a direction is more.

    Parameters
    ----------
    shape : (n, 2) array of float
        k1, k2.
    d1, normals, along : (n, 3) array of float
        The direction of k1, the normal, and the one along which, of which what is in the tangent plane counts.
    more : (n,) array of float
        By how much: the shape operator S becomes S + more t t^T with the unit vector t along.
    """
    d2 = np.cross(normals, d1)
    a, b = (along * d1).sum(axis=1), (along * d2).sum(axis=1)
    length = np.maximum(np.hypot(a, b), 1e-300)
    a, b = a / length, b / length
    p, q, r = shape[:, 0] + more * a * a, more * a * b, shape[:, 1] + more * b * b
    half, swing, turn = (p + r) / 2, np.hypot((p - r) / 2, q), 0.5 * np.arctan2(2 * q, p - r)
    return np.column_stack([half + swing, half - swing]), np.cos(turn)[:, None] * d1 + np.sin(turn)[:, None] * d2


def _learned(samples: Samples, scales: Scales, whole: Side) -> tuple[Array, float]:
    """Return the weights of guesses, and what to multiply expected errors with to be right about what they leave."""
    lessons, doubts = [], []
    for off in TAKEN_OFF:
        rows = np.flatnonzero(whole.depths == off)
        rows = np.sort(rows[shuffling(scales.spacing)[rows].argsort(kind="stable")][:TAUGHT])
        offsets, members = kernels.peeled(*whole, off)
        side = Side(offsets, members, whole.depths - off)
        known = fitted(samples, rows, scales, whole)
        half = fitted(samples, rows, scales, side)
        guesses, _ = _guesses(samples, scales, side, rows, half)
        usable = (
            (known.reasons == FOUND) & (half.reasons == FOUND) & (half.error > 0) & np.isfinite(guesses).all(axis=1)
        )
        error, wanted = half.error[usable], (known.shape - half.shape).mean(axis=1)[usable]
        if usable.any():
            lessons.append((guesses[usable] / error[:, None], wanted / error))
            doubts.append(known.error[usable] / error)
    if sum(map(len, doubts)) < FEWEST:
        return np.zeros(1 + 3 * len(RADII)), 1.0
    weights, rest = stacked(lessons, MOST)
    noise, signal = (np.concatenate(part) @ np.concatenate(part) for part in (doubts, [y for _, y in lessons]))
    weights *= max(0.0, 1.0 - DOUBT * noise / max(signal, 1e-300))
    return weights, max(1.0, float(np.median(np.abs(rest))) / 0.6745)


def _guesses(samples: Samples, scales: Scales, side: Side, rows: Indices, own: Jets) -> tuple[Array, Array]:
    """Return (n, g) guesses of H as differences from what was found, and (n, 3) ways inward; NaN where there are none.

    Polynomials of degrees 2, 3 and 4 in each ball, and what is found around the vertex `INSIDE` rows farther in.
    """
    n = len(rows)
    means, lean, inward = np.zeros((n, len(RADII), 3)), np.zeros(n), np.zeros((n, 3))
    seen = (samples.points, scales.directions, scales.oriented, scales.spacing[rows, None] * RADII)
    kernels.plain_fits(rows, *(part.view(np.uint64) for part in side[:2]), *seen, FULL, chunks(n), means, lean, inward)
    means[lean < LEANING] = np.nan
    mean = own.shape.mean(axis=1)
    farther = np.zeros(n)
    inner = np.flatnonzero(side.depths == INSIDE)
    if len(inner):
        away, nearest = cKDTree(samples.points[inner]).query(samples.points[rows])
        there, row = np.unique(inner[nearest], return_inverse=True)
        jets = fitted(samples, there, scales, side).some(row)
        near = (away < FAR * INSIDE * scales.spacing[rows]) & ((own.normals * jets.normals).sum(axis=1) > 0)
        farther = np.where(near & (jets.reasons == FOUND), jets.shape.mean(axis=1) - mean, 0.0)
    return np.column_stack([means.reshape(n, 3 * len(RADII)) - mean[:, None], farther]), inward
