"""What a library keeps of a model: points of its surface, images around some of them, and its profile."""

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
from simplexmesh.recognition.bags import PIXELS, Bag, bag_of, octaves_of_model
from simplexmesh.recognition.pose_candidates import principal_axes
from simplexmesh.recognition.profile import SIZES, profile_of
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

KEPT = 4_000
"""So many points of a model are kept, ..."""

LOOKED = 200
"""... and the images around so many."""

HEAD = struct.Struct("<3Ii6d")
FINEST = 65535
STEEPEST = 32767
KINDS = ("<u2", "<i2", "<u2", "|u1", "<f4")
"""Of places, directions, what was chosen, images and profile, one after the other."""


@dataclass(frozen=True, eq=False)
class Model:
    """What is known of a model, in the whole numbers it is kept in: thousands of models are in memory at once.

    Attributes
    ----------
    places : (n, 3) array of uint16
        Of points, from the lowest corner, in 1/65535 of the longest side.
    directions : (n, 3) array of int16
        Their normals, in 1/32767.
    low : (3,) array of float
    side, spacing, noise : float
    bag : Bag
    profile : (SIZES,) array of float32
    """

    places: NDArray[np.uint16]
    directions: NDArray[np.int16]
    low: Array
    side: float
    spacing: float
    noise: float
    bag: Bag
    profile: NDArray[np.float32]

    @property
    def surface(self) -> Surface:
        """The surface, smooth."""
        points = self.places * (self.side / FINEST) + self.low
        return Surface(points, normalized(self.directions.astype(float)), self.spacing, self.noise, points)

    @cached_property
    def placement(self) -> tuple[Array, Array, float]:
        """The middle (3,) of the points, their principal axes (3, 3) as rows, and the diagonal of their box."""
        points = self.places.astype(float) * (self.side / FINEST) + self.low
        return *principal_axes(points), float(norm(np.ptp(self.places, axis=0) * (self.side / FINEST)))

    def normalized_to(self, unit: float) -> Surface:
        """Return the surface with its middle for zero and a length for one."""
        points, normals = np.empty((len(self.places), 3)), np.empty((len(self.places), 3))
        corner = (self.low - self.placement[0]) / unit
        _kernels_poses.unpack(self.places, self.directions, self.side / FINEST / unit, corner, points, normals)
        return Surface(points, normals, self.spacing / unit, self.noise / unit, points)

    def packed(self) -> bytes:
        """Return the model as bytes."""
        head = HEAD.pack(
            *(len(self.places), len(self.bag.chosen), len(self.bag.images), self.bag.first),
            *(self.spacing, self.noise, self.side, *self.low),
        )
        parts: list[NDArray[Any]] = [self.places, self.directions, self.bag.chosen, self.bag.images, self.profile]
        return head + b"".join(part.astype(kind).tobytes() for part, kind in zip(parts, KINDS, strict=True))

    @staticmethod
    def unpacked(data: bytes) -> Model:
        """Return the model that was packed into bytes; its arrays lie in them.

        Raises
        ------
        ValueError
            They are no model.
        """
        if len(data) < HEAD.size:
            raise ValueError("a model is not whole")
        n, k, radii, first, spacing, noise, side, *low = HEAD.unpack_from(data)
        at, parts = HEAD.size, []
        for kind, shape in zip(KINDS, ((n, 3), (n, 3), (k,), (radii, k, PIXELS), (SIZES,)), strict=True):
            count = math.prod(shape)
            if at + count * np.dtype(kind).itemsize > len(data):
                raise ValueError("a model is not whole")
            parts.append(np.frombuffer(data, kind, count, at).reshape(shape))
            at += parts[-1].nbytes
        places, directions, chosen, images, profile = parts
        numbers = (spacing, noise, side, *low, *profile.tolist())
        if at != len(data) or not 0 < k <= n or chosen.max() >= n or not side > 0 or not np.isfinite(numbers).all():
            raise ValueError("a model holds what no model can")
        bag = Bag(chosen.astype(np.int64), first, images)
        return Model(places, directions, np.array(low), side, spacing, noise, bag, profile)


def model_of(surface: Surface) -> Model:
    """Return what is to be kept of a model.

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
        np.round((points - low) * (FINEST / side)).astype(np.uint16),
        np.round(smooth.normals * STEEPEST).astype(np.int16),
        *(low, side, smooth.spacing, smooth.noise),
        bag_of(smooth, octaves_of_model(smooth), LOOKED, np.random.default_rng(0)),
        profile_of(smooth).astype(np.float32),
    )
