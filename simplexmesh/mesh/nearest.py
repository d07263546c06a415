"""How far points are from a surface, found by walking over it from the nearest of its vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.mesh import _kernels_fitting as kernels
from simplexmesh.mesh.fitting import FAR, faces_of
from simplexmesh.mesh.simplex_mesh import SimplexMesh

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

    def largest(self, mesh: SimplexMesh) -> float:
        """Return the largest distance of vertices, face centroids and the middles of fan edges of another mesh."""
        points, triangles = mesh.triangulated().vertices, mesh.triangulated().faces
        middles = [(points[triangles[:, i]] + points[triangles[:, i - 1]]) / 2 for i in (1, 2)]
        _, _, squared = self._found(np.concatenate([points, *middles]))
        return float(np.sqrt(squared.max()))

    def pulled(self, mesh: SimplexMesh, bound: float) -> Array:
        """Return the vertices of another mesh, those farther than a bound put where the surface is closest."""
        vertices = np.array(mesh.vertices)
        places, weights, squared = self._found(vertices)
        corners = [self._mesh.vertices[index[places]] for index in (self._faces.vertices, self._faces.ahead)]
        corners.append(self._middle[self._faces.owner[places]])
        far = squared > bound**2
        closest = sum(weights[:, k, None] * corners[k] for k in range(3))
        return np.asarray(np.where(far[:, None], closest, vertices))

    def _found(self, points: Array) -> tuple[Indices, Array, Array]:
        """Return the corner of the fan triangle where points belong, the weights there, and the squared distances."""
        start = self._face[self._tree.query(points)[1]].astype(np.int32)
        places = kernels.Places(np.zeros(len(points), np.int32), np.zeros((len(points), 3)))
        squared = np.empty(len(points))
        kernels.locate(self._mesh.vertices, self._middle, self._faces, points, start, places, squared)
        far = FAR * float(squared.max())
        kernels.settle(self._mesh.vertices, self._middle, self._faces, points, start, places, squared, far)
        return places.corner, places.weights, squared
