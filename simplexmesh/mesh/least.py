"""How few vertices a mesh can have that keeps its topology."""

from __future__ import annotations

import math

import numpy as np

from simplexmesh import _check
from simplexmesh.errors import TopologyError
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def least_vertices(connectivity: Connectivity) -> int:
    """Return a number of vertices that no complete mesh of the same genus, holes and components can be below.

    A triangulated surface of genus g has at least (7 + sqrt(1 + 48 g)) / 2 corners, which are the faces here. Holes
    do not touch each other, and the k other faces have room for 2 (k - 2 + 2 g) of them.

    References
    ----------
    P. J. Heawood, 1890; M. Jungerman and G. Ringel, *Minimal triangulations on orientable surfaces*, Acta Math. 145
    (1980) 121.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.mesh.least import least_vertices
    >>> least_vertices(sm.sphere(4).connectivity), least_vertices(sm.torus(14, 6).connectivity)
    (4, 14)
    """
    c = connectivity
    of_face = np.empty(len(c.face_sizes), np.int64)
    of_face[c.face.reshape(-1)] = np.repeat(c.components, 3)
    n = np.bincount(c.components)
    faces, holes = np.bincount(of_face), np.bincount(of_face[c.face_is_hole], minlength=len(n))
    total = 0
    for n_vertices, n_faces, n_holes in zip(n.tolist(), faces.tolist(), holes.tolist(), strict=True):
        genus = 1 - (n_faces - n_vertices // 2) // 2
        corners = 10 if genus == 2 else math.ceil((7 + math.sqrt(1 + 48 * genus)) / 2)
        others = max(3, 2 - 2 * genus + (n_holes + 1) // 2)
        total += 2 * (max(corners, n_holes + others if n_holes > 1 else 0) - 2 + 2 * genus)
    return total


def vertices_wanted(mesh: SimplexMesh, vertices: int | None) -> int:
    """Return the number of vertices to keep, or say why it cannot be."""
    wanted = _check.integer("vertices", vertices, 1)
    if wanted > mesh.n_vertices:
        raise ValueError(f"vertices must be at most {mesh.n_vertices}, as many as the mesh has, not {wanted}")
    least = least_vertices(mesh.connectivity)
    if wanted < least:
        pieces = "" if mesh.n_components == 1 else f", {mesh.n_components} components"
        topology = f"genus {mesh.genus}, {mesh.n_holes} holes{pieces}"
        raise TopologyError(f"vertices must be at least {least}, the fewest with {topology}, not {wanted}")
    if wanted % 2:
        raise ValueError(
            f"vertices must be even, as three edges meet in each and every edge has two ends, not {wanted}"
        )
    return wanted
