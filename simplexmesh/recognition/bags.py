"""What the surface looks like around its points: spin images of some of them, at several radii."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition import _kernels_library
from simplexmesh.recognition._kernels_library import ALONG, AWAY
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

PIXELS = AWAY * ALONG
LEAST, MOST = 0.046, 0.193
"""The smaller of two radii used together may be such shares of a model's extent, if half of it and more is seen."""

USUAL = 0.13
"""About this share of a scan's extent is the smaller radius it is looked at with."""

FULL = 255.0


@dataclass(frozen=True, eq=False)
class Bag:
    """Images around some points of a surface. Radii are powers of two, in the data's unit.

    Attributes
    ----------
    chosen : (k,) array of int
        The points.
    first : int
        The exponent of the least radius.
    images : (r, k, PIXELS) array of uint8
        At each radius: square roots of the shares of the points there, over 255.
    """

    chosen: NDArray[np.int64]
    first: int
    images: NDArray[np.uint8]

    def has(self, octave: int) -> bool:
        """Whether there are images at a radius of two to a power, and at twice that."""
        return self.first <= octave < self.first + len(self.images) - 1

    def at(self, octave: int) -> NDArray[np.float32]:
        """Return (k, 2 PIXELS) images at a radius and at twice that, side by side."""
        k = octave - self.first
        return np.hstack([self.images[k], self.images[k + 1]]).astype(np.float32) / np.float32(FULL)


def bag_of(surface: Surface, octaves: range, count: int, rng: np.random.Generator) -> Bag:
    """Return spin images (A. Johnson, M. Hebert, 1999) of so many points, for pairs of radii from each of the octaves.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.recognition.surfaces import surface_of
    >>> ball = surface_of(sm.sphere(10), "ball")
    >>> bag = bag_of(ball, octaves_of_model(ball), 50, np.random.default_rng(0))
    >>> bag.at(bag.first).shape, bool(np.ptp(bag.at(bag.first), axis=0).max() < 0.2)  # all alike on a ball
    ((50, 80), True)
    """
    chosen = surface.sample(count, rng)
    images = np.zeros((len(octaves) + 1, len(chosen), PIXELS))
    for k, octave in enumerate(range(octaves.start, octaves.stop + 1)):
        _kernels_library.spin_images(surface.smooth, surface.normals, chosen, 2.0**octave, images[k])
    images = np.sqrt(images / images.sum(axis=2, keepdims=True))
    return Bag(chosen, octaves.start, np.round(FULL * images).astype(np.uint8))


def octaves_of_model(surface: Surface) -> range:
    """Return all octaves that scans of at least half a model may ask for."""
    low, high = np.log2(LEAST * surface.extent), np.log2(MOST * surface.extent)
    return range(int(np.floor(low)) + 1, int(np.floor(high)) + 1)


def octave_of_scan(surface: Surface) -> int:
    """Return the octave a scan is looked at with."""
    return round(float(np.log2(USUAL * surface.extent)))
