"""What a signature is taken from: points on the surface, and how near to them is seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import mean_edge
from simplexmesh.motion.subjects import PointsSubject, Subject, TrianglesSubject

Array = NDArray[np.float64]

FEWEST_POINTS = 100
FLATTEST = 1e-3
"""Points whose least extent is less than this of the largest lie in a plane."""


def samples(subject: Subject) -> tuple[Array, Array | None]:
    """Return points on the surface, and normals where the data knows them."""
    if isinstance(subject, PointsSubject):
        return subject.cloud.points, subject.cloud.normals
    if isinstance(subject, TrianglesSubject):
        return subject.sampled.points, subject.sampled.normals
    return subject.points, None


def sound(points: Array) -> None:
    """Refuse what cannot carry a signature.

    Raises
    ------
    ValueError
    """
    if len(points) < FEWEST_POINTS:
        raise ValueError(f"data must hold at least {FEWEST_POINTS} points to carry a signature, not {len(points)}")
    extents = np.linalg.svd(points - points.mean(axis=0), full_matrices=False, compute_uv=False)
    if not extents[2] > FLATTEST * extents[0]:
        raise ValueError("data must bend to carry a signature; its points lie in a plane")


def reach_of(points: Array, tree: cKDTree, mesh: SimplexMesh) -> float:
    """Return how far from the data a vertex may be and still be seen."""
    some = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)]
    near = tree.query(some, k=min(5, len(points)), workers=-1)[0][:, -1]
    return max(3.0 * float(np.quantile(near, 0.95)), 0.75 * mean_edge(mesh))
