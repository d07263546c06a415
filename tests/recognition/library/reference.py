"""What a library compares, done plainly: point by point, pair by pair."""

from __future__ import annotations

import numpy as np


def spin_images(points, normals, chosen, radius, shape):
    """Where the points within a radius of each chosen one lie, shared between bins by how near these are."""
    away_bins, along_bins = shape
    images = np.zeros((len(chosen), away_bins, along_bins))
    for k, i in enumerate(chosen):
        for q in points:
            offset = (q - points[i]) / radius
            square = offset @ offset
            if square > 1:
                continue
            height = offset @ normals[i]
            x = np.sqrt(max(square - height**2, 0)) * away_bins - 0.5
            y = (height + 1) / 2 * along_bins - 0.5
            for a, share_a in ((np.floor(x), 1 - x % 1), (np.floor(x) + 1, x % 1)):
                for b, share_b in ((np.floor(y), 1 - y % 1), (np.floor(y) + 1, y % 1)):
                    place = int(np.clip(a, 0, away_bins - 1)), int(np.clip(b, 0, along_bins - 1))
                    images[k][place] += (1 - square**2) * share_a * share_b
    return images.reshape(len(chosen), -1)


def pair_histogram(points, normals, longest, shape):
    """How many pairs have a distance and a cosine between normals."""
    pairs = np.zeros(shape)
    for i in range(len(points)):
        for j in range(i):
            length = np.linalg.norm(points[j] - points[i]) / longest
            cosine = (normals[i] @ normals[j] + 1) / 2
            column = min(max(int(cosine * shape[1]), 0), shape[1] - 1)
            pairs[min(int(length * shape[0]), shape[0] - 1), column] += 1
    return pairs


def consistent_pairs(p, n, q, m, minimum_length, tolerance, cosine_tolerance):
    """Which two correspondences one motion may bring about."""
    pairs = []
    for i in range(len(p)):
        for j in range(i):
            d, e = p[j] - p[i], q[j] - q[i]
            here, there = np.linalg.norm(d), np.linalg.norm(e)
            if here < minimum_length or there < minimum_length / 2 or abs(here - there) > tolerance:
                continue
            d, e = d / here, e / there
            cosines = [d @ n[i] - e @ m[i], d @ n[j] - e @ m[j], n[i] @ n[j] - m[i] @ m[j]]
            if max(np.abs(cosines)) <= cosine_tolerance:
                pairs.append((i, j))
    return pairs


def frame(p, n, q, m):
    """The frame along the line of two points, then toward their normals, the first counting twice; none if untold."""
    line = (q - p) / np.linalg.norm(q - p)
    up = n + m / 2
    up = up - (up @ line) * line
    if np.linalg.norm(up) <= 0.1:
        return None
    up /= np.linalg.norm(up)
    return np.stack([line, up, np.cross(line, up)], axis=1)


def pair_motions(p, n, distinctiveness, queries, rows, q, m, minimum_length, tolerance, cosine_tolerance, most):
    """The motions of the pairs of correspondences that agree with most others, and are rare, of one model."""
    nearest = np.argsort(squared_distances(rows, queries), axis=0)[:2].T
    here, there = np.repeat(np.arange(len(p)), 2), nearest.ravel()
    p, n, distinctiveness, q, m = p[here], n[here], distinctiveness[here], q[there], m[there]
    pairs = consistent_pairs(p, n, q, m, minimum_length, tolerance, cosine_tolerance)
    degree = np.bincount(np.ravel(pairs).astype(int), minlength=len(p))
    pairs.sort(key=lambda pair: -np.prod([degree[k] * distinctiveness[k] for k in pair]))
    motions = []
    for i, j in pairs[:most]:
        F, G = frame(p[i], n[i], p[j], n[j]), frame(q[i], m[i], q[j], m[j])
        if F is not None and G is not None:
            R = F @ G.T
            shift = (p[i] + p[j]) / 2 - R @ (q[i] + q[j]) / 2
            motions.append(np.hstack([R, shift[:, None]]).ravel())
    return np.array(motions).reshape(-1, 12)


def squared_distances(rows, queries):
    """The squared distance of each of some rows to each query (k, d)."""
    return ((rows[:, None] - queries[None]) ** 2).sum(axis=2)
