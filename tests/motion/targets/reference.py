"""Naive twins of the target kernels: written from the definitions, in NumPy, one point at a time."""

from __future__ import annotations

import numpy as np

FACING = 0.2
TURN = 0.15
FLOOR = 0.04


def form(surfel):
    xx, yy, zz, xy, xz, yz = surfel[6:12]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def height(surfel, place):
    """Height of a place above one surfel."""
    d = place - surfel[:3]
    return surfel[3:6] @ d - 0.5 * d @ form(surfel) @ d


def faces(surfel, normal, oriented, least=FACING):
    d = surfel[3:6] @ normal
    return (d if oriented else abs(d)) > least or not surfel[3:6].any()


def nearest_facing(table, place, normal, oriented, reach):
    """Index of the nearest surfel that faces along the normal, -1 where none is within reach."""
    distance = ((table[:, :3] - place) ** 2).sum(axis=1)
    seen = np.array([faces(surfel, normal, oriented) for surfel in table])
    distance[~seen | (distance > reach**2)] = np.inf
    best = int(np.argmin(distance))
    return best if np.isfinite(distance[best]) else -1


def around(table, place, normal, oriented, wide):
    """Indices of all surfels within sqrt(wide) that face along the normal or almost do, nearest first."""
    squared = ((table[:, :3] - place) ** 2).sum(axis=1)
    seen = np.array([faces(surfel, normal, oriented, FACING - TURN) for surfel in table])
    order = np.argsort(squared, kind="stable")
    return order[(seen & (squared <= wide))[order]]


def kinship(table, i, j, oriented):
    """Cosine between two surfels' normals, 0 unless they are of one sheet."""
    if i == j:
        return 1.0
    d = table[j, :3] - table[i, :3]
    agree = table[i, 3:6] @ table[j, 3:6]
    if (agree if oriented else abs(agree)) < 0.5 or (table[i, 3:6] @ d) ** 2 > 0.36 * d @ d:
        return 0.0
    return agree


def blended_height(table, support, neighbors, at, place, oriented):
    """Weighted mean height above a surfel and its seven nearest, and the sum of the weights."""
    total = value = 0.0
    for j in [at, *neighbors[at, :7]]:
        agree = kinship(table, at, j, oriented)
        d = place - table[j, :3]
        w = max(0.0, 1 - d @ d / support[j] ** 2) ** 2
        value += w * agree * height(table[j], place)
        total += w * abs(agree)
    return value / total, total


def plane_fit(points, place, normal, radius):
    """Quadric fitted once to points around a place: coefficients of 1, s, t, s^2/2, s t, t^2/2, and the frame."""
    u = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.9 else [0, 1.0, 0])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    local = (points - place) @ np.stack([u, v, normal], axis=1) / radius
    s, t, h = local.T
    w = 1 - s**2 - t**2
    keep = (w > 0) & (abs(h) <= 1)
    s, t, h, w = s[keep], t[keep], h[keep], w[keep]
    basis = np.stack([np.ones_like(s), s, t, s**2 / 2, s * t, t**2 / 2], axis=1)
    x = np.linalg.lstsq(basis * np.sqrt(w)[:, None], h * np.sqrt(w), rcond=None)[0]
    return x, u, v


def crossings(mask):
    """Midpoints (n, 3) between neighboring samples of which one is inside, and the axis of each."""
    padded = np.pad(mask.astype(bool), 2)
    found = []
    for axis in range(3):
        for at in np.ndindex(*padded.shape):
            before = list(at)
            before[axis] -= 1
            if at[axis] > 0 and padded[at] != padded[tuple(before)]:
                found.append([*((np.array(at) + before) / 2 - 2), axis])
    found = np.array(found).reshape(-1, 4)
    return found[:, :3], found[:, 3].astype(int)


def outward(mask, places, axes):
    """Unit directions away from the samples inside around each crossing; along its axis where these tell little."""
    padded, out = np.pad(mask.astype(bool), 4), []
    for place, axis in zip(places + 4, axes, strict=True):
        low, high = np.floor(place).astype(int), np.ceil(place).astype(int)
        box = tuple(slice(a - 1, b + 2) for a, b in zip(low, high, strict=True))
        around = np.argwhere(padded[box]) + low - 1
        direction = (place - around).sum(axis=0)
        side = 1.0 if padded[tuple(low)] else -1.0
        size = np.linalg.norm(direction)
        if side * direction[axis] < 0.3 * size or size == 0:
            direction[axis] = side * max(size, 1.0)
        out.append(direction / np.linalg.norm(direction))
    return np.array(out)


def boundary_criteria(points, rows, near, normals=None):
    """Normals of the planes through the neighbors, their largest angular gap there, and the offset of their mean."""
    offsets = points[near] - points[rows][:, None]
    centered = offsets - offsets.mean(axis=1, keepdims=True)
    axes = np.linalg.eigh(np.einsum("nki,nkj->nij", centered, centered))[1]
    found = axes[:, :, 0] if normals is None else normals
    free, off = [], []
    for normal, around in zip(found, offsets, strict=True):
        u, v = np.linalg.svd(normal[None])[2][1:]
        x, y = around @ u, around @ v
        angle = np.sort(np.arctan2(y, x))
        free.append(np.diff(np.append(angle, angle[0] + 2 * np.pi)).max())
        off.append(np.hypot(x.mean(), y.mean()) / np.hypot(x, y).max())
    return found, np.array(free), np.array(off)
