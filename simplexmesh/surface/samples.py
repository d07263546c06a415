"""What estimators look at: points of a surface, and who is next to whom."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.data.convert import as_data
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface import _kernels_neighborhoods as kernels
from simplexmesh.surface.neighborhoods import Ball, Nearest, Neighborhood, Neighborhoods, Rings

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NEAREST = 12
"""A cloud has no edges: so many nearest points stand for its one-ring."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a surface, with faces where there are any.

    Attributes
    ----------
    points : (n, 3) array of float
    faces : (f, 3) array of int or None
        Triangles, counter-clockwise seen from outside.
    links : Neighborhoods or None
        The one-ring where it does not come from triangles: the three neighbors in a simplex mesh, or what was given.
    outward : (n, 3) array of float or None
        Unit normals known beforehand: those of a cloud, those of a simplex mesh.
    """

    points: Array
    faces: Indices | None = None
    links: Neighborhoods | None = None
    outward: Array | None = None

    @cached_property
    def one_ring(self) -> Neighborhoods:
        """The vertices one edge away, in order; of a cloud the nearest points."""
        if self.links is not None:
            return self.links
        if self.faces is None:
            return self.around(Nearest(min(NEAREST, len(self.points) - 1)))
        offsets, members, closed = kernels.ordered_rings(self.faces, len(self.points))
        return Neighborhoods(np.arange(len(self.points)), offsets, members, closed)

    @cached_property
    def tree(self) -> cKDTree:
        """Of all points."""
        return cKDTree(self.points)

    def around(self, neighborhood: Neighborhood, vertices: ArrayLike | None = None) -> Neighborhoods:
        """Return the neighbors of all points, or of some.

        Parameters
        ----------
        neighborhood : Rings, Ball, Nearest or Neighborhoods
            What was asked for; neighborhoods already made are returned as they are.
        vertices : (c,) array of int, optional
            Analyze these points only.
        """
        n = len(self.points)
        if isinstance(neighborhood, Neighborhoods):
            return neighborhood
        centers = np.arange(n) if vertices is None else _check.selection("vertices", vertices, n)
        if isinstance(neighborhood, Rings):
            if neighborhood.count == 1 and vertices is None:
                return self.one_ring
            ring = self.one_ring
            offsets, members = kernels.rings(ring.offsets, ring.members, centers, neighborhood.count)
        elif isinstance(neighborhood, Nearest):
            count = min(neighborhood.count, n - 1)
            _, found = self.tree.query(self.points[centers], count + 1, workers=-1)
            return _without_centers(centers, found.reshape(len(centers), count + 1))
        elif neighborhood.connected and (self.faces is not None or self.links is not None):
            ring = self.one_ring
            radius = neighborhood.radius
            offsets, members = kernels.reached(ring.offsets, ring.members, self.points, centers, radius)
        else:
            offsets, members = self._in_ball(neighborhood, centers)
        return Neighborhoods(centers, offsets, members, np.zeros(len(centers), bool))

    def _in_ball(self, asked: Ball, centers: Indices) -> tuple[Indices, Indices]:
        found = self.tree.query_ball_point(self.points[centers], asked.radius, workers=-1, return_sorted=True)
        kept = [np.array([j for j in row if j != i], np.int64) for i, row in zip(centers, found, strict=True)]
        offsets = np.concatenate([[0], np.cumsum([len(row) for row in kept])])
        return offsets, np.concatenate(kept)


def _without_centers(centers: Indices, found: Indices) -> Neighborhoods:
    """Neighborhoods of (c, k + 1) nearest points less the center, or the farthest where copies crowd it out."""
    itself = found == centers[:, None]
    itself[~itself.any(axis=1), -1] = True
    members = found[~itself]
    offsets = np.arange(len(centers) + 1) * (found.shape[1] - 1)
    return Neighborhoods(centers, offsets, members, np.zeros(len(centers), bool))


def as_samples(value: Any, name: str = "surface") -> Samples:
    """Return samples made of a triangle mesh, a simplex mesh, a cloud or what can be made into one; nothing is merged.

    Row i of every result belongs to vertex or point i of what was given, so duplicate points stay.

    Raises
    ------
    TypeError
        It is not a surface.
    ValueError, OSError
        Its content cannot be used.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> as_samples(sm.sphere(3)).one_ring
    Neighborhoods(180 centers, 540 neighbors)
    """
    if isinstance(value, Samples):
        return value
    if isinstance(value, tuple | list) and len(value) == 2 and all(np.ndim(part) == 2 for part in value):
        value = TriangleMesh(value[0], value[1])
    elif isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[1] in (3, 6):
        value = PointCloud(value[:, :3], value[:, 3:] if value.shape[1] == 6 else None)
    elif not isinstance(value, PointCloud):
        value = as_data(value, name)
    if isinstance(value, TriangleMesh):
        return Samples(value.vertices, value.faces)
    if isinstance(value, PointCloud):
        return Samples(value.points, outward=value.normals)
    if hasattr(value, "connectivity"):
        links = Neighborhoods.of(value.neighbors, closed=True)
        return Samples(value.vertices, links=links, outward=value.normals)
    what = os.fspath(value) if isinstance(value, os.PathLike) else type(value).__name__
    raise TypeError(f"{name} must be a mesh or points, not {what}")
