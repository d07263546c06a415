"""Naive twins of refinement: the factors of a face's score, the best cut by exhaustive search, disjoint groups."""

from __future__ import annotations

import itertools

import numpy as np


def loops(connectivity):
    return np.split(connectivity.face_vertices, connectivity.face_offsets[1:-1])


def elongation(points):
    lengths = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    return 1 + (lengths.max() - lengths.min()) / np.median(lengths)


def area(points):
    spokes = points - points.mean(axis=0)
    return 0.5 * np.linalg.norm(np.cross(spokes, np.roll(spokes, -1, axis=0)), axis=1).sum()


def bending(mesh):
    """Per vertex, the mean over its neighbors of the squared change of normal per squared length."""
    out = []
    for i, around in enumerate(mesh.neighbors):
        turn = ((mesh.normals[around] - mesh.normals[i]) ** 2).sum(axis=1)
        length = ((mesh.vertices[around] - mesh.vertices[i]) ** 2).sum(axis=1)
        out.append((turn / length).mean())
    return np.array(out)


def score(mesh, away, reach):
    """Relative area x elongation x curvature x relative distance, face by face."""
    c, bend = mesh.connectivity, bending(mesh)
    faces = loops(c)
    areas = [0.0 if c.face_is_hole[f] else area(mesh.vertices[face]) for f, face in enumerate(faces)]
    out = []
    for f, face in enumerate(faces):
        if c.face_is_hole[f]:
            out.append(0.0)
            continue
        far = 0.0 if np.isnan(away[f]) else min(away[f], reach)
        turn = max(areas[f] * bend[face].mean(), far**2 / areas[f])
        out.append(areas[f] / sum(areas) * elongation(mesh.vertices[face]) * turn * far / reach)
    return np.array(out)


def cut_costs(mesh, face, may_grow, crowding):
    """The cost of each pair of darts that halves a face, in a dict; without pairs that may not be used."""
    c = mesh.connectivity
    darts = c.face_darts[c.face_offsets[face] : c.face_offsets[face + 1]].tolist()
    twin, beside, m = c.twin.reshape(-1), c.face.reshape(-1), len(darts)
    middle = {d: (mesh.vertices[d // 3] + mesh.vertices[twin[d] // 3]) / 2 for d in darts}
    pairs = [
        (a, b)
        for (i, a), (j, b) in itertools.combinations(enumerate(darts), 2)
        if abs((j - i + 2) - (m - (j - i) + 2)) <= m % 2
    ]
    length = {pair: np.linalg.norm(middle[pair[0]] - middle[pair[1]]) for pair in pairs}
    out = {}
    for pair in pairs:
        across = [beside[twin[d]] for d in pair]
        if all(may_grow[f] for f in across):
            beyond = sum(c.face_sizes[f] - 6 for f in across)
            out[frozenset(pair)] = length[pair] / max(length.values()) + crowding * beyond
    return out


def apart(groups, free, limit):
    """Groups chosen greedily in order, disjoint from those before."""
    free, out = set(np.flatnonzero(free).tolist()), []
    for i, group in enumerate(groups):
        if len(out) < limit and set(group.tolist()) <= free:
            out.append(i)
            free -= set(group.tolist())
    return out
