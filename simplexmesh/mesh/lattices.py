"""Regular triangulations, the duals of the primitive shapes: subdivided polyhedra, triangle strips on a rectangle."""

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import normalized

BASES = ("tetrahedron", "octahedron", "icosahedron")


def polyhedron(name: str) -> tuple[Array, Indices]:
    """Return the corners of a regular polyhedron on the unit sphere, and its triangles."""
    corners: list[list[float]]
    if name == "tetrahedron":
        corners = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
        faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    elif name == "octahedron":
        corners = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
        faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    else:
        t = (1 + math.sqrt(5)) / 2
        corners = [[-1, t, 0], [1, t, 0], [-1, -t, 0], [1, -t, 0], [0, -1, t], [0, 1, t]]
        corners += [[0, -1, -t], [0, 1, -t], [t, 0, -1], [t, 0, 1], [-t, 0, -1], [-t, 0, 1]]
        faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2]]
        faces += [[10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5]]
        faces += [[2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]]
    return normalized(np.array(corners, float)), np.array(faces)


def subdivided(corners: Array, faces: Indices, f: int) -> tuple[Array, Indices]:
    """Return a triangulation with each triangle divided into f^2, points shared along the edges."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(f + 1), np.arange(f + 1), indexing="ij"))
    i, j = i[i + j <= f], j[i + j <= f]
    weights = np.stack([f - i - j, i, j], axis=1)
    row = np.concatenate([[0], np.cumsum(np.arange(f + 1, 0, -1))])[:-1]
    at = row[i] + j
    up = at[i + j < f]
    right, above = row[i[i + j < f] + 1] + j[i + j < f], up + 1
    down = i + j < f - 1
    corner = right[(i + j)[i + j < f] < f - 1] + 1
    local = np.concatenate(
        [np.stack([up, right, above], axis=1), np.stack([row[i[down] + 1] + j[down], corner, at[down] + 1], axis=1)]
    )
    # Two triangles share a point when the same corners have the same barycentric weights.
    codes = np.sort(np.where(weights > 0, faces[:, None, :] * (f + 1) + weights, 0), axis=2)
    base = len(corners) * (f + 1)
    keys = (codes[..., 0] * base + codes[..., 1]) * base + codes[..., 2]
    _, first, number = np.unique(keys.ravel(), return_index=True, return_inverse=True)
    points = np.einsum("pk,fkx->fpx", weights / f, corners[faces]).reshape(-1, 3)
    return points[first], number.reshape(len(faces), -1)[:, local].reshape(-1, 3)


def strip(around: int, along: int) -> tuple[Array, Indices]:
    """Return rows of nearly equilateral triangles on the unit square, periodic in u; every second one is shifted."""
    row, i = np.divmod(np.arange((along + 1) * around), around)
    uv = np.stack([(i + 0.5 * (row % 2)) / around, row / along], axis=1)
    row, i = np.divmod(np.arange(along * around), around)
    here, right = row * around + i, row * around + (i + 1) % around
    above, above_right = here + around, right + around
    odd = row % 2 == 1
    first = np.stack([here, right, np.where(odd, above_right, above)], axis=1)
    second = np.stack([np.where(odd, here, right), above_right, above], axis=1)
    return uv, np.concatenate([first, second])


def sheet(across: int, along: int) -> tuple[Array, Indices]:
    """Return rows of nearly equilateral triangles that fill the unit square exactly."""
    short = np.arange(across + 1) / across
    long = np.concatenate([[0.0], (np.arange(across) + 0.5) / across, [1.0]])
    u = [long if row % 2 else short for row in range(along + 1)]
    uv = np.concatenate([np.stack([x, np.full(len(x), row / along)], axis=1) for row, x in enumerate(u)])
    start = np.cumsum([0, *(len(x) for x in u)])
    n, m = np.arange(across + 1), np.arange(across)
    triangles = []
    for row in range(along):
        lower, upper = start[row], start[row + 1]
        if row % 2:
            triangles += [np.stack([lower + n, lower + n + 1, upper + n], axis=1)]
            triangles += [np.stack([lower + m + 1, upper + m + 1, upper + m], axis=1)]
        else:
            triangles += [np.stack([lower + m, lower + m + 1, upper + m + 1], axis=1)]
            triangles += [np.stack([lower + n, upper + n + 1, upper + n], axis=1)]
    return uv, np.concatenate(triangles)


def tube(around: int, across: int) -> tuple[Array, Indices]:
    """Return rows of nearly equilateral triangles on the unit square, periodic: six at every point."""
    uv, triangles = strip(around, across)
    return uv[: around * across], triangles % (around * across)
