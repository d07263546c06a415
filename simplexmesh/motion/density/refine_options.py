"""Checked options of `refine` and `redistribute`: threshold, zone, reach and target."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.targets.protocol import checked_reach

Mask = NDArray[np.bool_]

THRESHOLDS = {"coarse": 2e-4, "medium": 2.5e-5, "fine": 3e-6}
"""Score thresholds by name. On a smooth surface the score of a face falls with the cube of the number of faces, so each
eighth of a threshold about doubles the number of vertices."""


def default_reach(mesh: SimplexMesh, reach: float | None) -> float:
    """Return the reach given, checked, or by default 10 % of the mesh's diagonal."""
    if reach is not None:
        return checked_reach(reach)
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    if diagonal == 0.0:
        raise ValueError("mesh must have some size, but all its vertices are at one point")
    return 0.1 * diagonal


def threshold_of(threshold: str | float) -> float:
    """Return the score threshold of a name, or the number given, checked to be above 0."""
    if isinstance(threshold, str):
        return THRESHOLDS[checks.choice("threshold", threshold, tuple(THRESHOLDS))]
    return checks.number("threshold", threshold, 0.0, open_low=True)


def zone_of(mesh: SimplexMesh, zones: ArrayLike) -> Mask:
    """Return the mask (f,) of the faces that refinement is limited to."""
    c = mesh.connectivity
    given = checks.any_array("zones", zones)
    if given.dtype == bool:
        if given.shape == (c.n_vertices,):
            return np.logical_and.reduceat(given[c.face_vertices], c.face_offsets[:-1])
        if given.shape == (c.face_sizes.size,):
            return given.copy()
        raise ValueError(
            f"zones must be a mask of the {c.face_sizes.size} faces or of the {c.n_vertices} vertices, "
            f"not one of shape {given.shape}"
        )
    out = np.zeros(c.face_sizes.size, bool)
    out[checks.indices("zones", zones, (None,), out.size)] = True
    return out


def as_target(target: Any, *, level: float | None, label: int | None, inside: str = "above") -> Target:
    """Return a target unchanged, and the target made from data of any kind that `reconstruct` accepts."""
    if callable(getattr(target, "gap", None)):
        if level is not None or label is not None or inside != "above":
            raise ValueError(f"level, label and inside are for volumes, not for {type(target).__name__}")
        return target
    try:
        return as_input(target, level=level, label=label, inside=inside).target
    except TypeError as error:
        raise TypeError(f"target must have a method gap(vertices, normals, reach) or be data; {error}") from error
