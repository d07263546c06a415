"""A surface compared with a coarser one that stands for it: which faces are too far from each other, and where."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.fitting import Surface
from simplexmesh.mesh.nearest import Nearest
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Pulls(NamedTuple):
    """Points of a coarse surface that should move."""

    triangles: Indices  # (p,) of its fans
    weights: Array  # (p, 3) of their corners
    ways: Array  # (p, 3) to where the surfaces are as far apart as they may be


class Compared(NamedTuple):
    """What is too far."""

    faces: Flags  # (g,) of the coarse mesh
    pulls: Pulls


class Original:
    """A surface with which coarser ones are compared.

    Parameters
    ----------
    mesh : SimplexMesh
        The surface.
    """

    def __init__(self, mesh: SimplexMesh) -> None:
        self.mesh, self.samples = mesh, Surface.of(mesh)
        self._points, self._triangles = fan(mesh.vertices, mesh.connectivity)
        self._nearest = Nearest(self._points, self._triangles)
        self._owner = fan_owners(mesh.connectivity)
        self._rims, self._rim_faces = rims(mesh)
        self._nearest_rim = Nearest(*self._rims) if len(self._rim_faces) else None

    def compared(self, mesh: SimplexMesh, part_of: NDArray[np.integer], distance: float) -> Compared:
        """Return what is farther than a distance, either way, of a mesh whose face `part_of` (f,) each face became.

        Everything else is within it for certain, on all of the fans and on all of the rims.
        """
        c = mesh.connectivity
        points, triangles = fan(mesh.vertices, c)
        nearest = Nearest(points, triangles)
        out = np.zeros(len(c.face_sizes), bool)
        far, here = self._nearest.beyond(points, triangles, distance)
        out[fan_owners(c)[far]] = True
        far, there = nearest.beyond(self._points, self._triangles, distance)
        out[part_of[self._owner[far]]] = True
        if self._nearest_rim is not None:
            new, faces = rims(mesh)
            out[faces[self._nearest_rim.beyond(*new, distance)[0]]] = True
            out[part_of[self._rim_faces[Nearest(*new).beyond(*self._rims, distance)[0]]]] = True
        return Compared(out, self._pulls(nearest, here, there, distance))

    def _pulls(self, nearest: Nearest, here: Array, there: Array, distance: float) -> Pulls:
        """Return how points `here`, of the coarse surface, and those closest to points `there` should move."""
        ends = self._nearest.closest_points(here)[0]
        starts = nearest.closest_points(there)[0]
        triangles, weights, _ = nearest.places(np.concatenate([here, starts]))
        ways = np.concatenate([ends - here, there - starts])
        length = np.linalg.norm(ways, axis=1, keepdims=True)
        return Pulls(triangles, weights, ways * np.maximum(1 - distance / np.maximum(length, distance), 0))

    def distances(self, mesh: SimplexMesh) -> tuple[float, float]:
        """Return the rms and the largest distance of samples to a mesh, those on rims to the rims in the latter."""
        s = self.samples
        found = Nearest(*fan(mesh.vertices, mesh.connectivity)).distances(s.points)
        largest = float(found.max())
        if self._nearest_rim is not None:
            largest = max(largest, float(Nearest(*rims(mesh)[0]).distances(s.rim_points).max()))
        area = max(float(s.weights.sum()), np.finfo(float).tiny)
        return float(np.sqrt((s.weights * found**2).sum() / area)), largest


def fan_owners(connectivity: Connectivity) -> Indices:
    """Return the face of each triangle of the fans."""
    c = connectivity
    return np.repeat(np.arange(len(c.face_sizes)), np.where(c.face_is_hole, 0, c.face_sizes))


def rims(mesh: SimplexMesh) -> tuple[tuple[Array, Indices], Indices]:
    """Return the edges on holes, as points and triangles (r, 3) whose last two corners are one, and their faces."""
    c = mesh.connectivity
    on_hole = np.flatnonzero(np.repeat(c.face_is_hole, c.face_sizes))
    ends = [c.face_vertices[on_hole], face_geometry.following(c.face_vertices, c.face_offsets)[on_hole]]
    used, edges = np.unique(ends, return_inverse=True)
    one, other = edges.reshape(2, -1)
    faces = c.face.reshape(-1)[c.twin.reshape(-1)[c.face_darts[on_hole]]]
    return (mesh.vertices[used], np.stack([one, other, other], axis=1)), faces.astype(np.int64)
