"""The topology of a surface known by points: the genus that persists over a range of offset radii.

The union of balls around the points has gaps for small radii, and its tunnels close for large ones. In between its
genus is constant. Its boundary, an offset surface, shows the place of each tunnel once it is projected to the points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.initial.planes import planes
from simplexmesh.motion.initial.polygonize import isosurface
from simplexmesh.motion.initial.remesh import decimated
from simplexmesh.motion.initial.topology import euler, pieces, without_cavities

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CELLS = 96
"""Maximum number of grid cells along the longest side of the bounding box."""

LARGEST, GROWTH = 0.2, 1.09
"""The largest radius relative to that side, and the ratio of consecutive radii."""

STEADY = 3
"""Number of consecutive radii with the same genus for it to be accepted."""

SMALLEST, LATEST_START, LAST = 0.6, 2.0, 3.0
"""In distances between neighbors: the first radius, the largest at which a steady genus may begin, and the last."""

CLOSURE = 0.03
"""A wall has just closed when the enclosed volume increases by this fraction of the body."""

MOST_FOR_NONE = 0.1
"""Radius, relative to the longest side, above which genus 0 is no evidence against tunnels."""

NEIGHBORS, MOST_POINTS, TRIANGLES = 6, 20_000, 12_000
PROJECTIONS, INTERPOLATIONS = 3, 10
"""Iterations of projection to local planes, and of interpolation of the points themselves."""

FEW = 600
"""Up to this number of points are taken to be exact: the surface interpolates them."""


@dataclass(frozen=True, eq=False)
class Shell:
    """A closed surface through points, with the topology that they show.

    Attributes
    ----------
    radius : float
        Of the balls, in the unit of the points; gaps between points are narrower than twice that, tunnels wider.
    genus : int
        Number of tunnels.
    vertices : (v, 3) array of float
        Positions on the surface of the points.
    offset_vertices : (v, 3) array of float
        Positions on the offset surface, at the radius from the points, which is free of folds.
    faces : (t, 3) array of int
        Counter-clockwise seen from outside.
    """

    radius: float
    genus: int
    vertices: Array
    offset_vertices: Array
    faces: Indices


def shell_of(points: Array) -> Shell | None:
    """Return a closed surface through points, None when no genus is steady, as gaps are as wide as tunnels.

    Genus 0 is accepted at small radii only, as large balls close all tunnels.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> shell_of(sm.torus(24, 12).vertices).genus, shell_of(sm.sphere(8).vertices).genus
    (1, 0)
    >>> shell_of(np.random.default_rng(0).uniform(size=(40, 3))) is None
    True
    """
    if len(points) > MOST_POINTS:
        points = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
    longest = float(np.ptp(points, axis=0).max())
    if not longest > 0:
        return None
    unit = 2.0 ** round(np.log2(longest))  # distances in the data's unit may be beyond single precision
    points = points / unit
    longest /= unit
    tree = cKDTree(points)
    count = min(NEIGHBORS + 1, len(points))
    spacing = float(np.median(tree.query(points, k=[count])[0]))
    cell = max(longest / CELLS, spacing / 3)
    margin = int(LARGEST * longest / cell) + 3
    away = _distances(points, cell, margin)
    radii = _radii(max(SMALLEST * spacing, 1.2 * cell), min(LARGEST * longest, LAST * spacing))
    found = _steady(radii, lambda radius: _body(away, radius))
    if found is None or found[0] > LATEST_START * spacing:
        return None
    radius, genus = found
    if genus == 0 and radius > MOST_FOR_NONE * longest:  # balls this large close tunnels, too
        return None
    vertices, faces = isosurface(radius - away, _body(away, radius)[0])
    vertices, faces = decimated(points.min(axis=0) + cell * (vertices - margin), faces, TRIANGLES)
    projected = _projected(vertices, points, tree)
    if len(points) <= FEW:
        projected = interpolating(projected, faces, points)
    return Shell(radius * unit, genus, projected * unit, vertices * unit, faces)


def _radii(first: float, last: float) -> Array:
    steps = int(np.log(last / first) / np.log(GROWTH)) + 1 if first < last else 0
    return np.asarray(first * GROWTH ** np.arange(steps))


def _steady(radii: Array, body: Callable[[float], tuple[NDArray[np.bool_], int]]) -> tuple[float, int] | None:
    """Return the first radius from which on the genus is steady, and that genus; None without any.

    A gap in the wall counts as a tunnel and may persist for some radii, so a genus found before the wall closes is
    rejected.
    """
    start, same, before, cavity = 0.0, 0, -1, 0
    found = None
    for radius in radii.tolist():
        solid, enclosed = body(radius)
        genus = 1 - euler(solid)
        if enclosed - cavity >= CLOSURE * np.count_nonzero(solid):
            found, before = None, -1
        start, same = (start, same + 1) if genus == before else (radius, 1)
        if same == STEADY and found is None:
            found = start, genus
        before, cavity = genus, enclosed
    return found


def _body(away: NDArray[np.float32], radius: float) -> tuple[NDArray[np.bool_], int]:
    """Return the largest piece of the union of balls with its cavities filled, and the number of cells in these."""
    wall = pieces(away < radius)[0]
    solid = without_cavities(wall)
    return solid, int(np.count_nonzero(solid) - np.count_nonzero(wall))


def _distances(points: Array, cell: float, margin: int) -> NDArray[np.float32]:
    """Return the distances of grid cells to the points, exact to a fraction of a cell.

    The points in a cell are replaced by their mean.
    """
    low = points.min(axis=0)
    shape = np.ceil(np.ptp(points, axis=0) / cell).astype(int) + 2 * margin + 1
    flat = np.ravel_multi_index((np.round((points - low) / cell).astype(int) + margin).T, tuple(shape))
    cells, owner, count = np.unique(flat, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(owner, points[:, axis] - low[axis]) / count for axis in range(3)], axis=1)
    number = np.full(int(np.prod(shape)), -1, np.int32)
    number[cells] = np.arange(len(cells))
    nearest = ndimage.distance_transform_edt(
        (number < 0).reshape(shape), return_distances=False, return_indices=True
    )  # fmt: skip
    own = number[np.ravel_multi_index(tuple(nearest), tuple(shape))]
    square = np.zeros(tuple(shape), np.float32)
    for axis in range(3):
        along = np.expand_dims(cell * (np.arange(shape[axis]) - margin), [k for k in range(3) if k != axis])
        square += (along - means[own, axis]) ** 2
    return np.asarray(np.sqrt(square))


def _projected(vertices: Array, points: Array, tree: cKDTree) -> Array:
    """Return vertices projected to the local planes of the points, blended by distance."""
    normals = planes(points).normals
    for _ in range(PROJECTIONS):
        far, near = tree.query(vertices, k=min(NEIGHBORS, len(points)))
        weight = np.exp(-2 * (far / np.maximum(far.mean(axis=1, keepdims=True), 1e-300)) ** 2)
        height = np.einsum("nki,nki->nk", vertices[:, None] - points[near], normals[near])
        step = np.einsum("nk,nk,nki->ni", weight, height, normals[near]) / weight.sum(axis=1)[:, None]
        vertices = vertices - step
    return vertices


def interpolating(vertices: Array, faces: Indices, points: Array) -> Array:
    """Return the vertices of a surface moved so that it interpolates nearby points.

    Parameters
    ----------
    vertices, faces : (v, 3) array of float, (t, 3) array of int
    points : (n, 3) array of float
        Fewer than vertices.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(16).triangulated()
    >>> points = 1.02 * sm.sphere(5).vertices
    >>> interpolating(ball.vertices, ball.faces, points).std(axis=0).round(2).tolist()
    [0.59, 0.59, 0.59]
    """
    for _ in range(INTERPOLATIONS):
        normals = TriangleMesh(vertices, faces).vertex_normals
        foot = cKDTree(vertices).query(points)[1]
        rise = np.einsum("ni,ni->n", points - vertices[foot], normals[foot])
        far, near = cKDTree(vertices[foot]).query(vertices, k=min(4, len(points)))
        weight = 1 / (far**2 + 1e-6 * (far**2).mean())
        vertices = vertices + ((weight * rise[near]).sum(axis=1) / weight.sum(axis=1))[:, None] * normals
    return vertices
