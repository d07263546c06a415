"""Normals of triangles without the noise of their vertices, sharp at creases."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm, normalized
from simplexmesh.surface.features.lines import _kernels_normals
from simplexmesh.surface.features.lines._kernels_patches import patches
from simplexmesh.surface.features.lines.facets import EVEN, Facets, measured
from simplexmesh.surface.features.lines.noise import vertex_noise

PATCH = 5.0
"""Least radius of patches, in standard deviations of the noise: the mean over one errs by some 10 degrees."""

ROUNDS = 10
"""Averages taken; twice as many round off soft creases at low noise."""

LEAST_GAIN = 0.25
"""A patch beside a triangle guides it if its normals differ so much less: else curved surfaces turn into stairs."""

PURE = 0.05
"""How much the normals of patches that guide others may differ on simplified surfaces, beside what noise explains."""

EXACT = 0.005
"""In radians: normals known to a third of a degree need no neighbors where triangles are not as scanners make them."""

FLAT = 1e-3
"""In radians: triangles of files in single precision are in one plane to that."""

COARSE, STRIPS = 300, 0.5
"""Triangles of coarse solids, and the share of them in one plane with others above which files are made of strips."""


def sampled(vertices: Array, faces: Indices, mates: Indices) -> tuple[Facets, Array, Mask]:
    """Return facets with their noise, normals (t, 3) filtered of it, and whose are given ones (t,).

    Guided bilateral filtering of normals (Zhang et al. 2015): each is averaged with those whose guides, the means of
    the most consistent patches around, are alike. A triangle that straddles a crease so takes the normal of one side.
    """
    facets = measured(vertices, faces, mates)
    noise = vertex_noise(facets)
    everywhere = np.arange(len(faces))
    ring = patches(faces, len(vertices), facets.centers, np.zeros(len(faces)), everywhere)
    owner, counts = np.repeat(np.arange(len(faces)), np.diff(ring[0])), np.diff(ring[0])
    scales = np.sqrt(4 / np.sqrt(3) * np.bincount(owner, facets.areas[ring[1]]) / counts)
    facets = facets.seen(noise, np.maximum(scales, 1e-9 * facets.longest.max(initial=0.0)))
    even = facets.uniform | (np.bincount(owner, facets.qualities[ring[1]]) / counts >= EVEN)
    height = 2 * facets.areas / np.maximum(facets.longest, 1e-300)
    exact = (~even | _in_planes(facets, *ring)) & (np.sqrt(2) * noise < EXACT * height)
    around = patches(faces, len(vertices), facets.centers, PATCH * noise, everywhere) if noise.any() else ring
    return facets, _filtered(facets, exact, *around), exact


def _in_planes(facets: Facets, offsets: Indices, members: Indices) -> Mask:
    """Return which triangles (t,) are in one plane with those next to them, and so on to one whose whole patch is.

    Those in one plane with others also count where no such patch is near, unless a grid may have made them, and all
    where none is at all, in meshes without noise of few triangles, or of strips: curved facets of others are no planes.
    """
    means, spreads = np.empty_like(facets.normals), np.empty(len(facets.normals))
    _kernels_normals.fill_means(len(means), offsets, members, facets.areas, facets.normals, means, spreads)
    half = np.flatnonzero(facets.mates > np.arange(len(facets.mates)))
    one, two = half // 3, facets.mates[half] // 3
    flat = norm(facets.normals[one] - facets.normals[two]) < FLAT
    links = csr_matrix((np.ones(int(flat.sum()), bool), (one[flat], two[flat])), (len(spreads), len(spreads)))
    labels = connected_components(links, directed=False)[1]
    pure = spreads < FLAT**2
    owner, near = np.repeat(np.arange(len(pure)), np.diff(offsets)), pure
    for _ in range(2):
        near = np.bincount(owner, near[members]) > 0
    paired = np.zeros(len(pure), bool) if facets.uniform else np.bincount(labels)[labels] > 1
    coarse = not pure.any() and float(facets.noise.mean()) < FLAT * float(facets.scales.mean())
    coarse &= len(pure) < COARSE or bool(paired.mean() > STRIPS)
    alone: Mask = (paired | coarse) & ~near
    return alone | (np.bincount(labels, pure)[labels] > 0)


def _filtered(facets: Facets, exact: Mask, offsets: Indices, members: Indices) -> Array:
    """Return normals (t, 3) averaged over patches of triangles with normals alike, but for exact ones."""
    weights = np.empty(len(members))
    _kernels_normals.fill_weights(len(facets.areas), offsets, members, facets.centers, facets.areas, weights)
    alike = 0.1 + 0.85 * facets.noise / np.sqrt((facets.scales**2).mean())
    limits = np.ones(len(facets.faces))
    if facets.simplified:
        owner, areas = np.repeat(np.arange(len(limits)), np.diff(offsets)), facets.areas[members]
        explained = np.bincount(owner, areas * facets.variances[members])
        limits = PURE + 4 * explained / np.maximum(np.bincount(owner, areas), 1e-300)
    normals, averaged = facets.normals.copy(), np.empty_like(facets.normals)
    means, guides, spreads = np.empty_like(normals), np.empty_like(normals), np.empty(len(normals))
    for _ in range(ROUNDS):
        _kernels_normals.fill_means(len(means), offsets, members, facets.areas, normals, means, spreads)
        _kernels_normals.fill_guides(
            len(guides), offsets, members, facets.normals, means, spreads, LEAST_GAIN, limits, guides
        )
        guides[exact] = facets.normals[exact]
        _kernels_normals.fill_averages(len(averaged), offsets, members, weights, guides, normals, alike, averaged)
        averaged[exact] = facets.normals[exact]
        normals, averaged = averaged, normals
    return normals


def within_zones(facets: Facets, labels: Indices, at: Indices) -> Array:
    """Return the mean normals (k, 3) of the parts of patches that are in the zones of triangles (k,)."""
    offsets, inside = patches(facets.faces, len(facets.vertices), facets.centers, PATCH * facets.noise[at], at)
    owner = np.repeat(np.arange(len(at)), np.diff(offsets))
    weights = facets.areas[inside] * (labels[inside] == labels[at][owner])
    total = np.stack([np.bincount(owner, weights * facets.normals[inside, k], len(at)) for k in range(3)], axis=1)
    return normalized(total.astype(float))
