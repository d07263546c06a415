"""What a library keeps of a model: points of its surface, images around some of them, and its profile."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import normalized
from simplexmesh.recognition.bags import PIXELS, Bag, bag_of, octaves_of_model
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


@dataclass(frozen=True, eq=False)
class Model:
    """What is known of a model.

    Attributes
    ----------
    surface : Surface
        Smooth.
    bag : Bag
    profile : (SIZES,) array of float32
    """

    surface: Surface
    bag: Bag
    profile: NDArray[np.float32]

    def packed(self) -> bytes:
        """Return the model as bytes: places to 1/65535 of its longest side, normals to 1/32767."""
        points = self.surface.points
        low, side = points.min(axis=0), float(np.ptp(points, axis=0).max())
        head = HEAD.pack(
            *(len(points), len(self.bag.chosen), len(self.bag.images), self.bag.first),
            *(self.surface.spacing, self.surface.noise, side, *low),
        )
        parts = (
            np.round((points - low) * (FINEST / side)).astype("<u2"),
            np.round(self.surface.normals * STEEPEST).astype("<i2"),
            self.bag.chosen.astype("<u2"),
            self.bag.images,
            self.profile.astype("<f4"),
        )
        return head + b"".join(part.tobytes() for part in parts)

    @staticmethod
    def unpacked(data: bytes) -> Model:
        """Return the model that was packed into bytes."""
        n, k, radii, first, spacing, noise, side, *low = HEAD.unpack_from(data)
        at = HEAD.size

        def part(kind: str, *shape: int) -> NDArray[np.generic]:
            nonlocal at
            values = np.frombuffer(data, kind, int(np.prod(shape)), at).reshape(shape)
            at += values.nbytes
            return values

        points = part("<u2", n, 3) * (side / FINEST) + low
        normals = normalized(part("<i2", n, 3).astype(float))
        surface = Surface(points, normals, spacing, noise, points)
        chosen = part("<u2", k).astype(np.int64)
        bag = Bag(chosen, first, part("|u1", radii, k, PIXELS))  # type: ignore[arg-type]
        return Model(surface, bag, part("<f4", SIZES))  # type: ignore[arg-type]


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
    smooth = surface.smoothed()
    bag = bag_of(smooth, octaves_of_model(smooth), LOOKED, np.random.default_rng(0))
    return Model(smooth, bag, profile_of(smooth).astype(np.float32))
