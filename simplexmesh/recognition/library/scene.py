"""A scan in which models are recognized, and candidate motions of models in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm
from simplexmesh.recognition.library import _kernels_correspondences
from simplexmesh.recognition.library._kernels_correspondences import Likeness, Tolerances
from simplexmesh.recognition.library.model_index import ImageIndex
from simplexmesh.recognition.library.models import Model
from simplexmesh.recognition.library.spin_images import scan_octave, spin_images_of
from simplexmesh.recognition.register._kernels_pose_scoring import TargetGrid
from simplexmesh.recognition.register.oriented_points import OrientedPoints, drawn_rows
from simplexmesh.recognition.register.pose_candidates import axis_candidates, principal_axes
from simplexmesh.recognition.register.pose_scoring import Source, source_of, target_grid

OUTLIER_RATIO = 5.0
"""Distance of an outlier's neighbors relative to the median: parts of another density are no outliers."""

SCAN_IMAGES = 120
"""Number of points of a scan with spin images: more take longer, and find smaller parts."""

MINIMUM_LENGTH, LENGTH_TOLERANCE, COSINE_TOLERANCE = 0.15, 0.06, 0.25
"""Minimum length of consistent pairs and tolerance of their length, relative to the size of the smaller surface, and
tolerance of their cosines: wider ones stand more noise and leave more wrong pairs."""

MOTIONS = 800
"""Maximum number of motions from pairs of correspondences."""

SCORED, REFINED = 150, 500
"""Numbers of points of a model that motions are scored and refined with."""


def without_outliers(surface: OrientedPoints) -> OrientedPoints:
    """Return the surface without outliers, which would enlarge its extent."""
    if surface.neighbor_distances is None:
        return surface
    kept = surface.neighbor_distances <= OUTLIER_RATIO * np.median(surface.neighbor_distances)
    if kept.all() or kept.mean() < 0.9:  # a varying density rather than outliers
        return surface
    return replace(
        surface, points=surface.points[kept], normals=surface.normals[kept], smooth=surface.smooth[kept],
        fine=None if surface.fine is None else surface.fine[:, kept],
        neighbor_distances=surface.neighbor_distances[kept],
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Scene:
    """A scan, centered and scaled to extent 1, with its spin images, and the tree and grid of its points."""

    surface: OrientedPoints
    center: Array  # (3,) of the data
    unit: float  # extent of the data
    rows: Indices  # (k,) of the points with images
    images: NDArray[np.float32]  # (k, 2 PIXELS)
    octave: int  # of the images
    tree: cKDTree
    grid: TargetGrid

    @staticmethod
    def of(surface: OrientedPoints) -> Scene:
        """Return the scene of a scan."""
        smooth = surface.on_planes()
        octave = scan_octave(smooth)
        images = spin_images_of(smooth, range(octave, octave + 1), SCAN_IMAGES, np.random.default_rng(0))
        center, unit = smooth.points.mean(axis=0), smooth.extent
        scaled = smooth.normalized_to(center, unit)
        tree, grid = cKDTree(scaled.points), target_grid(scaled)
        return Scene(scaled, center, unit, images.chosen, images.at(octave), octave, tree, grid)

    def source(self, model: Model) -> Source:
        """Return a model in the scene's unit, with its center at the origin."""
        surface = model.surface(model.frame[0], self.unit)
        return source_of(surface, self.surface, _sampled_rows(len(surface)), min(model.frame[2] / self.unit, 1.0))

    def motions(self, models: list[Model], sources: list[Source], images: ImageIndex, which: Indices) -> list[Array]:
        """Return motions (h, 12) of each model, from principal axes and consistent correspondences."""
        chosen = [model.spin_images.chosen for model in models]
        rows = [(each.surface, at) for each, at in zip(sources, chosen, strict=True)]
        oriented = np.concatenate([np.hstack([surface.points[at], surface.normals[at]]) for surface, at in rows])
        scan = np.hstack([self.surface.points[self.rows], self.surface.normals[self.rows]])
        starts = np.cumsum([0, *map(len, chosen[:-1])])
        tolerances = [
            Tolerances(MINIMUM_LENGTH * each.size, LENGTH_TOLERANCE * each.size, COSINE_TOLERANCE) for each in sources
        ]
        likeness = Likeness(images.reduced(self.images), images.rows, images.squares, images.spans(which))
        # how far each image is from the median one: on a flat side all are alike
        distinctiveness = np.asarray(norm(self.images - np.median(self.images, axis=0)), np.float64)
        out, counts = np.empty((len(models), MOTIONS, 12)), np.zeros(len(models), np.int64)
        _kernels_correspondences.pair_motions(
            len(models), scan, distinctiveness, oriented, starts, likeness, np.array(tolerances), out, counts
        )
        own = principal_axes(self.surface.points)
        axes = [axis_candidates((np.zeros(3), model.frame[1]), own) for model in models]
        return [np.concatenate([first, each[:count]]) for first, each, count in zip(axes, out, counts, strict=True)]


@cache
def _sampled_rows(count: int) -> tuple[Indices, Indices]:
    """Return the rows of the points, of `count`, that motions are scored and refined with; cached."""
    rng = np.random.default_rng(0)
    return drawn_rows(count, SCORED, rng), drawn_rows(count, REFINED, rng)
