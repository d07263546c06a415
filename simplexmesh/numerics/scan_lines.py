"""Neighbors across the lines of a scanner: where points are dense along lines, the nearest are all on one line."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.numerics import _kernels_local_fits

NARROW = 0.1
"""Of the variance along neighbors, that across them on a line."""

FARTHEST = 512
"""Rank of the farthest neighbor that is looked at."""


def steps(tree: cKDTree, places: Array, count: int) -> Indices:
    """Return the least step 1, 2, 4 ... (m,) at which so many of the nearest points to places span a surface.

    It is 0 where none does: nothing is beside the line. More than an eighth of a bent curve is no line.
    """
    out = np.empty(len(places), np.int64)
    for step, rows, *_ in _spanning(tree, places, count):
        out[rows] = step
    return out


def neighbors(tree: cKDTree, places: Array, count: int) -> tuple[Array, Indices]:
    """Return distances and indices (m, count) of points near places, the nearest first, at steps that span a surface.

    They are the nearest themselves where no step does.
    """
    distance, near = np.empty((len(places), count)), np.empty((len(places), count), np.int64)
    for _, rows, *found in _spanning(tree, places, count):
        distance[rows], near[rows] = found
    return distance, near


def _spanning(tree: cKDTree, places: Array, count: int) -> Iterator[tuple[int, Indices, Array, Indices]]:
    """Yield each step with the places where it is the least to span a surface, the distances and the neighbors."""
    narrow, step = np.arange(len(places)), 1
    first = found = _ranked(tree, places, count, step)
    while True:
        widths = np.empty(len(narrow))
        _kernels_local_fits.fill_widths(tree.data, found[1], widths)
        wide = widths > NARROW
        yield step, narrow[wide], found[0][wide], found[1][wide]
        narrow, step = narrow[~wide], 2 * step
        if not len(narrow) or step * count > min(FARTHEST, tree.n // 8):
            break
        found = _ranked(tree, places[narrow], count, step)
    yield 0, narrow, first[0][narrow], first[1][narrow]


def _ranked(tree: cKDTree, places: Array, count: int, step: int) -> tuple[Array, Indices]:
    distance, near = tree.query(places, k=1 + step * np.arange(count), workers=-1)
    return distance, near
