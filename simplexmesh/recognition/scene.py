"""A scan in which models are recognized, and candidate motions of models in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import norm
from simplexmesh.recognition import _kernels_poses
from simplexmesh.recognition.grid_scoring import GridScorer, nearest_grid
from simplexmesh.recognition.model_index import ImageIndex
from simplexmesh.recognition.models import Model
from simplexmesh.recognition.pose_candidates import axis_candidates, principal_axes
from simplexmesh.recognition.spin_images import scan_octave, spin_images_of
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

OUTLIER_RATIO, MAXIMUM_OUTLIERS = 5.0, 0.1
"""Distance of an outlier's neighbors relative to the median, and the largest fraction of outliers."""

SCAN_IMAGES = 120
"""Number of points of a scan with spin images."""

MINIMUM_LENGTH, LENGTH_TOLERANCE, COSINE_TOLERANCE = 0.15, 0.06, 0.25
"""Minimum length of consistent pairs and tolerance of their length, relative to the size of the smaller surface, and
tolerance of their cosines."""

MOTIONS = 800
"""Maximum number of motions from pairs of correspondences."""

SCORING_POINTS, REFINING_POINTS = 150, 500
COARSE_MOTIONS, FINE_MOTIONS = 8, 3
"""Numbers of a model's motions that are refined coarsely, then finely."""


class SingleThreadTree(cKDTree):  # type: ignore[misc]
    """A k-d tree queried in one thread: for small samples, starting threads takes longer than the search."""

    def query(self, x: Any, **options: Any) -> Any:
        """Return distances and indices of nearest points, as in `scipy.spatial.cKDTree`."""
        return super().query(x, **{**options, "workers": 1})


def without_outliers(surface: Surface) -> Surface:
    """Return the surface without outliers, which would enlarge its extent.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.recognition.surfaces import surface_of
    >>> points = np.vstack([sm.sphere(10).vertices, [[9.0, 0, 0], [0, 7, 0]]])
    >>> bool(without_outliers(surface_of(points, "ball")).extent < 3.5)
    True
    """
    if surface.neighbor_distances is None:
        return surface
    kept = surface.neighbor_distances <= OUTLIER_RATIO * np.median(surface.neighbor_distances)
    if kept.all() or kept.mean() < 1 - MAXIMUM_OUTLIERS:  # a varying density rather than outliers
        return surface
    fine = None if surface.fine is None else surface.fine[:, kept]
    points, normals, smooth = surface.points[kept], surface.normals[kept], surface.smooth[kept]
    return replace(
        surface,
        points=points,
        normals=normals,
        smooth=smooth,
        fine=fine,
        neighbor_distances=surface.neighbor_distances[kept],
    )


@dataclass(frozen=True, eq=False)
class Scene:
    """A scan in a normalized frame, its center at the origin and its extent 1, with a grid of nearest points.

    Attributes
    ----------
    surface : Surface
        With points projected to local planes.
    center : (3,) array of float
    unit : float
        Center and extent of the scan as given.
    chosen : (k,) array of int
        Indices of the points with spin images.
    images : (k, 2 PIXELS) array of float32
        Their images at the radius ``2**octave`` and at twice that.
    octave : int
    tree : SingleThreadTree
    grid : (i, j, k) array of int32
    low : (3,) array of float
    cell : float
        As `nearest_grid` returns them.
    """

    surface: Surface
    center: Array
    unit: float
    chosen: NDArray[np.int64]
    images: NDArray[np.float32]
    octave: int
    tree: SingleThreadTree
    grid: NDArray[np.int32]
    low: Array
    cell: float

    @staticmethod
    def of(surface: Surface) -> Scene:
        """Return the scene of a scan."""
        smooth = surface.on_planes()
        octave = scan_octave(smooth)
        images = spin_images_of(smooth, range(octave, octave + 1), SCAN_IMAGES, np.random.default_rng(0))
        center, unit = smooth.points.mean(axis=0), smooth.extent
        normalized = smooth.normalized_to(center, unit)
        tree, (grid, low, cell) = SingleThreadTree(normalized.points), nearest_grid(normalized.points)
        return Scene(
            normalized, center, unit, images.chosen, images.at(octave), octave, tree, grid, low, cell
        )  # fmt: skip

    @cached_property
    def distinctiveness(self) -> Array:
        """(k,) distance of each image from the median image: on a flat side all are alike."""
        return np.asarray(norm(self.images - np.median(self.images, axis=0)), np.float64)

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """Center (3,) and principal axes (3, 3)."""
        return principal_axes(self.surface.points)

    def scorer(self, model: Model) -> GridScorer:
        """Return the grid scorer of a model, in the scene's unit and with the model's center at the origin."""
        surface = model.normalized_to(self.unit)
        return GridScorer(
            surface, self.surface, *_samples(len(surface)), self.grid, self.low, self.cell,
            min(model.frame[2] / self.unit, 1.0),
        )  # fmt: skip

    def motions(
        self, models: list[Model], scorers: list[GridScorer], images: ImageIndex, which: NDArray[np.int64]
    ) -> list[Array]:
        """Return candidate motions (h, 12) of each model, from principal axes and from consistent correspondences.

        `which` are the indices of the models among those in `images`.
        """
        chosen = [model.spin_images.chosen for model in models]
        q = np.concatenate([scorer.source.points[rows] for scorer, rows in zip(scorers, chosen, strict=True)])
        m = np.concatenate([scorer.source.normals[rows] for scorer, rows in zip(scorers, chosen, strict=True)])
        starts = np.cumsum([0, *map(len, chosen[:-1])])
        tolerances = np.array([[MINIMUM_LENGTH * scorer.size, LENGTH_TOLERANCE * scorer.size] for scorer in scorers])
        out, counts = np.empty((len(models), MOTIONS, 12)), np.zeros(len(models), np.int64)
        _kernels_poses.pair_motions(
            *(self.surface.points[self.chosen], self.surface.normals[self.chosen], self.distinctiveness),
            *(images.reduced(self.images), images.rows, images.squares, images.spans(which)),
            *(q, m, starts, tolerances, COSINE_TOLERANCE, out, counts),
        )
        axes = [axis_candidates((np.zeros(3), model.frame[1]), self.axes) for model in models]
        return [np.concatenate([first, each[:count]]) for first, each, count in zip(axes, out, counts, strict=True)]


@cache
def _samples(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices of the points, of `count`, that motions are scored and refined with; cached."""
    rng = np.random.default_rng(0)
    return tuple(  # type: ignore[return-value]
        np.sort(rng.choice(count, maximum, replace=False)) if count > maximum else np.arange(count)
        for maximum in (SCORING_POINTS, REFINING_POINTS)
    )
