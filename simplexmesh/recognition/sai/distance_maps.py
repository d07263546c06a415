"""The distance between two signatures as a function of the rotation or shift that maps one to the other."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from simplexmesh._base.arrays import Array
from simplexmesh.recognition.sai import _kernels_rotations
from simplexmesh.recognition.sai._kernels_rotations import SignaturePair
from simplexmesh.recognition.sai.attribute_image import SAI
from simplexmesh.recognition.sai.flat_domains import flat_domain
from simplexmesh.recognition.sai.match import rotation_differences, scaled_signatures, tried_scales
from simplexmesh.recognition.sai.match_result import Match
from simplexmesh.recognition.sai.partial_signatures import Signature
from simplexmesh.recognition.sai.rotations import rotations
from simplexmesh.recognition.sai.shift_matching import compared_values, shift_differences
from simplexmesh.recognition.sai.sphere_domain import sphere_domain

NODES = 6
"""Frequency of the sphere over which rotations are binned: about 27 of the 19,800 per vertex."""


def over_sphere(sai_a: SAI, sai_b: SAI, pole: Array) -> Array:
    """Return (720,) minimum distances over rotations that take a pole of b to each vertex of ``sphere_domain(6)``."""
    a, b = _signatures(sai_a, sai_b)
    table = rotations(sai_a.frequency)
    total, common = rotation_differences(a, b, table)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(common >= 0.5 * common.max(), np.sqrt(total / common), np.inf)
    at = cKDTree(sphere_domain(NODES).vertices).query(table.matrices @ pole)[1]
    out = np.full(len(sphere_domain(NODES).vertices), np.inf)
    np.minimum.at(out, at, distance)
    return np.where(np.isfinite(out), out, np.max(out[np.isfinite(out)], initial=0.0))


def around_rotation(sai_a: SAI, sai_b: SAI, rotation: Array, vectors: Array) -> Array:
    """Return (k,) distances under a rotation followed by others."""
    a, b = _signatures(sai_a, sai_b)
    sphere = sphere_domain(sai_a.frequency)
    pair = SignaturePair(a.values, sphere.face_means(a.values), a.seen, b.values, b.seen)
    A, slope = np.zeros((3, 3)), np.zeros(3)
    near = np.argmax(sphere.vertices @ rotation.T @ sphere.vertices.T, axis=1)
    out = np.full(len(vectors), np.nan)
    for k, turn in enumerate(Rotation.from_rotvec(vectors).as_matrix()):
        total, count = _kernels_rotations.residuals(turn @ rotation, near, pair, sphere.arrays, A, slope)
        out[k] = np.sqrt(total / count) if count else np.nan
    return out


def over_patch(sai_a: SAI, sai_b: SAI) -> Array:
    """Return (n,) distances under the shift that takes the origin of a torus, cylinder or disc to each vertex."""
    patch = flat_domain(sai_a.topology, sai_a.frequency)
    a, b = (compared_values(one, 2, 0.3) for one in (sai_a, sai_b))
    squares = []
    for flipped in (False, True) if patch.topology != "plane" else (False,):
        total, common = shift_differences(patch.topology, patch.frequency, a, b, flipped=flipped)
        squares.append(np.maximum(total, 0.0) / np.maximum(common, 1e-12))
    mean = np.min(squares, axis=0)
    rows, columns = mean.shape
    x, y = patch.coordinates.T
    turn = np.arctan2(y, x) / (2 * np.pi) % 1.0 if patch.topology == "plane" else x
    row = y * rows if patch.topology == "torus" else np.zeros(len(x))
    return np.asarray(np.sqrt(map_coordinates(mean, [row, turn * columns], order=1, mode="grid-wrap")))


def rotation_plane(found: list[Match]) -> Array:
    """Return two orthonormal axes (2, 3) that span the rotation vectors from the first hypothesis to the next ones."""
    first = found[0].rotation
    axes: list[Array] = []
    for other in [*(Rotation.from_matrix(each.rotation @ first.T).as_rotvec() for each in found[1:]), *np.eye(3)]:
        for axis in axes:
            other = other - (other @ axis) * axis
        if np.linalg.norm(other) > 0.1 and len(axes) < 2:
            axes.append(other / np.linalg.norm(other))
    return np.stack(axes)


def _signatures(sai_a: SAI, sai_b: SAI) -> tuple[Signature, Signature]:
    """Return the signatures that `match` compares by default, partial ones scaled by equation 6.8."""
    (scaled,) = tried_scales(sai_a, sai_b, 1.0)
    return scaled_signatures(sai_a, sai_b, *scaled, smoothing=2, limit=0.3)
