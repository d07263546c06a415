"""The refinement score of a face: a product of four dimensionless factors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh.face_geometry import face_centroids, face_gauss, face_normals
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion import _kernels_refine
from simplexmesh.motion.adapt import curvedness
from simplexmesh.motion.state import Target
from simplexmesh.motion.targets.protocol import target_gaps

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FaceScore:
    """The dimensionless factors of the score of each face, (f,) arrays; holes are included and score 0.

    Attributes
    ----------
    area : (f,) array of float
        Area of the face over that of the mesh.
    elongation : (f,) array of float
        1 + (longest - shortest edge) / median edge.
    curvature : (f,) array of float
        Integral of curvature over the face, in steradians.
    distance : (f,) array of float
        Distance to the data relative to the reach, 0 to 1; 0 where no data is within reach.
    """

    area: Array
    elongation: Array
    curvature: Array
    distance: Array

    @property
    def total(self) -> Array:
        """(f,) the product of the factors."""
        return self.area * self.elongation * self.curvature * self.distance


def face_distance(mesh: SimplexMesh, target: Target, reach: float) -> Array:
    """Return the distance of each face to the data, in its unit, NaN where none of it has data within reach.

    The mean over its vertices, or the distance at its centroid if that is larger: a face with vertices on a curved
    surface is farthest from it at the center.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    reach : float
        Search distance for data along the normals of vertices and faces.

    Returns
    -------
    (f,) array of float

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball, egg = sm.sphere(6), sm.ellipsoid((1, 1, 1.2), 12)
    >>> away = face_distance(ball, sm.targets.Triangles(egg.triangulated()), reach=0.5)
    >>> bool(0.15 < away.max() < 0.25)
    True
    """
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


def face_score(mesh: SimplexMesh, away: Array, reach: float, *, curvature: str = "bending") -> FaceScore:
    """Return the refinement score of each face: relative area x elongation x curvature x relative distance.

    The thesis's third factor is the total Gaussian curvature, the solid angle of the normals. It vanishes on cylinders,
    creases and wherever the mesh is flat, so that faces along the edges of a machined part, and flat ones that span a
    cavity, would never be refined. By default it is replaced by the bending, the integral of (k1^2 + k2^2) / 2, equal
    on a sphere and never less than the absolute Gaussian measure elsewhere, or by squared distance over area where that
    is larger: the curvature a face would need to reach the data.

    Parameters
    ----------
    mesh : SimplexMesh
    away : (f,) array of float
        Distance of each face to the data from `face_distance`; NaN counts as 0.
    reach : float
        Distance at which the fourth factor saturates, in the same unit.
    curvature : {"bending", "gauss"}
        The third factor: as above, or as in the thesis.

    Returns
    -------
    FaceScore

    References
    ----------
    H. Delingette, thesis, 1994, section 5.5.2.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> score = face_score(ball, np.full(ball.connectivity.face_sizes.size, 0.01), reach=0.5)
    >>> float(score.area.sum().round(6)), bool(np.isclose(score.curvature.sum(), 4 * np.pi, rtol=0.02))
    (1.0, True)
    """
    c = mesh.connectivity
    loops = c.face_vertices, c.face_offsets
    elongation, area = np.zeros(c.face_sizes.size), np.zeros(c.face_sizes.size)
    _kernels_refine.lengths_and_areas(np.asarray(mesh.vertices), *loops, elongation, area)
    area[c.face_is_hole] = 0.0
    away = np.where(c.face_is_hole, 0.0, np.minimum(np.nan_to_num(away), reach))
    if curvature == "gauss":
        total = np.abs(face_gauss(mesh.normals, *loops))
    else:
        bend2 = curvedness(mesh.vertices, mesh.normals, mesh.neighbors) ** 2
        total = area * np.add.reduceat(bend2[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes
        total = np.maximum(total, away**2 / np.maximum(area, np.finfo(float).tiny))
    total[c.face_is_hole] = 0.0
    return FaceScore(area / max(float(area.sum()), np.finfo(float).tiny), elongation, total, away / reach)
