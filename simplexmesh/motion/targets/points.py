"""A cloud of points, noisy or not: the surface it was measured on."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.data.convert import as_points
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.targets import _kernels_nearest, _kernels_points
from simplexmesh.motion.targets.borders import Border, border_of_points
from simplexmesh.motion.targets.door import BuiltIn, checked
from simplexmesh.motion.targets.surfels import Surfels, fitted_surfels

Array = NDArray[np.float64]


class SurfelTarget(BuiltIn):
    """The surface that surfels describe; what `Points` and `LabelSurface` have in common.

    Remembers what was nearest to each vertex, and how far it may move before that must be found anew: the answer does
    not depend on it.

    Attributes
    ----------
    surfels : Surfels
        In coordinates relative to `center`.
    center : (3,) array of float
    """

    surfels: Surfels
    center: Array

    def _set(self, surfels: Surfels, center: Array) -> None:
        self.surfels, self.center = surfels, center
        self._memory = _kernels_nearest.nothing_kept(0)

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the signed distance along each normal to the surface of the data, NaN beyond `reach`.

        Parameters
        ----------
        vertices, normals : (n, 3) array of float
            Unit normals, outward.
        reach : float
            How far to look either way, in the data's unit; infinity for any distance.

        Returns
        -------
        (n,) array of float
            Positive where the surface is outside of the vertex. NaN also beside the data (over its holes) and where
            the data only faces another way (more than 78 degrees from the normal).
        """
        vertices, normals, reach = checked(vertices, normals, reach)
        s, out = self.surfels, np.zeros(len(vertices))
        search = reach + s.spacing
        memory = self._memory  # by a name of its own: another thread may ask about another mesh
        if len(memory[0]) != len(vertices):
            kept = _kernels_nearest.nothing_kept(len(vertices))
            surfels = s.tree.points, s.heads, s.oriented
            _kernels_nearest.carry_over(vertices, normals, self.center, search**2, *surfels, memory, kept)
            self._memory = memory = kept
        _kernels_points.surfel_gaps(
            vertices,
            normals,
            self.center,
            reach,
            search,
            s.heads,
            s.tree.points,
            s.neighbors,
            s.patches,
            s.wide,
            s.oriented,
            memory,
            out,
        )
        return out

    def beyond(self, places: Array, distance: float) -> NDArray[np.bool_]:
        """Return (n,) whether places are farther than a distance from all the data, wherever its surface would go on.

        Where the noise is large the surface found reaches out past its border, and `gap` with it.
        """
        if not np.isfinite(self.surfels.horizon).any():
            return np.zeros(len(places), bool)
        nearest, _ = self.surfels.tree.nearest(np.asarray(places) - self.center, 1)
        between = 0.5 * float(np.quantile(self.surfels.horizon[np.isfinite(self.surfels.horizon)], 0.9))
        return np.asarray(nearest[:, 0] > distance + between)

    @property
    def noise(self) -> float:
        """Standard deviation of the data about the surface found, along its normal; in the data's unit."""
        return float(np.median(self.surfels.noise))

    def samples(self) -> tuple[Array, Array]:
        """Return points (m, 3) on the surface found, freed of noise, and unit normals (m, 3) there."""
        return self.surfels.table[:, :3] + self.center, self.surfels.table[:, 3:6].copy()


class Points(SurfelTarget):
    """The surface that points were measured on, without their noise.

    The cloud is turned into small quadratic pieces of surface, each a robust fit to the points around, over a
    neighborhood sized from the data's own noise, density and shape; between the pieces one blends into the next.
    Nothing need be known about noise, density or normals. Normals, when the cloud has them, tell the two walls of a
    thin sheet apart and which way is out.

    Parameters
    ----------
    cloud : PointCloud or whatever one can be made of
        (n, 3) points, (n, 6) with normals, PyVista or trimesh objects, a path; of a surface, its vertices and normals.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> square = np.column_stack([rng.uniform(-1, 1, (2000, 2)), rng.normal(0, 0.02, 2000)])
    >>> target = Points(square)
    >>> up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    >>> bool(abs(target.gap(np.array([[0, 0, -0.1], [0, 0, 3.0]]), up, reach=1.0)[0] - 0.1) < 0.01)
    True
    """

    def __init__(self, cloud: Any) -> None:
        if isinstance(cloud, np.ndarray) and cloud.shape[1:] == (3,):
            cloud = PointCloud(cloud)  # copies of points change nothing here: no need to look for them
        self.cloud = cloud if isinstance(cloud, PointCloud) else as_points(cloud, "cloud")
        center = self.cloud.points.mean(axis=0)
        self._set(fitted_surfels(self.cloud.points - center, self.cloud.normals), center)

    @cached_property
    def border(self) -> Border:
        """The points where the cloud ends; rims of a mesh are drawn there."""
        return border_of_points(self.cloud.points)

    def oriented_by(self, directions: ArrayLike | Callable[[Array], Any]) -> Points:
        """Return the target of the same points with their outsides known.

        Parameters
        ----------
        directions : (n, 3) array of float or function
            A rough outward direction at each point of the cloud, of any length, or a function that takes (n, 3)
            points to such directions. Points with direction zero are left out.
        """
        points = self.cloud.points
        given = directions(points) if callable(directions) else directions
        outward = _check.array("directions", given, (len(points), 3))
        known = outward.any(axis=1)
        return Points(PointCloud(points[known], outward[known]))
