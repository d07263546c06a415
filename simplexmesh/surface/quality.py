"""Mesh quality: aspect ratios of triangles (Charton 2014, def. 1.6)."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base import checks, vectors
from simplexmesh._base.arrays import Array
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh

KINDS = ["edge", "height"]


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
    checks.choice("kind", kind, KINDS)
    mesh: TriangleMesh = as_triangles(surface, "surface")
    corners = mesh.vertices[mesh.faces]
    edges = corners[:, [1, 2, 0]] - corners
    size = np.abs(edges).max(axis=(1, 2))
    edges /= np.where(size > 0.0, size, 1.0)[:, None, None]
    sides = vectors.norm(edges)
    longest = sides.max(axis=1)
    above = sides.min(axis=1) * longest if kind == "edge" else vectors.norm(vectors.cross(edges[:, 0], edges[:, 1]))
    return np.divide(above, longest**2, out=np.zeros(len(sides)), where=longest > 0)
