"""Decimation of surfaces as they come: simplex meshes, triangles, objects of other libraries, files."""

from __future__ import annotations

import os
from typing import Any

from simplexmesh._base import checks
from simplexmesh.data.conversion import as_data
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.decimation.decimated import Decimated, with_vertices, within_tolerance
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def decimate(surface: Any, *, vertices: int | None = None, tolerance: float | None = None) -> Decimated:
    """Return a mesh of the same shape and topology with fewer vertices.

    Edges are removed (T1), the cheapest first. Each face represents a region of the surface, and the cost of an edge is
    the increase in energy when the regions of its two faces merge: squared distance to the best-fitting plane, spread
    of the normals, and extent. So faces end at creases, and are elongated where the surface bends in one direction
    only. An edge is kept if a triangle of the dual would turn over or become thin. T7 then regularizes the face sizes,
    and a least-squares fit moves the vertices so that the faces are closest to the surface, each only as far as no
    face folds or crosses another more than before.

    Genus, components and holes are kept. Faces never merge with holes; merging two on a boundary costs the squared
    distance of their parts of it from a line.

    `simplify` keeps triangles, some of the given vertices, and creases; it bounds the distance of the given vertices.

    Parameters
    ----------
    surface : SimplexMesh, TriangleMesh, PyVista or trimesh object, or path
        For triangles, their dual: vertices in `vertex_map` and in distances are then the triangles and their centroids,
        see `dual`. Equal positions are merged where no two triangles share a vertex, as in STL files.
    vertices : int, optional
        Number of vertices to keep: even, as it always is in a simplex mesh.
    tolerance : float, optional
        The largest distance allowed between the two surfaces, in both directions, and between their boundaries, in the
        unit of the mesh. It holds everywhere, not only at samples: where it is exceeded, vertices are displaced, and if
        that is not enough, decimation is repeated with smaller faces there. A mesh without folds stays so. Give this or
        `vertices`.

    Returns
    -------
    Decimated
        The mesh, the maps, and its distance from the given mesh. Vertices that are kept keep their data; at the ends of
        edges swapped by T7, floating-point data are averaged as in `swap_edge`.

    Raises
    ------
    TypeError
        When neither or both of `vertices` and `tolerance` are given, or `surface` is none.
    ValueError
        When `vertices` is odd or larger than the number there is, or `tolerance` is not above 0.
    TopologyError
        When the mesh is not complete, or `vertices` is below the minimum for its genus, holes and components.

    Warns
    -----
    SimplexMeshWarning
        When more vertices had to be kept, when none could be removed within the tolerance, or when some are on faces
        that fold or cross: because those of the given mesh do, or because there are too few vertices for its thin
        parts.

    References
    ----------
    H. Delingette, thesis, 1994, section 7.1; M. Garland, A. Willmott and P. Heckbert, *Hierarchical face clustering on
    polygonal surfaces*, 2001, and D. Cohen-Steiner, P. Alliez and M. Desbrun, *Variational shape approximation*, 2004,
    for the cost.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(12)
    >>> out = sm.decimate(ball, vertices=400)
    >>> out.mesh
    SimplexMesh(400 vertices, 202 faces, genus 0, 0 holes)
    >>> out.rms < 0.01
    True
    >>> sm.decimate(ball.triangulated("dual"), vertices=400).mesh.n_vertices
    400
    """
    if (vertices is None) == (tolerance is None):
        raise TypeError("give vertices or tolerance" + ("" if vertices is None else ", not both"))
    given = as_data(surface, "surface")
    if isinstance(given, TriangleMesh):
        given = dual(given if given.shares_vertices else given.welded(report=False))
    if not isinstance(given, SimplexMesh):
        where = f" in {os.path.basename(os.fspath(surface))}" if isinstance(surface, str | os.PathLike) else ""
        kind = type(given).__name__
        raise TypeError(f"surface must be a SimplexMesh or triangles, not the {kind}{where}: see reconstruct")
    checks.size("surface", given.bounds)
    return within_tolerance(given, tolerance) if vertices is None else with_vertices(given, vertices)
