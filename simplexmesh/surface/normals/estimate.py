"""Normals of a surface by any of the estimators."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks, vectors
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.adaptive.adaptive import ADAPTIVE
from simplexmesh.surface.face_cycles import one_rings
from simplexmesh.surface.neighborhoods import Neighborhood, Neighborhoods
from simplexmesh.surface.normals import faces, neighbors
from simplexmesh.surface.reasons import DEGENERATE, FOUND
from simplexmesh.surface.registry import (
    Method,
    Normals,
    chosen,
    neighborhoods_for,
    warn_of_clashing_faces,
    warn_of_failures,
)
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface

METHODS = {
    "mean": Method(faces.estimate, fixed={"weighting": "uniform"}, normals=None, needs_faces=True),
    "area": Method(faces.estimate, fixed={"weighting": "area"}, normals=None, needs_faces=True),
    "angle": Method(faces.estimate, fixed={"weighting": "angle"}, normals=None, needs_faces=True),
    "max": Method(faces.estimate, fixed={"weighting": "max"}, normals=None, needs_faces=True),
    "plane": Method(neighbors.plane, {"variant": "pca"}, normals=None, orients=True),
    "quadric": Method(neighbors.quadric, {"passes": 1}),
    "chen_schmitt": Method(neighbors.chen_schmitt, {"normalized": False}),
    "extended_sine": Method(neighbors.extended_sine, {"solver": "newton", "tolerance": 1e-9, "iterations": 50}),
    "adaptive": ADAPTIVE,
}
"""All normal estimators."""


def vertex_normals(
    surface: Any,
    method: str = "adaptive",
    *,
    neighborhood: Neighborhood | None = None,
    normals: str | ArrayLike | None = None,
    at: ArrayLike | None = None,
    **options: Any,
) -> Array:
    """Return unit normals at the vertices of a surface, oriented as its faces or a cloud's own normals.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface. In a cloud without normals the orientation is propagated from neighbor to neighbor, outward as a
        whole; which side of an open surface is outward is a guess.
    method : str
        The estimator. "adaptive", the default, chooses its scale, as in `curvature`. From the faces around each vertex:
        "mean" of their unit normals, weighted by "area" or "angle", or by the weights of "max", exact on spheres. From
        neighbors, with or without faces: "plane", "quadric", "chen_schmitt", "extended_sine".
    neighborhood : from `rings`, `ball`, `nearest`, or Neighborhoods, optional
        The neighbors used; by default the one-ring, in a cloud the 12 nearest points.
    normals : str or (n, 3) array of float, optional
        Initial normals of the estimators from neighbors, which determine the orientation too: a method, or directions;
        by default "area", or a cloud's or simplex mesh's own.
    at : (c,) array of int or (n,) array of bool, optional
        Measure only at these vertices.
    **options
        Options of the method. "adaptive": `noise`, `detail`; "plane": `variant` ("pca", "svd4"); "quadric": `passes`;
        "chen_schmitt": `normalized`; "extended_sine": `solver` ("newton", "ternary"), `tolerance`, `iterations`.

    Returns
    -------
    (n, 3) array of float
        Zero where there is no estimate.

    Raises
    ------
    ValueError, TypeError, OSError
        As `curvature`.

    Warns
    -----
    SimplexMeshWarning
        How many vertices have no estimate, and why; across how many edges triangles disagree on which side is outward,
        or that normals of a cloud do.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(8).triangulated("dual")
    >>> normals = sm.vertex_normals(ball, method="area")
    >>> normals.shape
    (642, 3)
    >>> cloud = sm.PointCloud(ball.vertices)
    >>> bool((sm.vertex_normals(cloud, method="quadric") * normals > -1e-3).all())
    True
    """
    kind, _ = chosen(method, METHODS, options)
    samples = as_sampled_surface(surface)
    around = neighborhoods_for(method, kind, samples, neighborhood, normals, at)
    if kind.needs_faces and samples.is_connected:
        one_rings(samples, around, method)
    found = found_normals(samples, around, method, normals=normals, **options)
    warn_of_failures("a normal", found.reasons, samples, around)
    warn_of_clashing_faces(samples, found.reasons, normals)
    return found.normals


def found_normals(
    samples: SampledSurface,
    around: Neighborhoods,
    method: str,
    *,
    normals: str | ArrayLike | None = None,
    called: str = "method",
    **options: Any,
) -> Normals:
    """Return normals by a method of `vertex_normals`, which the argument `called` has named, and why there is none."""
    kind, settings = chosen(method, METHODS, options, called)
    if kind.needs_faces and not samples.is_connected and not around.closed.any():
        others = ", ".join(repr(name) for name, other in METHODS.items() if not other.needs_faces)
        raise ValueError(f"{called} must be one of {others} for points without faces, not {method!r}")
    start = starting_normals(samples, around, kind.normals, normals)
    found = kind.estimate(samples, around, start, **settings)  # of an estimator of curvature too, which has more
    good = np.asarray(np.isfinite(found.normals).all(axis=1))
    reasons = np.where(good | (found.reasons != FOUND), found.reasons, DEGENERATE).astype(np.uint8)
    return Normals(np.where(good[:, None], found.normals, 0.0), reasons)


def starting_normals(
    samples: SampledSurface, around: Neighborhoods, default: str | None, given: str | ArrayLike | None
) -> Array | None:
    """Return (c, 3) initial unit normals: given, else the surface's own, else by the `default` method or "plane"."""
    if isinstance(given, str):
        return found_normals(samples, around, given, called="normals").normals
    if given is not None:
        chosen_normals = checks.array("normals", given, (len(samples.points), 3))[around.centers]
        largest = np.abs(chosen_normals).max(axis=1, initial=0.0)[:, None]
        return vectors.normalized(chosen_normals / np.where(largest > 0.0, largest, 1.0))
    if default is None:
        return None
    if samples.outward is not None:
        return samples.outward[around.centers]
    from_faces = METHODS[default].needs_faces and not samples.is_connected and not around.closed.any()
    return found_normals(samples, around, "plane" if from_faces else default).normals
