"""Quantities by which a simplex mesh is colored: its curvatures and arrays, and distances to data."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.stages import mean_edge
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.plot.polydata import as_drawable

Array = NDArray[np.float64]

SIGNED = "simplex angle (rad)"
"""Vertex array with a scale symmetric about zero even where all are positive."""


class Scalars(NamedTuple):
    """Values per vertex, their name, their power of the unit of length, and whether their scale is diverging."""

    values: Array
    name: str = ""
    power: int = 0
    diverging: bool = False


DIVERGING = {
    "mean_curvature": ("mean curvature", -1),
    "sphere_curvature": ("curvature of spheres", -1),
    "simplex_angle": ("simplex angle, rad", 0),
}


def scalars_of(
    mesh: SimplexMesh,
    wanted: str | ArrayLike,
    data: Any,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
) -> Scalars:
    """Return the given values, or those of the mesh by name; "distance" is to the data, if there is any."""
    if not isinstance(wanted, str):
        return Scalars(checks.array("scalars", wanted, (mesh.n_vertices,)))
    if wanted in DIVERGING:
        return Scalars(getattr(mesh, wanted), *DIVERGING[wanted], diverging=True)
    if wanted == "distance" and data is not None:
        return Scalars(_distances(mesh, as_drawable(data), level, label, inside), "distance to the data", 1)
    if wanted == "distance" and "distance" not in mesh.data:
        raise ValueError("scalars 'distance' needs data to measure to: data is None, and the mesh has no such array")
    names = list(dict.fromkeys([*DIVERGING, "distance", *mesh.data]))
    values = np.asarray(mesh.data[checks.choice("scalars", wanted, names)], dtype=float)
    if values.ndim != 1:
        raise ValueError(f"scalars {wanted!r} must have one number for each vertex, not shape {values.shape}")
    if wanted == "distance":
        return Scalars(values, "distance to the data", 1)
    signed = wanted == SIGNED or bool((values < 0).any() and (values > 0).any())
    return Scalars(values, wanted.replace("_", " "), diverging=signed)


def _distances(mesh: SimplexMesh, data: Any, level: float | None, label: int | None, inside: str) -> Array:
    """Return distances of vertices to the surface in the data along their normals, NaN where none is near.

    These are the distances from mesh to data of `Reconstruction.distance`; near is within two samples or one edge.
    """
    if isinstance(data, SimplexMesh):
        data = data.triangulated(method="fan")
    fitted = as_input(data, level=level, label=label, inside=inside, components="all")
    reach = max(2 * fitted.resolution, mean_edge(mesh))
    gaps = fitted.target.gap(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.normals), reach)
    return np.abs(np.asarray(gaps))
