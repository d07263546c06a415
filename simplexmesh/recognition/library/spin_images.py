"""Spin images of some points of a surface, at several radii."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Indices
from simplexmesh.recognition.library import _kernels_descriptors
from simplexmesh.recognition.library._kernels_descriptors import AXIAL_BINS, RADIAL_BINS
from simplexmesh.recognition.register.oriented_points import OrientedPoints

PIXELS = RADIAL_BINS * AXIAL_BINS
SMALLEST_RADIUS, LARGEST_RADIUS = 0.046, 0.193
"""Range of the smaller of two radii of a model's images, relative to its extent, for scans of at least half of it."""

SCAN_RADIUS = 0.13
"""Approximate smaller radius of a scan's images, relative to its extent."""


@dataclass(frozen=True, eq=False)
class SpinImages:
    """Spin images of some points of a surface. Radii are powers of two, in the data's unit."""

    chosen: Indices  # (k,) rows of the points
    first_octave: int  # exponent of the smallest radius
    pixels: NDArray[np.uint8]  # (r, k, PIXELS) at each radius, the square roots of normalized bin counts, times 255

    def has(self, octave: int) -> bool:
        """Whether there are images at the radius ``2**octave`` and at twice that."""
        return self.first_octave <= octave < self.first_octave + len(self.pixels) - 1

    def at(self, octave: int) -> NDArray[np.float32]:
        """Return images (k, 2 PIXELS) at the radius ``2**octave`` and at twice that, concatenated."""
        k = octave - self.first_octave
        return np.hstack([self.pixels[k], self.pixels[k + 1]]).astype(np.float32) / np.float32(255)


def spin_images_of(surface: OrientedPoints, octaves: range, count: int, rng: np.random.Generator) -> SpinImages:
    """Return spin images (Johnson and Hebert 1999) of `count` points, at the radii of octaves and at twice the last."""
    chosen = surface.sample(count, rng)
    pixels = np.zeros((len(octaves) + 1, len(chosen), PIXELS))
    for k, octave in enumerate(range(octaves.start, octaves.stop + 1)):
        _kernels_descriptors.spin_images(len(chosen), surface.smooth, surface.normals, chosen, 2.0**octave, pixels[k])
    pixels = np.sqrt(pixels / pixels.sum(axis=2, keepdims=True))
    return SpinImages(chosen, octaves.start, np.round(255 * pixels).astype(np.uint8))


def model_octaves(surface: OrientedPoints) -> range:
    """Return the octaves that scans of at least half of a model can have."""
    low, high = np.log2(SMALLEST_RADIUS * surface.extent), np.log2(LARGEST_RADIUS * surface.extent)
    return range(int(np.floor(low)) + 1, int(np.floor(high)) + 1)


def scan_octave(surface: OrientedPoints) -> int:
    """Return the octave of a scan's images."""
    return round(float(np.log2(SCAN_RADIUS * surface.extent)))
