"""Normals from the neighbors of a vertex, with or without faces, over initial ones; after Charton 2014, chapter 3.

Planes: 3.4-3.5; Klasing et al. 2009. Quadrics: 3.6-3.10; McIvor, Valkenburg 1997. Circles: 3.11-3.13; Chen, Schmitt
1992. ExtendedSineFitting: 3.3.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.classic import fans
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_chen_schmitt, _kernels_extended_sine, _kernels_plane
from simplexmesh.surface.normals.orientation import oriented, outward_directions
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface


def plane(samples: SampledSurface, around: Neighborhoods, normals: Array | None, *, variant: str) -> Normals:
    """Return the normals of least-squares planes, "pca" about the mean or "svd4", the thesis's, about the origin."""
    n = len(around)
    homogeneous = checks.choice("variant", variant, ["pca", "svd4"]) == "svd4"
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    _kernels_plane.planes(n, around.centers, around._rows, samples.points, homogeneous, out, reasons)
    return Normals(oriented(out, outward_directions(samples, around) if normals is None else normals), reasons)


def quadric(samples: SampledSurface, around: Neighborhoods, normals: Array, *, passes: int) -> Normals:
    """Return the normal of the curvature estimator "extended_quadric", from five neighbors on."""
    for _ in range(checks.integer("passes", passes, 1)):
        found = fans.estimate(samples, around, normals, kind="quadric", terms=5, least=5)
        assert found.normals is not None
        normals = found.normals
    return Normals(normals, found.reasons)


def chen_schmitt(samples: SampledSurface, around: Neighborhoods, normals: Array, *, normalized: bool) -> Normals:
    """Return the sum of the cross products of the tangents of circles, on the side of the given normals."""
    out, reasons = np.zeros((len(around), 3)), np.zeros(len(around), np.uint8)
    seen = around._rows, samples.points, normals, checks.flag("normalized", normalized)
    _kernels_chen_schmitt.chen_schmitt(len(around.centers), around.centers, *seen, out, reasons)
    return Normals(out, reasons)


def extended_sine(
    samples: SampledSurface, around: Neighborhoods, normals: Array, *, solver: str, tolerance: float, iterations: int
) -> Normals:
    """Return the normals for which normal curvatures have no first harmonic; those of "quadric" elsewhere."""
    n = len(around)
    settings = _kernels_extended_sine.Solver(
        checks.choice("solver", solver, ["newton", "ternary"]) == "newton",
        checks.number("tolerance", tolerance, 0.0, open_low=True),
        checks.integer("iterations", iterations, 1),
    )
    out, fits, reasons = np.zeros((n, 3)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    _kernels_extended_sine.extended_sine(
        n, around.centers, around._rows, samples.points, normals, settings, out, fits, reasons
    )
    if len(left := np.flatnonzero(reasons)):
        instead = quadric(samples, around.taken(left), normals[left], passes=1)
        out[left], reasons[left] = instead.normals, instead.reasons
    return Normals(out, reasons)
