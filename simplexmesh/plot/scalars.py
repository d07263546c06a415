"""Quantities by which a mesh or points are colored: curvatures and arrays, and distances to data."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.points import PointCloud
from simplexmesh.data.volume import Volume
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.reconstruct.deviation import deviation
from simplexmesh.plot.polydata import as_drawable, points_of
from simplexmesh.surface.curvature.estimate import curvature
from simplexmesh.surface.saliency.fields import field_values

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
    shown: Any,
    wanted: str | ArrayLike,
    data: Any,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
) -> Scalars:
    """Return the given values, or those of a mesh or points by name; some are measured to the data, if there is any."""
    if isinstance(shown, Volume):
        raise TypeError("scalars need a mesh or points to color, not Volume")
    if not isinstance(wanted, str):
        values = field_values("scalars", wanted, len(points_of(shown)))
        return Scalars(values, diverging=_has_both_signs(values))
    is_model = isinstance(shown, SimplexMesh)
    computed = list(DIVERGING) if is_model else ["mean_curvature"]
    if wanted in computed:
        values = getattr(shown, wanted) if is_model else curvature(shown).mean
        return Scalars(values, *DIVERGING[wanted], diverging=True)
    if wanted == "distance" and is_model and data is not None:
        return Scalars(_distances(shown, as_drawable(data), level, label, inside), "distance to the data", 1)
    if wanted == "deviation" and data is not None:
        target = as_drawable(data)
        if isinstance(target, PointCloud | Volume):
            raise TypeError(f"scalars 'deviation' needs a surface as data, not {type(target).__name__}")
        return Scalars(deviation(shown, target).distances, "deviation from the data", 1, diverging=True)
    measured = ["distance", "deviation"] if is_model else ["deviation"]
    if wanted in measured and wanted not in shown.data:
        raise ValueError(f"scalars {wanted!r} needs data to measure to: data is None, and the mesh has no such array")
    names = list(dict.fromkeys([*computed, *measured, *shown.data]))
    values = np.asarray(shown.data[checks.choice("scalars", wanted, names)], dtype=float)
    if values.ndim != 1:
        raise ValueError(f"scalars {wanted!r} must have one number for each vertex, not shape {values.shape}")
    if wanted == "distance":
        return Scalars(values, "distance to the data", 1)
    return Scalars(values, wanted.replace("_", " "), diverging=wanted == SIGNED or _has_both_signs(values))


def _has_both_signs(values: Array) -> bool:
    return bool((values < 0).any() and (values > 0).any())


def _distances(mesh: SimplexMesh, data: Any, level: float | None, label: int | None, inside: str) -> Array:
    """Return distances along the normals as in `Reconstruction.distance`, NaN beyond two samples and one edge."""
    if isinstance(data, SimplexMesh):
        data = data.triangulated(method="fan")
    fitted = as_input(data, level=level, label=label, inside=inside, components="all")
    reach = max(2 * fitted.resolution, mean_edge(mesh))
    gaps = fitted.target.gap(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.normals), reach)
    return np.abs(np.asarray(gaps))
