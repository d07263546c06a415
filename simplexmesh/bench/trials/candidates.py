"""The methods compared: all that are registered, called through the public functions."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.bench.truth.exact import Exact
from simplexmesh.surface.curvature import estimate as curvatures
from simplexmesh.surface.neighborhoods import Neighborhood, Neighborhoods
from simplexmesh.surface.normals import estimate as normal_estimates
from simplexmesh.surface.registry import Method
from simplexmesh.surface.sampled_surface import SampledSurface

Estimate = tuple[str, str, Array]
"""Method, quantity ("H", "K", or "N", the normal) and values, NaN where there is no estimate."""

REGISTRIES = {"curvature": curvatures.METHODS, "normals": normal_estimates.METHODS}


def estimates(
    kind: str,
    names: Sequence[str],
    samples: SampledSurface,
    *,
    normals: Array | None = None,
    around: Neighborhood | None = None,
) -> Iterator[Estimate]:
    """Yield what methods estimate for the rows of `around`, or all vertices; from `normals` if they start from some."""
    call: Callable[..., Any] = curvatures.curvature if kind == "curvature" else normal_estimates.vertex_normals
    for name in names:
        method = REGISTRIES[kind][name]
        asked: dict[str, Any] = {}  # the neighborhoods, or the vertices if the method does not take any
        if around is not None and not (method.own_scale or method.needs_faces):
            asked["neighborhood"] = around
        elif isinstance(around, Neighborhoods):
            asked["at"] = around.centers
        if normals is not None and starts(method):
            asked["normals"] = normals
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SimplexMeshWarning)
            try:
                found = call(samples, name, **asked)
            except ValueError:  # too few neighbors, or none of the faces that it reads
                continue
        if kind == "curvature":
            yield name, "H", found.mean
            yield name, "K", found.gauss
        else:
            yield name, "N", np.where((found != 0).any(axis=1)[:, None], found, np.nan)


def starts(method: Method) -> bool:
    """Return whether a method uses given initial normals."""
    return method.normals is not None and not method.own_scale


def truth(quantity: str, exact: Exact) -> Array:
    """Return the exact values of a quantity."""
    return {"H": exact.mean, "K": exact.gauss, "N": exact.normals}[quantity]


def distance(values: Array, exact: Array) -> Array:
    """Return absolute errors; of normals, (n, 3), the distance of unit vectors."""
    off = np.abs(values - exact)
    return off if off.ndim == 1 else np.linalg.norm(off, axis=1)
