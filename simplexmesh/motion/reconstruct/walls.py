"""Walls of which a model is only one sheet: the outer one, with data inside, or one of two layers of data."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Mask
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.targets.triangles import inside_surface

MOST_BEHIND = 0.05
"""Share of the data inside of a model, or in two layers about it, above which a warning is given."""

PATCH, LEAST = 16, 8
"""Points of a patch in the mean, and the fewest that tell whether they are in two layers."""

APART = 0.2
"""Least distance of two layers, in edges of the model: both sides of a solid of which it has both are at none."""


def walls_message(points: Array, away: Array, mesh: SimplexMesh) -> str:
    """Return a message about data (m, 3), `away` (m,) from a closed mesh, much of it inside or in two layers."""
    edge, spacing = mean_edge(mesh), np.sqrt(mesh.area / len(points))
    some = np.random.default_rng(0).choice(len(points), min(len(points), 40_000), replace=False)
    points, away = points[some], away[some]
    inside = inside_surface(points, *fan(mesh.vertices, mesh.connectivity))
    deep = away > max(edge / 2, spacing)
    if (deep & inside).mean() - (deep & ~inside).mean() > MOST_BEHIND:  # noise is as much on both sides
        within = (deep & inside).mean()
        return f"{within:.0%} of the data is inside of the model, as inner walls, spanned holes and stray points are"
    split = in_two_layers(points, np.where(inside, -away, away), APART * edge).mean()
    if split <= MOST_BEHIND:
        return ""
    return (
        f"{split:.0%} of the data lies in two layers of which the model is one sheet, as thin walls, pits or steps too "
        "small for it and scans that do not meet do; more vertices or points may tell the layers apart"
    )


def in_two_layers(points: Array, heights: Array, apart: float) -> Mask:
    """Return the points (m,) of patches whose heights leave a gap over `apart` and half of their range."""
    count = len(points) // PATCH + 1
    patch = cKDTree(points[:count]).query(points, workers=-1)[1]
    size = np.bincount(patch, minlength=count)
    first = np.cumsum(size) - size
    order = np.lexsort((heights, patch))
    sorted_heights, place = heights[order], np.arange(len(points)) - first[patch[order]]
    amid = (place >= 2) & (place <= size[patch[order]] - 2)  # at least two points on either side of the gap
    gap = np.zeros(count)
    np.maximum.at(gap, patch[order][amid], np.diff(sorted_heights, prepend=0.0)[amid])
    extent = (
        sorted_heights[np.minimum(first + size, len(points)) - 1] - sorted_heights[np.minimum(first, len(points) - 1)]
    )
    return np.asarray(((size >= LEAST) & (gap > np.maximum(apart, extent / 2)))[patch])
