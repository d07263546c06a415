"""Regions: parts of a surface that are of one class, small ones joined to their neighbors."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from simplexmesh import _check
from simplexmesh.surface.diffusion import Diffusion
from simplexmesh.surface.samples import Samples, as_samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SMALLEST = 0.002
"""Regions of less than this share of the area are joined to a neighbor, where nothing else is asked for."""


@dataclass(frozen=True, eq=False, repr=False)
class Regions:
    """A surface divided into connected regions, the largest first.

    Attributes
    ----------
    labels : (n,) array of int
        Region of each vertex.
    classes : (r,) array of int
        Class of each region.
    areas : (r,) array of float
        In the surface's unit squared.
    sizes : (r,) array of int
        Vertices of each.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(8).triangulated("dual")
    >>> halves = sm.regions(ball, (ball.vertices[:, 2] > 0.5).astype(int))
    >>> halves, halves.classes.tolist()
    (Regions(2 regions of 642 vertices), [0, 1])
    """

    labels: Indices
    classes: Indices
    areas: Array
    sizes: Indices

    def __repr__(self) -> str:
        return f"Regions({len(self)} regions of {len(self.labels)} vertices)"

    def __len__(self) -> int:
        return len(self.classes)


def regions(surface: Any, labels: Any, *, minimum: float | None = None) -> Regions:
    """Return the connected regions of one class each; those too small take the class they border on most.

    The smallest goes first, to the neighbor it shares the most edges with, so that specks vanish into what surrounds
    them. A piece of surface that is small as a whole stays.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        What is divided.
    labels : HKClasses, or (n,) array of int or bool
        Class of each vertex.
    minimum : float, optional
        The least area of a region, in the surface's unit squared; 0 keeps all. By default 0.2 % of the whole.

    Returns
    -------
    Regions

    Raises
    ------
    ValueError, TypeError
        Labels of another length, or that are no whole numbers.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(8).triangulated("dual")
    >>> specks = np.zeros(ball.n_vertices, int)
    >>> specks[[3, 40, 77]] = 1
    >>> len(sm.regions(ball, specks)), len(sm.regions(ball, specks, minimum=0))
    (1, 4)
    """
    samples = as_samples(surface)
    given = np.asarray(getattr(labels, "labels", labels))
    if given.dtype == bool:
        given = given.astype(np.int64)
    kinds = _check.array("labels", given, (len(samples.points),), np.int64)
    areas = Diffusion(samples).areas
    least = SMALLEST * float(areas.sum()) if minimum is None else _check.number("minimum", minimum, 0.0)
    ends, others = _edges(samples)
    piece = _pieces(kinds, ends, others)
    piece, kinds = _joined(piece, kinds, areas, ends, others, least)
    whole, first, place, sizes = np.unique(piece, return_index=True, return_inverse=True, return_counts=True)
    area = np.bincount(place, areas, len(whole))
    order = np.argsort(-area, kind="stable")
    rank = np.zeros(len(whole), np.int64)
    rank[order] = np.arange(len(whole))
    frozen = _check.frozen
    return Regions(frozen(rank[place]), frozen(kinds[first][order]), frozen(area[order]), frozen(sizes[order]))


def _edges(samples: Samples) -> tuple[Indices, Indices]:
    ring = samples.one_ring
    return np.repeat(ring.centers, ring.valence), ring.members


def _pieces(kinds: Indices, ends: Indices, others: Indices) -> Indices:
    """Return the number of the connected piece of one class that each vertex is in."""
    same = kinds[ends] == kinds[others]
    n = len(kinds)
    links = csr_matrix((np.ones(int(same.sum()), bool), (ends[same], others[same])), (n, n))
    piece: Indices = connected_components(links, directed=False)[1].astype(np.int64)
    return piece


def _joined(
    piece: Indices, kinds: Indices, areas: Array, ends: Indices, others: Indices, least: float
) -> tuple[Indices, Indices]:
    """Return pieces and classes after those smaller than `least` have gone to their neighbors, the smallest first."""
    count = int(piece.max(initial=-1)) + 1
    area: Array = np.bincount(piece, areas, count).astype(float)
    kind = np.zeros(count, np.int64)
    kind[piece] = kinds
    across = piece[ends] != piece[others]
    border: list[dict[int, int]] = [{} for _ in range(count)]
    shared, times = np.unique(
        np.stack([piece[ends[across]], piece[others[across]]], axis=1), axis=0, return_counts=True
    )
    for (a, b), k in zip(shared.tolist(), times.tolist(), strict=True):
        border[a][b] = border[a].get(b, 0) + k
        border[b][a] = border[b].get(a, 0) + k
    into = np.arange(count)
    queue = [(area[a], a) for a in range(count) if area[a] < least]
    heapq.heapify(queue)
    while queue:
        size, a = heapq.heappop(queue)
        if into[a] != a or size != area[a] or not border[a]:
            continue
        toward = max(border[a], key=lambda b: (border[a][b], area[b], -b))
        _merge(a, toward, border, area, into, kind)
        if area[toward] < least:
            heapq.heappush(queue, (area[toward], toward))
    for a in range(count):
        while into[a] != into[into[a]]:
            into[a] = into[into[a]]
    piece = into[piece]
    return piece, kind[piece]


def _merge(a: int, b: int, border: list[dict[int, int]], area: Array, into: Indices, kind: Indices) -> None:
    """Join piece a to b, and with it to all neighbors that are of b's class."""
    waiting = [a]
    while waiting:
        gone = waiting.pop()
        into[gone] = b
        area[b] += area[gone]
        for other, k in border[gone].items():
            del border[other][gone]
            if other != b:
                border[b][other] = border[b].get(other, 0) + k
                border[other][b] = border[other].get(b, 0) + k
        border[gone] = {}
        waiting += [other for other in border[b] if kind[other] == kind[b] and other not in waiting]
