"""Surface samples that a signature is fitted to, and the distance up to which a vertex counts as visible."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import mean_edge
from simplexmesh.motion.subjects import PointsSubject, Subject, TrianglesSubject

Array = NDArray[np.float64]

FEWEST_POINTS = 100
MINIMUM_EXTENT = 1e-3
"""Least ratio of the smallest to the largest principal extent; points below it lie in a plane."""


def samples(subject: Subject) -> tuple[Array, Array | None]:
    """Return points (n, 3) on the surface, and their normals where the data has them."""
    if isinstance(subject, PointsSubject):
        return subject.cloud.points, subject.cloud.normals
    if isinstance(subject, TrianglesSubject):
        return subject.sampled.points, subject.sampled.normals
    return subject.points, None


def check_samples(points: Array) -> None:
    """Require enough points that are not coplanar.

    Raises
    ------
    ValueError
    """
    if len(points) < FEWEST_POINTS:
        raise ValueError(f"data must hold at least {FEWEST_POINTS} points to carry a signature, not {len(points)}")
    extents = np.linalg.svd(points - points.mean(axis=0), full_matrices=False, compute_uv=False)
    if not extents[2] > MINIMUM_EXTENT * extents[0]:
        raise ValueError("data must bend to carry a signature; its points lie in a plane")


def visibility_threshold(points: Array, tree: cKDTree, mesh: SimplexMesh) -> float:
    """Return the largest distance from the data at which a vertex is visible, from sample spacing and edge length."""
    sample = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)]
    distance = tree.query(sample, k=min(5, len(points)), workers=-1)[0][:, -1]
    return max(3.0 * float(np.quantile(distance, 0.95)), 0.75 * mean_edge(mesh))
