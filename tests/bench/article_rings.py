"""Six points on a cylinder or sphere at equal distances, as the articles have them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh.bench.truth import closed
from simplexmesh.bench.truth.rings import Ring

KINDS = ("regular", "vertex", "angles")


def gs03_ring(distance: float, *, perturbed: bool = False, radius: float = 2.0) -> Ring:
    """Return six points of a cylinder at a distance from P (Goldfeather and Interrante 2004; Charton 2014, 4.1-4.3)."""
    return _at_heights([1, 0.5, -0.5, -1, -0.8 if perturbed else -0.5, 0.5], distance, "cylinder", radius)


def symmetric_ring(distance: float, count: int = 6, *, surface: str = "cylinder", radius: float = 2.0) -> Ring:
    """Return points at a distance from P whose heights divide the diameter along z evenly: a symmetric, uneven ring."""
    half = checks.integer("count", count, 4) // 2
    if count % 2:
        raise ValueError(f"count must be even, not {count}")
    down = 1 - 2 * np.arange(half + 1) / half
    return _at_heights(np.concatenate([down, down[-2:0:-1]]), distance, surface, radius)


def article_ring(distance: float, kind: str = "regular", *, radius: float = 2.0) -> Ring:
    """Return six points of a sphere at a distance from P, as in the article of 2012 (eqs 31-38, corrected)."""
    if checks.choice("kind", kind, KINDS) == "angles":
        return symmetric_ring(distance, 6, surface="sphere", radius=radius)
    ring = _at_heights([1, 0.5, -0.5, -1, -0.5, 0.5], distance, "sphere", radius)
    if kind == "regular":
        return ring
    x, y, z = ring.neighbors[5]
    moved = closed.sphere(np.arctan2(y, x), 1.6 * np.arcsin(z / radius), radius)[0]
    return replace(ring, neighbors=np.concatenate([ring.neighbors[:5], moved]))


def _at_heights(heights: ArrayLike, distance: float, surface: str, radius: float) -> Ring:
    """Return neighbors at a distance from P = (radius, 0, 0) at these shares of it along z, first down, then up."""
    share = np.asarray(heights, float)
    half = len(share) // 2 - 1
    sides = np.array([0, *[-1] * half, 0, *[1] * half])
    d = checks.number("distance", distance, 0.0, radius, open_low=True)
    if checks.choice("surface", surface, ("cylinder", "sphere")) == "cylinder":
        z = d * share
        x = (z**2 + 2 * radius**2 - d**2) / (2 * radius)
        y = np.sqrt(np.maximum((d**2 - z**2) * (1 - (radius - x) / (2 * radius)), 0))
    else:
        high = d / radius * np.sqrt(radius**2 - d**2 / 4)
        z, x = high * share, np.full(len(share), radius - d**2 / (2 * radius))
        y = np.sqrt(np.maximum(high**2 - z**2, 0))
    center, exact = getattr(closed, surface)(0.0, 0.0, radius)
    return Ring(center[0], np.stack([x, sides * y, z], axis=1), exact)
