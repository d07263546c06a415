"""Lower bound on the number of vertices of a mesh with given topology: that of the vertices of its dual.

P. J. Heawood, 1890; M. Jungerman and G. Ringel, *Minimal triangulations on orientable surfaces*, Acta Math. 145 (1980)
121. Holes do not touch each other, so k other faces leave space for at most 2 (k - 2 + 2 g) of them.
"""

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def minimum_vertices(connectivity: Connectivity) -> int:
    """Return a lower bound on the vertices of a complete mesh with the same genus, holes and components."""
    c = connectivity
    of_face = np.empty(len(c.face_sizes), np.int64)
    of_face[c.face.reshape(-1)] = np.repeat(c.components, 3)
    n = np.bincount(c.components)
    faces, holes = np.bincount(of_face), np.bincount(of_face[c.face_is_hole], minlength=len(n))
    total = 0
    for n_vertices, n_faces, n_holes in zip(n.tolist(), faces.tolist(), holes.tolist(), strict=True):
        genus = 1 - (n_faces - n_vertices // 2) // 2
        heawood = 10 if genus == 2 else math.ceil((7 + math.sqrt(1 + 48 * genus)) / 2)
        others = max(3, 2 - 2 * genus + (n_holes + 1) // 2)
        total += 2 * (max(heawood, n_holes + others if n_holes > 1 else 0) - 2 + 2 * genus)
    return total


def checked_vertices(mesh: SimplexMesh, vertices: int | None) -> int:
    """Return the number of vertices to keep, or raise when no mesh of this topology has that many."""
    wanted = checks.integer("vertices", vertices, 1)
    if wanted > mesh.n_vertices:
        raise ValueError(f"vertices must be at most {mesh.n_vertices}, as many as the mesh has, not {wanted}")
    minimum = minimum_vertices(mesh.connectivity)
    if wanted < minimum:
        components = "" if mesh.n_components == 1 else f", {mesh.n_components} components"
        topology = f"genus {mesh.genus}, {mesh.n_holes} holes{components}"
        raise TopologyError(f"vertices must be at least {minimum}, the minimum for {topology}, not {wanted}")
    if wanted % 2:
        raise ValueError(f"vertices must be even, as every vertex has three edges, not {wanted}")
    return wanted
