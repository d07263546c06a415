"""Two-sided comparison of a surface with a coarser approximation: faces beyond a distance, and corrections."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.fitting import SurfaceSamples
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangle_tree import TriangleTree
from simplexmesh.mesh.triangulation import fan

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Corrections(NamedTuple):
    """Displacements wanted at points of the coarse surface."""

    triangles: Indices  # (p,) fan triangles of the points
    weights: Array  # (p, 3) barycentric coordinates in them
    displacements: Array  # (p, 3) that reduce the distance to the tolerance


class Comparison(NamedTuple):
    """The parts of a coarse mesh that are beyond the tolerance."""

    faces: Flags  # (g,) of the coarse mesh
    corrections: Corrections


class Original:
    """The surface with which coarser ones are compared.

    Parameters
    ----------
    mesh : SimplexMesh
        The surface.
    """

    def __init__(self, mesh: SimplexMesh) -> None:
        self.mesh, self.samples = mesh, SurfaceSamples.of(mesh)
        self._points, self._triangles = fan(mesh.vertices, mesh.connectivity)
        self._tree = TriangleTree(self._points, self._triangles)
        self._owner = fan_owners(mesh.connectivity)
        self._rims, self._rim_faces = rims(mesh)
        self._rim_tree = TriangleTree(*self._rims) if len(self._rim_faces) else None

    def compare(self, mesh: SimplexMesh, part_of: NDArray[np.integer], distance: float) -> Comparison:
        """Return the faces of a coarse mesh that are beyond a distance of this surface, in either direction.

        Face f of this surface was merged into face `part_of[f]`. All others are certainly within it, rims included.
        """
        c = mesh.connectivity
        points, triangles = fan(mesh.vertices, c)
        tree = TriangleTree(points, triangles)
        out = np.zeros(len(c.face_sizes), bool)
        far, here = self._tree.beyond(points, triangles, distance)
        out[fan_owners(c)[far]] = True
        far, there = tree.beyond(self._points, self._triangles, distance)
        out[part_of[self._owner[far]]] = True
        if self._rim_tree is not None:
            coarse_rims, faces = rims(mesh)
            out[faces[self._rim_tree.beyond(*coarse_rims, distance)[0]]] = True
            far, _ = TriangleTree(*coarse_rims).beyond(*self._rims, distance)
            out[part_of[self._rim_faces[far]]] = True
        return Comparison(out, self._corrections(tree, here, there, distance))

    def _corrections(self, tree: TriangleTree, here: Array, there: Array, distance: float) -> Corrections:
        """Return the displacements of far points `here` on the coarse surface, and of those closest to `there`."""
        ends = self._tree.closest_points(here)[0]
        starts = tree.closest_points(there)[0]
        triangles, weights, _ = tree.closest(np.concatenate([here, starts]))
        gaps = np.concatenate([ends - here, there - starts])
        length = np.linalg.norm(gaps, axis=1, keepdims=True)
        return Corrections(triangles, weights, gaps * np.maximum(1 - distance / np.maximum(length, distance), 0))

    def distances(self, mesh: SimplexMesh) -> tuple[float, float]:
        """Return the rms and the largest distance of the samples to a mesh; the largest includes rim to rim."""
        s = self.samples
        found = TriangleTree(*fan(mesh.vertices, mesh.connectivity)).distances(s.points)
        largest = float(found.max())
        if self._rim_tree is not None:
            largest = max(largest, float(TriangleTree(*rims(mesh)[0]).distances(s.rim_points).max()))
        area = max(float(s.weights.sum()), np.finfo(float).tiny)
        return float(np.sqrt((s.weights * found**2).sum() / area)), largest


def fan_owners(connectivity: Connectivity) -> Indices:
    """Return the face of each fan triangle."""
    c = connectivity
    return np.repeat(np.arange(len(c.face_sizes)), np.where(c.face_is_hole, 0, c.face_sizes))


def rims(mesh: SimplexMesh) -> tuple[tuple[Array, Indices], Indices]:
    """Return the edges on holes, as points and degenerate triangles (r, 3), and the face of each."""
    c = mesh.connectivity
    on_hole = np.flatnonzero(np.repeat(c.face_is_hole, c.face_sizes))
    ends = [c.face_vertices[on_hole], face_geometry.following(c.face_vertices, c.face_offsets)[on_hole]]
    used, edges = np.unique(ends, return_inverse=True)
    one, other = edges.reshape(2, -1)
    faces = c.face.reshape(-1)[c.twin.reshape(-1)[c.face_darts[on_hole]]]
    return (mesh.vertices[used], np.stack([one, other, other], axis=1)), faces.astype(np.int64)
