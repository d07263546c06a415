"""Readable references of the kernels of the automatic initialization, written from their definitions."""

from __future__ import annotations

import itertools

import numpy as np
from scipy import ndimage

CORNERS = np.ones((3, 3, 3))
EDGES = ndimage.generate_binary_structure(3, 2)


def near(points, reach, shape):
    at = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), axis=-1).astype(float)
    return np.any([((at - point) ** 2).sum(axis=-1) <= reach**2 for point in points], axis=0)


def outside(near):
    label, _ = ndimage.label(~near)
    return (label == label[0, 0, 0]) & ~near


def splat(points, values, shape):
    out = np.zeros(shape)
    for point, value in zip(points, values, strict=True):
        low = point.astype(int)
        for corner in itertools.product((0, 1), repeat=3):
            weight = np.prod(np.where(corner, point - low, 1 - point + low))
            out[tuple(low + corner)] += weight * value
    return out


def interpolate(field, points):
    values, gradients = [], []
    for point in points:
        low = point.astype(int)
        block = field[tuple(slice(i, i + 2) for i in low)]
        x, y, z = point - low
        wx, wy, wz, d = np.array([1 - x, x]), np.array([1 - y, y]), np.array([1 - z, z]), np.array([-1, 1])
        values.append(np.einsum("ijk,i,j,k", block, wx, wy, wz))
        parts = (d, wy, wz), (wx, d, wz), (wx, wy, d)
        gradients.append([np.einsum("ijk,i,j,k", block, *weights) for weights in parts])
    return np.array(values), np.array(gradients)


def is_simple(block):
    """Whether the center cell of a 3x3x3 block may be removed from a 6-connected solid."""
    around = block.copy()
    around[1, 1, 1] = False
    label, _ = ndimage.label(around & EDGES)
    touching = {label[p] for p in ((0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2))} - {0}
    outside = ~block
    outside[1, 1, 1] = False
    return len(touching) == 1 and ndimage.label(outside, CORNERS)[1] == 1


def thin(solid, keep, cells, rounds):
    out = solid.copy()
    for _ in range(rounds):
        before = out.sum()
        for i, j, k in cells:
            block = out[i - 1 : i + 2, j - 1 : j + 2, k - 1 : k + 2]
            if out[i, j, k] and not keep[i, j, k] and is_simple(block):
                out[i, j, k] = False
        if out.sum() == before:
            break
    return out


def normal(p, q, r):
    return np.cross(q - p, r - p)


def cosine(a, b):
    norm = np.sqrt(a @ a * (b @ b))
    return a @ b / norm if norm > 0 else -1.0


def quality(p, q, r):
    sides = ((p - q) ** 2).sum() + ((q - r) ** 2).sum() + ((r - p) ** 2).sum()
    return np.linalg.norm(normal(p, q, r)) / sides if sides > 0 else 0.0


def flip_round(vertices, faces, mates):
    """Flip edges in the order of their half-edges, as sets of triangles; return faces as sets and the count.

    The kernel keeps half-edges, this one only triangles: it looks everything up by corners.
    """
    faces = [tuple(int(c) for c in face) for face in faces]
    mates = [int(m) for m in np.ravel(mates)]
    flips = 0
    for h in range(len(mates)):
        g = mates[h]
        if g < h:
            continue
        t, u = h // 3, g // 3
        a, b, c = _from(faces[t], h % 3)
        d = _from(faces[u], g % 3)[2]
        valence = np.bincount(np.ravel(faces))
        gain = sum((valence[v] - 6) ** 2 for v in (a, b, c, d))
        after = sum((valence[v] - 6 - 1) ** 2 for v in (a, b)) + sum((valence[v] - 6 + 1) ** 2 for v in (c, d))
        if after >= gain or min(valence[a], valence[b]) <= 4:
            continue
        if any(c in face and d in face for face in faces):
            continue
        p, q, r, s = (vertices[v] for v in (a, b, c, d))
        one, two = normal(p, q, r), normal(q, p, s)
        new = normal(p, s, r), normal(s, q, r)
        if cosine(one, two) < 0.5 or min(cosine(n, one + two) for n in new) < 0.5:
            continue
        if min(quality(p, s, r), quality(s, q, r)) <= 0.25 * min(quality(p, q, r), quality(q, p, s)):
            continue
        faces[t], faces[u] = (a, d, c), (d, b, c)
        mates = _mates(faces)
        flips += 1
    return faces, flips


def _from(face, j):
    return face[j], face[(j + 1) % 3], face[(j + 2) % 3]


def _mates(faces):
    start = {(f[j], f[(j + 1) % 3]): 3 * t + j for t, f in enumerate(faces) for j in range(3)}
    return [start[f[(j + 1) % 3], f[j]] for f in faces for j in range(3)]


def relax_round(vertices, faces, step):
    out = np.array(vertices)
    for v in range(len(out)):
        ring = [_from(tuple(f), list(f).index(v)) for f in faces if v in f]
        if not ring:
            continue
        normals = np.array([normal(*out[list(f)]) for f in ring])
        areas = np.linalg.norm(normals, axis=1)
        center = (areas[:, None] * np.array([out[list(f)].mean(axis=0) for f in ring])).sum(axis=0) / areas.sum()
        n = normals.sum(axis=0)
        move = center - out[v]
        move = move - n * (n @ move) / (n @ n)
        for scale in (step, step / 2, step / 4, step / 8):
            moved = out[v] + scale * move
            if all(cosine(normal(*out[list(f)]), normal(moved, out[f[1]], out[f[2]])) >= 0.5 for f in ring):
                out[v] = moved
                break
    return out


def collapse_shortest(vertices, faces, triangles, turn):
    """The shortest edge collapsed to its midpoint, repeatedly, as by `_kernels_remesh.collapse_shortest`."""
    at = {v: np.array(p) for v, p in enumerate(vertices)}
    faces = {tuple(face) for face in faces.tolist()}
    refused = set()

    def around(v):
        return {face for face in faces if v in face}

    def neighbors(v):
        return set().union(*around(v)) - {v}

    def normal(face, places):
        p, q, r = (places[v] for v in face)
        n = np.cross(q - p, r - p)
        return n / np.linalg.norm(n)

    def fair(a, b):
        there = {**at, a: (at[a] + at[b]) / 2}
        stay = (face for face in around(a) if b not in face)
        return all(normal(face, at) @ normal(face, there) >= turn for face in stay)

    while len(faces) > max(triangles, 4):
        edges = {(min(e), max(e)) for face in faces for e in itertools.combinations(face, 2)} - refused
        if not edges:
            break
        a, b = min(edges, key=lambda edge: ((at[edge[0]] - at[edge[1]]) ** 2).sum())
        tetrahedron = len(around(a)) == len(around(b)) == 3
        if len(neighbors(a) & neighbors(b)) != 2 or tetrahedron or not (fair(a, b) and fair(b, a)):
            refused.add((a, b))
            continue
        at[a] = (at[a] + at[b]) / 2
        gone = around(a) & around(b)
        faces = {tuple(a if v == b else v for v in face) for face in faces - gone}
        refused = {edge for edge in refused if a not in edge and b not in edge}
    return at, faces
