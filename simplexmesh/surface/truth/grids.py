"""Faces of regular triangulations, counter-clockwise seen from outside, and borders of meshes."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


def quads(a: Indices, b: Indices, c: Indices, d: Indices, flipped: Mask | None = None) -> Indices:
    """Return two triangles for each quad a, b, c, d, split from a to c, or from b to d if flipped.

    Examples
    --------
    >>> quads(*np.arange(4)[:, None]).tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    other = np.zeros(len(a), bool) if flipped is None else flipped
    first = np.where(other[:, None], np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other[:, None], np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return np.stack([first, second], axis=1).reshape(-1, 3)


def sheet(columns: int, rows: int) -> Indices:
    """Return faces of a grid of columns x rows quads, vertices row by row, with normals along z.

    Examples
    --------
    >>> sheet(1, 1).tolist()
    [[0, 1, 3], [0, 3, 2]]
    """
    i, j = (part.ravel() for part in np.meshgrid(np.arange(columns), np.arange(rows)))
    corner = j * (columns + 1) + i
    return quads(corner, corner + 1, corner + columns + 2, corner + columns + 1)


def sawtooth(rows: int) -> Indices:
    """Return faces between rows of alternately rows + 1 and `rows` vertices."""
    faces: list[list[int]] = []
    start = 0
    for j in range(rows):
        long, short = (start, start + rows + 1) if j % 2 == 0 else (start + rows, start)
        up = j % 2 == 0
        for i in range(rows):  # triangles with an edge on the long row
            a, b, tip = long + i, long + i + 1, short + i
            faces.append([a, b, tip] if up else [b, a, tip])
        for i in range(rows - 1):
            a, b, tip = short + i, short + i + 1, long + i + 1
            faces.append([b, a, tip] if up else [a, b, tip])
        start += rows + 1 if up else rows
    return np.array(faces)


def tube(around: int, bands: int, flipped: Mask | None = None) -> Indices:
    """Return faces of bands of quads around an axis, parallel by parallel from below, with normals off the axis."""
    i, j = (part.ravel() for part in np.meshgrid(np.arange(around), np.arange(bands)))
    a, b = j * around + i, j * around + (i + 1) % around
    return quads(a, b, b + around, a + around, flipped)


def torus(around: int, rows: int, flipped: Mask | None = None) -> Indices:
    """Return faces of a torus, parallel by parallel: a tube whose last row is its first."""
    return tube(around, rows, flipped) % (around * rows)


def globe(meridians: int, bands: int, flipped: Mask | None = None) -> Indices:
    """Return faces of a sphere: vertex 0 is the upper pole, then parallels downward, then the lower pole."""
    last = meridians * (bands - 1) + 1
    ring = np.arange(1, meridians + 1)
    inside = tube(meridians, bands - 2, flipped)[:, ::-1] + 1
    return np.concatenate([fan(ring, 0), inside, fan((last - meridians + np.arange(meridians))[::-1], last)])


def fan(ring: Indices, tip: int) -> Indices:
    """Return triangles from the edges of a ring to a tip, counter-clockwise if the ring is."""
    return np.stack([ring, np.roll(ring, -1), np.full(len(ring), tip)], axis=1)


def icosahedral(frequency: int) -> tuple[Array, Indices]:
    """Return unit vectors and faces of an icosahedron, subdivided evenly (class I) and projected.

    Examples
    --------
    >>> directions, faces = icosahedral(4)
    >>> len(directions), len(faces)
    (162, 320)
    """
    golden = (1 + 5**0.5) / 2
    base = np.array([[s, t * golden, 0] for s in (-1, 1) for t in (-1, 1)])
    corners = np.concatenate([np.roll(base, shift, axis=1) for shift in range(3)])
    step = {
        pair for pair in combinations(range(12), 2) if abs(np.linalg.norm(np.subtract(*corners[list(pair)])) - 2) < 1e-9
    }
    sides = [three for three in combinations(range(12), 3) if all(pair in step for pair in combinations(three, 2))]
    n = frequency
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)])
    place = {(int(i), int(j)): at for at, (i, j, _) in enumerate(weights)}
    up = [[place[i, j], place[i + 1, j], place[i, j + 1]] for i in range(n) for j in range(n - i)]
    down = [[place[i + 1, j], place[i + 1, j + 1], place[i, j + 1]] for i in range(n) for j in range(n - 1 - i)]
    small = np.array(up + down)
    points = np.concatenate([weights @ corners[list(three)] / n for three in sides])
    faces = np.concatenate([small + k * len(weights) for k in range(len(sides))])
    _, first, same = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    points, faces = points[first], same.reshape(-1)[faces]
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ni,ni->n", np.cross(b - a, c - a), a + b + c) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points / np.linalg.norm(points, axis=1)[:, None], faces


def on_border(faces: Indices, count: int) -> Mask:
    """Return whether each vertex is on an edge of only one face, (count,) array of bool.

    Examples
    --------
    >>> on_border(sheet(2, 2), 9).tolist()
    [True, True, True, True, False, True, True, True, True]
    """
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys, times = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    once = keys[times == 1]
    out = np.zeros(count, bool)
    out[once // count] = out[once % count] = True
    return out
