"""Regions: connected parts of a surface of one class, small ones merged into their neighbors."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.sampled_surface import as_sampled_surface


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
        Areas, in the surface's unit squared.
    sizes : (r,) array of int
        Number of vertices of each.

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
    """Return the connected regions of one class each, with small ones merged into their neighbors.

    The smallest is merged first, into the neighbor it shares the most edges with. Small connected components of the
    surface remain.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PointCloud, array, PyVista or trimesh object, or path
        The surface.
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
        Labels of another length, or not integers.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ball = sm.sphere(8).triangulated("dual")
    >>> specks = np.zeros(ball.n_vertices, int)
    >>> specks[[3, 40, 77]] = 1
    >>> len(sm.regions(ball, specks)), len(sm.regions(ball, specks, minimum=0))
    (1, 4)
    """
    samples = as_sampled_surface(surface)
    given = np.asarray(getattr(labels, "labels", labels))
    if given.dtype == bool:
        given = given.astype(np.int64)
    vertex_labels = checks.array("labels", given, (len(samples.points),), np.int64)
    areas = Diffusion(samples).areas
    least = 0.002 * float(areas.sum()) if minimum is None else checks.number("minimum", minimum, 0.0)
    ends, others = samples.ring_edges[0], samples.one_ring.members
    component = _components(vertex_labels, ends, others)
    component, vertex_labels = _merged(component, vertex_labels, areas, ends, others, least)
    whole, first, place, sizes = np.unique(component, return_index=True, return_inverse=True, return_counts=True)
    area = np.bincount(place, areas, len(whole))
    order = np.argsort(-area, kind="stable")
    rank = np.zeros(len(whole), np.int64)
    rank[order] = np.arange(len(whole))
    frozen = checks.frozen
    return Regions(frozen(rank[place]), frozen(vertex_labels[first][order]), frozen(area[order]), frozen(sizes[order]))


def _components(vertex_labels: Indices, ends: Indices, others: Indices) -> Indices:
    """Return the index of the connected component of one class that each vertex is in."""
    same = vertex_labels[ends] == vertex_labels[others]
    n = len(vertex_labels)
    links = csr_matrix((np.ones(int(same.sum()), bool), (ends[same], others[same])), (n, n))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)


def _merged(
    component: Indices, vertex_labels: Indices, areas: Array, ends: Indices, others: Indices, least: float
) -> tuple[Indices, Indices]:
    """Return components and classes with those smaller than `least` merged into their neighbors, smallest first."""
    count = int(component.max(initial=-1)) + 1
    area: Array = np.bincount(component, areas, count).astype(float)
    label = np.zeros(count, np.int64)
    label[component] = vertex_labels
    across = component[ends] != component[others]
    border: list[dict[int, int]] = [{} for _ in range(count)]
    shared, times = np.unique(
        np.stack([component[ends[across]], component[others[across]]], axis=1), axis=0, return_counts=True
    )
    for (a, b), k in zip(shared.tolist(), times.tolist(), strict=True):
        border[a][b] = border[a].get(b, 0) + k
        border[b][a] = border[b].get(a, 0) + k
    parent = np.arange(count)
    queue = [(area[a], a) for a in range(count) if area[a] < least]
    heapq.heapify(queue)
    while queue:
        size, a = heapq.heappop(queue)
        if parent[a] != a or size != area[a] or not border[a]:
            continue
        target = max(border[a], key=lambda b: (border[a][b], area[b], -b))
        _merge(a, target, border, area, parent, label)
        if area[target] < least:
            heapq.heappush(queue, (area[target], target))
    for a in range(count):
        while parent[a] != parent[parent[a]]:
            parent[a] = parent[parent[a]]
    component = parent[component]
    return component, label[component]


def _merge(a: int, b: int, border: list[dict[int, int]], area: Array, parent: Indices, label: Indices) -> None:
    """Merge component a into b, and then all of b's neighbors that are of its class."""
    stack = [a]
    while stack:
        removed = stack.pop()
        parent[removed] = b
        area[b] += area[removed]
        for other, k in border[removed].items():
            del border[other][removed]
            if other != b:
                border[b][other] = border[b].get(other, 0) + k
                border[other][b] = border[other].get(b, 0) + k
        border[removed] = {}
        stack += [other for other in border[b] if label[other] == label[b] and other not in stack]
