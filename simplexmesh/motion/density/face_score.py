"""The refinement score of a face: a product of four dimensionless factors (Delingette, thesis, 1994, section 5.5.2).

The thesis's third factor is the total Gaussian curvature. It vanishes on cylinders, creases and wherever the mesh is
flat, so that faces along the edges of a machined part, and flat ones that span a cavity, would never be refined. Here
it is the bending, the integral of (k1^2 + k2^2) / 2, or squared distance over area where that is larger: the curvature
a face would need to reach the data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.face_geometry import face_centroids, face_normals
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density import _kernels_refine
from simplexmesh.motion.model.adapt import curvedness
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.targets.protocol import target_gaps

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FaceScore:
    """The dimensionless factors of the score of each face, (f,) arrays; holes are included and score 0."""

    area: Array  # over that of the mesh
    elongation: Array  # 1 + (longest - shortest edge) / median edge
    curvature: Array  # integral over the face
    distance: Array  # to the data relative to the reach, 0 to 1; 0 where no data is within reach

    @property
    def total(self) -> Array:
        """(f,) the product of the factors."""
        return self.area * self.elongation * self.curvature * self.distance


def face_distance(mesh: SimplexMesh, target: Target, reach: float) -> Array:
    """Return (f,) the mean distance of a face's vertices to the data, or its centroid's if larger; NaN off data."""
    c = mesh.connectivity
    loops = c.face_vertices, c.face_offsets
    at = np.concatenate([mesh.vertices, face_centroids(mesh.vertices, *loops)])
    along = np.concatenate([mesh.normals, face_normals(mesh.vertices, *loops)])
    gaps = np.abs(target_gaps(target, at, along, reach))
    here, middle = gaps[: mesh.n_vertices][c.face_vertices], gaps[mesh.n_vertices :]
    seen = np.add.reduceat(np.isfinite(here).astype(float), c.face_offsets[:-1])
    with np.errstate(invalid="ignore"):
        mean = np.add.reduceat(np.nan_to_num(here), c.face_offsets[:-1]) / seen
    return np.fmax(mean, middle)


def face_score(mesh: SimplexMesh, away: Array, reach: float) -> FaceScore:
    """Return the score of each face from its distance (f,) to the data, NaN for none, which saturates at `reach`."""
    c = mesh.connectivity
    loops = c.face_vertices, c.face_offsets
    elongation, area = np.zeros(c.face_sizes.size), np.zeros(c.face_sizes.size)
    _kernels_refine.lengths_and_areas(np.asarray(mesh.vertices), *loops, elongation, area)
    area[c.face_is_hole] = 0.0
    away = np.where(c.face_is_hole, 0.0, np.minimum(np.nan_to_num(away), reach))
    bend2 = curvedness(mesh.vertices, mesh.normals, mesh.neighbors) ** 2
    total = area * np.add.reduceat(bend2[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes
    total = np.maximum(total, away**2 / np.maximum(area, np.finfo(float).tiny))
    total[c.face_is_hole] = 0.0
    return FaceScore(area / max(float(area.sum()), np.finfo(float).tiny), elongation, total, away / reach)
