"""Naive references of the mesh kernels, written from the definitions."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np


def rotate(dart, by=1):
    return 3 * (dart // 3) + (dart + by) % 3


def face_orbits(twin):
    """Faces as the orbits of next(d) = rotate^-1(twin(d)), numbered by smallest dart."""
    face, darts, offsets = [-1] * len(twin), [], [0]
    for start in range(len(twin)):
        dart = start
        while face[dart] < 0:
            face[dart] = len(offsets) - 1
            darts.append(dart)
            dart = rotate(int(twin[dart]), -1)
        if len(darts) > offsets[-1]:
            offsets.append(len(darts))
    return face, darts, offsets


def component_labels(neighbors):
    labels = {}
    count = 0
    for start in range(len(neighbors)):
        if start in labels:
            continue
        front = {start}
        while front:
            labels.update(dict.fromkeys(front, count))
            front = {int(k) for i in front for k in neighbors[i] if k >= 0 and int(k) not in labels}
        count += 1
    return [labels[i] for i in range(len(neighbors))]


def rings(neighbors, size):
    out = []
    for i in range(len(neighbors)):
        ring = {i}
        for _ in range(size):
            ring |= {int(k) for j in ring for k in neighbors[j]}
        out.append(sorted(ring))
    return out


def half_edge_mates(faces):
    """The other half-edge on each edge, -1 on a border; None where an edge has three."""
    on_edge = {}
    for t, corners in enumerate(faces):
        for j in range(3):
            on_edge.setdefault(frozenset((corners[j], corners[(j + 1) % 3])), []).append(3 * t + j)
    if max(map(len, on_edge.values())) > 2:
        return None
    out = [-1] * (3 * len(faces))
    for halves in on_edge.values():
        if len(halves) == 2:
            out[halves[0]], out[halves[1]] = halves[1], halves[0]
    return out


def _side(a, b, c, d):
    """Sign of the determinant of a - d, b - d, c - d, in exact arithmetic."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = ([x - y for x, y in zip(p, d, strict=True)] for p in (a, b, c))
    det = ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
    return (det > 0) - (det < 0)


def _pierces(p, q, a, b, c):
    if _side(a, b, c, p) * _side(a, b, c, q) != -1:
        return False
    around = {_side(p, q, a, b), _side(p, q, b, c), _side(p, q, c, a)}
    return not {1, -1} <= around and around != {0}


def crossing_triangles(points, triangles):
    """All pairs of triangles that cross other than in shared corners or edges, in exact arithmetic."""
    exact = [[Fraction(float(x)) for x in p] for p in points]
    out = []
    for s, t in combinations(range(len(triangles)), 2):
        S, T = triangles[s].tolist(), triangles[t].tolist()
        shared = set(S) & set(T)
        if len(shared) > 1:
            continue
        edges = [(e, T) for e in combinations(S, 2)] + [(e, S) for e in combinations(T, 2)]
        if any(
            not shared & set(edge) and _pierces(*(exact[i] for i in edge), *(exact[i] for i in other))
            for edge, other in edges
        ):
            out.append([s, t])
    return np.array(out, int).reshape(-1, 2)


def sphere_radius(p, a, b, c):
    """Radius of the sphere through four points, from the linear equations of its center."""
    center = np.linalg.solve(2 * np.array([a - p, b - p, c - p]), [a @ a - p @ p, b @ b - p @ p, c @ c - p @ p])
    return np.linalg.norm(center - p)


def face_area(points):
    center = points.mean(axis=0)
    return sum(
        np.linalg.norm(np.cross(p - center, q - center)) / 2
        for p, q in zip(points, np.roll(points, -1, axis=0), strict=True)
    )


def height(points, neighbors):
    """The height of each vertex above the plane of its neighbors."""
    a, b, c = points[neighbors].transpose(1, 0, 2)
    n = np.cross(b - a, c - a)
    return ((points - a) * n).sum(axis=1) / np.linalg.norm(n, axis=1)
