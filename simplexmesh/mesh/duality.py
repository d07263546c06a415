"""The simplex mesh dual to a triangulation: a vertex for each triangle and border edge, a face for each vertex."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import counted, warn
from simplexmesh._base.units import InUnits
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.manifold import matched, oriented
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.numerics.blending import blended


def _vertices_and_faces(triangles: Any) -> tuple[Array, Indices]:
    """Return the checked vertices and faces of a pair of arrays or of a mesh (ours, trimesh's, Open3D's, PyVista's)."""
    if isinstance(triangles, tuple | list) and len(triangles) == 2:
        vertices, faces = triangles
    elif hasattr(triangles, "regular_faces"):
        vertices, faces = triangles.points, triangles.regular_faces
    elif hasattr(triangles, "vertices") and (hasattr(triangles, "faces") or hasattr(triangles, "triangles")):
        faces = triangles.faces if hasattr(triangles, "faces") else np.asarray(triangles.triangles)
        vertices = np.asarray(triangles.vertices)
    else:
        hint = ": sm.read_triangles reads a file" if isinstance(triangles, str | os.PathLike) else ""
        raise TypeError(f"triangles must be (vertices, faces) or have both, not {checks.type_name(triangles)}{hint}")
    vertices = checks.array("triangles.vertices", vertices, (None, 3))
    faces = checks.array("triangles.faces", faces, (None, 3), np.int64)
    if not len(faces):
        raise ValueError("triangles must have at least one face, not none")
    return vertices, checks.indices("triangles.faces", faces, (None, 3), len(vertices))


def dual(triangles: Any, *, outward: bool = True) -> SimplexMesh:
    """Return the simplex mesh dual to a triangulation, closed or open.

    Vertex `t` is the centroid of triangle `t`, and its dart `j` crosses the triangle's edge from corner `j` to corner
    `j + 1`. They are followed by one vertex for each border edge, at its midpoint, whose neighbors are the triangle
    and the previous and next border edge; each border is a hole face.

    Flaws that can be repaired safely are, with a warning: triangles with a repeated corner and duplicate triangles
    are dropped, triangles oriented against their neighbors are flipped, and a vertex where several sheets touch is
    split. Unused vertices are ignored.

    Parameters
    ----------
    triangles : pair of arrays or object
        `(vertices, faces)` of shapes (v, 3) and (t, 3), or an object with `vertices` and `faces`.
    outward : bool
        Flip closed components that are inside out. Without it the orientation given is kept, as the inner wall of a
        cavity needs.

    Returns
    -------
    SimplexMesh
        With one vertex for each triangle kept and each border edge, and the named arrays of a `TriangleMesh` there.

    Raises
    ------
    TopologyError
        Where an edge has more than two triangles, or a component has no consistent orientation.
    ValueError
        When there is no triangle, or one with a vertex index out of range.

    Warns
    -----
    SimplexMeshWarning
        Listing the repairs.

    References
    ----------
    H. Delingette, thesis, 1994, sections 2.2 and 2.3, table 2.2.

    Examples
    --------
    >>> octahedron = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    >>> faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    >>> dual((octahedron, faces))
    SimplexMesh(8 vertices, 6 faces, genus 0, 0 holes)
    >>> dual((octahedron, faces[:4]))
    SimplexMesh(8 vertices, 5 faces, genus 0, 1 holes)
    """
    checks.flag("outward", outward)
    vertices, faces = _vertices_and_faces(triangles)
    faces, mates, repairs = matched(faces)
    faces, mates, flipped = oriented(vertices, faces, mates, outward=outward)
    connectivity = _dual_connectivity(mates)
    repairs += flipped + _split_vertices(faces, connectivity)
    if repairs:
        warn("triangles repaired: " + ", ".join(repairs))
    border = np.flatnonzero(mates.ravel() < 0)
    ends = np.stack([faces[border // 3, (border + j) % 3] for j in (0, 1)], axis=1)
    positions = np.concatenate([vertices[faces].mean(axis=1), vertices[ends].mean(axis=1)])
    unit, data = None, {}
    if isinstance(triangles, InUnits):
        unit, arrays = triangles.unit, getattr(triangles, "data", {})
        data = blended(arrays, np.concatenate([np.tile(faces, 2), np.tile(ends, 3)]), np.ones((len(positions), 6)))
    return SimplexMesh(positions, connectivity, data, unit)


def _dual_connectivity(mates: Indices) -> Connectivity:
    """Return the connectivity of the dual, given the opposite of each half-edge, -1 on a border."""
    n = len(mates)
    twin = mates.ravel()
    border = np.flatnonzero(twin < 0)
    if not len(border):
        return Connectivity(mates)  # type: ignore[arg-type]
    number = np.full(twin.size, -1)
    number[border] = np.arange(n, n + len(border))
    after = number[_next_on_border(twin, border)]
    here = number[border]
    twin = np.concatenate([np.where(twin < 0, 3 * number, twin), np.zeros(3 * len(border), np.int64)])
    twin[3 * here] = border
    twin[3 * here + 2] = 3 * after + 1
    twin[3 * after + 1] = 3 * here + 2
    return Connectivity(twin.reshape(-1, 3), 3 * here + 1)  # type: ignore[arg-type]


def _next_on_border(mates: Indices, border: Indices) -> Indices:
    """Return the next border half-edge of each one, rotating about its end, so that sheets that touch stay apart."""
    current = border.copy()
    turning = np.arange(len(border))
    while len(turning):
        at = current[turning]
        step = 3 * (at // 3) + (at + 1) % 3
        current[turning] = np.where(mates[step] < 0, step, mates[step])
        turning = turning[mates[step] >= 0]
    return current


def _split_vertices(faces: Indices, connectivity: Connectivity) -> list[str]:
    """Return a phrase for the repair of vertices where sheets touch, which became several faces, if any."""
    source = np.full(len(connectivity.face_sizes), -1)
    source[connectivity.face[: len(faces)]] = np.roll(faces, -1, axis=1)
    split = np.flatnonzero(np.bincount(source[source >= 0]) > 1)
    if not len(split):
        return []
    return [f"split {counted(len(split), 'vertex', 'vertices')} where sheets touch, the first being {split[0]}"]
