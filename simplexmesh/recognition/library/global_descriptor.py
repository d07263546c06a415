"""Rotation-invariant global descriptor of a surface: histograms of pairs and of distances from the center.

Of pairs by length and angle between normals, after R. Osada and others, Shape distributions, 2002, there without these.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.recognition.library import _kernels_descriptors
from simplexmesh.recognition.library._kernels_descriptors import COSINE_BINS, LENGTH_BINS, RADIUS_BINS
from simplexmesh.recognition.register.oriented_points import OrientedPoints

MAXIMUM_LENGTH, MAXIMUM_RADIUS = 4.0, 2.6
"""Upper ends of the histograms of lengths and radii, relative to the root mean square radius."""

DESCRIPTOR_SIZE = LENGTH_BINS * COSINE_BINS + RADIUS_BINS + 4
"""Number of entries of a descriptor."""


def global_descriptor(surface: OrientedPoints) -> Array:
    """Return the descriptor (DESCRIPTOR_SIZE,) of a complete surface; its last entry is the logarithm of the size."""
    local = surface.smooth - surface.smooth.mean(axis=0)
    radii = norm(local)
    size = float(np.sqrt((radii**2).mean()))
    sample = surface.sample(1000, np.random.default_rng(0))
    pairs = np.zeros((LENGTH_BINS, COSINE_BINS))
    _kernels_descriptors.pair_histogram(local[sample], surface.normals[sample], MAXIMUM_LENGTH * size, pairs)
    bins = np.minimum((radii / (MAXIMUM_RADIUS * size) * RADIUS_BINS).astype(np.int64), RADIUS_BINS - 1)
    radius_histogram = np.bincount(bins, minlength=RADIUS_BINS) / len(local)
    extents = np.sqrt(np.maximum(np.linalg.eigvalsh(local.T @ local / len(local))[::-1], 0.0)) / size
    return np.concatenate([np.sqrt(pairs.ravel() / pairs.sum()), np.sqrt(radius_histogram), extents, [np.log(size)]])
