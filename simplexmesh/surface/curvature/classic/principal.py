"""libigl's principal curvatures (Panozzo, Puppo, Rocca 2010): quadrics over wide rings, in its own frames."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import cross, dot, norm, normalized
from simplexmesh.surface.neighborhoods import Neighborhoods, rings
from simplexmesh.surface.normals import faces as face_normals
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND
from simplexmesh.surface.registry import Estimates
from simplexmesh.surface.sampled_surface import SampledSurface

CHUNK = 50_000
"""Vertices whose rings are in memory at a time."""

CANCELED = 1e-6
"""Normals whose sum is shorter than this share of their number cancel."""


def estimate(samples: SampledSurface, around: Neighborhoods, normals: Array, *, radius: int) -> Estimates:
    """Return the results of `igl.principal_curvature`, in our signs and order, where it does not end the process."""
    radius = checks.integer("radius", radius, 2)
    if samples.faces is None:
        raise ValueError("surface must be triangles for method 'principal'")
    n = len(samples.points)
    d1, d2, k1, k2 = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    reasons = np.full(n, DEGENERATE, np.uint8)
    size = float(np.ptp(samples.points, axis=0).max()) or 1.0
    used, local, faces = _safe_part((samples.points - samples.points.mean(axis=0)) / size, samples.faces, radius)
    if len(used):
        first, second, greater, less, bad = igl.principal_curvature(local, faces, radius, useKring=True)
        reasons[used] = FOUND
        reasons[used[np.asarray(bad, np.int64)]] = FEW
        swapped = (greater < less)[:, None]
        d1[used], d2[used] = np.where(swapped, second, first), np.where(swapped, first, second)
        k1[used], k2[used] = np.maximum(greater, less) / size, np.minimum(greater, less) / size
    reasons[np.bincount(samples.faces.ravel(), minlength=n) == 0] = FEW
    kept = around.centers
    inward = (dot(face_normals.estimate(samples, around, weighting="area").normals, normals) < 0)[:, None]
    d1, d2 = np.where(inward, d2[kept], d1[kept]), np.where(inward, d1[kept], d2[kept])
    k1, k2 = np.where(inward[:, 0], -k2[kept], k1[kept]), np.where(inward[:, 0], -k1[kept], k2[kept])
    return _with_directions(k1, k2, d1, d2, reasons[kept], normals)


def _with_directions(
    k1: Array, k2: Array, d1: Array, d2: Array, reasons: NDArray[np.uint8], normals: Array
) -> Estimates:
    """Return estimates with normals orthogonal to both directions; on planes, where libigl has none, any directions."""
    reasons[~np.isfinite(k1 + k2) & (reasons == FOUND)] = DEGENERATE
    out = cross(d1, d2)
    out *= np.where(np.einsum("ij,ij->i", out, normals) < 0, -1.0, 1.0)[:, None]
    undirected = ~(np.abs(norm(out) - 1) < 1e-6)
    out[undirected] = normals[undirected]
    d1[undirected] = normalized(cross(out[undirected], np.eye(3)[np.abs(out[undirected]).argmin(axis=1)]))
    reasons[(norm(out) < 0.5) & (reasons == FOUND)] = DEGENERATE
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1, out)


def _safe_part(points: Array, faces: Indices, radius: int) -> tuple[Indices, Array, Indices]:
    """Return the vertices that libigl can process, their points, and the faces between them."""
    while True:
        used = np.unique(faces)
        local, faces = points[used], np.searchsorted(used, faces)
        good = _safe_vertices(local, faces, radius) if len(used) else np.ones(0, bool)
        if good.all():
            return used, local, faces
        faces = used[faces[good[faces].all(axis=1)]]


def _safe_vertices(points: Array, faces: Indices, radius: int) -> Mask:
    """Return which vertices have a normal; if all do, which are in components without cancelling neighborhoods."""
    directions = igl.per_vertex_normals(points, faces)
    safe: Mask = np.isfinite(directions).all(axis=1) & (norm(directions) > 0.5)
    if not safe.all():
        return safe
    n, samples = len(points), SampledSurface(points, faces)
    ring = samples.one_ring
    row = np.repeat(np.arange(n), ring.valence)
    turns = np.arccos(np.clip(np.einsum("ij,ij->i", directions[row], directions[ring.members]), -1, 1))
    total_turns = np.zeros(n)
    for _ in range(radius):
        total_turns = np.maximum.reduceat(turns + total_turns[ring.members], ring.offsets[:-1])
    doubtful = np.flatnonzero(total_turns > 1.5)  # normals within a right angle cannot cancel
    for start in range(0, len(doubtful), CHUNK):
        rows = doubtful[start : start + CHUNK]
        near = samples.around(rings(radius), rows)
        sums = np.add.reduceat(directions[near.members], near.offsets[:-1]) + directions[rows]
        safe[rows] = norm(sums) > CANCELED * (near.valence + 1)
    if safe.all():
        return safe
    return np.asarray(~np.isin(samples.components, samples.components[~safe]))
