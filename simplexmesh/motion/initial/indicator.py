"""Inside and outside of oriented points: the smooth field whose gradient is their normals (Poisson).

The equation is solved on a periodic grid by the fast Fourier transform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from simplexmesh.motion.initial import _kernels_grid
from simplexmesh.motion.initial.frame import Frame

Array = NDArray[np.float64]

BLUR = 1.0
_MARGIN = 0.12
_CELLS = 6.0


@dataclass(frozen=True, eq=False)
class Indicator:
    """A field on a grid, about 1/2 inside and -1/2 outside a body, 0 at its points.

    Attributes
    ----------
    frame : Frame
        Where the grid is.
    values : (nx, ny, nz) array of float
        The field.
    """

    frame: Frame
    values: NDArray[np.float32]

    def at(self, points: Array) -> tuple[Array, Array]:
        """Return the (n,) values and (n, 3) gradients (per unit of length) at points within the grid."""
        values, gradients = np.zeros(len(points)), np.zeros((len(points), 3))
        _kernels_grid.interpolate(self.values, self.frame.to_index(points), values, gradients)
        return values, gradients / self.frame.cell


def frame_for(points: Array, cell: float) -> Frame:
    """Return a grid with room around the points, so that the periodic images of the body do not disturb it."""
    extent = float(np.ptp(points, axis=0).max())
    return Frame.around(points, cell, margin=_CELLS + _MARGIN * extent / cell, fast=True)


def areas(points: Array, frame: Frame, blur: float = BLUR) -> Array:
    """Return about the area that each point stands for, from the number of points near it.

    Overlapping scans thus count once. A plane of one point per unit of area, blurred by a Gaussian of standard
    deviation s, has the density 1 / (s sqrt(2 pi)) at its middle.
    """
    count = np.zeros((*frame.shape, 1), dtype=np.float32)
    index = frame.to_index(points)
    _kernels_grid.splat(index, np.ones((len(points), 1)), count)
    spread = float(np.hypot(blur, np.sqrt(1 / 3)))
    density, _ = Indicator(frame, ndimage.gaussian_filter(count[..., 0], blur)).at(points)
    return frame.cell**2 / (np.sqrt(2 * np.pi) * spread * np.maximum(density, 1e-6))


def waves_of(shape: tuple[int, int, int]) -> list[NDArray[np.float32]]:
    """Return the wave numbers of a grid's transform, in radians a cell, to be broadcast along its axes."""
    waves = [2 * np.pi * fft.fftfreq(n) for n in shape[:2]] + [2 * np.pi * fft.rfftfreq(shape[2])]
    return list(np.meshgrid(*[w.astype(np.float32) for w in waves], indexing="ij", sparse=True))


def answer(shape: tuple[int, int, int], blur: float = BLUR) -> NDArray[np.complex64]:
    """Return what the equation makes of each wave of the divergence of blurred normals, for `solved`.

    Examples
    --------
    >>> answer((4, 4, 6)).shape
    (4, 4, 4)
    """
    k = waves_of(shape)
    k2 = k[0] ** 2 + k[1] ** 2 + k[2] ** 2
    k2[0, 0, 0] = 1.0
    return np.asarray(1j * np.exp(-0.5 * blur**2 * k2) / k2)


def solved(
    points: Array, normals: Array, frame: Frame, weight: Array, known: NDArray[np.complex64] | None = None
) -> Indicator:
    """Return the field whose gradient is nearest to minus the normals, as a layer on the points.

    Parameters
    ----------
    points, normals : (n, 3) array of float
        Normals point outwards; their length is their trust.
    frame : Frame
        From `frame_for`.
    weight : (n,) array of float
        Area that each point stands for.
    known : array of complex64, optional
        From `answer`, where several fields are solved on one frame.

    References
    ----------
    M. Kazhdan, Reconstruction of solid models from oriented point sets, SGP 2005.
    """
    layer = np.zeros((*frame.shape, 3), dtype=np.float32)
    _kernels_grid.splat(frame.to_index(points), normals * weight[:, None], layer)
    total: NDArray[np.complex64] | None = None
    for axis, k in enumerate(waves_of(frame.shape)):
        part = k * fft.rfftn(np.ascontiguousarray(layer[..., axis]), workers=-1)
        total = part if total is None else total + part
    assert total is not None
    total *= answer(frame.shape) if known is None else known
    values = fft.irfftn(total, s=frame.shape, workers=-1) / frame.cell**2
    found = Indicator(frame, values.astype(np.float32))
    level = float(np.average(found.at(points)[0], weights=weight))
    return Indicator(frame, found.values - np.float32(level))
