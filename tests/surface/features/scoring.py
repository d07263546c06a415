"""How well found crease lines and patches agree with the true ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

NEAR = 1.5
"""Found and true lines agree within this many mean edges."""

SAMPLES = 12
"""Samples of lines within that distance, at least."""


@dataclass(frozen=True)
class Score:
    """Shares of lengths that agree (NaN of nothing), found over true length, connected networks, free ends."""

    precision: float
    recall: float
    soft_recall: float
    excess: float
    pieces: int
    loose: int


def crease_score(points_lists, part, within=None):
    """Compare found polylines (n, 3), closed ones with their first point repeated, with the creases of a part.

    Lines agree within a distance, by default NEAR mean edges: of slivers, a large one.
    """
    within = NEAR * part.edge if within is None else within
    lines = [np.asarray(points, float) for points in points_lists]
    found = np.concatenate([np.zeros((0, 2, 3)), *(np.stack([line[:-1], line[1:]], axis=1) for line in lines)])
    true = np.concatenate([part.creases, part.soft])
    pieces, loose = networks(lines, 1e-9 * part.mesh.diagonal)
    return Score(
        precision=share_near(found, true, within),
        recall=share_near(part.creases, found, within),
        soft_recall=share_near(part.soft, found, within),
        excess=float(lengths(found).sum() / lengths(true).sum()),
        pieces=pieces,
        loose=loose,
    )


def paths(network):
    """The lines of a network as `crease_score` takes them: closed ones with their first point repeated."""
    return [np.concatenate([line.points, line.points[: int(line.closed)]]) for line in network.lines]


def lengths(segments):
    along = segments[:, 1] - segments[:, 0]
    return np.sqrt(np.einsum("ij,ij->i", along, along))


def samples(segments, step):
    """Points at most `step` apart on segments (k, 2, 3), and the length that each stands for."""
    counts = np.maximum(np.ceil(lengths(segments) / step).astype(int), 1)
    row = np.repeat(np.arange(len(segments)), counts)
    at = (np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[row]
    start, end = segments[row].transpose(1, 0, 2)
    return start + at[:, None] * (end - start), (lengths(segments) / counts)[row]


def share_near(segments, others, within):
    """The share of the length of segments that is within a distance of others."""
    if not len(segments):
        return np.nan
    if not len(others):
        return 0.0
    points, weights = samples(segments, within / SAMPLES)
    away = cKDTree(samples(others, within / SAMPLES)[0]).query(points, distance_upper_bound=2 * within)[0]
    return float(weights[away <= within].sum() / weights.sum())


def networks(lines, tolerance):
    """The number of connected networks of polylines, which share points, and of ends that touch nothing."""
    if not lines:
        return 0, 0
    counts = np.array([len(line) for line in lines])
    line_of, points = np.repeat(np.arange(len(lines)), counts), np.concatenate(lines)
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    place = components(len(points), pairs)
    ends = np.cumsum(counts)[:, None] - np.stack([counts, np.ones_like(counts)], axis=1)
    loose = int((np.bincount(place)[place[ends]] == 1).sum())
    pieces = components(len(lines) + place.max() + 1, np.stack([line_of, len(lines) + place], axis=1))
    return int(pieces.max()) + 1, loose


def components(n, pairs):
    """Labels (n,) of what the pairs (k, 2) connect."""
    graph = coo_array((np.ones(len(pairs)), tuple(np.asarray(pairs).reshape(-1, 2).T)), shape=(n, n))
    return connected_components(graph, directed=False)[1]


def rand_index(labels, truth, areas=None):
    """The adjusted Rand index of two partitions of faces: by pairs of faces, or of points if their areas are given."""
    labels, truth = (np.unique(each, return_inverse=True)[1] for each in (labels, truth))
    weights = np.ones(len(labels)) if areas is None else np.asarray(areas, float)
    table = coo_array((weights, (labels, truth))).toarray()

    def pairs(sums):
        return (sums * (sums - (1 if areas is None else 0))).sum() / 2

    both, one, other = pairs(table), pairs(table.sum(axis=1)), pairs(table.sum(axis=0))
    chance, most = one * other / pairs(table.sum()), (one + other) / 2
    return 1.0 if most == chance else float((both - chance) / (most - chance))


def kinds_told(zones, part, whole=0.8):
    """What each patch is, and what the zone says that has most of it, and little else; None if none does."""
    out = []
    for patch, kind in part.kinds.items():
        on = part.patches == patch
        zone = np.bincount(zones.labels[on]).argmax()
        both = np.count_nonzero(on & (zones.labels == zone))
        found = both > whole * max(on.sum(), np.count_nonzero(zones.labels == zone))
        out.append((kind, zones.kinds[zone] if found else None))
    return out


def labels_between(mesh, edges):
    """Labels (t,) of the components of faces of a mesh when it is cut along edges, pairs of vertices (k, 2)."""
    faces, n = np.asarray(mesh.faces, np.int64), mesh.n_vertices

    def keys(ends):
        return ends.min(axis=1) * n + ends.max(axis=1)

    sides = keys(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2))
    order = np.argsort(sides, kind="stable")
    joined = (sides[order][1:] == sides[order][:-1]) & ~np.isin(
        sides[order][1:], keys(np.asarray(edges, np.int64).reshape(-1, 2))
    )
    return components(len(faces), np.stack([order[:-1], order[1:]], axis=1)[joined] // 3)
