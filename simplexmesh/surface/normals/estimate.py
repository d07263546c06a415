"""Normals of a surface by any of the known estimators."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check, _vec
from simplexmesh.surface.methods import Method, Normals, around_of, chosen, warn_of_failures
from simplexmesh.surface.neighborhoods import Neighborhood, Neighborhoods
from simplexmesh.surface.reasons import DEGENERATE, FOUND
from simplexmesh.surface.samples import Samples, as_samples

Array = NDArray[np.float64]

METHODS = {
    "mean": Method("normals.faces", fixed={"weighting": "uniform"}, normals=None, needs_faces=True),
    "area": Method("normals.faces", fixed={"weighting": "area"}, normals=None, needs_faces=True),
    "angle": Method("normals.faces", fixed={"weighting": "angle"}, normals=None, needs_faces=True),
    "max": Method("normals.faces", fixed={"weighting": "max"}, normals=None, needs_faces=True),
    "plane": Method("normals.plane", {"variant": "pca"}, normals=None, turned=True),
    "quadric": Method("normals.quadric", {"passes": 1}),
    "chen_schmitt": Method("normals.chen_schmitt", {"normalized": False}),
    "extended_sine": Method("normals.extended_sine", {"solver": "newton", "tolerance": 1e-9, "iterations": 50}),
    "adaptive": Method("normals.adaptive", {"noise": None, "detail": None}, normals=None, own_scale=True),
}
"""Every normal estimator."""


def vertex_normals(
    surface: Any,
    method: str = "adaptive",
    *,
    neighborhood: Neighborhood | None = None,
    normals: str | ArrayLike | None = None,
    vertices: ArrayLike | None = None,
    **options: Any,
) -> Array:
    """Return unit normals at the vertices of a surface, outward as its faces, or a cloud's own normals, look.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What is measured. A cloud without normals has no outside: "adaptive" turns them from neighbor to neighbor and
        the whole of them outward; with other methods they look away from the middle of all points, which is outward
        on convex bodies; elsewhere neighbors may disagree.
    method : str
        The estimator. "adaptive", the default, chooses its own scale, as in `curvature`. Of the faces around each
        vertex: "mean" of their unit normals, weighted by "area" or "angle", or with the weights of "max", exact on
        spheres. Of neighbors, with or without faces: "plane", "quadric", "chen_schmitt", "extended_sine".
    neighborhood : from `rings`, `ball`, `nearest`, or Neighborhoods, optional
        Which neighbors it sees; by default the one-ring, in a cloud the 12 nearest points.
    normals : str or (n, 3) array of float, optional
        A method, or directions, that estimators of neighbors start from, and that say which side is outward; by
        default those by area, or a cloud's or simplex mesh's own.
    vertices : (c,) array of int, optional
        Measure these vertices only.
    **options
        What the method understands beyond these: "adaptive": `noise`, `detail`; "plane": `variant` ("pca", "svd4");
        "quadric": `passes`; "chen_schmitt": `normalized`; "extended_sine": `solver` ("newton", "ternary"), `tolerance`,
        `iterations`.

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
        Saying at how many vertices there is no estimate, and why.

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
    samples = as_samples(surface)
    around = around_of(method, kind, samples, neighborhood, normals, vertices)
    found = found_normals(samples, around, method, normals=normals, **options)
    warn_of_failures("a normal", found.reasons, samples, around)
    return found.normals


def found_normals(
    samples: Samples, around: Neighborhoods, method: str, *, normals: str | ArrayLike | None = None, **options: Any
) -> Normals:
    """Return normals around each center by a method of `vertex_normals`, with reasons where there is none."""
    return _found(samples, around, method, "method", normals, options)


def _found(
    samples: Samples,
    around: Neighborhoods,
    name: str,
    called: str,
    normals: str | ArrayLike | None = None,
    options: Mapping[str, Any] | None = None,
) -> Normals:
    """Return normals by the method of that name, which the caller gave as the argument `called`."""
    kind, understood = chosen(name, METHODS, options or {}, called)
    if kind.needs_faces and not samples.is_connected and not around.closed.any():
        others = ", ".join(repr(name) for name, other in METHODS.items() if not other.needs_faces)
        raise ValueError(f"{called} must be one of {others} for points without faces, not {name!r}")
    start = starting_normals(samples, around, kind.normals, normals)
    found: Normals = kind.estimate(samples, around, start, **understood)
    good = np.asarray(np.isfinite(found.normals).all(axis=1))
    if good.all():
        return found
    reasons = np.where(good | (found.reasons != FOUND), found.reasons, DEGENERATE).astype(np.uint8)
    return Normals(np.where(good[:, None], found.normals, 0.0), reasons)


def starting_normals(
    samples: Samples, around: Neighborhoods, default: str | None, given: str | ArrayLike | None
) -> Array | None:
    """Return (c, 3) unit normals that an estimator starts from, one for each center.

    Parameters
    ----------
    default : str or None
        The method where the caller names none. Normals known beforehand go before it, and points without faces have
        the plane's instead of those of faces. None: the estimator needs none.
    given : str, (n, 3) array of float or None
        The method or the normals the caller names.
    """
    if isinstance(given, str):
        return _found(samples, around, given, "normals").normals
    if given is not None:
        some = _check.array("normals", given, (len(samples.points), 3))[around.centers]
        largest = np.abs(some).max(axis=1, initial=0.0)[:, None]
        return _vec.normalized(some / np.where(largest > 0.0, largest, 1.0))
    if default is None:
        return None
    if samples.outward is not None:
        return samples.outward[around.centers]
    of_faces = METHODS[default].needs_faces and not samples.is_connected and not around.closed.any()
    return _found(samples, around, "plane" if of_faces else default, "method").normals
