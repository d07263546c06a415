"""How far points are from a surface, found by walking over it from the nearest of its vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.mesh import _kernels_fitting as kernels
from simplexmesh.mesh.fitting import FAR, faces_of
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan

Array = NDArray[np.float64]
Indices = NDArray[np.int32]


class Nearest:
    """A surface to which distances are asked for.

    Parameters
    ----------
    mesh : SimplexMesh
        The surface.
    """

    def __init__(self, mesh: SimplexMesh) -> None:
        c = mesh.connectivity
        self._mesh, self._faces, self._tree = mesh, faces_of(c), cKDTree(mesh.vertices)
        self._middle = np.empty((len(c.face_sizes), 3))
        kernels.centroids(mesh.vertices, self._faces, self._middle)
        solid = ~c.face_is_hole[c.vertex_faces]
        self._face = np.where(solid.any(axis=1), c.vertex_faces[np.arange(len(solid)), solid.argmax(axis=1)], 0)

    def distances(self, points: Array) -> Array:
        """Return how far points (p, 3) are from the surface."""
        return np.sqrt(self._found(points)[2])

    def faces_beyond(self, mesh: SimplexMesh, distance: float) -> NDArray[np.bool_]:
        """Return (g,) which faces of another mesh are farther than that, at a vertex, the centroid, or between."""
        c = mesh.connectivity
        points, triangles = fan(mesh.vertices, c)
        corners = [points[triangles[:, i]] for i in range(3)]
        far = self.distances(points) > distance
        out = np.zeros(len(c.face_sizes), bool)
        owner = np.repeat(np.arange(len(out)), c.face_sizes)[np.repeat(~c.face_is_hole, c.face_sizes)]
        out[owner[far[triangles].any(axis=1)]] = True
        for i in (1, 2):
            out[owner[self.distances((corners[i] + corners[i - 1]) / 2) > distance]] = True
        return out

    def _found(self, points: Array) -> tuple[Indices, Array, Array]:
        """Return the corner of the fan triangle where points belong, the weights there, and the squared distances."""
        start = self._face[self._tree.query(points)[1]].astype(np.int32)
        places = kernels.Places(np.zeros(len(points), np.int32), np.zeros((len(points), 3)))
        squared = np.empty(len(points))
        kernels.locate(self._mesh.vertices, self._middle, self._faces, points, start, places, squared)
        far = FAR * float(squared.max())
        kernels.settle(self._mesh.vertices, self._middle, self._faces, points, start, places, squared, far)
        return places.corner, places.weights, squared
