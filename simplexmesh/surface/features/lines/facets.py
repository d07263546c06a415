"""Triangles with what is measured of each one, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, norm

SIMPLIFIED = 0.68
"""Mean quality of triangles: that of scans is more, also with noise of a third of an edge, of simplified ones less."""

KNOWN = 0.25
"""In radians, the deviation of normals in the mean over the surface: those of small triangles with noise have more."""


class Facets(NamedTuple):
    """Triangles, matched across their edges."""

    vertices: Array
    """(n, 3), about the origin."""

    faces: Indices
    """(t, 3)."""

    mates: Indices
    """(3t,): the half-edge opposite to `3 t + j`, from corner j to corner j + 1; -1 on a border."""

    sides: Array
    """(t, 3): lengths."""

    areas: Array
    """(t,)."""

    normals: Array
    """(t, 3): unit normals, 0 of triangles without area."""

    centers: Array
    """(t, 3)."""

    scales: Array
    """(t,): the edge of equilateral triangles as large as those around a triangle in the mean."""

    variances: Array
    """(t,): of the components of a normal along the surface, from the noise of the corners."""

    simplified: bool
    """Whether triangles are as large as the shape lets them be, so that neighbors tell little of their normals."""

    @property
    def qualities(self) -> Array:
        """(t,): 1 if equilateral, 0 if without area."""
        return 4 * np.sqrt(3) * self.areas / np.maximum((self.sides**2).sum(axis=1), 1e-300)

    @property
    def tilts(self) -> Array:
        """(t,): deviation of the components of a normal along the surface, for one of 1 of the corners."""
        return np.sqrt((self.sides**2).sum(axis=1) / np.maximum(8 * self.areas**2, 1e-200))

    def seen(self, noise: float, scales: Array) -> Facets:
        """Return them with what the noise of their vertices and the scales (t,) around them tell."""
        variances = noise**2 * self.tilts**2
        known = np.sqrt(variances) @ self.areas < KNOWN * self.areas.sum()
        simplified = bool(known and self.qualities.mean() < SIMPLIFIED)
        return self._replace(scales=scales, variances=variances, simplified=simplified)


def measured(vertices: Array, faces: Indices, mates: Indices) -> Facets:
    """Return the facets of triangles, with zeros for what triangles around them and the noise tell."""
    corners = vertices[faces]
    sides = norm(corners - corners[:, [2, 0, 1]])
    vectors = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = norm(vectors)
    normals = vectors / np.where(doubled > 0, doubled, 1.0)[:, None]
    unknown = np.zeros(len(faces))
    return Facets(
        vertices, faces, mates, sides, doubled / 2, normals, corners.mean(axis=1), unknown, unknown, simplified=False
    )


def vertex_noise(facets: Facets) -> float:
    """Return the standard deviation of the positions of vertices that a surface itself shows, along its normals.

    The four corners at an inner edge, projected along the normal, have one affine relation. Where the surface is flat,
    the heights in that relation, with coefficients of unit length, have the deviation of a single vertex. The seventh
    of the edges that bends least tells it: creases and curvature bend the others more, and meshes of planes have none.
    Rounded coordinates put many edges into one plane: there half of those tell that are off by less than the rounding.
    """
    inner = np.flatnonzero(facets.mates > np.arange(facets.faces.size))
    other = facets.mates[inner]
    corners = facets.faces.ravel()
    a, b = corners[inner], corners[_after(inner)]
    c, d = corners[_after(_after(inner))], corners[_after(_after(other))]
    quads = facets.vertices[np.stack([a, b, c, d], axis=1)]
    quads = quads - quads[:, :1]
    normal = cross(quads[:, 1], quads[:, 2]) - cross(quads[:, 1], quads[:, 3])
    normal /= np.maximum(norm(normal), 1e-300)[:, None]
    area = [dot(cross(quads[:, j] - quads[:, i], quads[:, k] - quads[:, i]), normal) for i, j, k in TRIPLES]
    relation = np.stack(area, axis=1) * [1, -1, 1, -1]
    heights = dot(quads, normal[:, None])
    off = np.abs((relation * heights).sum(axis=1)) / np.maximum(norm(relation), 1e-300)
    noise, step = float(np.quantile(off, FEW)) / DEVIATION if len(off) else 0.0, _step(facets.vertices)
    largest = LARGEST * float(np.sqrt(facets.areas.mean()))
    if step < largest and (off < step).any():
        noise = max(noise, min(float(np.median(off[off < step])) / HALF_DEVIATION, step / np.sqrt(12)))
    return noise if noise < largest else 0.0


def _step(vertices: Array) -> float:
    """Return the length of which all differences of coordinates are multiples; 0 if there is none."""
    known = np.unique(np.abs(vertices - vertices[:1]))
    gaps = np.diff(known)[np.diff(known) > FINEST * known[-1]]
    if not len(gaps):
        return 0.0
    step = float(known[-1] / np.round(known[-1] / gaps.min()))
    counts = known / step
    return step if np.abs(counts - np.round(counts)).max() < 0.05 else 0.0


FINEST = 1e-6
"""Step of coordinates, over their range, that is looked for: single precision has about as many digits."""

LARGEST = 0.5
"""Of the root of a triangle's area: what is more, noise or rounding, is the shape of a mesh of few triangles."""

TRIPLES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
"""The corners left where one of four is taken away."""

FEW, DEVIATION, HALF_DEVIATION = 0.15, 0.18912, 0.67449
"""A share, and the values below which so many and half of the absolute values of a standard normal distribution are."""


def _after(half: Indices) -> Indices:
    """Return the half-edges that follow others around their triangles."""
    return half - half % 3 + (half + 1) % 3
