"""Junctions of three or more grooves, such as sutures at the pterion: strength of the third strongest arm."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, norm, tangents
from simplexmesh.surface.sampled_surface import SampledSurface

SECTORS, RINGS = 24, 4
"""Directions and distances into which a disk is divided."""

MAX_VERTICES = 1500
"""Mean number of vertices per disk above which they are subsampled at random."""

GAP, WEAKEST = 0.5, 0.25
"""The field between two arms must fall below this share of the weaker, itself at least this share of the strongest."""


def junctions(samples: SampledSurface, strength: Array, normals: Array, rows: Indices, reach: float) -> Array:
    """Return the strength of the junction at each vertex: that of its third strongest arm out to `reach`."""
    out = np.zeros(len(rows))
    used, tree = _subsampled(samples, rows, reach)
    for k, row in enumerate(rows.tolist()):
        near = used[tree.query_ball_point(samples.points[row], reach)]
        near = near[(near != row) & (dot(normals[near], normals[row][None]) > 0)]
        if len(near) >= SECTORS and normals[row].any():
            edges = samples.points[near] - samples.points[row]
            out[k] = _third_strongest(_profile(edges, strength[near], normals[row], reach))
    return out


def _subsampled(samples: SampledSurface, rows: Indices, reach: float) -> tuple[Indices, cKDTree]:
    """Return the vertices used, all or a random subset, and their kd-tree."""
    all_vertices = np.arange(len(samples.points))
    counts = samples.tree.query_ball_point(samples.points[rows], reach, return_length=True)
    if counts.mean() <= MAX_VERTICES:
        return all_vertices, samples.tree
    share = 0.5 ** np.ceil(np.log2(counts.mean() / MAX_VERTICES))  # a power of two, the same for nearby picks
    some = np.flatnonzero(np.random.default_rng(0).random(len(all_vertices)) < share)
    return some, cKDTree(samples.points[some])


def _profile(edges: Array, strength: Array, normal: Array, reach: float) -> Array:
    """Return the field's mean over distances in each direction, interpolated where there are no vertices."""
    u, v = tangents(normal)
    azimuth = np.arctan2(edges @ v, edges @ u)
    sector = np.minimum(((azimuth + np.pi) / (2 * np.pi) * SECTORS).astype(int), SECTORS - 1)
    ring = np.minimum((norm(edges) / reach * RINGS).astype(int), RINGS - 1)
    cell = ring * SECTORS + sector
    count = np.bincount(cell, minlength=RINGS * SECTORS).reshape(RINGS, SECTORS)
    total = np.bincount(cell, strength, RINGS * SECTORS).reshape(RINGS, SECTORS)
    at = np.arange(SECTORS)
    rows = [
        np.interp(at, at[n > 0], t[n > 0] / n[n > 0], period=SECTORS)
        for t, n in zip(total, count, strict=True)
        if n.any()
    ]
    return np.asarray(np.mean(rows, axis=0))


def _third_strongest(profile: Array) -> float:
    """Return the largest level reached in at least three directions separated by values below `GAP` times it."""
    for level in np.sort(profile)[::-1]:
        if level <= 0 or level < WEAKEST * profile.max():
            break
        low = profile < GAP * level
        if low.any():
            start = int(low.argmax())
            rotated, is_low = np.roll(profile, -start), np.roll(low, -start)
            parts = np.cumsum(is_low)[~is_low & (rotated >= level)]
            if len(np.unique(parts)) >= 3:
                return float(level)
    return 0.0
