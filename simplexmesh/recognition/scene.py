"""A scan that models are looked for in, and where each may lie."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import cross, dot, norm, normalized
from simplexmesh.recognition import _kernels_library
from simplexmesh.recognition.arena import Arena, grid_of, rows
from simplexmesh.recognition.bags import bag_of, octave_of_scan
from simplexmesh.recognition.models import Model
from simplexmesh.recognition.starts import from_axes
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

AMONG, STRAY, MANY = 6, 5.0, 0.1
"""A point whose so many-th neighbor is so many times farther than the usual one is a stray, if few are."""

LOOKED = 120
"""The images around so many points of a scan are compared."""

SHORTEST, SLACK, BEND = 0.15, 0.06, 0.25
"""Pairs of correspondences agree that are farther apart than this, and whose distances differ by less than this, in
sizes of the smaller surface, and whose cosines differ by less than this."""

TOLD = 0.1
"""Normals of a pair tell a direction whose part across its line is longer than this."""

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
    away = Tree(surface.points).query(surface.points, k=AMONG)[0][:, -1]
    kept = away <= STRAY * np.median(away)
    if kept.all() or kept.mean() < 1 - MANY:  # so many are no strays: the density differs from place to place
        return surface
    fine = None if surface.fine is None else surface.fine[:, kept]
    points, normals, smooth = surface.points[kept], surface.normals[kept], surface.smooth[kept]
    return replace(surface, points=points, normals=normals, smooth=smooth, fine=fine)


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
        smooth = surface.smoothed()
        octave = octave_of_scan(smooth)
        bag = bag_of(smooth, range(octave, octave + 1), LOOKED, np.random.default_rng(0))
        middle, unit = smooth.points.mean(axis=0), smooth.extent
        placed = smooth.placed(middle, unit)
        return Scene(
            placed, middle, unit, bag.chosen, bag.at(octave), octave, Tree(placed.points), *grid_of(placed.points)
        )  # fmt: skip

    @cached_property
    def rarity(self) -> Array:
        """(k,) how much each image differs from the others of the scan: on a flat side all are alike."""
        return np.asarray(norm(self.images - np.median(self.images, axis=0)), np.float64)

    def places(self, model: Model, likest: NDArray[np.int64] | None) -> tuple[Surface, Arena, Array]:
        """Return a model's surface in the scene's unit, an arena for it, and motions (h, 12) likely before trying.

        `likest` (k, 2) are the images of the model that are likest to those of the scan.
        """
        surface = model.surface
        surface = surface.placed(surface.points.mean(axis=0), self.unit)
        rng = np.random.default_rng(0)
        arena = Arena(
            surface, self.surface, surface.some(JUDGING, rng), surface.some(FOLLOWING, rng),
            self.grid, self.low, self.cell, min(surface.extent, self.surface.extent),
        )  # fmt: skip
        motions = from_axes(surface, self.surface)
        if likest is not None:
            motions = np.concatenate([motions, self.from_images(surface, model.bag.chosen[likest], arena.size)])
        return surface, arena, motions

    def from_images(self, surface: Surface, near: NDArray[np.int64], size: float) -> Array:
        """Return motions (h, 12) of pairs of points that look alike in the model and in the scan."""
        here, there = np.repeat(self.chosen, near.shape[1]), near.ravel()
        p, n, q, m = (array[which] for surface, which in ((self.surface, here), (surface, there))
                      for array in (surface.points, surface.normals))  # fmt: skip
        degree, pairs = np.zeros(len(p)), np.empty((len(p) * (len(p) - 1) // 2, 2), np.int64)
        count = _kernels_library.agreeing(p, n, q, m, SHORTEST * size, SLACK * size, BEND, degree, pairs)
        pairs = pairs[:count]
        weight = degree * np.repeat(self.rarity, near.shape[1])
        weight = weight[pairs[:, 0]] * weight[pairs[:, 1]]
        i, j = pairs[np.argsort(-weight, kind="stable")[:MOTIONS]].T
        F, G = frames_of_pairs(p[i], n[i], p[j], n[j]), frames_of_pairs(q[i], m[i], q[j], m[j])
        R = F @ G.transpose(0, 2, 1)
        whole = np.einsum("hab,hab->h", R, R) > 2.9
        return rows(R, (p[i] + p[j]) / 2 - np.einsum("hab,hb->ha", R, (q[i] + q[j]) / 2))[whole]


def frames_of_pairs(p: Array, n: Array, q: Array, m: Array) -> Array:
    """Return frames (h, 3, 3), in columns, of pairs of points with normals: along the line, then toward the normals.

    The first normal counts twice, so that opposite ones tell a direction too. Where they tell none the frame is zero.

    Examples
    --------
    >>> x, y = np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]])
    >>> frames_of_pairs(0 * x, y, 2 * x, -y)[0]
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    line = normalized(q - p)
    up = n + m / 2
    up = up - dot(up, line)[:, None] * line
    frames = np.stack([line, normalized(up), cross(line, normalized(up))], axis=2)
    return np.where((norm(up) > TOLD)[:, None, None], frames, 0.0)
