"""Simplification of triangles within a tolerance of each of their vertices."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.named_arrays import taken
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh import manifold
from simplexmesh.mesh.triangles.self_intersection import crossing_triangles
from simplexmesh.mesh.triangles.topology import vertex_fans
from simplexmesh.surface.features import _kernels_flips, _kernels_removal, _kernels_tolerance
from simplexmesh.surface.features._kernels_removal import Order
from simplexmesh.surface.features._kernels_tolerance import Change, Spheres, Triangulation
from simplexmesh.surface.features.feature_lines import prepared

FEW_REMOVED = 0.05
"""Of the vertices that are left: fewer in a round are not worth another."""

PATIENCE = 8
"""Times the surface is simplified again with no more frozen than what crosses: scans need up to 8, noise dozens."""

MOST_REPLACED = 64
"""Triangles that one change may make: a vertex of more stays."""


def simplify(surface: Any, tolerance: float | ArrayLike, *, longest: float | None = None) -> TriangleMesh:
    """Return triangles of the same shape with fewer vertices, each of which is one of the given ones.

    Every given vertex stays within its tolerance of the result, and one on a border within it of the border. Vertices
    are removed, each by drawing it to a neighbor, then edges are flipped where that lowers the sum of the angles
    between triangles, so that edges lie along creases, and where both triangles are of one smooth part that lowers
    the largest of their angles. Components, borders and genus stay, and if triangles of the
    result cross, they are given ones.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, pair of arrays, or path
        The surface; a simplex mesh is triangulated, duplicate positions are merged.
    tolerance : float or (n,) array of float
        The largest distance of each vertex, of the triangles, from the result, in its unit of length: four standard
        deviations of a scan's noise, say. It binds one way only: where the given surface has no vertex, the result may
        be farther from it. One wider than a wall is thick lets the wall collapse. `decimate` binds both ways, for
        simplex meshes, and its vertices are new ones. With more than two deviations `feature_lines` finds fewer lines.
    longest : float, optional
        No edge becomes longer than this, so that vertices remain in planes and along cylinders. Default: no limit.

    Returns
    -------
    TriangleMesh
        With the data of the vertices that are left.

    Raises
    ------
    TypeError, ValueError
        For anything but a surface, a tolerance that is not above 0 (of single vertices it may be 0), or one for each
        vertex of a surface with duplicate positions.
    TopologyError
        When an edge has more than two triangles, or the surface is one-sided.

    Warns
    -----
    SimplexMeshWarning
        For given triangles that are turned to agree with the others, or dropped.

    References
    ----------
    P. Veron, S. Lesage and J.-C. Leon, *Outils de base pour l'extraction de caracteristiques de surfaces numerisees*,
    1998, sections 2 and 3: the tolerances and flips. M. Garland and P. Heckbert, *Surface simplification using
    quadric error metrics*, SIGGRAPH 1997, 209-216: the order of removal.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(20).triangulated("dual")
    >>> out = sm.simplify(ball, 0.01)
    >>> ball.n_vertices, out.n_vertices < 500, out.genus
    (4002, True, 0)
    >>> sm.deviation(ball, out).max <= 0.01
    True
    """
    given = as_triangles(surface, "surface")
    mesh = prepared(given)
    radii = _radii(tolerance, given.n_vertices, merged=mesh.n_vertices < given.n_vertices)[: mesh.n_vertices]
    limit = np.inf if longest is None else checks.number("longest", longest, 0.0, open_low=True)
    faces, mates, _ = manifold.matched(mesh.faces)
    fans = vertex_fans(faces, mates).astype(np.int64)
    vertex = np.zeros(int(fans.max()) + 1, np.int64)
    vertex[fans] = faces
    local = mesh.vertices - mesh.vertices.mean(axis=0)
    unit = 2.0 ** np.round(np.log2(np.abs(local).max()))  # squares of areas neither overflow nor vanish
    wide, far = np.minimum(radii[vertex] / unit, 8.0), min(limit / unit, 8.0)
    pinched = np.bincount(vertex)[vertex] > 1  # each fan would be changed without regard to the others
    left = vertex[_simplified(local[vertex] / unit, fans, mates, wide, far**2, pinched)]
    used, index = np.unique(left, return_inverse=True)
    return TriangleMesh(mesh.vertices[used], index.reshape(-1, 3), taken(mesh.data, used), mesh.unit)


def _radii(tolerance: float | ArrayLike, n: int, *, merged: bool) -> Array:
    """Return the tolerance of each vertex (n,)."""
    if np.ndim(tolerance) == 0:
        return np.full(n, checks.number("tolerance", tolerance, 0.0, open_low=True))
    radii = checks.array("tolerance", tolerance, (n,))
    if merged:
        raise ValueError("tolerance must be one number where vertices are duplicate or unused: see TriangleMesh.welded")
    if not radii.min() >= 0:
        raise ValueError(f"tolerance must be at least 0 everywhere, not {radii.min():g}")
    return radii


def _simplified(local: Array, fans: Indices, mates: Indices, radii: Array, longest: float, frozen: Mask) -> Indices:
    """Return the triangles (t, 3) that are left; `longest` is squared.

    `fans` (t, 3) are the triangles given, with a vertex for each fan of triangles around one. Where the result would
    cross itself, it is found again with the triangles around the corners there frozen, and a quarter of the tolerance
    of the vertices below, until only given triangles cross; after some times, with more and more around these.
    """
    frozen, radii = frozen.copy(), radii.copy()
    crossing, again = np.zeros((1, 2), np.int64), 0
    while len(crossing):
        tri, spheres = watched(local, fans, mates, radii, frozen)
        _change(tri, spheres, longest)
        triangles = tri.corners.reshape(-1, 3)
        there = np.flatnonzero((triangles[:, 2] >= 0) & (triangles[:, 2] < tri.caps))
        changed = (triangles[there] != fans[there]).any(axis=1)
        crossing = there[crossing_triangles(local, triangles[there], changed)]
        frozen[triangles[crossing]] = True
        for _ in range(again - PATIENCE):
            frozen[fans[frozen[fans].any(axis=1)]] = True
        radii[np.isin(_kernels_tolerance.holders(spheres)[: tri.caps], crossing)] /= 4
        again += 1
    return triangles[there]


def watched(local: Array, fans: Indices, mates: Indices, radii: Array, frozen: Mask) -> tuple[Triangulation, Spheres]:
    """Return the triangulation with its borders closed, no edge on lines, and the spheres of its vertices."""
    n = len(local)
    corners, mates, caps = _kernels_tolerance.capped(fans.ravel(), mates.ravel().astype(np.int64), n)
    vertices = np.concatenate([local, np.zeros((caps, 3))])
    sharp = np.zeros(len(corners), bool)
    tri = Triangulation(vertices, corners, mates, np.append(frozen, np.zeros(caps, bool)), sharp, n)
    border = np.zeros((len(corners) - fans.size) // 3)
    centers = np.concatenate([local, np.zeros((len(border), 3))])
    lists = np.full((2, len(centers)), -1)
    first = np.full(len(corners) // 3, -1)
    spheres = Spheres(centers, np.concatenate([radii**2, border]), first, *lists)
    _kernels_tolerance.fill_spheres(tri, spheres)
    return tri, spheres


def _change(tri: Triangulation, spheres: Spheres, longest: float) -> None:
    """Remove vertices and flip edges in turn, in place, while many vertices go; `longest` is the square of a length."""
    quadrics, change, order = quadrics_of(tri), no_change(), Order(longest, 0.0, np.inf, np.ones(tri.caps))
    removed, left = tri.caps, tri.caps
    while removed > FEW_REMOVED * left:
        removed = _kernels_removal.remove_vertices(tri, spheres, quadrics, starts(tri), change, order)
        _kernels_flips.flip_edges(tri, spheres, change, longest, False)  # noqa: FBT003
        left -= removed
    _kernels_flips.flip_edges(tri, spheres, change, longest, True)  # noqa: FBT003


def quadrics_of(tri: Triangulation) -> Array:
    """Return the quadrics (v, 11) of the vertices that are there."""
    out = np.zeros((tri.caps, 11))
    _kernels_removal.fill_quadrics(tri, out)
    return out


def no_change() -> Change:
    """Return room for the triangles of a change."""
    return Change(np.zeros(MOST_REPLACED, np.int64), np.zeros((MOST_REPLACED, 3), np.int64), np.zeros(1, np.int64))


def starts(tri: Triangulation) -> Indices:
    """Return a half-edge (v,) that starts at each vertex, or -1."""
    out, alive = np.full(len(tri.vertices), -1), np.flatnonzero(tri.corners >= 0)
    out[tri.corners[alive]] = alive
    return out
