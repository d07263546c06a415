"""Candidate motions between two surfaces: by votes of point pairs, and by principal axes.

A match of two pairs determines the target point of a source point, and the rotation about its normal (B. Drost,
M. Ulrich, N. Navab, S. Ilic, Model globally, match locally, CVPR 2010).
"""

from __future__ import annotations

import itertools

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, normalized
from simplexmesh.recognition.register import _kernels_point_pairs
from simplexmesh.recognition.register._kernels_point_pairs import Framed
from simplexmesh.recognition.register.oriented_points import OrientedPoints
from simplexmesh.recognition.register.pose_scoring import motion_rows

PAIR_POINTS, REFERENCES, PEAKS = 600, 200, 8
"""Points of each surface that form pairs, those of the source that vote, and motions of each: more find smaller
overlaps and take longer."""


def pose_candidates(source: OrientedPoints, target: OrientedPoints, size: float, rng: np.random.Generator) -> Array:
    """Return the motions (h, 12) with the most votes of point pair features; `size` is the extent of the smaller."""
    one, other = (_framed(each, each.sample(PAIR_POINTS, rng)) for each in (source, target))
    table = _kernels_point_pairs.pair_table(other, size)
    references = np.sort(rng.permutation(len(one.points))[:REFERENCES])
    found = np.zeros((len(references), PEAKS, 2))
    _kernels_point_pairs.vote(len(references), references, one, table, len(other.points), found)
    at, turn = found[:, :, 0].astype(int).ravel(), found[:, :, 1].ravel()
    i = np.repeat(references, PEAKS)
    c, s, zero, unit = np.cos(turn), np.sin(turn), np.zeros_like(turn), np.ones_like(turn)
    about = np.stack([unit, zero, zero, zero, c, -s, zero, s, c], axis=1).reshape(-1, 3, 3)
    R = np.einsum("hba,hbc,hcd->had", other.frames[at], about, one.frames[i])
    return motion_rows(R, other.points[at] - np.einsum("hij,hj->hi", R, one.points[i]))


def _framed(surface: OrientedPoints, rows: Indices) -> Framed:
    """Return points with frames that take each normal to the x axis."""
    normals = surface.normals[rows]
    other = np.where(np.abs(normals[:, :1]) < 0.6, [[1.0, 0, 0]], [[0, 1.0, 0]])
    y = normalized(cross(normals, other))
    return Framed(surface.points[rows], np.stack([normals, y, cross(normals, y)], axis=1))


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
