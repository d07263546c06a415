"""How many tunnels points show: balls around them bound a body whose genus stays the same while they grow.

Small balls leave gaps, large ones close tunnels. In between the genus does not change, and the surface of that body,
drawn in to the points, tells where each tunnel is.
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
"""Cells of the grid along the longest side of the points, at most."""

LARGEST, GROWTH = 0.2, 1.09
"""The largest radius against that side, and how much larger each is than the one before."""

STEADY = 3
"""The genus is believed that stays the same for so many radii in a row."""

SMALLEST, SOON, LATE = 0.6, 2.0, 3.0
"""In distances between neighbors: the first radius, that from which on the genus must be steady, and the last."""

CLOSED = 0.03
"""A wall has just closed when the hollow it encloses grows by this share of the body."""

HIDDEN = 0.1
"""Balls larger than that, against the longest side, tell nothing of tunnels when they show none."""

NEIGHBORS, MOST_POINTS, TRIANGLES = 6, 20_000, 12_000
ONTO, THROUGH = 3, 10
"""Steps on to planes through the points, then through the points themselves."""

FEW = 600
"""So few points are exact: the surface goes through them."""


@dataclass(frozen=True, eq=False)
class Shell:
    """The closed surface that points lie on, of the topology they show.

    Attributes
    ----------
    radius : float
        Of the balls, in the unit of the points: gaps between points are narrower than twice that, tunnels wider.
    genus : int
        How many tunnels there are.
    vertices : (v, 3) array of float
        Near the points.
    around : (v, 3) array of float
        Where they were before they were drawn in: as far from the points as the radius, the surface free of folds.
    faces : (t, 3) array of int
        Counter-clockwise seen from outside.
    """

    radius: float
    genus: int
    vertices: Array
    around: Array
    faces: Indices


def shell_of(points: Array) -> Shell | None:
    """Return the closed surface around points, None when no genus is steady: gaps are as wide as tunnels.

    All balls that are large enough show none: that says something only of small ones.

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
    tree = cKDTree(points)
    count = min(NEIGHBORS + 1, len(points))
    spacing = float(np.median(tree.query(points, k=[count])[0]))
    longest = float(np.ptp(points, axis=0).max())
    cell = max(longest / CELLS, spacing / 3)
    if not cell > 0:
        return None
    margin = int(LARGEST * longest / cell) + 3
    away = _distances(points, cell, margin)
    radii = _radii(max(SMALLEST * spacing, 1.2 * cell), min(LARGEST * longest, LATE * spacing))
    found = _steady(radii, lambda radius: _body(away, radius))
    if found is None or found[0] > SOON * spacing:
        return None
    radius, genus = found
    if genus == 0 and radius > HIDDEN * longest:  # so large balls close tunnels, too
        return None
    corners, faces = isosurface(radius - away, _body(away, radius)[0])
    corners, faces = decimated(points.min(axis=0) + cell * (corners - margin), faces, TRIANGLES)
    onto = _drawn_in(corners, points, tree)
    if len(points) <= FEW:
        onto = through(onto, faces, points)
    return Shell(radius, genus, onto, corners, faces)


def _radii(first: float, last: float) -> Array:
    steps = int(np.log(last / first) / np.log(GROWTH)) + 1 if first < last else 0
    return np.asarray(first * GROWTH ** np.arange(steps))


def _steady(radii: Array, body: Callable[[float], tuple[NDArray[np.bool_], int]]) -> tuple[float, int] | None:
    """Return the first radius whose genus the next ones keep, and that genus.

    A gap in the wall looks like a tunnel, and may stay for some radii: none is believed before the wall has closed.
    """
    start, same, before, hollow = 0.0, 0, -1, 0
    found = None
    for radius in radii.tolist():
        solid, enclosed = body(radius)
        genus = 1 - euler(solid)
        if enclosed - hollow >= CLOSED * np.count_nonzero(solid):
            found, before = None, -1
        start, same = (start, same + 1) if genus == before else (radius, 1)
        if same == STEADY and found is None:
            found = start, genus
        before, hollow = genus, enclosed
    return found


def _body(away: NDArray[np.float32], radius: float) -> tuple[NDArray[np.bool_], int]:
    """Return the largest piece of what is within a radius of points with what it encloses, and how much that is."""
    wall = pieces(away < radius)[0]
    solid = without_cavities(wall)
    return solid, int(np.count_nonzero(solid) - np.count_nonzero(wall))


def _distances(points: Array, cell: float, margin: int) -> NDArray[np.float32]:
    """Return how far the cells of a grid are from the points, within a fraction of a cell.

    Each cell with points in it stands for their mean.
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


def _drawn_in(places: Array, points: Array, tree: cKDTree) -> Array:
    """Return places near points on the planes through these, blended by how near they are."""
    normals = planes(points).normals
    for _ in range(ONTO):
        far, near = tree.query(places, k=min(NEIGHBORS, len(points)))
        weight = np.exp(-2 * (far / np.maximum(far.mean(axis=1, keepdims=True), 1e-300)) ** 2)
        height = np.einsum("nki,nki->nk", places[:, None] - points[near], normals[near])
        step = np.einsum("nk,nk,nki->ni", weight, height, normals[near]) / weight.sum(axis=1)[:, None]
        places = places - step
    return places


def through(corners: Array, faces: Indices, points: Array) -> Array:
    """Return the corners of a surface moved so that it goes through points near it.

    Parameters
    ----------
    corners, faces : (v, 3) array of float, (t, 3) array of int
    points : (n, 3) array of float
        Fewer than corners.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(16).triangulated()
    >>> points = 1.02 * sm.sphere(5).vertices
    >>> through(ball.vertices, ball.faces, points).std(axis=0).round(2).tolist()
    [0.59, 0.59, 0.59]
    """
    for _ in range(THROUGH):
        normals = TriangleMesh(corners, faces).vertex_normals
        foot = cKDTree(corners).query(points)[1]
        rise = np.einsum("ni,ni->n", points - corners[foot], normals[foot])
        far, near = cKDTree(corners[foot]).query(corners, k=min(4, len(points)))
        weight = 1 / (far**2 + 1e-6 * (far**2).mean())
        corners = corners + ((weight * rise[near]).sum(axis=1) / weight.sum(axis=1))[:, None] * normals
    return corners
