"""Surfaces with their edges on their creases."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.triangles.self_intersection import crossing_triangles
from simplexmesh.surface.features.feature_lines import network_on
from simplexmesh.surface.features.lines.network import FeatureNetwork


def aligned(surface: Any, network: FeatureNetwork | None = None) -> TriangleMesh:
    """Return a surface whose vertices along sharp edges are moved to where the surfaces on both sides meet.

    The triangles of a scan straddle its edges, as if they were beveled; here they meet in them. Triangles stay the
    same ones. A vertex stays where a triangle would turn against the surface, or come to cross another.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, pair of arrays, or path
        The surface.
    network : FeatureNetwork, optional
        Its sharp edges; by default those that `feature_lines` finds.

    Returns
    -------
    TriangleMesh
        With the data and the unit of the given one, duplicate positions merged.

    Raises
    ------
    ValueError, TypeError
        A network of another surface, not a surface of triangles.
    TopologyError
        When an edge has more than two triangles, or the surface is one-sided.

    Examples
    --------
    >>> import numpy as np, pyvista as pv, simplexmesh as sm
    >>> cube = sm.divided(pv.Cube().triangulate().clean(), 0.1)
    >>> bool(np.allclose(sm.aligned(cube).vertices, cube.vertices))
    True
    """
    network = network_on(surface, network)
    found, given, to = network._found, network.mesh.vertices, network._places.copy()
    faces = found.edges.facets.faces
    while True:
        corners = to[faces]
        turned = dot(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), found.normals) <= 0
        if not turned.any():
            turned[np.setdiff1d(crossing_triangles(to, faces), crossing_triangles(given, faces))] = True
        back = np.unique(faces[turned])
        back = back[(to[back] != given[back]).any(axis=1)]
        if not len(back):
            return replace(network.mesh, vertices=to)
        to[back] = given[back]
