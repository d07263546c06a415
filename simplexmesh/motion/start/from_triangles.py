"""Initial mesh from a closed surface: the dual of its own triangles, divided and decimated to the number wanted."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.vectors import norm
from simplexmesh.data.cutting.dividing import divided
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.motion.start.report import Start, StartReport
from simplexmesh.motion.start.solid_mesh import dual_mesh, edge_length

MOST_TRIANGLES = 400_000
"""Of divided surfaces: collapsing more takes longer than a start from points of them."""


def start_from_triangles(surface: TriangleMesh, vertices: int) -> Start | None:
    """Return a mesh of about as many vertices along one closed body, with its topology; None if it would be tangled.

    So thin walls and fine handles are in the start that a grid through points does not resolve.
    """
    found, edge = surface.topology, edge_length(surface.area, vertices)
    corners = surface.vertices[surface.faces]
    longest = norm(corners - np.roll(corners, 1, axis=1)).max(axis=1)  # slivers are divided into rows
    expected = 3 * vertices + np.maximum(longest / edge, 1.0).sum()
    if found.n_components > 1 or found.n_borders or expected > MOST_TRIANGLES:
        return None
    fine = divided(surface, edge)
    mesh = dual_mesh(fine.vertices, fine.faces, vertices)
    if mesh.genus != found.genus or tangled_vertices(mesh).any():
        return None
    return Start(mesh, StartReport((), 0.0, mesh.genus, 1))
