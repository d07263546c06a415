"""One point with neighbors in five patterns: at decreasing distances, and with tilted normals (Charton 2014, 4.2)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import normalized, tangents
from simplexmesh.bench.trials.candidates import REGISTRIES, distance, estimates, starts, truth
from simplexmesh.bench.trials.curve import Curve
from simplexmesh.bench.truth.graphs import Graph
from simplexmesh.bench.truth.rings import SCHEMES, scheme_ring, stacked

COUNTS = (6, 12)
DISTANCES = np.geomspace(0.5, 0.0005, 13)
ANGLES = (0.0, 1.0, 5.0, 15.0, 45.0)
"""Tilts of the initial normal, in degrees."""


class Pointwise:
    """Rings around the origins of surfaces, at decreasing distances, stacked, so that each method is called once."""

    def __init__(self, surfaces: Sequence[Graph], counts: Sequence[int] = COUNTS, distances: Array = DISTANCES) -> None:
        self.distances = distances
        self.keys = list(product(surfaces, counts, SCHEMES))
        rings = [scheme_ring(surface, scheme, count, d) for surface, count, scheme in self.keys for d in distances]
        self.samples, self.around = stacked(rings)
        self.normals = np.zeros_like(self.samples.points)
        self.normals[self.around.centers] = np.concatenate([ring.exact.normals for ring in rings])

    def curves(self, kind: str, name: str) -> list[Curve]:
        """Return the curves of H and K, from the exact normal, or of N, by a method; none if it needs whole meshes."""
        if REGISTRIES[kind][name].own_scale:
            return []
        normals, many = self.normals if kind == "curvature" else None, len(self.distances)
        out = []
        for _, quantity, values in estimates(kind, [name], self.samples, normals=normals, around=self.around):
            for row, (surface, count, scheme) in enumerate(self.keys):
                exact = surface.exact()
                largest = float(max(abs(exact.k1[0]), abs(exact.k2[0]))) or 1.0
                scale = {"H": largest, "K": largest**2, "N": 1.0}[quantity]
                found, true = values[many * row : many * (row + 1)], np.asarray(truth(quantity, exact)[0])
                out.append(Curve(name, quantity, surface.name, scheme, count, self.distances, found, true, scale))
        return [] if all(curve.failed for curve in out) else out


def spreads(curves: Sequence[Curve]) -> Iterator[dict[str, Any]]:
    """Yield the range of estimates over the five schemes at equal distance, in scales; for normals, its diagonal."""
    groups: dict[tuple[Any, ...], list[Curve]] = {}
    for c in curves:
        groups.setdefault((c.method, c.quantity, c.surface, c.count), []).append(c)
    for key, group in groups.items():
        place = dict(zip(("method", "quantity", "surface", "neighbors"), key, strict=True))
        spread = np.ptp([curve.values for curve in group], axis=0) / group[0].scale
        for d, value in zip(group[0].distances, distance(spread, np.zeros(())), strict=True):
            yield place | {"distance": d, "spread": value}


def tilts(
    surfaces: Sequence[Graph], names: Mapping[str, Sequence[str]], angles: Sequence[float] = ANGLES
) -> Iterator[dict[str, Any]]:
    """Yield the median error of H, in largest curvatures, or N when the normal is tilted (fig. 4.10, 4.38)."""
    keys = product(surfaces, COUNTS, SCHEMES)
    rings = [scheme_ring(surface, scheme, count, 0.1) for surface, count, scheme in keys]
    samples, around = stacked(rings)
    exact = np.concatenate([ring.exact.normals for ring in rings])
    true = {"H": np.concatenate([ring.exact.mean for ring in rings]), "N": exact}
    largest = np.concatenate([np.maximum(abs(ring.exact.k1), abs(ring.exact.k2)) for ring in rings])
    unit = {"H": np.where(largest > 0, largest, 1.0), "N": np.ones(len(rings))}
    u, v = tangents(exact)
    azimuth = 2.4 * np.arange(len(rings))[:, None]  # the golden angle, for an even distribution
    toward = np.cos(azimuth) * u + np.sin(azimuth) * v
    for angle in angles:
        normals = np.tile([0.0, 0.0, 1.0], (len(samples.points), 1))
        normals[around.centers] = normalized(exact + np.tan(np.radians(angle)) * toward)
        for kind in names:
            methods = [name for name in names[kind] if starts(REGISTRIES[kind][name])]
            for name, quantity, values in estimates(kind, methods, samples, normals=normals, around=around):
                if quantity in true:
                    error = float(np.nanmedian(distance(values, true[quantity]) / unit[quantity]))
                    yield {"method": name, "quantity": quantity, "degrees": angle, "error": error}
