"""Kernels of connectivity: face orbits, connected components, neighborhoods, half-edge matching."""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Indices, Indices32


@njit(cache=True)
def face_orbits(twin: Indices32) -> tuple[Indices32, Indices32, Indices32]:
    """Return the face left of each dart, numbered by smallest dart, the darts around the faces, and their offsets."""
    count = twin.size
    face = np.full(count, -1, np.int32)
    face_darts = np.empty(count, np.int32)
    offsets = np.empty(count // 3 + 2, np.int32)
    n_faces = 0
    at = 0
    for start in range(count):
        if face[start] >= 0:
            continue
        offsets[n_faces] = at
        dart = start
        while face[dart] < 0:
            face[dart] = n_faces
            face_darts[at] = dart
            at += 1
            back = twin[dart]
            corner = back % 3
            dart = back - 1 if corner > 0 else back + 2
        n_faces += 1
    offsets[n_faces] = at
    return face, face_darts, offsets[: n_faces + 1].copy()


@njit(cache=True)
def component_labels(neighbors: Indices32) -> Indices32:
    """Return the connected component of every row of `neighbors` (n, k), where -1 is none, numbered by smallest row."""
    n = neighbors.shape[0]
    labels = np.full(n, -1, np.int32)
    stack = np.empty(n, np.int32)
    n_components = 0
    for start in range(n):
        if labels[start] >= 0:
            continue
        labels[start] = n_components
        stack[0] = start
        top = 1
        while top > 0:
            top -= 1
            row = stack[top]
            for j in range(neighbors.shape[1]):
                other = neighbors[row, j]
                if other >= 0 and labels[other] < 0:
                    labels[other] = n_components
                    stack[top] = other
                    top += 1
        n_components += 1
    return labels


@njit(cache=True)
def _ring(neighbors: Indices32, vertex: int, size: int, stamp: Indices32, queue: Indices32) -> int:
    """Write the vertices within `size` edges of `vertex` to `queue`, sorted, and return their number."""
    stamp[vertex] = vertex
    queue[0] = vertex
    begin, end = 0, 1
    for _ in range(size):
        stop = end
        for at in range(begin, stop):
            for j in range(3):
                other = neighbors[queue[at], j]
                if stamp[other] != vertex:
                    stamp[other] = vertex
                    queue[end] = other
                    end += 1
        begin = stop
    queue[:end].sort()
    return end


@njit(cache=True)
def rings(neighbors: Indices32, size: int) -> tuple[Indices, Indices32]:
    """Return `(offsets, vertices)`: for each vertex, all vertices within `size` edges, itself included, sorted."""
    n = neighbors.shape[0]
    stamp = np.full(n, -1, np.int32)
    queue = np.empty(n, np.int32)
    offsets = np.zeros(n + 1, np.int64)
    out = np.empty(4 * n, np.int32)
    for vertex in range(n):
        count = _ring(neighbors, vertex, size, stamp, queue)
        start = offsets[vertex]
        if start + count > out.size:
            grown = np.empty(2 * (start + count), np.int32)
            grown[:start] = out[:start]
            out = grown
        out[start : start + count] = queue[:count]
        offsets[vertex + 1] = start + count
    return offsets, out[: offsets[n]].copy()


@njit(cache=True)
def half_edge_mates(faces: Indices) -> tuple[Indices, int]:
    """Return opposite half-edges (3t,), -1 on a border, and the first half-edge of an edge of three triangles or -1."""
    count = 3 * faces.shape[0]
    bits = 4
    while (1 << bits) < 2 * count:
        bits += 1
    mask = (1 << bits) - 1
    table = np.full(1 << bits, -1, np.int32)
    mates = np.full(count, -1, np.int64)
    for half in range(count):
        t, j = half // 3, half % 3
        a, b = faces[t, j], faces[t, (j + 1) % 3]
        low, high = min(a, b), max(a, b)
        at = ((low * 73856093) ^ (high * 19349663)) & mask
        while table[at] >= 0:
            u, k = table[at] // 3, table[at] % 3
            c, d = faces[u, k], faces[u, (k + 1) % 3]
            if min(c, d) == low and max(c, d) == high:
                break
            at = (at + 1) & mask
        other = table[at]
        if other < 0:
            table[at] = half
        elif mates[other] < 0:
            mates[other] = half
            mates[half] = other
        else:
            return mates, half
    return mates, -1
