"""A shape in a hundred numbers that no rotation changes: how far its points are apart, and from its middle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import norm
from simplexmesh.recognition import _kernels_library
from simplexmesh.recognition._kernels_library import BENDS, LENGTHS, REACHES
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

PAIRED = 1000
FARTHEST_PAIR, FARTHEST = 4.0, 2.6
"""Distances between points, and from the middle, that no longer differ, in root mean square distances from it."""

SIZES = LENGTHS * BENDS + REACHES + 4
"""How many numbers a profile has."""


def profile_of(surface: Surface) -> Array:
    """Return a profile (SIZES,) of a complete surface; its last number is the logarithm of its size.

    Square roots of the shares of pairs of points with a distance and an angle between their normals (R. Osada,
    T. Funkhouser, B. Chazelle, D. Dobkin, Shape distributions, 2002, there without normals), and of points with a
    distance from the middle; the principal extents; the size.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.recognition.surfaces import surface_of
    >>> egg = sm.ellipsoid((3, 2, 1), 12).vertices
    >>> one, other = (profile_of(surface_of(points, "egg")) for points in (egg, 2 * egg[:, [1, 2, 0]]))
    >>> bool(np.allclose(one[:-1], other[:-1], atol=1e-3)), bool(np.isclose(other[-1] - one[-1], np.log(2)))
    (True, True)
    """
    at = surface.smooth - surface.smooth.mean(axis=0)
    away = norm(at)
    size = float(np.sqrt((away**2).mean()))
    sample = surface.sample(PAIRED, np.random.default_rng(0))
    pairs = np.zeros((LENGTHS, BENDS))
    _kernels_library.pair_profile(at[sample], surface.normals[sample], FARTHEST_PAIR * size, pairs)
    bins = np.minimum((away / (FARTHEST * size) * REACHES).astype(np.int64), REACHES - 1)
    reaches = np.bincount(bins, minlength=REACHES) / len(at)
    extents = np.sqrt(np.maximum(np.linalg.eigvalsh(at.T @ at / len(at))[::-1], 0.0)) / size
    return np.concatenate([np.sqrt(pairs.ravel() / pairs.sum()), np.sqrt(reaches), extents, [np.log(size)]])
