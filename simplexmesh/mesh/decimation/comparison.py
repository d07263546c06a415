"""Two-sided comparison of a surface with a coarser approximation: faces beyond a distance, and corrections."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.decimation import _kernels_fitting as kernels
from simplexmesh.mesh.decimation.certified import Surface
from simplexmesh.mesh.decimation.fitting import SurfaceSamples
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan


class Corrections(NamedTuple):
    """Displacements wanted at points of the coarse surface."""

    triangles: Indices  # (p,) fan triangles of the points
    weights: Array  # (p, 3) barycentric coordinates in them
    displacements: Array  # (p, 3) that reduce the distance to the tolerance


class Comparison(NamedTuple):
    """The parts of a coarse mesh that are beyond the tolerance."""

    faces: Mask  # (g,) of the coarse mesh
    corrections: Corrections


class Original:
    """The surface with which coarser ones are compared."""

    def __init__(self, mesh: SimplexMesh) -> None:
        self.samples = SurfaceSamples.of(mesh)
        self._surface, self._owner = Surface(*fan(mesh.vertices, mesh.connectivity)), fan_owners(mesh.connectivity)
        self._rims, self._rim_faces = rims(mesh)

    def compare(self, mesh: SimplexMesh, part_of: NDArray[np.integer], distance: float) -> Comparison:
        """Return what of a coarse mesh is not certainly within a distance, either way and from rim to rim."""
        one, other = self._surface, Surface(*fan(mesh.vertices, mesh.connectivity))
        out = np.zeros(len(mesh.connectivity.face_sizes), bool)
        far, here = one.beyond(other.points, other.triangles, distance)
        out[fan_owners(mesh.connectivity)[far]] = True
        far, there = other.beyond(one.points, one.triangles, distance)
        out[part_of[self._owner[far]]] = True
        if len(self._rim_faces):
            coarse_rims, faces = rims(mesh)
            out[faces[self._rims.beyond(coarse_rims.points, coarse_rims.triangles, distance)[0]]] = True
            far, _ = coarse_rims.beyond(self._rims.points, self._rims.triangles, distance)
            out[part_of[self._rim_faces[far]]] = True
        return Comparison(out, self._corrections(other, here, there, distance))

    def _corrections(self, coarse: Surface, here: Array, there: Array, distance: float) -> Corrections:
        """Return the displacements of far points `here` on the coarse surface, and of those closest to `there`."""
        ends, starts = self._surface.closest(here)[1], coarse.closest(there)[1]
        points = np.concatenate([here, starts])
        triangles = coarse.closest(points)[0]
        weights = kernels.barycentric(coarse.points, coarse.triangles, triangles, points)
        gaps = np.concatenate([ends - here, there - starts])
        length = norm(gaps)[:, None]
        return Corrections(triangles, weights, gaps * np.maximum(1 - distance / np.maximum(length, distance), 0))


def sample_distances(samples: SurfaceSamples, mesh: SimplexMesh) -> tuple[float, float]:
    """Return the rms and the largest distance of the samples to a mesh; the largest includes rim to rim."""
    found = Surface(*fan(mesh.vertices, mesh.connectivity)).closest(samples.points)[2]
    on_rims = rims(mesh)[0].closest(samples.rim_points)[2]
    area = max(float(samples.weights.sum()), np.finfo(float).tiny)
    return float(np.sqrt((samples.weights * found**2).sum() / area)), float(max(found.max(), on_rims.max(initial=0)))


def fan_owners(connectivity: Connectivity) -> Indices:
    """Return the face of each fan triangle."""
    c = connectivity
    return np.repeat(np.arange(len(c.face_sizes)), np.where(c.face_is_hole, 0, c.face_sizes))


def rims(mesh: SimplexMesh) -> tuple[Surface, Indices]:
    """Return the edges on holes, as degenerate triangles, and the face of each."""
    c = mesh.connectivity
    on_hole = np.flatnonzero(np.repeat(c.face_is_hole, c.face_sizes))
    ends = [c.face_vertices[on_hole], face_geometry.following(c.face_vertices, c.face_offsets)[on_hole]]
    used, edges = np.unique(ends, return_inverse=True)
    one, other = edges.reshape(2, -1)
    faces = c.face.reshape(-1)[c.twin.reshape(-1)[c.face_darts[on_hole]]]
    return Surface(mesh.vertices[used], np.stack([one, other, other], axis=1)), faces.astype(np.int64)
