"""H and K with less noise: averaged over windows, or shrunk toward the averages as far as the noise requires."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import cross, dot
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.noise import local_noise, remaining_noise, smallest_window

Complex = NDArray[np.complex128]


class SmoothedCurvature(NamedTuple):
    """Mean and Gaussian curvature, NaN where unknown, and the standard deviation of H's error; (n,) each."""

    mean: Array
    gauss: Array
    error: Array


def smoothed_curvature(diffusion: Diffusion, known: Curvature, width: float) -> SmoothedCurvature:
    """Return H and K averaged over windows of a width, 0 for none; K from the averaged tensor, if there is one."""
    error = local_noise(diffusion, known)
    if width <= 0:
        return SmoothedCurvature(known.mean, known.gauss, error)
    mask = np.where(known.failed, np.nan, 0.0)
    mean, remaining = diffusion.smoothed(known.mean, width) + mask, remaining_noise(diffusion, known, width) * error
    if known.d1 is None:
        return SmoothedCurvature(mean, diffusion.smoothed(known.gauss, width) + mask, remaining)
    # averages of products keep the variance of the noise, so K is H^2 less the square of the averaged deviator
    deviator = mean_deviators(diffusion, known, known.d1, width) + mask
    return SmoothedCurvature(mean, mean**2 - np.abs(deviator) ** 2, remaining)


def shrunk(diffusion: Diffusion, known: Curvature) -> tuple[SmoothedCurvature, SmoothedCurvature]:
    """Return H and K shrunk toward their averages as far as noise explains them (after James and Stein), and these."""
    width = smallest_window(diffusion)
    if known.error is None or known.d1 is None or width <= 0:
        found = smoothed_curvature(diffusion, known, width)
        return found, found
    error, remaining = local_noise(diffusion, known), remaining_noise(diffusion, known, width)
    mask, half = np.where(known.failed, np.nan, 0.0), (known.k1 - known.k2) / 2
    mean = diffusion.smoothed(known.mean, width) + mask
    deviator = mean_deviators(diffusion, known, known.d1, width) + mask
    # differences that the noise explains vanish, much larger ones are due to the shape and remain
    square = diffusion.smoothed((mean - known.mean) ** 2 + np.abs(deviator - half) ** 2, width, steps=1)
    removed = (1 - remaining**2) * error**2
    factor = np.divide(3 * removed, square, out=np.ones(len(square)), where=square > 3 * removed)
    shrunk_mean, shrunk_deviator = known.mean + factor * (mean - known.mean), half + factor * (deviator - half)
    shrunk_gauss = shrunk_mean**2 - np.abs(shrunk_deviator) ** 2
    return (
        SmoothedCurvature(shrunk_mean, shrunk_gauss, np.sqrt(error**2 - factor * removed)),
        SmoothedCurvature(mean, mean**2 - np.abs(deviator) ** 2, remaining * error),
    )


def mean_deviators(diffusion: Diffusion, known: Curvature, d1: Array, width: float) -> Complex:
    """Return averages of the deviator of the curvature tensor, (n,): (k1 - k2) / 2 times exp(2 i angle from d1)."""
    rows, columns = diffusion.links
    found = ~known.failed
    normals, directions = (np.where(found[:, None], each, 0.0) for each in (known.normals, d1))
    half = np.where(found, (known.k1 - known.k2) / 2, np.nan)
    # between tangent planes by the least rotation (Sharp, Soliman and Crane 2019, *The vector heat method*)
    return diffusion.smoothed_deviators(half, _rotations(normals, directions, rows, columns), width)


def _rotations(normals: Array, directions: Array, to: Indices32, of: Indices32) -> Complex:
    """Return exp(2 i angle) from the direction at `to` to the one at `of`, transported there."""
    n, m, u, v = normals[to], normals[of], directions[to], directions[of]
    cosine, axis = dot(n, m), cross(m, n)
    defined = cosine > -0.95  # it is not at -1
    along = np.divide(dot(axis, v), 1 + cosine, out=np.zeros(len(n)), where=defined)
    transported = v * cosine[:, None] + cross(axis, v) + axis * along[:, None]
    out = (dot(transported, u) + 1j * dot(transported, cross(n, u))) ** 2
    size = np.abs(out)
    return np.divide(out, size, out=np.ones(len(out), complex), where=defined & (size > 0))
