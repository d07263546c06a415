"""Curvature at borders, where half of each ball is missing: a weighted sum of fits, with weights learned from the mesh.

Without its outermost rows a mesh has an artificial border much like its own, where the curvature is known from the
whole mesh. Fits of several sizes and degrees are regressed on it there (stacked regression), and combined with the same
weights at the true border. Where there is hardly any noise, a single fit of high degree does better.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.surface.curvature import _kernels_rims as kernels
from simplexmesh.surface.curvature._kernels_adaptive import LEANING, chunks
from simplexmesh.surface.curvature.high_degree import refitted
from simplexmesh.surface.curvature.jets import Jets, fitted
from simplexmesh.surface.curvature.scales import Scales, shuffling
from simplexmesh.surface.curvature.stacked import stacked
from simplexmesh.surface.reasons import FOUND
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

RADII = np.array([4.5, 6.5, 9.0, 11.5])
"""Of the balls of the fits combined, in spacings."""

FULL = np.array([70, 140, 210, 280])
"""Balls of more points are shortened; half-balls seldom hold so many, but borders are often sampled densely."""

TAKEN_OFF = (2, 3, 4)
"""Rows removed for the artificial borders. With fewer, what is known there is hardly better than at the border itself;
with more, the surface there differs too much."""

INSIDE, FAR = 8, 2.0
"""The curvature so many rows inside the border is a predictor too, if no farther away than this factor times as many
spacings."""

TAUGHT, FEWEST = 80, 40
"""Most vertices of each artificial border in the training set, and fewest of all together."""

DOUBT = 0.1
"""Share of the squared error expected of what is known there that counts as noise of the training set."""

QUIET = 1e-5
"""With less noise than this, in spacings, nothing is learned: truncation errors are not alike from row to row."""

SMOOTH = 1e-3
"""With less noise than this, in spacings, fits of high degree are tried."""

MOST = 3.0
"""Largest change of a curvature, in expected errors."""


class Side(NamedTuple):
    """A mesh without its outermost rows: the adjacency of what is left (CSR), and each vertex's depth in rows."""

    offsets: Indices
    members: Indices
    depths: Indices


def improved_at_borders(samples: Samples, rows: Indices, scales: Scales, found: Jets) -> Jets:
    """Return the jets at the points `rows`, improved at those on borders."""
    ring = samples.one_ring
    at = np.flatnonzero(~ring.closed[rows] & (found.reasons == FOUND))
    if not len(at) or not ring.closed.any():  # clouds have no rings
        return found
    noise = scales.noise / np.median(scales.spacing[scales.spacing > 0])
    if noise >= QUIET:
        found = _corrected(samples, rows, at, scales, found)
    return refitted(samples, rows, at, scales, found) if noise < SMOOTH else found


def _corrected(samples: Samples, rows: Indices, at: Indices, scales: Scales, found: Jets) -> Jets:
    """Return jets, those at `at` with the curvature across the border corrected by learned weights.

    Along the border balls are whole, so nothing else changes. Where too few vertices can be learned from, nothing does.
    """
    ring = samples.one_ring
    depths = kernels.depths(ring.offsets, ring.members, ring.closed, max(TAKEN_OFF) + INSIDE)
    whole = Side(ring.offsets, ring.members, depths)
    weights, scaling = _weights(samples, scales, whole)
    predictors, inward = _predictors(samples, scales, whole, rows[at], found.some(at))
    usable = np.isfinite(predictors).all(axis=1)
    at, error = at[usable], found.error[at[usable]]
    wanted = predictors[usable] @ weights
    change = wanted.clip(-MOST * error, MOST * error)
    shape, d1, errors = found.shape.copy(), found.d1.copy(), found.error.copy()
    shape[at], d1[at] = bent(shape[at], d1[at], found.normals[at], inward[usable], 2.0 * change)
    errors[at] = np.hypot(scaling * error, wanted)
    return found._replace(shape=shape, d1=d1, error=errors)


def bent(shape: Array, d1: Array, normals: Array, along: Array, more: Array) -> tuple[Array, Array]:
    """Return (n, 2) principal curvatures and (n, 3) first directions after increasing the curvature in one direction.

    Parameters
    ----------
    shape : (n, 2) array of float
        k1, k2.
    d1, normals, along : (n, 3) array of float
        The direction of k1, the normal, and the direction of the increase, which is projected to the tangent plane.
    more : (n,) array of float
        The increase: the shape operator S becomes S + more t t^T for the projected unit direction t.
    """
    d2 = np.cross(normals, d1)
    a, b = (along * d1).sum(axis=1), (along * d2).sum(axis=1)
    length = np.maximum(np.hypot(a, b), 1e-300)
    a, b = a / length, b / length
    p, q, r = shape[:, 0] + more * a * a, more * a * b, shape[:, 1] + more * b * b
    half, swing, turn = (p + r) / 2, np.hypot((p - r) / 2, q), 0.5 * np.arctan2(2 * q, p - r)
    return np.column_stack([half + swing, half - swing]), np.cos(turn)[:, None] * d1 + np.sin(turn)[:, None] * d2


def _weights(samples: Samples, scales: Scales, whole: Side) -> tuple[Array, float]:
    """Return the predictors' weights, and the factor by which expected errors are to be scaled to match residuals."""
    training, doubts = [], []
    for off in TAKEN_OFF:
        rows = np.flatnonzero(whole.depths == off)
        rows = np.sort(rows[shuffling(scales.spacing)[rows].argsort(kind="stable")][:TAUGHT])
        offsets, members = kernels.peeled(*whole, off)
        side = Side(offsets, members, whole.depths - off)
        known = fitted(samples, rows, scales, whole)
        one_sided = fitted(samples, rows, scales, side)
        predictors, _ = _predictors(samples, scales, side, rows, one_sided)
        usable = (
            (known.reasons == FOUND)
            & (one_sided.reasons == FOUND)
            & (one_sided.error > 0)
            & np.isfinite(predictors).all(axis=1)
        )
        error, wanted = one_sided.error[usable], (known.shape - one_sided.shape).mean(axis=1)[usable]
        if usable.any():
            training.append((predictors[usable] / error[:, None], wanted / error))
            doubts.append(known.error[usable] / error)
    if sum(map(len, doubts)) < FEWEST:
        return np.zeros(1 + 3 * len(RADII)), 1.0
    weights, rest = stacked(training, MOST)
    noise, signal = (np.concatenate(part) @ np.concatenate(part) for part in (doubts, [y for _, y in training]))
    weights *= max(0.0, 1.0 - DOUBT * noise / max(signal, 1e-300))
    return weights, max(1.0, float(np.median(np.abs(rest))) / 0.6745)


def _predictors(samples: Samples, scales: Scales, side: Side, rows: Indices, own: Jets) -> tuple[Array, Array]:
    """Return (n, g) predictors of H as differences from the jets' own, NaN where undetermined, and (n, 3) ways inward.

    They are fits of degrees 2, 3 and 4 to each ball, and the jet of the nearest vertex `INSIDE` rows from the border.
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
