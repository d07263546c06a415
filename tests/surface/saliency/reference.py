"""Naive twins of the parts of saliency, written from the definitions."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation


def persistence(neighbors, values):
    """Each maximum's drop to a higher one, from the definition: by which sublevel it hangs together with one."""
    n = len(values)
    rank = np.lexsort((np.arange(n), -values))
    place = np.empty(n, int)
    place[rank] = np.arange(n)
    out = np.zeros(n)
    for i in range(n):
        if any(place[j] < place[i] for j in neighbors[i]):
            continue
        for count in range(place[i] + 1, n + 1):  # the `count` highest vertices
            links = np.zeros((n, n), bool)
            for a in rank[:count]:
                for b in neighbors[a]:
                    links[a, b] = place[b] < count
            _, piece = connected_components(links, directed=False)
            same = [a for a in rank[:count] if piece[a] == piece[i]]
            if any(place[a] < place[i] for a in same):
                out[i] = values[i] - values[rank[count - 1]]
                break
        else:
            out[i] = values[i] - min(values[a] for a in same)
    return out


def gaussian_mean(points, areas, values, sigma):
    """Means with the window exp(-d^2 / 2 sigma^2) of straight distances, as Lee, Varshney and Jacobs have them."""
    away = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    weights = np.exp(-away / (2 * sigma**2)) * areas
    return weights @ values / weights.sum(axis=1)


def turning_mean(diffusion, normals, d1, half, sigma):
    """Two implicit steps of heat for what has directions, each brought to its neighbor's plane by a rotation."""
    areas, links = diffusion.areas, diffusion.links
    n = len(areas)
    weights = diffusion._system[1].toarray()
    turning = np.zeros((n, n), complex)
    for i, j in zip(*links, strict=True):
        axis = np.cross(normals[j], normals[i])
        sine = np.linalg.norm(axis)
        angle = np.arctan2(sine, normals[j] @ normals[i])
        brought = Rotation.from_rotvec(axis / max(sine, 1e-300) * angle).apply(d1[j].copy())
        beside = np.cross(normals[i], d1[i])
        turning[i, j] = weights[i, j] * np.exp(2j * np.arctan2(brought @ beside, brought @ d1[i]))
    out = half.astype(complex)
    for _ in range(2):
        out = np.linalg.solve(np.diag(areas) + 0.25 * sigma**2 * turning, areas * out)
    return out
