"""H and K with their noise averaged out: over a window, and no more than the noise asks for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot
from simplexmesh.surface.averages import Averages
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.scales import left_of_noise, local_noise, smallest_scale

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

PARTS = 3
"""Numbers of a symmetric 2 x 2 tensor, each of which has noise: H, and size and direction of the difference."""

OPPOSED = -0.95
"""Between normals whose cosine is less there is no shortest way to turn."""


class Bends(NamedTuple):
    """Mean and Gaussian curvature, NaN where not known, and the standard deviation of H's error; (n,) each."""

    mean: Array
    gauss: Array
    error: Array


def averaged(averages: Averages, known: Curvature, width: float) -> Bends:
    """Return H and K averaged over windows of a width, in the unit of the points; 0 for none.

    Means of products keep the noise's square, so K is taken from means of the tensors of curvature: H^2 less the
    square of half the difference of k1 and k2, which is averaged with its direction. From methods without directions
    it is the mean of K.
    """
    error = local_noise(averages, known)
    if width <= 0:
        return Bends(known.mean, known.gauss, error)
    hidden = np.where(known.failed, np.nan, 0.0)
    mean, left = averages.over(known.mean, width) + hidden, left_of_noise(averages, known, width) * error
    if known.d1 is None:
        return Bends(mean, averages.over(known.gauss, width) + hidden, left)
    swing = swings(averages, known, known.d1, width) + hidden
    return Bends(mean, mean**2 - np.abs(swing) ** 2, left)


def settled(averages: Averages, known: Curvature) -> tuple[Bends, Bends]:
    """Return H and K averaged as far as their noise asks for, and over the whole smallest window.

    Each vertex goes from its own values to their means by the share 3 s^2 / D^2, at most 1: s^2 is what averaging takes
    of the error's variance, D^2 the mean square of the way to go, in all three numbers of the tensor (after James and
    Stein 1961). Where means differ from the values by no more than noise explains, they are taken; where by much more,
    on a coarse mesh of a tube, say, the difference is the shape's, and values stay as they are. From methods that
    tell no error, or no directions, means are taken.
    """
    width = smallest_scale(averages)
    if known.error is None or known.d1 is None or width <= 0:
        found = averaged(averages, known, width)
        return found, found
    error, left = local_noise(averages, known), left_of_noise(averages, known, width)
    hidden, half = np.where(known.failed, np.nan, 0.0), (known.k1 - known.k2) / 2
    mean, swing = averages.over(known.mean, width) + hidden, swings(averages, known, known.d1, width) + hidden
    way = averages.over((mean - known.mean) ** 2 + np.abs(swing - half) ** 2, width, steps=1)
    taken = (1 - left**2) * error**2
    share = np.divide(PARTS * taken, way, out=np.ones(len(way)), where=way > PARTS * taken)
    between, turned = known.mean + share * (mean - known.mean), half + share * (swing - half)
    return (
        Bends(between, between**2 - np.abs(turned) ** 2, np.sqrt(error**2 - share * taken)),
        Bends(mean, mean**2 - np.abs(swing) ** 2, left * error),
    )


def swings(averages: Averages, known: Curvature, d1: Array, width: float) -> Complex:
    """Return means of half the difference of k1 and k2 with its direction, (n,): its size times exp(2 i angle from d1).

    What diffuses is turned from tangent plane to tangent plane the shortest way, as vectors are in Sharp, Soliman and
    Crane (2019, *The vector heat method*). Means of tensors in space would lose what turns out of a vertex's tangent
    plane with the surface: on a tube, over windows of half its radius, a third of its bend.
    """
    rows, columns = averages.links
    there = ~known.failed
    normals, along = (np.where(there[:, None], each, 0.0) for each in (known.normals, d1))
    half = np.where(there, (known.k1 - known.k2) / 2, np.nan)
    return averages.over_turning(half, _turns(normals, along, rows, columns), width)


def _turns(normals: Array, along: Array, to: NDArray[np.int32], of: NDArray[np.int32]) -> Complex:
    """Return exp(2 i angle) from the direction at `to` to that at `of`, brought there by the least rotation."""
    n, m, u, v = normals[to], normals[of], along[to], along[of]
    cosine, axis = dot(n, m), cross(m, n)
    sound = cosine > OPPOSED
    lean = np.divide(dot(axis, v), 1 + cosine, out=np.zeros(len(n)), where=sound)
    brought = v * cosine[:, None] + cross(axis, v) + axis * lean[:, None]
    out = (dot(brought, u) + 1j * dot(brought, cross(n, u))) ** 2
    size = np.abs(out)
    return np.divide(out, size, out=np.ones(len(out), complex), where=sound & (size > 0))
