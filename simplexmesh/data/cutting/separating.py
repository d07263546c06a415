"""Take surfaces apart that meet in edges of more than two triangles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from simplexmesh._base.errors import TopologyError, counted, warn
from simplexmesh._base.named_arrays import taken
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.cutting.dividing import halved_where_crowded
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.welding import distinct_positions
from simplexmesh.mesh import manifold
from simplexmesh.mesh.triangles import separation

ROUNDS = 3
"""Times that edges are halved: of 75 parts of robots, 49 are taken apart in one round, 65 in three, 68 in five."""


def separated(surface: Any) -> TriangleMesh:
    """Return a surface with vertices of its own for each body that touches another along an edge.

    Files of assemblies have edges of more than two triangles, which most functions refuse. Each such edge is halved by
    a new vertex, up to three times, and its triangles are split there; then each triangle is joined to the next one on
    its inner side, first of its own body, and what finds none has a border there. Positions are kept, so that the
    bodies still touch: `welded` joins them again, and so does reading a file of the result.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, or path
        The surface; a simplex mesh is triangulated.

    Returns
    -------
    TriangleMesh
        With arrays interpolated at new vertices, and without triangles that are there twice; the surface itself if it
        has no such edges.

    Raises
    ------
    ValueError, TypeError
        The input is not a surface.
    TopologyError
        Surfaces lie on each other so that they cannot be told apart.

    Warns
    -----
    SimplexMeshWarning
        Surfaces were taken apart; the message says at how many edges.

    Examples
    --------
    >>> import warnings, simplexmesh as sm
    >>> spine, pages = [[0, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    >>> book = sm.TriangleMesh(spine + pages, [[0, 1, 2], [1, 0, 3], [0, 1, 4], [1, 0, 5]])
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore")  # 1 edge has more than two triangles
    ...     sm.separated(book).n_components
    2
    """
    mesh = as_triangles(surface, "surface")
    joined = welded_at_borders(mesh)
    apart, crowded = _taken_apart_once(replace(joined, faces=separation.without_repeated(joined.faces)))
    if not crowded:
        return mesh
    left = crowded
    for _ in range(ROUNDS):
        try:
            manifold.matched(apart.faces)
        except TopologyError:
            apart, left = _taken_apart_once(apart)
        else:
            where = counted(crowded, "edge has", "edges have")
            warn(f"{where} more than two triangles: the surfaces that meet there were taken apart")
            return apart
    raise TopologyError(f"surface cannot be taken apart at {left:,} of the edges of more than two triangles")


def _taken_apart_once(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Return the surface taken apart at edges of more than two triangles, halved, and how many these are."""
    halved, crowded = halved_where_crowded(mesh)
    faces, sources = separation.separated(halved.vertices, halved.faces)
    vertices, data = halved.vertices[sources], taken(halved.data, sources)
    return replace(halved, vertices=vertices, faces=faces, data=data), crowded


def welded_at_borders(mesh: TriangleMesh) -> TriangleMesh:
    """Return the surface with border vertices merged by position: seams close, and closed bodies that touch do not."""
    ends = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    rim = np.unique(edges[count == 1])
    first, inverse = distinct_positions(mesh.vertices[rim], 0.0)
    same = np.arange(mesh.n_vertices)
    same[rim] = rim[first[inverse]]
    used, faces = np.unique(same[mesh.faces], return_inverse=True)
    return replace(mesh, vertices=mesh.vertices[used], faces=faces.reshape(-1, 3), data=taken(mesh.data, used))
