"""The target of point clouds, noisy or not: the surface they were sampled from."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh.data.conversion import as_points
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.targets.borders import Border, border_of_points
from simplexmesh.motion.targets.protocol import BuiltInTarget, checked_arguments
from simplexmesh.motion.targets.surfels import _kernels_gaps
from simplexmesh.motion.targets.surfels.surfels import Surfels, fitted_surfels
from simplexmesh.numerics.kd_tree import nearest

DETAIL = 0.4
"""Size of a detail, in radii of the fits that show it: smaller faces pile up and fold on rims that noise blurs."""


class SurfelTarget(BuiltInTarget):
    """The surface that surfels fitted to points describe; common base of `Points` and `LabelSurface`.

    The nearest surfels of each vertex are cached between calls, which does not affect the results.

    Parameters
    ----------
    points : (n, 3) array of float
        Points, noisy or not.
    normals : (n, 3) array of float, optional
        Outward normals.
    errors : (n, 3) array of float, optional
        One standard deviation of the error of each point, along its direction, if that is known.

    Attributes
    ----------
    center : (3,) array of float
        The mean of the data, about which its surface is described.
    """

    def __init__(self, points: Array, normals: Array | None = None, errors: Array | None = None) -> None:
        self.center: Array = points.mean(axis=0)
        self._take(fitted_surfels(points - self.center, normals, errors))

    def _take(self, surfels: Surfels) -> None:
        """Be the surface of surfels relative to the center."""
        self._surfels = surfels
        self._spacing = self._surfels.spacing(0.99)

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the signed distance along each normal to the surface of the data, NaN beyond `reach`.

        Parameters
        ----------
        vertices, normals : (n, 3) array of float
            Unit normals, outward.
        reach : float
            Maximum distance in either direction, in the data's unit; may be infinite.

        Returns
        -------
        (n,) array of float
            Positive where the surface is outside of the vertex. NaN also beside the data (over its holes) and where the
            data only faces another way (more than 78 degrees from the normal).
        """
        vertices, normals, reach = checked_arguments(vertices, normals, reach)
        s, out = self._surfels, np.zeros(len(vertices))
        search = reach + self._spacing
        cache = vars(self).pop("_cache", None)  # no other thread shall use it meanwhile
        if cache is None or len(cache.known) != len(vertices):
            cache = _kernels_gaps.empty_cache(len(vertices))
        _kernels_gaps.surfel_gaps(len(vertices), vertices, normals, self.center, reach, search, s, cache, out)
        self._cache = cache
        return out

    def beyond(self, places: Array, reach: float) -> Mask:
        """Return (n,) bool: whether places are farther than a distance from all data points.

        With large noise the fitted surface, and `gap` with it, extends beyond the border of the data.
        """
        nearest_surfel, _ = nearest(self._surfels, np.asarray(places) - self.center, 1)
        return np.asarray(nearest_surfel[:, 0] > reach + 0.5 * self._surfels.spacing(0.9))

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) array of float: lowest and highest coordinates of the fitted surface."""
        places = self._surfels.table[:, :3]
        return np.stack([places.min(axis=0), places.max(axis=0)]) + self.center

    @property
    def noise(self) -> float:
        """Standard deviation of the data about the fitted surface, along its normal, in the data's unit."""
        return float(np.median(self._surfels.noise))

    def samples(self) -> tuple[Array, Array]:
        """Return points (m, 3) on the fitted surface and unit normals (m, 3) there."""
        return self._surfels.table[:, :3] + self.center, self._surfels.table[:, 3:6].copy()


class Points(SurfelTarget):
    """The surface that points were sampled from, without their noise.

    The cloud is converted to small quadratic surface pieces, each a robust fit to a neighborhood sized by the data's
    noise, density and shape; neighboring pieces are blended. Noise level, density and normals need not be known.
    Normals, if the cloud has them, separate the two walls of a thin sheet and define the outside.

    Parameters
    ----------
    cloud : PointCloud or anything convertible
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
            cloud = PointCloud(cloud)  # duplicates do no harm here and need not be merged
        self.cloud = cloud if isinstance(cloud, PointCloud) else as_points(cloud, "cloud")
        checks.size("cloud", np.stack([self.cloud.points.min(axis=0), self.cloud.points.max(axis=0)]))
        self.unit = self.cloud.unit
        super().__init__(self.cloud.points, self.cloud.normals)

    @cached_property
    def border(self) -> Border:
        """The border of the cloud, to which the boundary of a mesh is attracted."""
        return border_of_points(self.cloud.points)

    def resolution(self, places: Array) -> Array:
        """Return (n,) the size of the smallest details that the data shows at places (n, 3) near it."""
        _, nearest_surfel = nearest(self._surfels, np.asarray(places) - self.center, 1)
        return np.asarray(DETAIL * self._surfels.radius[nearest_surfel[:, 0]])
