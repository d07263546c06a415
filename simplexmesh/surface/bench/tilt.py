"""Sensitivity of estimators to a tilt of the initial normal (Charton 2014, fig. 4.10, 4.38)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import normalized
from simplexmesh.surface.bench.candidates import RefusedError, curvature_of, method, normals_of
from simplexmesh.surface.truth.exact import tangents
from simplexmesh.surface.truth.graphs import Graph
from simplexmesh.surface.truth.rings import SCHEMES, scheme_ring, stacked

Array = NDArray[np.float64]

ANGLES = (0.0, 1.0, 5.0, 15.0, 45.0)
"""Tilts of the initial normal, in degrees."""

DISTANCE, COUNTS = 0.1, (6, 12)


def tilt_table(
    surfaces: Sequence[Graph], names: Mapping[str, Sequence[str]], angles: Sequence[float] = ANGLES
) -> Iterator[dict[str, object]]:
    """Yield for each method and angle the median error over surfaces, patterns and numbers of neighbors.

    Of H in units of the largest principal curvature, of normals |N - truth|; neighbors at distance 0.1. Each case is
    tilted in a different direction. Methods without initial normals are left out.
    """
    keys = [(surface, count, scheme) for surface in surfaces for count in COUNTS for scheme in SCHEMES]
    rings = [scheme_ring(surface, scheme, count, DISTANCE) for surface, count, scheme in keys]
    samples, around = stacked(rings)
    truth = np.concatenate([ring.exact.normals for ring in rings])
    mean = np.concatenate([ring.exact.mean for ring in rings])
    scale = np.concatenate([np.maximum(abs(ring.exact.k1), abs(ring.exact.k2)) for ring in rings])
    u, v = tangents(truth)
    azimuth = 2.4 * np.arange(len(rings))  # the golden angle, for an even distribution
    toward = np.cos(azimuth)[:, None] * u + np.sin(azimuth)[:, None] * v
    for angle in angles:
        start = np.tile([0.0, 0.0, 1.0], (len(samples.points), 1))
        start[around.centers] = normalized(truth + np.tan(np.radians(angle)) * toward)
        for name in names["curvature"]:
            if not _starts("curvature", name):
                continue
            try:
                found = curvature_of(name, samples, normals=start, around=around)
            except RefusedError:
                continue
            errors = np.abs(found.mean - mean) / np.where(scale > 0, scale, 1.0)
            yield {"method": name, "quantity": "H", "degrees": angle, "error": float(np.nanmedian(errors))}
        for name in names["normals"]:
            if not _starts("normals", name):
                continue
            try:
                directions = normals_of(name, samples, around=around, normals=start)
            except RefusedError:
                continue
            chord = np.linalg.norm(directions - truth, axis=1)
            yield {"method": name, "quantity": "N", "degrees": angle, "error": float(np.nanmedian(chord))}


def _starts(kind: str, name: str) -> bool:
    """Return whether a method uses initial normals and given neighbors."""
    registered = method(kind, name)
    return registered.normals is not None and not registered.own_scale
