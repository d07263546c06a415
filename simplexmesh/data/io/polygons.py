"""Triangulation of polygons and strips."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, norm, sums, triangle_vectors

ROUNDING = 1e-6
"""Of the squared area of a polygon: triangles of less area along with it are flat or turned over."""


def triangulated(points: Array, sizes: Indices, flat: NDArray[Any]) -> Indices:
    """Return the triangles of polygons in their order: fans, or cut by VTK where these are flat or turned over."""
    triangles = fans(sizes, flat)
    if sizes.max(initial=0) <= 3 or not 0 <= triangles.min() <= triangles.max() < len(points):
        return triangles
    with np.errstate(over="ignore", invalid="ignore"):
        extent = float(np.ptp(points, axis=0).max())
    if not 0 < extent < np.inf:
        return triangles
    points = (points - points.min(axis=0)) / extent
    polygon = np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0))
    areas = triangle_vectors(points, triangles)
    whole = sums(areas, polygon, len(sizes))
    bad = dot(areas, whole[polygon]) < ROUNDING * dot(whole, whole)[polygon]
    wrong = np.unique(polygon[bad])
    if not len(wrong):
        return triangles
    from simplexmesh.data.io import polydata

    corners = _whole(flat)[np.repeat(np.isin(np.arange(len(sizes)), wrong), sizes)]
    used, corners = np.unique(corners, return_inverse=True)
    pieces, of = polydata.polygon_triangles(points[used], sizes[wrong], corners.reshape(-1))
    pieces, of = used[pieces], wrong[of]
    missing = sums(triangle_vectors(points, pieces), of, len(sizes)) - whole
    complete = norm(missing) <= ROUNDING * norm(whole)
    kept, cut = ~(complete & np.isin(np.arange(len(sizes)), wrong))[polygon], complete[of]
    order = np.argsort(np.concatenate([polygon[kept], of[cut]]), kind="stable")
    return np.concatenate([triangles[kept], pieces[cut]])[order]


def fans(sizes: Indices, flat: NDArray[Any]) -> Indices:
    """Return the triangles of polygons stored consecutively, each triangulated as a fan around its first corner."""
    corners = _whole(flat)
    starts = np.cumsum(sizes) - sizes
    cuts = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, cuts)
    step = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts) + 1
    return np.stack([corners[first], corners[first + step], corners[first + step + 1]], axis=1)


def strips(flat: NDArray[Any]) -> Indices:
    """Return the triangles of strips stored consecutively, with -1 after each; every other triangle is turned over."""
    corners = _whole(flat)
    triples = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    ends = np.flatnonzero(corners < 0)
    starts = np.concatenate([[0], ends + 1])
    at = np.arange(len(triples))
    odd = (at - starts[np.searchsorted(starts, at, side="right") - 1]) % 2 == 1
    triples[odd] = triples[odd][:, [1, 0, 2]]
    a, b, c = triples.T
    return triples[(triples >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)]


def _whole(corners: NDArray[Any]) -> Indices:
    """Return indices read from a file as integers."""
    if corners.dtype.kind == "f" and not (np.isfinite(corners) & (corners == np.rint(corners))).all():
        raise ValueError("faces must be whole numbers")
    return corners.astype(np.int64)
