"""libigl's principal curvatures (Panozzo, Puppo, Rocca 2010): quadrics over wide rings, in its own frames."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh._vec import cross, norm, normalized
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.reasons import DEGENERATE, FEW
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, radius: int) -> Estimates:
    """Return what `igl.principal_curvature` finds, with our signs and order; vertices it calls bad have failed.

    Parameters
    ----------
    radius : int
        Rings of neighbors, at least 2.

    Raises
    ------
    ValueError
        Points without triangles.
    """
    radius = _check.integer("radius", radius, 2)
    if samples.faces is None:
        raise ValueError("surface must be triangles for method 'principal'")
    first, second, k1, k2, bad = igl.principal_curvature(samples.points, samples.faces, radius, useKring=True)
    reasons = np.zeros(len(samples.points), np.uint8)
    reasons[np.asarray(bad, np.int64)] = FEW
    kept = around.centers
    d1, d2, k1, k2, reasons = first[kept], second[kept], k1[kept], k2[kept], reasons[kept]
    turned = k1 < k2
    k1, k2 = np.maximum(k1, k2), np.minimum(k1, k2)
    d1, d2 = np.where(turned[:, None], d2, d1), np.where(turned[:, None], d1, d2)
    reasons[~np.isfinite(k1 + k2) & (reasons == 0)] = DEGENERATE
    out = cross(d1, d2)
    out *= np.where(np.einsum("ij,ij->i", out, normals) < 0, -1.0, 1.0)[:, None]
    flat = ~(np.abs(norm(out) - 1) < 1e-6)  # where all curvatures are zero libigl has no directions
    out[flat] = normals[flat]
    d1[flat] = normalized(cross(out[flat], np.eye(3)[np.abs(out[flat]).argmin(axis=1)]))
    reasons[(norm(out) < 0.5) & (reasons == 0)] = DEGENERATE
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1, out)
