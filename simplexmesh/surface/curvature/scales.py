"""At which scale to look at a surface: a radius, a degree and priors for every point, from probes of some."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh.surface.curvature import _kernels_adaptive_scales as kernels
from simplexmesh.surface.curvature.probes import Probed, judged, noise_of, probed
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LADDER = np.array([2.4, 3.4, 4.6, 6.0, 7.6])
"""Radii tried, in spacings: some 20, 42, 77, 130 and 210 points."""

TRIED = 3
"""So many of them, around the best for all, are tried again for each place."""

FIRST, LEAST = 96, 160
"""So many probes try all radii; and there are so many at least when radii are chosen."""

SHARE = 18
"""Then one vertex in so many is a probe, but at least `LEAST`."""

TOGETHER, MORE = 8, 24
"""So many probes next to each other speak together of the radius, and so many of priors and degrees."""

AS_GOOD = 1.2
"""The shortest radius whose risk is at most this times the least is taken: it is cheaper and sees more."""

CAUTIOUS = 0.8
"""What radii are chosen by overstates what degrees left out do, by as much on noisy tori."""

SIGNED = True
"""To average rows as they are, not turned to each other."""

ROUNDS = 3
"""How often what was found is averaged with the neighbors', so that scales change smoothly."""


class Scales(NamedTuple):
    """How each point is fitted.

    Attributes
    ----------
    radii, smallest : (n,) array of float
        Of the ball, 0 where a point has no neighbors; and how far it may be shortened.
    degrees : (n,) array of int
    priors : (n, 4) array of float
        Deviation of the coefficients of degrees d = 3 to 6, length^(1 - d).
    beyond : (n,) array of float
        Error of H expected of what no degree says.
    noise : float
    directions : (n, 3) array of float
        Rough normals, of any length.
    oriented : bool
        Whether they look to one side of the surface.
    spacing : (n,) array of float
        The edge of an even triangulation as dense as the points; 0 where a point has no neighbors.
    """

    radii: Array
    smallest: Array
    degrees: Indices
    priors: Array
    beyond: Array
    noise: float
    directions: Array
    oriented: bool
    spacing: Array


def scales_of(samples: Samples, *, noise: float | None = None, detail: float | None = None) -> Scales:
    """Choose the scale of every point.

    Parameters
    ----------
    noise : float, optional
        Deviation of the noise along the normal, where it is known.
    detail : float, optional
        What is smaller is not of interest: no radius is shorter.
    """
    ring = samples.one_ring
    directions, oriented = _directions(samples)
    raw = kernels.spacings(ring.offsets, ring.members, samples.points)
    linked = np.flatnonzero(raw > 0)
    logs = np.log(np.where(raw > 0, raw, 1.0))[:, None]
    smooth = np.exp(kernels.averaged(ring.offsets, ring.members, logs, 2, SIGNED)[:, 0])
    spacing = np.where(raw > 0, smooth, 0.0)
    if not len(linked):
        none = np.zeros(len(spacing))
        return Scales(
            none, none, np.full(len(none), 2), np.zeros((len(none), 4)), none, 0.0, directions, oriented, none
        )
    order = linked[shuffling(raw[linked]).argsort(kind="stable")]
    rows = np.sort(order[:FIRST])
    told = probed(samples, rows, spacing[rows, None] * LADDER, directions, oriented=oriented)
    size = noise_of(told) if noise is None else noise
    near = _groups(samples.points[rows], TOGETHER)
    best = _best(judged(told.mean(near), size).compared(told.steps, near).risk)
    low = min(max(int(np.median(best)) - 1, 0), len(LADDER) - TRIED)
    rows = np.sort(order[: max(LEAST, len(order) // SHARE)])
    told = probed(samples, rows, spacing[rows, None] * LADDER[low : low + TRIED], directions, oriented=oriented)
    columns, degrees = _at_probes(samples.points[rows], told, spacing[rows], size, shortest=low == 0)
    label = kernels.nearest_probe(ring.offsets, ring.members, samples.points, rows)
    values = kernels.averaged(ring.offsets, ring.members, columns[label], ROUNDS, SIGNED)
    radii = np.exp(values[:, 0]) * spacing
    smallest = np.minimum(0.7 * LADDER[0] * spacing, radii)
    if detail is not None:
        radii, smallest = np.where(spacing > 0, np.maximum(radii, detail), 0.0), np.maximum(smallest, detail)
    with np.errstate(divide="ignore", invalid="ignore"):
        priors = np.where(radii[:, None] > 0, np.sqrt(values[:, 2:]) / radii[:, None] ** np.arange(2, 6), 0.0)
    return Scales(
        radii, smallest, degrees[label], priors, CAUTIOUS * np.sqrt(values[:, 1]), size, directions, oriented, spacing
    )


def _best(risk: Array) -> Indices:
    """Return the shortest radius of each row that is about as good as the best."""
    return (risk <= AS_GOOD * risk.min(axis=1)[:, None]).argmax(axis=1)


def _at_probes(places: Array, told: Probed, spacing: Array, noise: float, *, shortest: bool) -> tuple[Array, Indices]:
    """Return (p + 1, 6) columns, log radius in spacings and squares of the other error and of priors, and degrees.

    The last row is for points that no edges lead from to a probe: the middle of all.
    """
    near, far = _groups(places, TOGETHER), _groups(places, MORE)
    told_together = told.mean(near)
    found = judged(told_together, noise).compared(told.steps, near)
    wide = judged(told.mean(far), noise)
    if shortest:
        found.risk[:, 0] *= 2.0  # so few points must be clearly better
    k, i = _best(found.risk), np.arange(len(places))
    values = np.column_stack(
        [
            np.log(told_together.radii[i, k] / spacing),
            found.beyond[i, k] ** 2,
            wide.priors[i, k] ** 2,
        ]
    )[near].mean(axis=1)
    degrees = wide.degrees[i, k]
    middle = int(np.median(degrees))
    return np.vstack([values, np.median(values, axis=0)]), np.append(degrees, middle)


def shuffling(values: Array) -> Array:
    """Return keys that sort points as if at random, but the same points however they are numbered, turned or sized."""
    out: Array = (1e6 * values / values.mean()) % 1.0
    return out


def _groups(places: Array, count: int) -> Indices:
    """Return (p, g) rows: each place with those nearest to it, so many in all if there are so many."""
    out: Indices = cKDTree(places).query(places, min(count, len(places)))[1]
    return out.reshape(len(places), -1)


def _directions(samples: Samples) -> tuple[Array, bool]:
    """Rough normals, not of unit length, averaged over two rings, and whether their signs mean anything."""
    ring = samples.one_ring
    links = ring.offsets, ring.members
    if samples.faces is not None:
        found = kernels.area_vectors(samples.faces, samples.points)
    elif samples.outward is not None:
        found = np.ascontiguousarray(samples.outward)
    else:
        planes = kernels.agreeing(*links, kernels.planes(*links, samples.points), samples.points)
        return kernels.averaged(*links, planes, 2, not SIGNED), False
    return kernels.averaged(*links, found, 2, SIGNED), True
