"""Sharp edges of blurred volumes: their isosurface is round there, over the width of the blur and no more.

Across an edge between flat sides, seen through a Gaussian blur, the normal of the isosurface turns as the error
function does: within one standard deviation by 0.72 of what it turns within two, and not any more beyond.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree
from scipy.special import ndtri

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, normalized
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.line import CreaseLine, stretches
from simplexmesh.motion.targets.isosurface import Isosurface

WIDEST = 3.0
"""In voxels: with a wider blur values have no step at the surface."""

WITHIN, BEYOND = (0.6, 0.85), (0.75, 1.33)
"""Ranges of the turn within one over that within two, and within four over within two deviations, of sharp edges."""

LEAST_TURN = 0.15
"""In radians: the turn of the normals at a sharp edge."""


def blur_of(target: Isosurface, mesh: SimplexMesh) -> float:
    """Return the deviation of the Gaussian blur with the slope of an isosurface near a mesh, infinite if none."""
    voxel = float(np.min(target.volume.spacing))
    gaps = target.gap(mesh.vertices, mesh.normals, WIDEST * voxel)
    known = ~np.isnan(gaps)
    normals = mesh.normals[known]
    places = mesh.vertices[known] + gaps[known, None] * normals

    def drop(distance: float) -> Array:
        return _values(target, places - distance * normals) - _values(target, places + distance * normals)

    if not known.any():
        return np.inf
    slope, blur = drop(0.5 * voxel), voxel
    for _ in range(6):
        step = drop(2.5 * blur)
        share = float(np.median(slope[step != 0] / step[step != 0])) if step.any() else 0.0
        width = float(ndtri(0.5 + 0.5 * share))
        if not 0.5 / WIDEST < width < np.inf:
            return np.inf
        blur = 0.5 * voxel / width
    return blur


def are_sharp(lines: Sequence[CreaseLine], mesh: SimplexMesh, target: Isosurface, blur: float) -> Mask:
    """Return which lines (k,) on the isosurface near a mesh are sharp edges but for the blur."""
    places, along, of = stretches(lines, blur)
    up = mesh.normals[cKDTree(mesh.vertices).query(places)[1]]
    up = normalized(up - dot(up, along)[:, None] * along)
    one, two, four = (_turns(target, places, up, along, blur, k) for k in (1, 2, 4))
    unknown = np.bincount(of, np.isnan([one, two, four]).any(axis=0)) / np.bincount(of)
    a, b, c = (_medians(turn, of) for turn in (one, two, four))
    with np.errstate(divide="ignore", invalid="ignore"):
        inner, outer = a / b, c / b
    sharp = (
        (abs(b) > LEAST_TURN) & (WITHIN[0] < inner) & (inner < WITHIN[1]) & (BEYOND[0] < outer) & (outer < BEYOND[1])
    )
    return np.asarray(sharp & (unknown < 0.5))


def _medians(values: Array, of: Indices) -> Array:
    """Return the medians of the numbers among values (n,) of groups `of` (n,), sorted; anything where all are NaN."""
    order, counts = np.lexsort((values, of)), np.bincount(of)
    known = np.bincount(of, ~np.isnan(values)).astype(np.int64)
    first = np.cumsum(counts) - counts
    low, high = (values[order[first + np.maximum(middle, 0)]] for middle in ((known - 1) // 2, known // 2))
    return np.asarray(0.5 * (low + high))


def _turns(target: Isosurface, places: Array, up: Array, along: Array, blur: float, deviations: float) -> Array:
    """Return the angle (n,) by which the isosurface turns between both sides of lines through places; NaN off it."""
    aside, steps = np.cross(along, up), np.diag(target.volume.spacing)
    turn = np.zeros(len(places))
    for side in (-1.0, 1.0):
        at = places + side * deviations * blur * aside
        gaps = target.gap(at, up, (2 + 2 * deviations) * blur)
        at = at + np.nan_to_num(gaps)[:, None] * up
        slope = np.stack([(_values(target, at + step) - _values(target, at - step)) / step.sum() for step in steps])
        turn += side * np.arctan2(-(slope.T * aside).sum(axis=1), -(slope.T * up).sum(axis=1))
        turn[np.isnan(gaps)] = np.nan
    return turn


def _values(target: Isosurface, places: Array) -> Array:
    """Return the values (n,) of the volume at places, positive where the object is."""
    index = target.volume.to_index(places).T
    out = ndimage.map_coordinates(target.volume.values, index, np.float64, order=1, mode="nearest")
    return out if target.inside == "above" else -out
