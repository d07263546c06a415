"""Candidate motions between two surfaces: from point pairs, principal axes, and a covering of all rotations."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, normalized
from simplexmesh.recognition import _kernels_pair_voting
from simplexmesh.recognition.grid_scoring import GridScorer, motion_rows
from simplexmesh.recognition.rotations import even_representatives, icosahedral_group
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

PAIR_POINTS = 600
"""Number of points of each surface that pairs are formed of."""

REFERENCES = 200
PEAKS = 8
STEP = 0.04
"""Width of a distance bin, relative to the extent of the smaller surface."""

MAXIMUM_BIN = 600
ROTATION_FACTOR = 10
"""Number of rotations that are tried with the centers aligned, divided by 60."""


def normal_frames(normals: Array) -> Array:
    """Return rotations (n, 3, 3) that take each unit normal to the x axis."""
    other = np.where(np.abs(normals[:, :1]) < 0.6, [[1.0, 0, 0]], [[0, 1.0, 0]])
    y = normalized(cross(normals, other))
    return np.stack([normals, y, cross(normals, y)], axis=1)


def pair_candidates(source: Surface, target: Surface, size: float, rng: np.random.Generator) -> Array:
    """Return the motions (h, 12) with the most votes of point pair features.

    Two pairs match if distance, angles of their line to the normals and angle between the normals agree; a match
    determines the target point of a source point, and the rotation about its normal (B. Drost, M. Ulrich, N. Navab,
    S. Ilic, Model globally, match locally, CVPR 2010).
    """
    one, other = source.sample(PAIR_POINTS, rng), target.sample(PAIR_POINTS, rng)
    p, n, q, m = source.points[one], source.normals[one], target.points[other], target.normals[other]
    F, G = normal_frames(n), normal_frames(m)
    step = STEP * size
    distances = int(np.ceil(1.0 / STEP)) + 1
    starts = np.zeros(distances * _kernels_pair_voting.ANGLES**3 + 2, np.int64)
    firsts, turns = np.zeros(len(q) ** 2, np.int32), np.zeros(len(q) ** 2, np.float32)
    _kernels_pair_voting.pair_table(q, m, G, step, distances, starts, firsts, turns)
    references = np.sort(rng.permutation(len(p))[:REFERENCES])
    found, votes = np.zeros((len(references), PEAKS, 2)), np.zeros((len(references), PEAKS))
    _kernels_pair_voting.vote(
        *(references, p, n, F, step, distances, starts, firsts, turns, len(q), found, votes, MAXIMUM_BIN)
    )
    at, turn = found[:, :, 0].astype(int).ravel(), found[:, :, 1].ravel()
    i = np.repeat(references, PEAKS)
    c, s, zero, unit = np.cos(turn), np.sin(turn), np.zeros_like(turn), np.ones_like(turn)
    about = np.stack([unit, zero, zero, zero, c, -s, zero, s, c], axis=1).reshape(-1, 3, 3)
    R = np.einsum("hba,hbc,hcd->had", G[at], about, F[i])
    return motion_rows(R, q[at] - np.einsum("hij,hj->hi", R, p[i]))


def principal_axes(points: Array) -> tuple[Array, Array]:
    """Return the center (3,) of points, and their principal axes as rows (3, 3), right-handed."""
    center = points.mean(axis=0)
    axes = np.linalg.eigh((points - center).T @ (points - center))[1].T[::-1]
    return center, axes * np.sign(np.linalg.det(axes))


def axis_candidates(source: tuple[Array, Array], target: tuple[Array, Array]) -> Array:
    """Return the four motions (4, 12) that align centers and principal axes, from `principal_axes`."""
    (source_center, A), (target_center, B) = source, target
    flips = np.array([f for f in itertools.product((1.0, -1.0), repeat=3) if np.prod(f) > 0])
    R = (B.T * flips[:, None]) @ A
    return motion_rows(R, target_center - R @ source_center)


def centered_candidates(source: Surface, target: Surface) -> Array:
    """Return motions (h, 12) that align centers: the four of the principal axes, then a covering of all rotations."""
    source_center, target_center = source.points.mean(axis=0), target.points.mean(axis=0)
    group = icosahedral_group()
    R = np.einsum("gab,jbc->jgac", group, even_representatives(ROTATION_FACTOR, group)).reshape(-1, 3, 3)
    axes = axis_candidates(principal_axes(source.points), principal_axes(target.points))
    return np.concatenate([axes, motion_rows(R, target_center - R @ source_center)])


def pose_candidates(scorer: GridScorer, rng: np.random.Generator) -> Array:
    """Return all candidate motions (h, 12)."""
    pairs = pair_candidates(scorer.source, scorer.target, scorer.size, rng)
    return np.concatenate([pairs, centered_candidates(scorer.source, scorer.target)])
