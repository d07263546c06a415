"""Curvatures of a surface by any of the estimators."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.surface.curvature.adaptive.adaptive import ADAPTIVE
from simplexmesh.surface.curvature.classic import discrete, fans, principal, simplex_angle
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.neighborhoods import Neighborhood
from simplexmesh.surface.normals.estimate import starting_normals
from simplexmesh.surface.reasons import DEGENERATE, FOUND
from simplexmesh.surface.registry import (
    Estimates,
    Method,
    chosen,
    neighborhoods_for,
    warn_of_clashing_faces,
    warn_of_failures,
    warn_of_inward_faces,
)
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface

METHODS = {
    "adaptive": ADAPTIVE,
    "chen_schmitt": Method(fans.estimate, {"weighted": True, "normalized": False}, {"kind": "chen_schmitt"}),
    "discrete": Method(discrete.estimate, {"area": "mixed", "projected": False}, needs_faces=True),
    "extended_quadric": Method(fans.estimate, {"least": 6}, {"kind": "quadric", "terms": 5}),
    "full_quadric": Method(fans.estimate, {"least": 6}, {"kind": "quadric", "terms": 6}),
    "langer": Method(fans.estimate, fixed={"kind": "langer"}),
    "langer_exact": Method(fans.estimate, fixed={"kind": "langer_exact"}),
    "principal": Method(principal.estimate, {"radius": 5}, needs_faces=True, own_scale=True),
    "quadric": Method(fans.estimate, {"least": 3}, {"kind": "quadric", "terms": 3}),
    "simplex_angle": Method(simplex_angle.estimate, normals=None, needs_faces=True),
    "sine": Method(fans.estimate, {"least_swing": False}, {"kind": "sine"}),
    "taubin": Method(fans.estimate, fixed={"kind": "taubin"}),
}
"""All curvature estimators."""


def curvature(
    surface: Any,
    method: str = "adaptive",
    *,
    neighborhood: Neighborhood | None = None,
    normals: str | ArrayLike | None = None,
    at: ArrayLike | None = None,
    **options: Any,
) -> Curvature:
    """Return the principal, mean and Gaussian curvatures at the vertices of a surface.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface. Faces must be counter-clockwise seen from outside; in a cloud without normals the orientation is
        propagated from neighbor to neighbor, outward as a whole, a guess on open surfaces.
    method : str
        The estimator: "adaptive", the default, fits polynomials at scales chosen from the data; "sine" fits Euler's
        formula to the circles through each neighbor; "quadric" fits a paraboloid along the normal, "extended_quadric"
        one that may tilt, "full_quadric" one that need not pass through the vertex; "discrete" uses cotangents and
        angle defects; "taubin", "langer", "langer_exact" are quadratures; "chen_schmitt" fits circles through opposite
        neighbors; "simplex_angle" the sphere through three neighbors; "principal" is libigl's.
    neighborhood : from `rings`, `ball`, `nearest`, or Neighborhoods, optional
        The neighbors used; by default the one-ring, in a cloud the 12 nearest points. "adaptive" and "principal"
        choose their own and take none.
    normals : str or (n, 3) array of float, optional
        Initial normals: a method of `vertex_normals`, or unit vectors.
    at : (c,) array of int or (n,) array of bool, optional
        Measure only at these vertices; the result has one row for each.
    **options
        Options of the method. "adaptive": `noise`, its standard deviation along the normal, if known; `detail`, the
        smallest length of interest. Quadrics: `least`, the least number of neighbors. "sine": `least_swing`, take the
        least k1 - k2 where there are only two directions. "discrete": `area` ("mixed", "voronoi", "barycentric"),
        `projected`, H along the normal only. "chen_schmitt": `weighted`, `normalized`. "principal": `radius`, rings of
        neighbors.

    Returns
    -------
    Curvature
        `k1`, `k2`, `d1`, `d2`, `mean`, `gauss`, `normals`, `failed`, `error`, `confidence`, `scale`.

    Raises
    ------
    ValueError
        An unknown method, normals of another shape, `at` out of range, points without faces for a method that
        needs them.
    TypeError
        Not a surface, an option the method does not have, normals or neighborhoods that it does not use.
    OSError
        A file that does not exist or cannot be read.

    Warns
    -----
    SimplexMeshWarning
        How many vertices have no estimate, and why; across how many edges triangles disagree on which side is outward,
        or that normals of a cloud do; that all are oriented inward.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> mesh = sm.sphere(8).triangulated("dual")
    >>> ball = sm.TriangleMesh(2.0 * mesh.vertex_normals, mesh.faces)
    >>> found = sm.curvature(ball, method="sine")
    >>> float(found.mean.mean().round(3)), float(found.gauss.mean().round(3))
    (0.5, 0.25)
    """
    kind, settings = chosen(method, METHODS, options)
    samples = as_sampled_surface(surface)
    around = neighborhoods_for(method, kind, samples, neighborhood, normals, at)
    directions = starting_normals(samples, around, kind.normals, normals)
    with np.errstate(over="ignore", invalid="ignore"):
        found = _finite_or_failed(kind.estimate(samples, around, directions, **settings))
    warn_of_failures("curvature", found.reasons, samples, around)
    warn_of_clashing_faces(samples, found.reasons, normals)
    warn_of_inward_faces(samples, normals)
    return _result(found, directions, method, _shown(surface, samples) if at is None else None)


def _finite_or_failed(found: Estimates) -> Estimates:
    """Mark rows that are not finite, as by overflow, as failed."""
    total = found.k1 + found.k2 + found.mean + found.gauss
    for part in (found.d1, found.normals, found.error, found.scale):
        if part is not None:
            total = total + (part if part.ndim == 1 else part.sum(axis=1))
    overflowed = (found.reasons == FOUND) & ~np.isfinite(total)
    return found._replace(reasons=np.where(overflowed, DEGENERATE, found.reasons).astype(np.uint8))


def _shown(surface: Any, samples: SampledSurface) -> Any:
    """Return what was measured as something that can be drawn."""
    if isinstance(surface, SimplexMesh | TriangleMesh | PointCloud):
        return surface
    if samples.faces is not None:
        return TriangleMesh(samples.points, samples.faces)
    return PointCloud(samples.points, samples.outward)


def _result(found: Estimates, directions: Array | None, method: str, surface: Any) -> Curvature:
    """Return the result, with NaN exactly where the mask says failed."""
    failed = found.reasons != FOUND
    normals = found.normals if found.normals is not None else directions
    normals = np.zeros((len(failed), 3)) if normals is None else normals

    def masked(values: Array | None) -> Array | None:
        if values is None:
            return None
        shown = failed if values.ndim == 1 else failed[:, None]
        return checks.frozen(np.where(shown, np.nan, values))

    values = {name: masked(getattr(found, name)) for name in ("k1", "k2", "mean", "gauss", "d1", "error", "scale")}
    return Curvature(**values, normals=masked(normals), failed=checks.frozen(failed), method=method, _surface=surface)  # type: ignore[arg-type]
