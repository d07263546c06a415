"""Quadrics in three forms (McIvor and Valkenburg 1997; Charton 2014, 2.1.2): simple, extended and full."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.surface.curvature import _kernels_quadric as kernels
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, terms: int, least: int) -> Estimates:
    """Fit z = a x^2 + b x y + c y^2 (+ d x + e y (+ f)) to the neighbors, z along the normal, by least squares.

    With three terms the normal is fixed, and its error does not vanish as the mesh is refined. With d and e the fit
    corrects the normal, and the curvatures are those of the tilted surface. With f it need not pass through the vertex,
    which reduces the effect of noise; f is zero where the neighbors do not determine it, as six in opposite pairs.

    Parameters
    ----------
    terms : int
        3, 5 or 6.
    least : int
        Least number of neighbors, at least `terms`.
    """
    least = _check.integer("least", least, terms)
    n = len(around)
    k1, k2, d1, corrected = np.full(n, np.nan), np.full(n, np.nan), np.full((n, 3), np.nan), np.zeros((n, 3))
    reasons = np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    kernels.quadric(*rows, samples.points, normals, terms, least, k1, k2, d1, corrected, reasons)
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1, corrected)
