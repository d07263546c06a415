"""Regularity of the neighbors around a point: distances, angles, balance (Charton 2014, def. 1.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh.surface import _kernels_spread as kernels
from simplexmesh.surface.neighborhoods import Neighborhood, rings
from simplexmesh.surface.normals.estimate import starting_normals
from simplexmesh.surface.reasons import FOUND
from simplexmesh.surface.registry import warn_of_failures
from simplexmesh.surface.sampled_surface import as_sampled_surface


@dataclass(frozen=True, eq=False, repr=False)
class Spread:
    """Regularity of neighborhoods; all three measures are zero in a regular grid of equilateral triangles.

    Attributes
    ----------
    distances : (n,) array of float
        Variance of the neighbors' distances over the square of their mean.
    angles : (n,) array of float
        Variance of the angles between consecutive neighbors in the tangent plane, radians squared; at a border
        including the gap.
    imbalances : (n,) array of float
        Largest distance from a neighbor's mirror image at the center to the nearest neighbor, in the tangent plane,
        over the mean distance: 0 if they come in opposite pairs, 1 and more if they are all on one side.
    failed : (n,) array of bool
        Whether the others are NaN: fewer than two neighbors, or no normal.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> around = sm.spread(sm.sphere(8).triangulated("dual"))
    >>> around
    Spread(642 vertices)
    >>> int((around.imbalances > 0.5).sum())  # the twelve with five neighbors
    12
    """

    distances: Array
    angles: Array
    imbalances: Array
    failed: Mask

    def __repr__(self) -> str:
        return f"Spread({len(self.failed):,} vertices)"


def spread(
    surface: Any,
    *,
    neighborhood: Neighborhood | None = None,
    normals: str | ArrayLike | None = None,
    at: ArrayLike | None = None,
) -> Spread:
    """Measure how regularly the neighbors of each vertex lie around it, on which the accuracy of estimators depends.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
    neighborhood : from `rings`, `ball`, `nearest`, or Neighborhoods, optional
        The neighbors; by default the one-ring, in a cloud the 12 nearest points.
    normals : str or (n, 3) array of float, optional
        Normals of the tangent planes: a method of `vertex_normals`, or directions; by default "area", in clouds their
        own or "plane".
    at : (c,) array of int or (n,) array of bool, optional
        Measure only at these vertices.

    Returns
    -------
    Spread
        `distances`, `angles`, `imbalances`, `failed`.

    Raises
    ------
    ValueError, TypeError
        As `vertex_normals`.

    Warns
    -----
    SimplexMeshWarning
        At how many vertices there are too few neighbors.

    Examples
    --------
    >>> import numpy as np
    >>> import simplexmesh as sm
    >>> x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    >>> grid = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    >>> middle = sm.spread(grid, neighborhood=sm.nearest(4), at=[12])
    >>> middle.distances.round(12), middle.angles.round(12), middle.imbalances.round(12)
    (array([0.]), array([0.]), array([0.]))
    """
    samples = as_sampled_surface(surface)
    around = samples.around(rings(1) if neighborhood is None else neighborhood, at)
    directions = starting_normals(samples, around, "area", normals)
    n = len(around)
    distances, angles, imbalances = np.full((3, n), np.nan)
    reasons = np.zeros(n, np.uint8)
    seen = around.centers, around._rows, samples.points, directions
    kernels.spreads(n, *seen, distances, angles, imbalances, reasons)
    warn_of_failures("the spread of neighbors", reasons, samples, around)
    return Spread(*map(checks.frozen, (distances, angles, imbalances, reasons != FOUND)))
