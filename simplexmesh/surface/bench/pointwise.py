"""First test: one point with neighbors in five patterns at decreasing distances (Charton 2014, 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.bench.candidates import RefusedError, curvature_of, method, normals_of
from simplexmesh.surface.bench.curve import Curve
from simplexmesh.surface.truth.exact import Exact
from simplexmesh.surface.truth.graphs import Graph
from simplexmesh.surface.truth.rings import SCHEMES, scheme_ring, stacked

Array = NDArray[np.float64]

COUNTS = (6, 12)
DISTANCES = np.geomspace(0.5, 0.0005, 13)


class Pointwise:
    """All rings of the comparison, stacked, so that each method is called once.

    Parameters
    ----------
    surfaces : sequence of Graph
        Evaluated at the origin.
    counts : sequence of int
        Numbers of neighbors.
    distances : (d,) array of float
        Decreasing.

    Examples
    --------
    >>> from simplexmesh.surface.truth.graphs import graph
    >>> test = Pointwise([graph("sphere")])
    >>> mean, gauss = test.curvature("sine")[:2]
    >>> mean.quantity, mean.exact, mean.limit_is_correct
    ('H', True, True)
    """

    def __init__(self, surfaces: Sequence[Graph], counts: Sequence[int] = COUNTS, distances: Array = DISTANCES) -> None:
        self.distances = np.asarray(distances, float)
        self.keys = list(product(surfaces, counts, SCHEMES))
        rings = [scheme_ring(surface, scheme, count, d) for surface, count, scheme in self.keys for d in self.distances]
        self.samples, self.around = stacked(rings)
        self.truths: list[Exact] = [surface.exact() for surface, _, _ in self.keys]
        self.normals = np.zeros_like(self.samples.points)
        for ring, center in zip(rings, self.around.centers, strict=True):
            self.normals[center] = ring.exact.normals[0]

    def curvature(self, name: str) -> list[Curve]:
        """Return the curves of H and K by a method with the exact initial normal; none if it needs whole meshes."""
        if method("curvature", name).own_scale:
            return []
        try:
            found = curvature_of(name, self.samples, normals=self.normals, around=self.around)
        except RefusedError:
            return []
        if len(found.mean) != len(self.around):
            return []
        curves = []
        for truth, mean, gauss, key in self._cases(found.mean, found.gauss):
            largest = float(max(abs(truth.k1[0]), abs(truth.k2[0]))) or 1.0
            curves.append(self._curve(name, "H", key, mean, truth.mean[0], largest))
            curves.append(self._curve(name, "K", key, gauss, truth.gauss[0], largest**2))
        return [] if all(curve.failed for curve in curves) else curves

    def normal(self, name: str) -> list[Curve]:
        """Return the curves of N by a method; none if it needs whole meshes."""
        if method("normals", name).own_scale:
            return []
        try:
            found = normals_of(name, self.samples, around=self.around)
        except RefusedError:
            return []
        if len(found) != len(self.around):
            return []
        curves = [
            self._curve(name, "N", key, normals, truth.normals[0], 1.0) for truth, normals, key in self._cases(found)
        ]
        return [] if all(curve.failed for curve in curves) else curves

    def _cases(self, *values: Array) -> list[tuple[Any, ...]]:
        many = len(self.distances)
        rows = [slice(many * k, many * (k + 1)) for k in range(len(self.keys))]
        return [
            (truth, *(part[row] for part in values), key)
            for truth, row, key in zip(self.truths, rows, self.keys, strict=True)
        ]

    def _curve(
        self, name: str, quantity: str, key: tuple[Graph, int, str], values: Array, truth: Array, scale: float
    ) -> Curve:
        surface, count, scheme = key
        return Curve(name, quantity, surface.name, scheme, count, self.distances, values, np.asarray(truth), scale)


def rows_of(curves: Sequence[Curve]) -> list[dict[str, object]]:
    """Return a table with a row per curve."""
    return [
        {
            "method": c.method,
            "quantity": c.quantity,
            "surface": c.surface,
            "scheme": c.scheme,
            "neighbors": c.count,
            "truth": float(c.truth) if c.truth.ndim == 0 else "",
            "error at 0.5": c.error_at(0.5),
            "error at 0.1": c.error_at(0.1),
            "error at 0.0005": c.error_at(0.0005),
            "order": "exact" if c.exact else c.order,
            "monotone": c.monotone,
            "has limit": c.has_limit,
            "limit is correct": c.limit_is_correct,
        }
        for c in curves
    ]


def spreads(curves: Sequence[Curve]) -> list[dict[str, object]]:
    """Return the range of estimates over the five schemes at equal distance: the third test, of stability.

    Relative to the scale; for normals, the diagonal of their bounding box.
    """
    groups: dict[tuple[str, str, str, int], list[Curve]] = {}
    for curve in curves:
        groups.setdefault((curve.method, curve.quantity, curve.surface, curve.count), []).append(curve)
    lines = []
    for (name, quantity, surface, count), group in groups.items():
        stack = np.stack([curve.values for curve in group])
        spread = np.ptp(stack, axis=0) / group[0].scale
        spread = spread if spread.ndim == 1 else np.linalg.norm(spread, axis=1)
        for d, value in zip(group[0].distances, spread, strict=True):
            lines.append(
                {
                    "method": name,
                    "quantity": quantity,
                    "surface": surface,
                    "neighbors": count,
                    "distance": d,
                    "spread": value,
                }
            )
    return lines
