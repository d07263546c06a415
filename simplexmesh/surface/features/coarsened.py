"""Closed surfaces with fewer vertices, even and near, whose triangles have edges along given lines."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.named_arrays import taken
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh import manifold
from simplexmesh.mesh.triangles._kernels_relaxation import relax_round
from simplexmesh.surface.features import _kernels_flips, _kernels_removal
from simplexmesh.surface.features._kernels_removal import Order
from simplexmesh.surface.features.simplify import no_change, quadrics_of, starts, watched

EVENNESS = 0.05
"""Of an edge, how far off a surface may be if that makes its triangles as much more even."""

RELAXATIONS = 5
"""Rounds after each of three rounds of removal: vertices off lines to the middle of their triangles."""

LONGEST = 4.0
"""Of the root of the mean area, that no edge exceeds."""


def coarsened(mesh: TriangleMesh, sharp: Mask, count: int, weights: Array) -> tuple[TriangleMesh, Mask]:
    """Return a closed surface with fewer vertices, some of those given, and its half-edges (t, 3) that are on lines.

    Of lines, whose half-edges are `sharp` (t, 3), vertices are drawn along them alone, and ends and branchings stay.
    Until `count` triangles are left, of which each edge on a line counts for two more, vertices go where that moves the
    surface least (Garland and Heckbert 1997) and edges are shortest, by squares times the weights (n,) of vertices;
    others move along the surface to the middle of their triangles.
    """
    faces, n = mesh.faces.astype(np.int64), mesh.n_vertices
    radius = float(np.sqrt(mesh.area / count))
    local = (mesh.vertices - mesh.vertices.mean(axis=0)) / radius
    mates, radii, frozen = manifold.half_edge_mates(faces), np.ones(n), np.zeros(n, bool)
    tri, spheres = watched(local, faces, mates, radii, frozen)
    tri.sharp[:] = sharp.ravel()
    quadrics, change, longest = quadrics_of(tri), no_change(), LONGEST**2
    for share in (2.0, 1.4, 1.0):  # flips between leave vertices fewer triangles
        surplus = (tri.corners >= 0).sum() / 3 + tri.sharp.sum() - share * count
        order = Order(longest, EVENNESS**2, float(surplus), weights)
        _kernels_removal.remove_vertices(tri, spheres, quadrics, starts(tri), change, order)
        _kernels_flips.flip_edges(tri, spheres, change, longest, False)  # noqa: FBT003
        for _ in range(RELAXATIONS):
            _kernels_flips.flip_edges(tri, spheres, change, longest, True)  # noqa: FBT003
            first = starts(tri)
            first[tri.corners[tri.sharp]] = -1
            relax_round(tri.vertices, tri.corners, tri.mates, first, 0.5)
    corners = tri.corners.reshape(-1, 3)
    left = np.flatnonzero(corners[:, 0] >= 0)
    used, index = np.unique(corners[left], return_inverse=True)
    vertices = mesh.vertices[used] + radius * (tri.vertices - local)[used]
    out = TriangleMesh(vertices, index.reshape(-1, 3), taken(mesh.data, used), mesh.unit)
    return out, tri.sharp.reshape(-1, 3)[left]
