"""The target of volumes: an isosurface."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.conversion import as_volume
from simplexmesh.motion.targets import _kernels_volume
from simplexmesh.motion.targets.protocol import BuiltInTarget, checked_arguments

PACE = 0.7
"""Step of the search, in voxels; thinner sheets may be missed."""


class Isosurface(BuiltInTarget):
    """An isosurface of a volume, located along each vertex's normal with sub-voxel precision.

    The volume is interpolated trilinearly in physical space. Only crossings where the normal leaves the object count: a
    vertex inside searches outwards, one outside inwards. Beyond the volume is background, so objects cut by its border
    are closed there, within one voxel.

    Parameters
    ----------
    volume : Volume or anything convertible
        An array, a PyVista or VTK image, a path.
    level : float
        Strictly between the smallest and the largest value of the volume.
    inside : {"above", "below"}
        Whether values inside the object are above the level (bone in CT) or below it (air).

    Raises
    ------
    ValueError
        The level is outside the range of the volume.

    References
    ----------
    H. Delingette, thesis, 1994, section 5.3.2, "volumetric images".

    Examples
    --------
    >>> import simplexmesh as sm
    >>> x, y, z = np.mgrid[-8:9, -8:9, -8:9].astype(float)
    >>> ball = sm.Volume(6 - np.sqrt(x * x + y * y + z * z), origin=(-8, -8, -8))
    >>> target = Isosurface(ball, 0.0)
    >>> target.gap(np.array([[5.0, 0, 0], [7.5, 0, 0]]), np.array([[1.0, 0, 0], [1.0, 0, 0]]), reach=3.0)
    array([ 1. , -1.5])
    """

    def __init__(self, volume: Any, level: float, *, inside: str = "above") -> None:
        self.volume = as_volume(volume)
        self.unit = self.volume.unit
        self.level = checks.number("level", level)
        self.inside = checks.choice("inside", inside, ("above", "below"))
        low, high = self.volume.range
        if not low < self.level < high:
            within = f"above {low:g} and below {high:g}, the range of the volume"
            raise ValueError(f"level must be {within}, not {self.level:g}")
        values, above = self.volume.values, inside == "above"
        steps = [stride // values.itemsize for stride in values.strides]
        to_index = np.array(np.linalg.inv(self.volume.T_world_index)[:3], np.float64)
        self._field = _kernels_volume.Field(
            values.ravel(order="K"), steps[0], steps[1], steps[2], *self.volume.shape,
            to_index, self.level, 1.0 if above else -1.0, float(low if above else high),
        )  # fmt: skip

    @property
    def bounds(self) -> Array:
        """(2, 3) array of float: lowest and highest coordinates of the volume, which close the surface."""
        return self.volume.bounds

    def gap(self, vertices: Array, normals: Array, reach: float, *, pace: float = PACE) -> Array:
        """Return (n,) the signed distance along each normal to the nearest valid crossing, NaN beyond `reach`.

        Parameters
        ----------
        vertices, normals : (n, 3) array of float
        reach : float
            Maximum distance in either direction, in the volume's unit; may be infinite.
        pace : float
            Step of the search, in voxels; thinner sheets may be missed.

        Returns
        -------
        (n,) array of float
        """
        vertices, normals, reach = checked_arguments(vertices, normals, reach)
        pace = checks.number("pace", pace, 0.0, open_low=True)
        out = np.zeros(len(vertices))
        _kernels_volume.isosurface_gaps(len(vertices), vertices, normals, self._field, reach, pace, out)
        return out
