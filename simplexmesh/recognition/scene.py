"""A scan that models are looked for in, and where each may lie."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import norm
from simplexmesh.recognition import _kernels_poses
from simplexmesh.recognition.bags import bag_of, octave_of_scan
from simplexmesh.recognition.grid_scoring import GridScorer, nearest_grid
from simplexmesh.recognition.models import Model
from simplexmesh.recognition.pose_candidates import axis_candidates, principal_axes
from simplexmesh.recognition.shelf import Images
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

STRAY, MANY = 5.0, 0.1
"""A point whose neighbors are so many times farther than usual is a stray, if few are."""

LOOKED = 120
"""The images around so many points of a scan are compared."""

SHORTEST, SLACK, BEND = 0.15, 0.06, 0.25
"""Pairs of correspondences agree that are farther apart than this, and whose distances differ by less than this, in
sizes of the smaller surface, and whose cosines differ by less than this."""

MOTIONS = 800
"""The motions of so many pairs are tried, those whose correspondences agree with most others."""

JUDGING, FOLLOWING = 150, 500
FIRST, LAST = 8, 3
"""So many of a model's motions are followed, roughly, then well."""


class Tree(cKDTree):  # type: ignore[misc]
    """A tree that is asked by one thread: for the few points of a sample others take longer to start than to search."""

    def query(self, x: Any, **options: Any) -> Any:
        """Return distances and indices of nearest points, as in `scipy.spatial.cKDTree`."""
        return super().query(x, **{**options, "workers": 1})


def without_strays(surface: Surface) -> Surface:
    """Return the surface without points far from all others, which would make it seem larger than it is.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.recognition.surfaces import surface_of
    >>> points = np.vstack([sm.sphere(10).vertices, [[9.0, 0, 0], [0, 7, 0]]])
    >>> bool(without_strays(surface_of(points, "ball")).extent < 3.5)
    True
    """
    if surface.neighbor_distances is None:
        return surface
    kept = surface.neighbor_distances <= STRAY * np.median(surface.neighbor_distances)
    if kept.all() or kept.mean() < 1 - MANY:  # so many are no strays: the density differs from place to place
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
    """A scan with its middle at zero and its extent for one, on a grid that knows the nearest of its points.

    Attributes
    ----------
    surface : Surface
        Smooth.
    middle : (3,) array of float
    unit : float
    chosen : (k,) array of int
        Some points, ...
    images : (k, 2 PIXELS) array of float32
        ... and the images around them, at one radius and twice that, ...
    octave : int
        ... of which this is the logarithm.
    tree : Tree
    grid : (i, j, k) array of int32
    low : (3,) array of float
    cell : float
    """

    surface: Surface
    middle: Array
    unit: float
    chosen: NDArray[np.int64]
    images: NDArray[np.float32]
    octave: int
    tree: Tree
    grid: NDArray[np.int32]
    low: Array
    cell: float

    @staticmethod
    def of(surface: Surface) -> Scene:
        """Return the scene of a scan."""
        smooth = surface.on_planes()
        octave = octave_of_scan(smooth)
        bag = bag_of(smooth, range(octave, octave + 1), LOOKED, np.random.default_rng(0))
        middle, unit = smooth.points.mean(axis=0), smooth.extent
        normalized_to = smooth.normalized_to(middle, unit)
        return Scene(
            normalized_to, middle, unit, bag.chosen, bag.at(octave), octave, Tree(normalized_to.points), *nearest_grid(normalized_to.points)
        )  # fmt: skip

    @cached_property
    def rarity(self) -> Array:
        """(k,) how much each image differs from the others of the scan: on a flat side all are alike."""
        return np.asarray(norm(self.images - np.median(self.images, axis=0)), np.float64)

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """The middle and the principal axes."""
        return principal_axes(self.surface.points)

    def scorer(self, model: Model) -> GridScorer:
        """Return an arena for a model's surface, in the scene's unit and with its middle at zero."""
        surface = model.normalized_to(self.unit)
        return GridScorer(
            surface, self.surface, *_samples(len(surface)), self.grid, self.low, self.cell,
            min(model.placement[2] / self.unit, 1.0),
        )  # fmt: skip

    def motions(
        self, models: list[Model], scorers: list[GridScorer], images: Images, which: NDArray[np.int64]
    ) -> list[Array]:
        """Return motions (h, 12) of each model that are likely before trying: of axes, and of pairs that look alike.

        `which` of all whose `images` these are the models are.
        """
        chosen = [model.bag.chosen for model in models]
        q = np.concatenate([scorer.source.points[rows] for scorer, rows in zip(scorers, chosen, strict=True)])
        m = np.concatenate([scorer.source.normals[rows] for scorer, rows in zip(scorers, chosen, strict=True)])
        starts = np.cumsum([0, *map(len, chosen[:-1])])
        slacks = np.array([[SHORTEST * scorer.size, SLACK * scorer.size] for scorer in scorers])
        out, counts = np.empty((len(models), MOTIONS, 12)), np.zeros(len(models), np.int64)
        _kernels_poses.pair_motions(
            *(self.surface.points[self.chosen], self.surface.normals[self.chosen], self.rarity),
            *(images.reduced(self.images), images.rows, images.squares, images.spans(which)),
            *(q, m, starts, slacks, BEND, out, counts),
        )
        axes = [axis_candidates((np.zeros(3), model.placement[1]), self.axes) for model in models]
        return [np.concatenate([first, each[:count]]) for first, each, count in zip(axes, out, counts, strict=True)]


@cache
def _samples(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which of so many points judge a motion, and which move one."""
    rng = np.random.default_rng(0)
    return tuple(  # type: ignore[return-value]
        np.sort(rng.choice(count, most, replace=False)) if count > most else np.arange(count)
        for most in (JUDGING, FOLLOWING)
    )
