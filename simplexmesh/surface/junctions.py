"""Where three grooves meet: how strong the third of the arms is that leave a place (sutures at the pterion)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SECTORS, RINGS = 24, 4
"""A disk around each place is divided into so many directions and distances."""

ARMS = 3

MOST = 1500
"""Of more vertices in a disk, on average, so many are looked at, drawn at random."""

APART, FAINTEST = 0.5, 0.25
"""Between two arms the field falls below this share of the fainter, which has at least this share of the strongest."""


def junctions(samples: Samples, strength: Array, normals: Array, rows: Indices, reach: float) -> Array:
    """Return how strong a junction each place is: the strength of the third strongest arm that leaves it.

    An arm is a direction in which the field is high all the way out to `reach`; between arms it must be low. A groove
    has two, a pit, which is alike all around, one; a place beside a junction has none that run all the way.

    Parameters
    ----------
    samples : Samples
    strength : (n,) array of float
        How much of a groove each vertex is, 0 where it is none or nothing is known.
    normals : (n, 3) array of float
    rows : (m,) array of int
        The places.
    reach : float
        Length of the arms.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.surface.samples import as_samples
    >>> sheet = as_samples(sm.plane(40, 40, size=(2.0, 2.0)).triangulated("dual"))
    >>> x, y, _ = sheet.points.T
    >>> cross = np.exp(-200 * np.minimum(abs(x), abs(y)) ** 2)
    >>> up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    >>> inner = np.flatnonzero(np.hypot(x, y) < 0.5)
    >>> best = inner[junctions(sheet, cross, up, inner, 0.4).argmax()]
    >>> bool(np.hypot(x[best], y[best]) < 0.1)
    True
    """
    out = np.zeros(len(rows))
    looked_at, tree = _thinned(samples, rows, reach)
    for k, row in enumerate(rows.tolist()):
        near = looked_at[tree.query_ball_point(samples.points[row], reach)]
        near = near[(near != row) & (dot(normals[near], normals[row][None]) > 0)]
        if len(near) >= SECTORS and normals[row].any():
            out[k] = _third(_profile(samples.points[near] - samples.points[row], strength[near], normals[row], reach))
    return out


def _thinned(samples: Samples, rows: Indices, reach: float) -> tuple[Indices, cKDTree]:
    """Return the vertices that are looked at, all or as many as are needed, and a tree of them."""
    every = np.arange(len(samples.points))
    counts = samples.tree.query_ball_point(samples.points[rows], reach, return_length=True)
    if not len(rows) or counts.mean() <= MOST:
        return every, samples.tree
    share = 0.5 ** np.ceil(np.log2(counts.mean() / MOST))  # the same for picks that lead to the same place
    some = np.flatnonzero(np.random.default_rng(0).random(len(every)) < share)
    return some, cKDTree(samples.points[some])


def _profile(arms: Array, strength: Array, normal: Array, reach: float) -> Array:
    """Return the field's mean over distances in each direction; where no vertex lies it is between its neighbors'."""
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u /= np.linalg.norm(u)
    turn = np.arctan2(arms @ np.cross(normal, u), arms @ u)
    sector = np.minimum(((turn + np.pi) / (2 * np.pi) * SECTORS).astype(int), SECTORS - 1)
    ring = np.minimum((norm(arms) / reach * RINGS).astype(int), RINGS - 1)
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


def _third(profile: Array) -> float:
    """Return the largest level that at least three directions reach with less than `APART` of it between them."""
    for level in np.sort(profile)[::-1]:
        if level <= 0 or level < FAINTEST * profile.max():
            break
        low = profile < APART * level
        if low.any():
            start = int(low.argmax())
            turned, valley = np.roll(profile, -start), np.roll(low, -start)
            parts = np.cumsum(valley)[~valley & (turned >= level)]
            if len(np.unique(parts)) >= ARMS:
                return float(level)
    return 0.0
