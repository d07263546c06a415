"""Values of a signature for comparison: smoothed, clipped, and the visible part scaled to that of a complete object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices32, Mask
from simplexmesh._base.vectors import normalized
from simplexmesh.recognition.sai.attribute_image import SAI
from simplexmesh.recognition.sai.sphere_domain import sphere_domain

COMPLETE = 0.98
"""Visible fraction from which a signature counts as complete."""


@dataclass(frozen=True, eq=False)
class Signature:
    """Values on the sphere that are compared, possibly scaled about the center of the visible part."""

    values: Array  # (n,)
    seen: Mask  # (n,)
    sources: Array  # (n, 3) the direction on the original sphere that each vertex's value comes from


def scale_factor(first: SAI, second: SAI) -> float:
    """Return k of equation 6.8, with the *visible* areas: the scale that makes the second comparable with the first."""
    density = [sai.visible_fraction / max(sai.visible_area, 1e-300) for sai in (first, second)]
    return float(density[0] / density[1])


def scaled_directions(directions: Array, center: Array, k: float) -> tuple[Array, Mask]:
    """Return the preimages (n, 3) of directions when areas about a center grow by k (6.9), and whether they exist."""
    height = (1 - directions @ center) / k
    exist = height <= 2.0
    cosine = np.clip(1 - height, -1.0, 1.0)
    tangent = directions - (directions @ center)[:, None] * center
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    tangent = tangent / np.where(length > 1e-12, length, 1.0)
    sources = cosine[:, None] * center + np.sqrt(1 - cosine**2)[:, None] * tangent
    return normalized(np.where(exist[:, None], sources, -center)), exist


def signature_of(sai: SAI, *, smoothing: int = 0, scale: float = 1.0, limit: float = np.pi) -> Signature:
    """Return the values of a signature for comparison, its visible part scaled about its center."""
    domain = sphere_domain(sai.frequency)
    values = smoothed(sai.angles, ~sai.hidden, sai.mesh.neighbors, smoothing)
    seen = ~(sai.hidden | sai.hidden[sai.mesh.neighbors].any(axis=1))  # the surface bends over the rim of what is seen
    if scale == 1.0:
        return Signature(np.clip(values, -limit, limit), seen, domain.vertices)
    sources, exist = scaled_directions(domain.vertices, sai.center, scale)
    locations = domain.locate(sources)
    # an angle, the size of a piece times curvature, is scaled with the piece (the thesis omits that)
    values = domain.interpolated(2 * np.arctan(np.tan(values / 2) / np.sqrt(scale)), locations)
    return Signature(np.clip(values, -limit, limit), exist & seen[locations.vertex], sources)


def smoothed(values: Array, seen: Mask, neighbors: Indices32, passes: int) -> Array:
    """Return values averaged over each vertex and its visible neighbors `passes` times; zero where hidden."""
    weight = seen.astype(float)
    values = np.where(seen, values, 0.0)
    for _ in range(passes):
        total = values + (values * weight)[neighbors].sum(axis=1)
        values = np.where(seen, total / (1.0 + weight[neighbors].sum(axis=1)), 0.0)
    return np.asarray(values)
