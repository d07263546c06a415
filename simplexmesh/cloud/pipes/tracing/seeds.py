"""Points of a cloud that may lie on pipes: what is about them is rounder than flat."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, norm
from simplexmesh.numerics.plane_fits import planes

TRIED = 2000
"""Points that are looked at: one in some dozens on every pipe of a scene of a million."""

SIZES = (60, 250)
"""Neighbors to which planes and circles are fitted."""

MOST = 400_000
"""Points whose normals are estimated, at most, spread evenly over the cloud."""


def likely_picks(points: Array, noise: float, rng: np.random.Generator) -> Indices:
    """Return points that may lie on pipes, the likeliest first."""
    some = np.arange(len(points)) if len(points) <= MOST else rng.choice(len(points), MOST, replace=False)
    normals, tree = planes(points[some]).normals, cKDTree(points[some], balanced_tree=False, compact_nodes=False)
    tried = rng.choice(len(some), min(TRIED, len(some)), replace=False)
    near = tree.query(points[some[tried]], k=[*range(1, min(max(SIZES), len(some)) + 1)])[1]
    gains = [_gain(points[some[near[:, :size]]], normals[near[:, :size]], noise) for size in SIZES]
    gain = np.max(gains, axis=0)
    order = np.argsort(-gain, kind="stable")
    found: Indices = some[tried[order[gain[order] > 1]]]
    return found


def _gain(near: Array, normals: Array, noise: float) -> Array:
    """Return the variances (n,) of neighbors (n, k, 3) from planes over those from circles about axes across normals.

    No circle fits better than the noise: those of rays at the pole of a scanner, narrower than that, gain nothing.
    """
    away = near - near.mean(axis=1, keepdims=True)
    frames = np.linalg.eigh(np.einsum("nki,nkj->nij", normals, normals))[1]
    flat = away @ frames[:, :, 1:]
    size = np.sqrt((flat**2).sum(axis=2).mean(axis=1))[:, None, None] + np.finfo(float).tiny
    rows = np.concatenate([flat / size, np.ones_like(flat[:, :, :1])], axis=2)
    square = dot(rows[:, :, :2], rows[:, :, :2])[:, :, None]
    across = rows.transpose(0, 2, 1)
    found = np.linalg.solve(across @ rows + 1e-9 * near.shape[1] * np.eye(3), across @ square)
    far = norm(flat - found[:, None, :2, 0] * size / 2)
    from_plane = np.linalg.eigvalsh(away.transpose(0, 2, 1) @ away)[:, 0] / near.shape[1]
    return np.asarray(from_plane / np.maximum(far.var(axis=1), max(noise**2, np.finfo(float).tiny)))
