"""Faces of regular triangulations, counter-clockwise seen from outside, and borders of meshes."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Indices, Mask
from simplexmesh.mesh.manifold import half_edge_mates


def quads(a: Indices, b: Indices, c: Indices, d: Indices, flipped: Mask | None = None) -> Indices:
    """Return two triangles for each quad a, b, c, d, split from a to c, or from b to d if flipped."""
    other = np.zeros(len(a), bool) if flipped is None else flipped
    first = np.where(other[:, None], np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other[:, None], np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return np.stack([first, second], axis=1).reshape(-1, 3)


def sheet(columns: int, rows: int) -> Indices:
    """Return faces of a grid of columns x rows quads, vertices row by row, with normals along z."""
    i, j = (part.ravel() for part in np.meshgrid(np.arange(columns), np.arange(rows)))
    corner = j * (columns + 1) + i
    return quads(corner, corner + 1, corner + columns + 2, corner + columns + 1)


def sawtooth(rows: int) -> Indices:
    """Return faces between rows of alternately rows + 1 and `rows` vertices."""
    i, start, faces = np.arange(rows), 0, []
    for row in range(rows):
        even = row % 2 == 0
        long, short = (start, start + rows + 1) if even else (start + rows, start)
        on_long = np.stack([long + i, long + i + 1, short + i], axis=1)
        on_short = np.stack([short + i + 1, short + i, long + i + 1], axis=1)[:-1]
        faces.append(np.concatenate([on_long, on_short])[:, [0, 1, 2] if even else [1, 0, 2]])
        start += rows + 1 if even else rows
    return np.concatenate(faces)


def tube(around: int, bands: int, flipped: Mask | None = None) -> Indices:
    """Return faces of bands of quads around an axis, parallel by parallel from below, with normals off the axis."""
    i, j = (part.ravel() for part in np.meshgrid(np.arange(around), np.arange(bands)))
    a, b = j * around + i, j * around + (i + 1) % around
    return quads(a, b, b + around, a + around, flipped)


def globe(meridians: int, bands: int, flipped: Mask | None = None) -> Indices:
    """Return faces of a sphere: vertex 0 is the upper pole, then parallels downward, then the lower pole."""
    last = meridians * (bands - 1) + 1
    ring = np.arange(1, meridians + 1)
    inside = tube(meridians, bands - 2, flipped)[:, ::-1] + 1
    return np.concatenate([fan(ring, 0), inside, fan((last - meridians + np.arange(meridians))[::-1], last)])


def fan(ring: Indices, tip: int) -> Indices:
    """Return triangles from the edges of a ring to a tip, counter-clockwise if the ring is."""
    return np.stack([ring, np.roll(ring, -1), np.full(len(ring), tip)], axis=1)


def on_border(faces: Indices, count: int) -> Mask:
    """Return whether each of `count` vertices is on an edge of only one face."""
    out = np.zeros(count, bool)
    out[faces[half_edge_mates(faces) < 0]] = True
    return out
