"""A model of a library: quantized surface points, spin images of some of them, and a global descriptor."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh._base.units import known_unit
from simplexmesh.recognition.library.global_descriptor import DESCRIPTOR_SIZE, global_descriptor
from simplexmesh.recognition.library.spin_images import PIXELS, SpinImages, model_octaves, spin_images_of
from simplexmesh.recognition.register.oriented_points import OrientedPoints
from simplexmesh.recognition.register.pose_candidates import principal_axes

MODEL_IMAGES = 200
"""Number of points with spin images: fewer find smaller parts less often, more take memory and time."""

HEADER = struct.Struct("<3Ii6d")
POSITION_LEVELS, NORMAL_LEVELS = 65535, 32767
DTYPES = ("<u2", "<i2", "<u2", "|u1", "<f4")
"""Types of the arrays of a packed model: points, normals, chosen points, images, descriptor."""


@dataclass(frozen=True, eq=False)
class Model:
    """A model in quantized form, since thousands are in memory at once."""

    quantized_points: NDArray[np.uint16]  # (n, 3) relative to the corner `low`, in 1/65535 of `side`
    quantized_normals: NDArray[np.int16]  # (n, 3) in 1/32767
    low: Array  # (3,)
    side: float  # the longest of the bounding box
    spacing: float
    noise: float
    spin_images: SpinImages
    descriptor: NDArray[np.float32]  # (DESCRIPTOR_SIZE,)
    unit: str | None = None  # of length, if it is known

    def surface(self, origin: Array | float = 0.0, unit: float = 1.0) -> OrientedPoints:
        """Return the surface, with points on local planes, about an origin (3,) and scaled by 1 / `unit`."""
        points = self.quantized_points * (self.side / POSITION_LEVELS / unit) + (self.low - origin) / unit
        normals = self.quantized_normals.astype(np.float64) / NORMAL_LEVELS
        return OrientedPoints(points, normals, self.spacing / unit, self.noise / unit, points)

    @cached_property
    def frame(self) -> tuple[Array, Array, float]:
        """The center (3,) of the points, their principal axes (3, 3) as rows, and the diagonal of their box."""
        surface = self.surface()
        return *principal_axes(surface.points), surface.extent

    def packed(self) -> bytes:
        """Return the model as bytes, the last of which name its unit."""
        images = self.spin_images
        head = HEADER.pack(
            *(len(self.quantized_points), len(images.chosen), len(images.pixels), images.first_octave),
            *(self.spacing, self.noise, self.side, *self.low),
        )
        arrays = self.quantized_points, self.quantized_normals, images.chosen, images.pixels, self.descriptor
        parts = [np.asarray(array, kind).tobytes() for array, kind in zip(arrays, DTYPES, strict=True)]
        return head + b"".join(parts) + (self.unit or "").encode()

    @staticmethod
    def unpacked(data: bytes) -> Model:
        """Return the model packed into bytes; its arrays are views of them."""
        if len(data) < HEADER.size:
            raise ValueError("a model is truncated")
        n, k, radii, first, spacing, noise, side, *low = HEADER.unpack_from(data)
        offset, parts = HEADER.size, []
        for kind, shape in zip(DTYPES, ((n, 3), (n, 3), (k,), (radii, k, PIXELS), (DESCRIPTOR_SIZE,)), strict=True):
            count = math.prod(shape)
            if offset + count * np.dtype(kind).itemsize > len(data):
                raise ValueError("a model is truncated")
            parts.append(np.frombuffer(data, kind, count, offset).reshape(shape))
            offset += parts[-1].nbytes
        quantized_points, quantized_normals, chosen, images, descriptor = parts
        numbers = (spacing, noise, side, *low, *descriptor.tolist())
        unit = data[offset:].decode(errors="replace") or None
        if (
            unit != known_unit(unit)
            or not 0 < k <= n
            or chosen.max() >= n
            or not side > 0
            or not np.isfinite(numbers).all()
        ):
            raise ValueError("a model holds invalid values")
        spin_images = SpinImages(chosen.astype(np.int64), first, images)
        return Model(
            quantized_points, quantized_normals, np.array(low), side, spacing, noise, spin_images, descriptor, unit
        )


def model_of(surface: OrientedPoints) -> Model:
    """Return the model of a surface."""
    smooth = surface.on_planes()
    points = smooth.points
    low, side = points.min(axis=0), float(np.ptp(points, axis=0).max())
    return Model(
        np.round((points - low) * (POSITION_LEVELS / side)).astype(np.uint16),
        np.round(smooth.normals * NORMAL_LEVELS).astype(np.int16),
        *(low, side, smooth.spacing, smooth.noise),
        spin_images_of(smooth, model_octaves(smooth), MODEL_IMAGES, np.random.default_rng(0)),
        global_descriptor(smooth).astype(np.float32),
        surface.unit,
    )
