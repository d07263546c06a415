"""Normals of a surface by any of the known estimators."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh.surface.methods import Method, Normals, chosen, warn_of_failures
from simplexmesh.surface.neighborhoods import Neighborhood, Neighborhoods, rings
from simplexmesh.surface.samples import Samples, as_samples

Array = NDArray[np.float64]

METHODS = {
    "mean": Method("normals.faces", {"weighting": "uniform"}, normals=None, needs_faces=True),
    "area": Method("normals.faces", {"weighting": "area"}, normals=None, needs_faces=True),
    "angle": Method("normals.faces", {"weighting": "angle"}, normals=None, needs_faces=True),
}
"""Every normal estimator."""


def vertex_normals(
    surface: Any,
    method: str = "area",
    *,
    neighborhood: Neighborhood | None = None,
    vertices: ArrayLike | None = None,
    **options: Any,
) -> Array:
    """Return unit normals at the vertices of a surface, outward as its faces, or a cloud's own normals, look.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What is measured.
    method : str
        The estimator.
    neighborhood : from `rings`, `ball`, `nearest`, or Neighborhoods, optional
        Which neighbors it sees; by default the one-ring, in a cloud the 12 nearest points.
    vertices : (c,) array of int, optional
        Measure these vertices only.
    **options
        What the method understands beyond these.

    Returns
    -------
    (n, 3) array of float
        Zero where there is no estimate.

    Raises
    ------
    ValueError, TypeError
        As `curvature`; a method that needs faces and was given points.

    Warns
    -----
    SimplexMeshWarning
        Saying at how many vertices there is no estimate, and why.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(8).triangulated("dual")
    >>> normals = sm.vertex_normals(ball, method="area")
    >>> normals.shape
    (642, 3)
    """
    samples = as_samples(surface)
    around = samples.around(rings(1) if neighborhood is None else neighborhood, vertices)
    found = found_normals(samples, around, method, **options)
    warn_of_failures("a normal", found.reasons)
    return found.normals


def normals_around(samples: Samples, around: Neighborhoods, method: str) -> Array:
    """Return the normals an estimator of curvature starts from, one for each center; nothing is said of failures."""
    return found_normals(samples, around, method).normals


def found_normals(samples: Samples, around: Neighborhoods, method: str, **options: Any) -> Normals:
    """Return normals around each center by a method of `vertex_normals`, with reasons where there is none."""
    kind, understood = chosen(method, METHODS, options)
    if kind.needs_faces:
        if samples.faces is None and samples.links is None:
            raise ValueError(f"method must not need faces for points without any, as {method!r} does")
        ring = samples.one_ring
        around = ring if np.array_equal(around.centers, ring.centers) else _rows(ring, around.centers)
    start = None if kind.normals is None else normals_around(samples, around, kind.normals)
    out: Normals = kind.estimate(samples, around, start, **understood)
    return out


def _rows(ring: Neighborhoods, centers: NDArray[np.int64]) -> Neighborhoods:
    """Return the rows of a ring of all vertices that belong to some."""
    counts = ring.valence[centers]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    members = ring.members[np.arange(offsets[-1]) + np.repeat(ring.offsets[centers] - offsets[:-1], counts)]
    return Neighborhoods(centers, offsets, members, ring.closed[centers])
