"""Patches of triangles: those that share a vertex with one, and those connected to it within a radius."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit

MOST = 1000
"""Triangles of a patch: of crumpled surfaces, and of fans, most would be in each."""


@njit(cache=True)
def _around_vertices(faces, n_vertices):
    """Return CSR (offsets, triangles) of the triangles at each vertex."""
    offsets = np.zeros(n_vertices + 1, np.int64)
    for t in range(len(faces)):
        for j in range(3):
            offsets[faces[t, j] + 1] += 1
    for v in range(n_vertices):
        offsets[v + 1] += offsets[v]
    filled, found = offsets[:-1].copy(), np.empty(3 * len(faces), np.int64)
    for t in range(len(faces)):
        for j in range(3):
            v = faces[t, j]
            found[filled[v]] = t
            filled[v] += 1
    return offsets, found


@njit(cache=True)
def _apart(centers, t, u):
    """Return the squared distance of two centers."""
    square = 0.0
    for axis in range(3):
        square += (centers[t, axis] - centers[u, axis]) ** 2
    return square


@njit(cache=True)
def patches(faces, n_vertices, centers, radii, at):
    """Return CSR (offsets, members) for triangles `at`: themselves, those that share a vertex, and those connected.

    Connected are those that share a vertex with one whose center is within a radius of the first's, each of which has
    its own, and are so too. Of too many these are the first that are found.
    """
    starts, around = _around_vertices(faces, n_vertices)
    offsets, stamp = np.zeros(len(at) + 1, np.int64), np.full(len(faces), -1, np.int64)
    members, place = np.empty(16 * len(at) + 64, np.int64), 0
    for i in range(len(at)):
        t = at[i]
        if place == len(members):
            members = np.concatenate((members, np.empty_like(members)))
        members[place], stamp[t], place, k = t, i, place + 1, place
        while k < place < offsets[i] + MOST:
            u = members[k]
            k += 1
            if u != t and (radii[i] == 0.0 or _apart(centers, t, u) > radii[i] * radii[i]):
                continue
            for turn in range(6):  # the hubs of fans last, or they would leave no room for neighbors
                v = faces[u, turn % 3]
                if (starts[v + 1] - starts[v] > MOST // 2) != (turn > 2):
                    continue
                for m in range(starts[v], starts[v + 1]):
                    if place == offsets[i] + MOST:
                        break
                    other = around[m]
                    if stamp[other] == i or (u != t and _apart(centers, t, other) > radii[i] * radii[i]):
                        continue
                    if place == len(members):
                        members = np.concatenate((members, np.empty_like(members)))
                    members[place], stamp[other] = other, i
                    place += 1
        offsets[i + 1] = place
    return offsets, members[:place].copy()
