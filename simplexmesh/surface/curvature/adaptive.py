"""Jets at a scale of their own: polynomials of degree 2 to 6 whose neighborhood follows sampling, noise and detail.

After Cazals and Pouget (2005, Estimating differential quantities using polynomial fitting of osculating jets), with
the choice of scale of Lepski (1990), coefficients held back as in empirical Bayes, and tangential coordinates
lengthened to chords, which leaves little for the polynomial to do.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.surface.curvature import _kernels_adaptive as kernels
from simplexmesh.surface.curvature.scales import scales_of
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


class Jets(NamedTuple):
    """What was fitted around each center: k1 and k2, (c, 2), and so on, in the order the kernel wants."""

    shape: Array
    d1: Array
    normals: Array
    error: Array
    scale: Array
    reasons: NDArray[np.uint8]


def jets(samples: Samples, around: Neighborhoods, *, noise: float | None, detail: float | None) -> Jets:
    """Fit a jet around each center.

    Raises
    ------
    ValueError
        Noise below zero, or detail that is not positive.
    """
    if noise is not None:
        noise = _check.number("noise", noise, 0.0)
    if detail is not None:
        detail = _check.number("detail", detail, 0.0, open_low=True)
    scales = scales_of(samples, noise=noise, detail=detail)
    ring, rows, n = samples.one_ring, around.centers, len(around)
    shape, d1, found = np.zeros((n, 2)), np.zeros((n, 3)), np.zeros((n, 3))
    out = Jets(shape, d1, found, np.zeros(n), np.zeros(n), np.zeros(n, np.uint8))
    links = (
        ring.offsets.view(np.uint64),
        ring.members.view(np.uint64),
        samples.points,
        scales.directions,
        scales.oriented,
    )
    fit = (part[rows] for part in scales[:5])
    kernels.adaptive_jets(rows, *links, *fit, scales.noise, kernels.chunks(n), *out)
    return out


def estimate(
    samples: Samples, around: Neighborhoods, normals: Any, *, noise: float | None = None, detail: float | None = None
) -> Estimates:
    """Fit a polynomial height around each center, at the radius that makes the expected error of curvature least.

    Parameters
    ----------
    noise : float, optional
        Deviation of the noise along the normal, in the unit of the points, where it is known.
    detail : float, optional
        What is smaller than this length is not of interest: no neighborhood has a shorter radius.
    """
    found = jets(samples, around, noise=noise, detail=detail)
    k1, k2 = found.shape.T.copy()
    mean, gauss = (k1 + k2) / 2, k1 * k2
    return Estimates(k1, k2, mean, gauss, found.reasons, found.d1, found.normals, found.error, found.scale)
