"""The simplex angle (Delingette 1994, 3.3): mean curvature from four points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.curvature.classic import _kernels_simplex_angle as kernels
from simplexmesh.surface.face_cycles import one_rings, simplex_neighbors
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND, OPEN
from simplexmesh.surface.registry import Estimates
from simplexmesh.surface.sampled_surface import SampledSurface

Codes = NDArray[np.uint8]


def estimate(samples: SampledSurface, around: Neighborhoods, normals: None) -> Estimates:
    """Return H = sin(phi) / r, of the sphere through a vertex and its three neighbors; of triangles, on the dual."""
    if samples.faces is not None:
        one_rings(samples, around, "simplex_angle")
        return _selected(_of_triangles(samples.points, samples.faces), around.centers)
    ring = simplex_neighbors(samples)
    if ring is None:
        raise ValueError("surface must be triangles or a simplex mesh for method 'simplex_angle', not points alone")
    one_rings(samples, around, "simplex_angle")
    mean, gauss, directions, reasons = _of_nodes(samples.points, ring.members.reshape(-1, 3))
    reasons = np.where((reasons == FOUND) & ~ring.closed, OPEN, reasons).astype(np.uint8)
    return _selected((mean, gauss, directions, reasons), around.centers)


def _of_nodes(points: Array, neighbors: Indices) -> tuple[Array, Array, Array, Codes]:
    """Return H, K, normals and reasons at vertices with three neighbors each."""
    n = len(points)
    mean, gauss, areas, normals = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros((n, 3))
    found, reasons = np.zeros(n, np.uint8), np.zeros(n, np.uint8)
    kernels.mean_curvatures(len(neighbors), neighbors, points, mean, normals, areas, found)
    kernels.gauss_curvatures(len(neighbors), neighbors, normals, areas, found, gauss, reasons)
    return mean, gauss, normals, reasons


def adjacent_faces(faces: Indices) -> Indices:
    """Return (f, 3): the face across the edge j, j + 1 of each face, -1 where there is none or more than one."""
    n, ahead = int(faces.max(initial=0)) + 1, np.roll(faces, -1, axis=1)
    here, there = (faces * n + ahead).ravel(), (ahead * n + faces).ravel()
    sides, place, times = np.unique(here, return_inverse=True, return_counts=True)
    owner = np.zeros(len(sides), np.int64)
    owner[place] = np.arange(len(here)) // 3
    back = np.searchsorted(sides, there).clip(max=len(sides) - 1)
    found = (sides[back] == there) & (times[back] == 1) & (times[place] == 1)
    return np.where(found, owner[back], -1).reshape(-1, 3)


def _of_triangles(points: Array, faces: Indices) -> tuple[Array, Array, Array, Codes]:
    """Return H, K, normals and reasons at the vertices of triangles: means over the faces around each."""
    n = len(points)
    across = adjacent_faces(faces)
    corners = points[faces]
    mean, gauss, normals, reasons = _of_nodes((corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3, across)
    good = reasons == FOUND
    at = faces[good].ravel()
    counts = np.bincount(at, minlength=n)

    def averaged(values: Array) -> Array:
        return np.asarray(np.bincount(at, np.repeat(values[good], 3), n) / np.maximum(counts, 1))

    summed = np.stack([averaged(normals[:, axis]) for axis in range(3)], axis=1)
    lengths = np.linalg.norm(summed, axis=1)
    used = np.bincount(faces.ravel(), minlength=n)
    degenerate = np.bincount(faces[reasons == DEGENERATE].ravel(), minlength=n)
    why = np.where(used == 0, FEW, np.where(degenerate > 0, DEGENERATE, OPEN))
    why = np.where(counts > 0, np.where(lengths > 0.0, FOUND, DEGENERATE), why).astype(np.uint8)
    return averaged(mean), averaged(gauss), summed / np.where(lengths > 0.0, lengths, 1.0)[:, None], why


def _selected(found: tuple[Array, Array, Array, Codes], centers: Indices) -> Estimates:
    """Return the estimates of some vertices."""
    mean, gauss, normals, reasons = found
    mean, gauss = mean[centers], gauss[centers]
    amplitude = np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return Estimates(mean + amplitude, mean - amplitude, mean, gauss, reasons[centers], normals=normals[centers])
