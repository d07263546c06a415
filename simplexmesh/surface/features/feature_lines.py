"""The sharp edges of a surface, as lines."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.errors import TopologyError
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.cutting.separating import welded_at_borders
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh import manifold
from simplexmesh.surface.features.lines.creases import DEFAULT_ANGLE, creases
from simplexmesh.surface.features.lines.network import FeatureNetwork
from simplexmesh.surface.features.lines.walking import crease_angle


def feature_lines(surface: Any, *, angle: float | None = None) -> FeatureNetwork:
    """Return the sharp edges of a surface as lines and the nodes where they meet, whatever its noise and triangles.

    A sharp edge is where the normal jumps: on both sides it is fitted as a straight line across the edge, so curved
    surfaces and fillets do not count however coarse their triangles, and the jump is compared with what the noise of
    the vertices, which the surface itself shows, leaves of it. Triangles need no vertices on the edge: the points of
    the lines lie where the surfaces on both sides meet.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, pair of arrays, or path
        The surface; a simplex mesh is triangulated, duplicate positions are merged.
    angle : float, optional
        The least angle by which the normal jumps, in radians, between 0 and pi. Default: ten degrees, or what stands
        out from the noise if that is more: some 15 degrees where vertices are off by 5 % of an edge, 30 at 20 %.

    Returns
    -------
    FeatureNetwork
        Without lines where nothing is sharp.

    Raises
    ------
    ValueError, TypeError
        An angle out of range; not a surface of triangles.
    TopologyError
        When an edge has more than two triangles, or the surface is one-sided.

    Warns
    -----
    SimplexMeshWarning
        For given triangles that are turned to agree with the others, or dropped.

    References
    ----------
    P. Veron, S. Lesage and J.-C. Leon, *Outils de base pour l'extraction de caracteristiques de surfaces numerisees*,
    1998, section 4: lines, their ends and clean-up. W. Zhang et al., *Guided mesh normal filtering*, Computer Graphics
    Forum 34, 2015: normals without noise. The jumps and their errors are ours (docs/features.md).

    Examples
    --------
    >>> import pyvista as pv, simplexmesh as sm
    >>> can = sm.feature_lines(pv.Cylinder(resolution=60).triangulate().clean())
    >>> [line.closed for line in can.lines], len(can.nodes), bool(abs(can.lines[0].angle - 1.57).max() < 0.01)
    ([True, True], 0, True)
    >>> len(sm.feature_lines(sm.sphere(10)).lines)
    0
    """
    least = DEFAULT_ANGLE if angle is None else crease_angle(angle)
    mesh = prepared(surface)
    local = mesh.vertices - mesh.vertices.mean(axis=0)
    found = creases(local, mesh.faces.astype(np.int64), manifold.half_edge_mates(mesh.faces).ravel(), least)
    return FeatureNetwork(mesh, found)


def prepared(surface: Any) -> TriangleMesh:
    """Return a surface's triangles, oriented, without duplicate faces and positions, but for bodies taken apart."""
    given = as_triangles(surface, "surface")
    try:
        mesh = given.welded(report=False).oriented(outward=False)
    except TopologyError:
        mesh = welded_at_borders(given).oriented(outward=False)
    checks.size("surface", mesh.bounds)
    return mesh


def network_on(surface: Any, network: FeatureNetwork | None) -> FeatureNetwork:
    """Return the network given, on a surface whose data but not triangles may differ; find one if there is none."""
    if network is None:
        return feature_lines(surface)
    checks.instance("network", network, FeatureNetwork)
    mesh, own = prepared(surface), network.mesh
    same = np.array_equal(mesh.faces, own.faces) and len(mesh.vertices) == len(own.vertices)
    if not same or np.abs(mesh.vertices - own.vertices).max() > 1e-9 * own.diagonal:
        raise ValueError("network must be one of this surface: its triangles are others")
    return replace(network, mesh=mesh)
