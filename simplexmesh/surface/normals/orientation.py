"""Orientation of normals: which of the two sides is outward."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import vectors
from simplexmesh._base.arrays import Array
from simplexmesh.orientation.propagation import propagated
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_plane as kernels
from simplexmesh.surface.normals import faces
from simplexmesh.surface.reasons import FOUND
from simplexmesh.surface.sampled_surface import SampledSurface


def outward_directions(samples: SampledSurface, around: Neighborhoods) -> Array:
    """Return (c, 3) directions at most a right angle from outward normals: known, of faces, or propagated."""
    if samples.outward is not None:
        return samples.outward[around.centers]
    if not samples.is_connected and not around.closed.any():
        return consistent_normals(samples)[around.centers]
    known = faces.estimate(samples, around, weighting="area")
    from_centroid = samples.points[around.centers] - samples.points.mean(axis=0)
    return np.where(known.reasons[:, None] == FOUND, known.normals, from_centroid)


def consistent_normals(samples: SampledSurface) -> Array:
    """Return (n, 3) normals of the planes of nearest points, signs propagated between them, outward as a whole."""
    ring, n = samples.one_ring, len(samples.points)
    planes, reasons, homogeneous = np.zeros((n, 3)), np.zeros(n, np.uint8), False
    kernels.planes(len(ring.centers), ring.centers, ring._rows, samples.points, homogeneous, planes, reasons)
    return propagated(ring.offsets, ring.members, samples.points, planes)


def oriented(normals: Array, directions: Array) -> Array:
    """Return the normals, reversed where the scalar product with `directions` is negative."""
    return np.where(vectors.dot(normals, directions)[:, None] < 0, -normals, normals)
