"""A model of a library: quantized surface points, spin images of some of them, and a global descriptor."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import norm, normalized
from simplexmesh.recognition import _kernels_poses
from simplexmesh.recognition.global_descriptor import DESCRIPTOR_SIZE, global_descriptor
from simplexmesh.recognition.pose_candidates import principal_axes
from simplexmesh.recognition.spin_images import PIXELS, SpinImages, model_octaves, spin_images_of
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

MODEL_POINTS = 4_000
"""Number of points that are kept of a model."""

MODEL_IMAGES = 200
"""Number of these points with spin images."""

HEADER = struct.Struct("<3Ii6d")
POSITION_LEVELS = 65535
NORMAL_LEVELS = 32767
DTYPES = ("<u2", "<i2", "<u2", "|u1", "<f4")
"""Types of the arrays of a packed model: points, normals, chosen points, images, descriptor."""


@dataclass(frozen=True, eq=False)
class Model:
    """A model in quantized form, since thousands are in memory at once.

    Attributes
    ----------
    quantized_points : (n, 3) array of uint16
        Points relative to the corner `low`, in 1/65535 of `side`.
    quantized_normals : (n, 3) array of int16
        Unit normals, in 1/32767.
    low : (3,) array of float
    side : float
        Longest side of the bounding box.
    spacing, noise : float
        As in `Surface`.
    spin_images : SpinImages
    descriptor : (DESCRIPTOR_SIZE,) array of float32
    """

    quantized_points: NDArray[np.uint16]
    quantized_normals: NDArray[np.int16]
    low: Array
    side: float
    spacing: float
    noise: float
    spin_images: SpinImages
    descriptor: NDArray[np.float32]

    @property
    def surface(self) -> Surface:
        """The surface, with points projected to local planes."""
        points = self.quantized_points * (self.side / POSITION_LEVELS) + self.low
        return Surface(points, normalized(self.quantized_normals.astype(float)), self.spacing, self.noise, points)

    @cached_property
    def frame(self) -> tuple[Array, Array, float]:
        """The center (3,) of the points, their principal axes (3, 3) as rows, and the diagonal of their box."""
        scale = self.side / POSITION_LEVELS
        points = self.quantized_points.astype(float) * scale + self.low
        return *principal_axes(points), float(norm(np.ptp(self.quantized_points, axis=0) * scale))

    def normalized_to(self, unit: float) -> Surface:
        """Return the surface with its center at the origin, scaled by 1 / `unit`."""
        points, normals = np.empty((len(self.quantized_points), 3)), np.empty((len(self.quantized_points), 3))
        corner = (self.low - self.frame[0]) / unit
        _kernels_poses.dequantize(
            self.quantized_points, self.quantized_normals, self.side / POSITION_LEVELS / unit, corner, points, normals
        )
        return Surface(points, normals, self.spacing / unit, self.noise / unit, points)

    def packed(self) -> bytes:
        """Return the model as bytes."""
        images = self.spin_images
        head = HEADER.pack(
            *(len(self.quantized_points), len(images.chosen), len(images.pixels), images.first_octave),
            *(self.spacing, self.noise, self.side, *self.low),
        )
        parts: list[NDArray[Any]] = [
            self.quantized_points,
            self.quantized_normals,
            images.chosen,
            images.pixels,
            self.descriptor,
        ]
        return head + b"".join(part.astype(kind).tobytes() for part, kind in zip(parts, DTYPES, strict=True))

    @staticmethod
    def unpacked(data: bytes) -> Model:
        """Return the model packed into bytes; its arrays are views of them.

        Raises
        ------
        ValueError
            The bytes are not a packed model.
        """
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
        if offset != len(data) or not 0 < k <= n or chosen.max() >= n or not side > 0 or not np.isfinite(numbers).all():
            raise ValueError("a model holds invalid values")
        spin_images = SpinImages(chosen.astype(np.int64), first, images)
        return Model(quantized_points, quantized_normals, np.array(low), side, spacing, noise, spin_images, descriptor)


def model_of(surface: Surface) -> Model:
    """Return the model of a surface.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.recognition.surfaces import surface_of
    >>> model = model_of(surface_of(sm.ellipsoid((3, 2, 1), 12), "egg"))
    >>> again = Model.unpacked(model.packed())
    >>> bool(np.allclose(again.surface.points, model.surface.points, atol=1e-4))
    True
    """
    smooth = surface.on_planes()
    points = smooth.points
    low, side = points.min(axis=0), float(np.ptp(points, axis=0).max())
    return Model(
        np.round((points - low) * (POSITION_LEVELS / side)).astype(np.uint16),
        np.round(smooth.normals * NORMAL_LEVELS).astype(np.int16),
        *(low, side, smooth.spacing, smooth.noise),
        spin_images_of(smooth, model_octaves(smooth), MODEL_IMAGES, np.random.default_rng(0)),
        global_descriptor(smooth).astype(np.float32),
    )
