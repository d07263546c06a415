"""Second test: errors on meshes of known surfaces under refinement (Charton 2014, 4.2.2)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.bench.candidates import RefusedError, curvature_of, normals_of
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.truth import discretized
from simplexmesh.surface.truth.discretized import Discretized
from simplexmesh.surface.truth.graphs import Graph

Array = NDArray[np.float64]

SIZES = (8, 16, 32, 64, 128)


def meshes(surfaces: Sequence[Graph], sizes: Sequence[int]) -> Iterator[tuple[str, str, int, Discretized]]:
    """Yield (surface, kind of mesh, size, mesh)."""
    for size in sizes:
        for surface in surfaces:
            yield surface.name, "SplitSquare", size, discretized.split_square(surface, size)
            yield surface.name, "Sawtooth", size, discretized.sawtooth(surface, size)
        yield "sphere", "UV", size, discretized.uv_sphere(size, size)
        yield "cylinder", "UV", size, discretized.uv_cylinder(size, size)


def mesh_errors(made: Discretized, names: Mapping[str, Sequence[str]]) -> Iterator[dict[str, object]]:
    """Yield the mean and largest error of every method over inner vertices of a mesh, and the number without estimate.

    Initial normals of curvatures are exact. Errors of H and K are in 1 / length and its square, of N |N - truth|.
    """
    samples = Samples(made.vertices, made.faces)
    kept = made.scored
    for name in names["curvature"]:
        try:
            found = curvature_of(name, samples, normals=made.exact.normals)
        except RefusedError:
            continue
        yield {"method": name, "quantity": "H", **_statistics(np.abs(found.mean - made.exact.mean)[kept])}
        yield {"method": name, "quantity": "K", **_statistics(np.abs(found.gauss - made.exact.gauss)[kept])}
    for name in names["normals"]:
        try:
            directions = normals_of(name, samples)
        except RefusedError:
            continue
        yield {
            "method": name,
            "quantity": "N",
            **_statistics(np.linalg.norm(directions - made.exact.normals, axis=1)[kept]),
        }


def _statistics(errors: Array) -> dict[str, object]:
    known = errors[np.isfinite(errors)]
    if not len(known):
        return {"mean error": np.nan, "max error": np.nan, "failed": len(errors)}
    return {"mean error": known.mean(), "max error": known.max(), "failed": len(errors) - len(known)}
