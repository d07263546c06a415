"""Mesh quality: mean edge length and aspect ratios of triangles (Charton 2014, def. 1.2, 1.6)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check, _vec
from simplexmesh.data.convert import as_triangles
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface.samples import as_samples

Array = NDArray[np.float64]
KINDS = ["edge", "height"]


class Statistics(NamedTuple):
    """Minimum, maximum, mean and population standard deviation of some values."""

    least: float
    greatest: float
    mean: float
    deviation: float


def statistics(values: ArrayLike) -> Statistics:
    """Return the statistics of the thesis's tables; NaN values are ignored.

    Examples
    --------
    >>> statistics([1.0, 3.0, np.nan])
    Statistics(least=1.0, greatest=3.0, mean=2.0, deviation=1.0)
    """
    known = np.asarray(values, float).ravel()
    known = known[~np.isnan(known)]
    if not len(known):
        return Statistics(*[np.nan] * 4)
    return Statistics(float(known.min()), float(known.max()), float(known.mean()), float(known.std()))


def scale(surface: Any) -> float:
    """Return the mean length of the edges of a mesh, in its unit.

    Raises
    ------
    ValueError
        The surface has no edges.

    Examples
    --------
    >>> scale(([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 9]], [[0, 1, 2]])).__round__(6)
    1.138071
    """
    samples = as_samples(surface)
    if not samples.is_connected or not samples.one_ring.members.size:
        raise ValueError("surface must have edges, not points alone")
    ring = samples.one_ring  # has each edge twice
    ends = np.repeat(samples.points[ring.centers], ring.valence, axis=0)
    return float(_vec.norm(samples.points[ring.members] - ends).mean())


def aspect_ratios(surface: Any, kind: str = "edge") -> Array:
    """Return the aspect ratio of each triangle.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh (its fan triangulation), PyVista or trimesh object, or path
        A surface of triangles.
    kind : {"edge", "height"}
        "edge": the shortest side over the longest: 1 for an equilateral triangle, but large for some flat ones too.
        "height": the smallest height over the longest side, 2 area / side^2: 0.866 for an equilateral triangle, 0 for
        one without area (the article of 2012 prints the largest height; its tables have the smallest).

    Returns
    -------
    (f,) array of float
        0 for triangles of coincident corners.

    Raises
    ------
    ValueError, TypeError
        An unknown kind, or not a surface of triangles.

    Examples
    --------
    >>> import numpy as np
    >>> import simplexmesh as sm
    >>> half = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 9]], [[0, 1, 2]])
    >>> sm.aspect_ratios(half).round(6), sm.aspect_ratios(half, "height").round(6)
    (array([0.707107]), array([0.5]))
    """
    _check.choice("kind", kind, KINDS)
    mesh: TriangleMesh = as_triangles(surface, "surface")
    corners = mesh.vertices[mesh.faces]
    edges = corners[:, [1, 2, 0]] - corners
    size = np.abs(edges).max(axis=(1, 2))
    edges /= np.where(size > 0.0, size, 1.0)[:, None, None]
    sides = _vec.norm(edges)
    longest = sides.max(axis=1)
    above = sides.min(axis=1) * longest if kind == "edge" else _vec.norm(_vec.cross(edges[:, 0], edges[:, 1]))
    return np.divide(above, longest**2, out=np.zeros(len(sides)), where=longest > 0)
