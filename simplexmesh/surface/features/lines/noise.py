"""The noise of the vertices that a surface itself shows, here and there."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.surface.features.lines.facets import SIMPLIFIED, Facets
from simplexmesh.surface.features.lines.residuals import FEW, residual_noise

REGION = 2000
"""Most edges that tell the noise of a region, to about a tenth."""

VARYING, SMALLEST = 2.0, 0.08
"""Regions with more have their own: times the whole's, of the root of a triangle's area; curvature passes for less."""


def vertex_noise(facets: Facets) -> Array:
    """Return the standard deviation (t,) of the corners of triangles along the normal, as the surface itself shows it.

    The four corners at an inner edge, projected along the normal, have one affine relation. Where the surface is flat,
    the heights in that relation, with coefficients of unit length, have the deviation of a single vertex. The seventh
    of the edges that bends least tells it: creases and curvature bend the others more, and meshes of planes have none.
    Where vertices are much nearer to smooth surfaces than the bends say, these are of tessellation. Then a seventh of
    the area tells it as well, as large triangles of planes have none, however many small ones a fillet has.
    Rounded coordinates put many edges into one plane: there half of those tell that are off by less than the rounding.

    Regions may have more: there the quartile of the bends to that side which has less tells, as curvature has one side.
    """
    half = np.flatnonzero(facets.mates > np.arange(facets.faces.size))
    sides, n = np.stack([half, facets.mates[half]], axis=1) // 3, len(facets.faces)
    bends = _bends(facets, half)
    if len(bends) < TELLING and not _both_ways(bends):
        return np.zeros(n)
    noise, largest = _whole_noise(facets, sides, bends), LARGEST * float(np.sqrt(facets.areas.mean()))
    squares = np.full(len(half), noise**2)
    qualities = facets.qualities[sides].mean(axis=1)
    least = max(VARYING * noise, SMALLEST / LARGEST * largest)
    for rows in _regions(facets.centers[sides].mean(axis=1)):
        low, high = np.quantile(bends[rows], [0.25, 0.75]) / HALF_DEVIATION
        if least < min(-low, high) < largest and qualities[rows].mean() > SIMPLIFIED:
            squares[rows] = min(-low, high) ** 2
    total = np.bincount(sides.ravel(), np.repeat(squares, 2), n)
    return np.sqrt(total / np.maximum(np.bincount(sides.ravel(), minlength=n), 1))


def _whole_noise(facets: Facets, sides: Indices, bends: Array) -> float:
    """Return the noise of the whole surface, from the bends (e,) between triangles at the `sides` (e, 2) of edges."""
    off, step, largest = np.abs(bends), _step(facets.vertices), LARGEST * float(np.sqrt(facets.areas.mean()))
    noise, residual = float(np.quantile(off, FEW)) / DEVIATION, residual_noise(facets)
    if residual < SHAPE * noise:
        by_area = np.argsort(off)
        areas = np.cumsum(facets.areas[sides].sum(axis=1)[by_area])
        noise = min(noise, float(off[by_area[np.searchsorted(areas, FEW * areas[-1])]]) / DEVIATION)
    if step < largest and (off < step).any():
        noise = max(noise, min(float(np.median(off[off < step])) / HALF_DEVIATION, step / np.sqrt(12)))
    return noise if noise < largest else 0.0


def _bends(facets: Facets, half: Indices) -> Array:
    """Return by how much the corners at edges (e,) are out of one plane, as a signed deviation of one."""
    other, corners = facets.mates[half], facets.faces.ravel()
    a, b = corners[half], corners[_after(half)]
    c, d = corners[_after(_after(half))], corners[_after(_after(other))]
    quads = facets.vertices[np.stack([a, b, c, d], axis=1)]
    quads = quads - quads[:, :1]
    normal = cross(quads[:, 1], quads[:, 2]) - cross(quads[:, 1], quads[:, 3])
    normal /= np.maximum(norm(normal), 1e-300)[:, None]
    area = [dot(cross(quads[:, j] - quads[:, i], quads[:, k] - quads[:, i]), normal) for i, j, k in TRIPLES]
    relation = np.stack(area, axis=1) * [1, -1, 1, -1]
    heights = dot(quads, normal[:, None])
    return np.asarray((relation * heights).sum(axis=1) / np.maximum(norm(relation), 1e-300))


def _both_ways(bends: Array) -> bool:
    """Return whether edges bend to both sides, as by noise: those of pyramids and hulls bend to one."""
    return len(bends) > 0 and min((bends > 0).mean(), (bends < 0).mean()) > LESSER


def _regions(points: Array) -> list[Indices]:
    """Return the rows of points in each of compact regions: all, halved across the longest extent; none if few."""
    whole, out = [np.arange(len(points))] if len(points) > REGION else [], []
    while whole:
        rows = whole.pop()
        apart = points[rows] - points[rows].mean(axis=0)
        ahead = apart @ np.linalg.eigh(apart.T @ apart)[1][:, -1] > 0
        if len(rows) <= REGION or not ahead.any():
            out.append(rows)
        else:
            whole += [rows[ahead], rows[~ahead]]
    return out


def _step(vertices: Array) -> float:
    """Return the length of which all differences of coordinates are multiples; 0 if there is none."""
    known = np.unique(np.abs(vertices - vertices[:1]))
    gaps = np.diff(known)
    least = gaps[gaps > FINEST * known[-1]].min(initial=known[-1])
    step = float(known[-1] / np.round(known[-1] / least))
    counts = known / step
    return step if np.abs(counts - np.round(counts)).max() < 0.05 else 0.0


FINEST = 1e-6
"""Step of coordinates, over their range, that is looked for: single precision has about as many digits."""

LARGEST = 0.5
"""Of the root of a triangle's area: what is more, noise or rounding, is the shape of a mesh of few triangles."""

TRIPLES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
"""The corners left where one of four is taken away."""

TELLING, LESSER = 100, 0.25
"""Edges that tell any in every case: of fewer, a share must bend to either side, else they are a body's own."""

SHAPE = 0.5
"""Of the bends: vertices nearer to smooth surfaces show that these are of tessellation, as noise moves both alike."""

DEVIATION, HALF_DEVIATION = 0.18912, 0.67449
"""Values below which those few and half of the absolute values of a standard normal distribution are."""


def _after(half: Indices) -> Indices:
    """Return the half-edges that follow others around their triangles."""
    return half - half % 3 + (half + 1) % 3
