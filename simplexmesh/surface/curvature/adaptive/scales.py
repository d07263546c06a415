"""Choice of scale: a radius, a degree and priors for the fit at every point, from probes at some."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, sums, triangle_vectors
from simplexmesh.surface.curvature.adaptive._kernels_balls import Surface
from simplexmesh.surface.curvature.adaptive._kernels_polynomials import HIGHEST
from simplexmesh.surface.curvature.adaptive.probes import ProbeFits, noise_level, probe_fits, risks
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals.orientation import consistent_normals
from simplexmesh.surface.sampled_surface import SampledSurface

LADDER = np.array([2.4, 3.4, 4.6, 6.0, 7.6])
"""Radii tried, in spacings: about 20, 42, 77, 130 and 210 points."""

RETRIED = 3
"""Number of radii, around the best of all, tried by all probes."""

FIRST_PROBES, MIN_PROBES = 96, 320
"""Probes that try all radii, and least number of probes in all."""

PER_PROBE = 20
"""Vertices per probe."""

RADIUS_GROUP, PRIOR_GROUP = 8, 24
"""Neighboring probes averaged for the radius, and for priors and degrees."""

RISK_TOLERANCE = 1.2
"""The shortest radius whose risk is at most this times the least is taken: it is cheaper and resolves more."""

TRUNCATION_FACTOR = 1.2
"""Factor of the truncation error that the choice of radii expects: with it actual errors are 0.3 to 0.9 of the expected
ones on noisy tori, and 0.7 to 2.6 on random surfaces, the more the faster their curvature varies."""

GOLDEN = 0.6180339887498949
"""Multiples of it, modulo 1, are spread evenly (van der Corput)."""

PROBED = 3
"""Least number of neighbors of a probe: stray triangles, of which an unclean mesh may have many, allow no fit."""

EQUAL = 1e-10
"""Spacings, relative to their mean, that differ by less are those of a regular grid."""

WIDEST = 9.0
"""Radius in spacings beyond which a wanted detail does not enlarge balls: within are more points than are fitted."""


class Scales(NamedTuple):
    """Settings of the fit at each point."""

    radii: Array  # (n,) of the balls, 0 where a point has no neighbors
    smallest: Array  # (n,) to which these may be shortened
    degrees: Indices
    priors: Array  # (n, 4) deviations of the coefficients of degrees d = 3 to 6, length^(1 - d)
    truncation: Array  # (n,) expected error of H by terms of higher degree
    noise: float  # standard deviation along the normal
    spacing: Array  # (n,) edge length of a regular triangulation as dense as the points; 0 without neighbors


def surface_of(samples: SampledSurface) -> Surface:
    """Return the points, their one-rings and rough normals of any length, averaged over two rings."""
    ring = samples.one_ring
    oriented = True
    if samples.faces is not None:
        areas = triangle_vectors(samples.points, samples.faces)
        directions = sums(np.repeat(areas, 3, axis=0), samples.faces.ravel(), len(samples.points))
    elif samples.outward is not None:
        directions = np.ascontiguousarray(samples.outward)
    else:
        directions, oriented = consistent_normals(samples), False
    smooth = smoothed(ring, directions, 2, signed=oriented)
    unsigned = ring.offsets.view(np.uint64), ring.members.view(np.uint64)
    return Surface(*unsigned, ring.closed, samples.points, smooth, oriented)


def smoothed(ring: Neighborhoods, values: Array, passes: int, *, signed: bool = True) -> Array:
    """Return the rows (n, k) averaged with those of their neighbors, `passes` times; up to sign if not `signed`."""
    n = len(values)
    members = np.insert(ring.members, ring.offsets[:-1], np.arange(n))
    offsets = ring.offsets + np.arange(n + 1)
    rows, shares = np.repeat(np.arange(n), np.diff(offsets)), np.ones(len(members))
    for _ in range(passes):
        if not signed:
            shares = np.copysign(1.0, dot(values[rows], values[members]))
        values = csr_array((shares, members, offsets), shape=(n, n)) @ values / np.diff(offsets)[:, None]
    return values


def spacings(samples: SampledSurface) -> Array:
    """Return the edge length of a regular triangulation as dense as the points around each vertex; 0 without any."""
    ends, lengths = samples.ring_edges
    count = samples.one_ring.valence
    # the v nearest of points with one on each area a have the mean square distance a (v + 1) / (2 pi)
    areas = 2 * np.pi * np.bincount(ends, lengths**2, len(count)) / np.maximum(count * (count + 1), 1)
    return np.asarray(np.sqrt(areas * 2 / np.sqrt(3)))


def scales_of(
    samples: SampledSurface, surface: Surface, *, noise: float | None = None, detail: float | None = None
) -> Scales:
    """Choose the scale of every point; options as in `curvature`."""
    ring = samples.one_ring
    raw_spacing = spacings(samples)
    connected = np.flatnonzero(raw_spacing > 0)
    logs = np.log(np.where(raw_spacing > 0, raw_spacing, 1.0))[:, None]
    smoothed_spacing = np.exp(smoothed(ring, logs, 2)[:, 0])
    spacing = np.where(raw_spacing > 0, smoothed_spacing, 0.0)
    if not len(connected):
        none = np.zeros(len(spacing))
        return Scales(none, none, np.full(len(none), 2), np.zeros((len(none), 4)), none, 0.0, none)
    order = _drawn(connected, raw_spacing, ring.valence)
    rows = np.sort(order[:FIRST_PROBES])
    fits = probe_fits(surface, rows, spacing[rows, None] * LADDER)
    deviation = noise_level(fits) if noise is None else noise
    near = _groups(samples.points[rows], RADIUS_GROUP)
    best = _best(risks(fits.mean(near), deviation).compared(fits.increments, near).risk)
    low = min(max(int(np.median(best)) - 1, 0), len(LADDER) - RETRIED)
    rows, nearest = _probed(samples, order)
    fits = probe_fits(surface, rows, spacing[rows, None] * LADDER[low : low + RETRIED])
    columns, degrees = _at_probes(samples.points[rows], fits, spacing[rows], deviation, shortest=low == 0)
    values = smoothed(ring, columns[nearest], 3)  # scales vary smoothly
    radii = np.exp(values[:, 0]) * spacing
    smallest = np.minimum(0.7 * LADDER[0] * spacing, radii)
    if detail is not None:
        least = np.minimum(detail, np.maximum(WIDEST * spacing, radii))
        radii, smallest = np.maximum(radii, least), np.maximum(smallest, least)
    with np.errstate(divide="ignore", invalid="ignore"):
        priors = np.where(radii[:, None] > 0, np.sqrt(values[:, 2:]) / radii[:, None] ** np.arange(2, 6), 0.0)
    truncation = TRUNCATION_FACTOR * np.sqrt(values[:, 1])
    return Scales(radii, smallest, degrees[nearest], priors, truncation, deviation, spacing)


def _drawn(connected: Indices, spacing: Array, valence: Indices) -> Indices:
    """Return the connected points in pseudo-random order, without those of too few neighbors unless all are such."""
    order = connected[shuffling(spacing[connected]).argsort(kind="stable")]
    many = valence[order] >= PROBED
    return order[many] if many.any() else order


def _probed(samples: SampledSurface, order: Indices) -> tuple[Indices, Indices]:
    """Return the points to probe, at least one per component, and the row of the nearest of these to each, or -1."""
    rows = np.sort(order[: max(MIN_PROBES, len(order) // PER_PROBE)])
    nearest = nearest_probe(samples, rows)
    missed = order[nearest[order] < 0]
    if len(missed):
        rows = np.sort(np.append(rows, missed[np.unique(samples.components[missed], return_index=True)[1]]))
        nearest = nearest_probe(samples, rows)
    return rows, nearest


def nearest_probe(samples: SampledSurface, rows: Indices) -> Indices:
    """Return for each point the place in `rows`, ascending, of the nearest along edges; -1 where none is connected."""
    nearest = dijkstra(samples.edges, indices=rows, min_only=True, return_predecessors=True)[2]
    return np.where(nearest >= 0, np.searchsorted(rows, nearest), -1)


def _best(risk: Array) -> Indices:
    """Return the index of the shortest radius of each row that is about as good as the best."""
    return (risk <= RISK_TOLERANCE * risk.min(axis=1)[:, None]).argmax(axis=1)


def _at_probes(
    positions: Array, fits: ProbeFits, spacing: Array, noise: float, *, shortest: bool
) -> tuple[Array, Indices]:
    """Return (p + 1, 6) columns, log radius and squares of truncation error and priors, and degrees; medians last."""
    far = _groups(positions, PRIOR_GROUP)
    near = far[:, :RADIUS_GROUP]
    grouped = fits.mean(near)
    found = risks(grouped, noise).compared(fits.increments, near)
    wide = risks(fits.mean(far), noise)
    if shortest:
        found.risk[:, 0] *= 2.0  # with so few points it must be clearly better
    k, i = _best(found.risk), np.arange(len(positions))
    values = np.column_stack(
        [np.log(grouped.radii[i, k] / spacing), found.truncation[i, k] ** 2, wide.priors[i, k] ** 2]
    )[near].mean(axis=1)
    degrees = wide.degrees[i, k]
    if shortest:
        degrees[k == 0] = HIGHEST  # so few points limit it already; larger radii should not inherit that
    return np.vstack([values, np.median(values, axis=0)]), np.append(degrees, int(np.median(degrees)))


def shuffling(values: Array) -> Array:
    """Return pseudo-random sorting keys that do not depend on numbering, pose or unit; equal values get even ones."""
    relative = values / values.mean()
    _, group, sizes = np.unique(np.round(relative / EQUAL), return_inverse=True, return_counts=True)
    order = group.argsort(kind="stable")
    rank = np.empty(len(values))
    rank[order] = np.arange(len(values)) - np.repeat(sizes.cumsum() - sizes, sizes)
    out: Array = (1e6 * relative + GOLDEN * rank) % 1.0
    return out


def _groups(positions: Array, count: int) -> Indices:
    """Return (p, g) rows: each position with its nearest others, `count` in all or as many as there are."""
    out: Indices = cKDTree(positions).query(positions, min(count, len(positions)))[1]
    return out.reshape(len(positions), -1)
