"""What was seen of an object, brought to the size it has on the sphere of the whole object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import normalized
from simplexmesh.recognition.sai import SAI
from simplexmesh.recognition.sphere_domain import sphere_domain

Array = NDArray[np.float64]

WHOLE = 0.98
"""A signature of which so much was seen counts as complete."""


@dataclass(frozen=True, eq=False)
class Signature:
    """Values on the sphere that are compared, perhaps scaled about the center of what was seen.

    Attributes
    ----------
    values : (n,) array of float
    seen : (n,) array of bool
    sources : (n, 3) array of float
        Where on the sphere of the signature as it was each vertex's value comes from, unit vectors.
    """

    values: Array
    seen: NDArray[np.bool_]
    sources: Array


def scale_factor(first: SAI, second: SAI) -> float:
    """Return k of equation 6.8: by how much what was seen of the second must be scaled to compare with the first.

    The area on the sphere over the area in space is to be the same for both: ``k = 4 pi A1 / (A2 A)`` when the first
    is complete, with A1 the area *seen* of the second (equation 6.6, of which 6.8 follows, holds for that one only).
    """
    density = [one.visible_fraction / max(one.visible_area, 1e-300) for one in (first, second)]
    return float(density[0] / density[1])


def scaled_directions(directions: Array, center: Array, k: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return where directions come from when a sphere is scaled about a center by equation 6.9, and which do.

    ``1 - cos(theta') = k (1 - cos(theta))``: areas about the center grow by k. Directions given are the theta'.

    Parameters
    ----------
    directions : (n, 3) array of float
        Unit vectors.
    center : (3,) array of float
        Unit vector.
    k : float
        Above 0.

    Returns
    -------
    sources : (n, 3) array of float
        On the great circle of center and direction; the direction opposite the center where there is none.
    exist : (n,) array of bool

    Examples
    --------
    >>> source, exist = scaled_directions(np.array([[0, 0.6, 0.8]]), np.array([0, 0, 1.0]), 0.5)
    >>> source.round(3), exist
    (array([[0. , 0.8, 0.6]]), array([ True]))
    """
    rise = (1 - directions @ center) / k
    exist = rise <= 2.0
    cosine = np.clip(1 - rise, -1.0, 1.0)
    aside = directions - (directions @ center)[:, None] * center
    length = np.linalg.norm(aside, axis=1, keepdims=True)
    aside = aside / np.where(length > 1e-12, length, 1.0)
    sources = cosine[:, None] * center + np.sqrt(1 - cosine**2)[:, None] * aside
    return normalized(np.where(exist[:, None], sources, -center)), exist


def signature_of(one: SAI, *, smoothing: int = 0, scale: float = 1.0, limit: float = np.pi) -> Signature:
    """Return the values of a signature that are compared.

    Vertices next to hidden ones are left out as well: the surface bends over the rim of what was seen.

    Parameters
    ----------
    one : SAI
    smoothing : int
        How often each value is replaced by the mean over the vertex and its neighbors, of those seen.
    scale : float
        By how much what was seen is scaled about its center; see `scaled_directions`. A vertex then stands for a
        larger or smaller piece of the surface, and its angle, which is the size of that piece times curvature, is
        changed with it (the thesis leaves that out).
    limit : float
        Angles beyond this, in radians, count as this.
    """
    here = sphere_domain(one.frequency)
    values = smoothed(one.angles, ~one.hidden, one.mesh.neighbors, smoothing)
    seen = ~(one.hidden | one.hidden[one.mesh.neighbors].any(axis=1))
    if scale == 1.0:
        return Signature(np.clip(values, -limit, limit), seen, here.vertices)
    sources, exist = scaled_directions(here.vertices, one.center, scale)
    places = here.locate(sources)
    values = here.interpolated(2 * np.arctan(np.tan(values / 2) / np.sqrt(scale)), places)
    return Signature(np.clip(values, -limit, limit), exist & seen[places.vertex], sources)


def smoothed(values: Array, seen: NDArray[np.bool_], neighbors: NDArray[np.int32], passes: int) -> Array:
    """Return values averaged over each vertex and its neighbors, of those seen, so many times; zero where hidden."""
    weight = seen.astype(float)
    values = np.where(seen, values, 0.0)
    for _ in range(passes):
        total = values + (values * weight)[neighbors].sum(axis=1)
        values = np.where(seen, total / (1.0 + weight[neighbors].sum(axis=1)), 0.0)
    return np.asarray(values)
