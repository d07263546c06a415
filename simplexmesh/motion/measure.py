"""Distances between a fitted mesh and its data, with warnings about a poor fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.errors import warn
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.distance import Distance, Summary
from simplexmesh.motion.subjects import MOST_POINTS, Subject
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance

Array = NDArray[np.float64]

MOST_UNSEEN = 0.25
"""Fraction of the model without data nearby above which a warning is given."""

MOST_MISSED = 0.05
"""Fraction of the data without model nearby above which a warning is given."""

FAR = 0.04
"""In diagonals of the data: beyond any noise."""


def measured(mesh: SimplexMesh, subject: Subject, reach: float, *, dropped: bool = False) -> tuple[Distance, Array]:
    """Return the distances between a mesh and its data, both ways, and (n,) that of each vertex to the data.

    For a vertex without data along its normal within `reach` it is the distance to the nearest point of the data.
    `dropped` tells whether the start omitted pieces of the data, for the warning.
    """
    points = subject.points
    if len(points) > MOST_POINTS:
        points = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
    gaps = subject.target.gap(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.normals), reach)
    unmatched = np.isnan(gaps)
    vertex_distances = np.abs(gaps)
    vertex_distances[unmatched] = cKDTree(points).query(mesh.vertices[unmatched], workers=-1)[0]
    surface = mesh.triangulated(method="fan")
    point_distances = surface_distance(points, surface.vertices, surface.faces)
    enclosed = np.zeros(0, dtype=np.int64)
    if not mesh.n_holes:
        far = np.flatnonzero(point_distances > reach)
        enclosed = far[inside_surface(points[far], surface.vertices, surface.faces)]
    distance = Distance(
        Summary.of(vertex_distances), Summary.of(point_distances), Summary.of(point_distances[enclosed])
    )
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    limit = max(reach, FAR * diagonal)
    missed = np.count_nonzero(np.delete(point_distances, enclosed) > limit) / max(len(points), 1)
    _warn_of_poor_fit(float((vertex_distances > limit).mean()), missed, mesh.n_holes == 0, dropped)
    return distance, vertex_distances


def _warn_of_poor_fit(unseen: float, missed: float, closed: bool, dropped: bool) -> None:  # noqa: FBT001
    """Warn when much of the model has no data nearby, or much of the data no model nearby."""
    if unseen > MOST_UNSEEN:
        hint = "; where the data is an open surface, give init='plane'" if closed else ""
        warn(f"{unseen:.0%} of the model is far from any data{hint}")
    if missed > MOST_MISSED:
        hint = "components='all' keeps all its pieces" if dropped else "more vertices or another start may reach it"
        warn(f"{missed:.0%} of the data is far from the model; {hint}")
