"""Where to begin: motions that may bring one surface to another, from pairs of points, axes, and turns all around."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, normalized
from simplexmesh.recognition import _kernels_register
from simplexmesh.recognition.arena import Arena, rows
from simplexmesh.recognition.rotations import even_representatives, icosahedral_group
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

PAIRED = 600
"""Points of each surface that pairs are made of."""

REFERENCES = 200
PEAKS = 8
STEP = 0.04
"""Width of a bin of distances, in extents of the smaller surface."""

CROWDED = 600
SPREAD = 10
"""Sixty times so many turns are tried with the middles together."""


def frames_of(normals: Array) -> Array:
    """Return rotations (n, 3, 3) that take each unit normal to the x axis."""
    other = np.where(np.abs(normals[:, :1]) < 0.6, [[1.0, 0, 0]], [[0, 1.0, 0]])
    y = normalized(cross(normals, other))
    return np.stack([normals, y, cross(normals, y)], axis=1)


def from_pairs(source: Surface, target: Surface, size: float, rng: np.random.Generator) -> Array:
    """Return motions (h, 12) that many pairs of points with their normals speak for.

    Two pairs agree that have the same distance, the same angles with their normals and between these; a pair then
    tells which point of the target one of the source comes to, and the turn about its normal (B. Drost, M. Ulrich,
    N. Navab, S. Ilic, Model globally, match locally, CVPR 2010).
    """
    one, other = source.some(PAIRED, rng), target.some(PAIRED, rng)
    p, n, q, m = source.points[one], source.normals[one], target.points[other], target.normals[other]
    F, G = frames_of(n), frames_of(m)
    step = STEP * size
    distances = int(np.ceil(1.0 / STEP)) + 1
    starts = np.zeros(distances * _kernels_register.ANGLES**3 + 2, np.int64)
    firsts, turns = np.zeros(len(q) ** 2, np.int32), np.zeros(len(q) ** 2, np.float32)
    _kernels_register.pair_table(q, m, G, step, distances, starts, firsts, turns)
    references = np.sort(rng.permutation(len(p))[:REFERENCES])
    found, votes = np.zeros((len(references), PEAKS, 2)), np.zeros((len(references), PEAKS))
    _kernels_register.vote(
        *(references, p, n, F, step, distances, starts, firsts, turns, len(q), found, votes, CROWDED)
    )
    at, turn = found[:, :, 0].astype(int).ravel(), found[:, :, 1].ravel()
    i = np.repeat(references, PEAKS)
    c, s, zero, unit = np.cos(turn), np.sin(turn), np.zeros_like(turn), np.ones_like(turn)
    about = np.stack([unit, zero, zero, zero, c, -s, zero, s, c], axis=1).reshape(-1, 3, 3)
    R = np.einsum("hba,hbc,hcd->had", G[at], about, F[i])
    return rows(R, q[at] - np.einsum("hij,hj->hi", R, p[i]))


def axes_of(points: Array) -> tuple[Array, Array]:
    """Return the middle of points, and their principal axes as rows, right-handed."""
    middle = points.mean(axis=0)
    axes = np.linalg.eigh((points - middle).T @ (points - middle))[1].T[::-1]
    return middle, axes * np.sign(np.linalg.det(axes))


def between_axes(source: tuple[Array, Array], target: tuple[Array, Array]) -> Array:
    """Return the four motions (4, 12) that bring middles and principal axes, from `axes_of`, together."""
    (here, A), (there, B) = source, target
    flips = np.array([f for f in itertools.product((1.0, -1.0), repeat=3) if np.prod(f) > 0])
    R = (B.T * flips[:, None]) @ A
    return rows(R, there - R @ here)


def from_middles(source: Surface, target: Surface) -> Array:
    """Return motions (h, 12) that bring middles together: the four of the principal axes, then turns all around."""
    here, there = source.points.mean(axis=0), target.points.mean(axis=0)
    group = icosahedral_group()
    R = np.einsum("gab,jbc->jgac", group, even_representatives(SPREAD, group)).reshape(-1, 3, 3)
    axes = between_axes(axes_of(source.points), axes_of(target.points))
    return np.concatenate([axes, rows(R, there - R @ here)])


def begun(arena: Arena, rng: np.random.Generator) -> Array:
    """Return all motions to begin with."""
    return np.concatenate([
        from_pairs(arena.source, arena.target, arena.size, rng), from_middles(arena.source, arena.target)
    ])  # fmt: skip
