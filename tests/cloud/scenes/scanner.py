"""What a laser scanner sees of shapes: first hits of rays even in solid angle, with the faults of real ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.vectors import dot, norm, normalized

STRADDLE = 0.3
"""How often the beam lies across the edge between two neighboring directions: its width in steps."""

JUMP = 0.05
"""Ranges that differ more, in metres, make an edge of depth; the beam averages what is nearer together."""

TRIAL = 20_000
"""Directions of a whole sphere that tell how many hit."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Points (n, 3), labels (n,) with -1 between shapes, stations (n,), and the stations' offsets (k, 3)."""

    points: np.ndarray
    labels: np.ndarray
    station: np.ndarray
    offsets: np.ndarray


def scanned(shapes, stations, count, rng, *, noise=0.0, offset=0.0, straddle=STRADDLE):
    """Scan shapes from stations (k, 3) in the same angular steps: `count` points, noise along the rays.

    The clouds of all stations but the first are shifted by `offset` in random directions.
    """
    trial = sum(len(seen(shapes, place, TRIAL, rng, straddle)[0]) for place in stations)
    if not trial:
        raise ValueError("no station sees a shape")
    whole = TRIAL * count / trial
    parts = [np.zeros((0, 3))]
    while sum(map(len, parts)) < count:
        whole *= 1.02
        each = [seen(shapes, place, round(whole), rng, straddle) for place in stations]
        parts = [points for points, _ in each]
    labels, station = np.concatenate([found for _, found in each]), np.repeat(np.arange(len(parts)), [*map(len, parts)])
    points, moves = np.concatenate(parts), normalized(rng.normal(size=(len(stations), 3))) * offset
    moves[0] = 0
    points = points + rng.normal(0, noise, (len(points), 1)) * normalized(points - stations[station]) + moves[station]
    kept = np.sort(rng.permutation(len(points))[:count])
    return Scan(points[kept], labels[kept], station[kept], moves)


def seen(shapes, place, whole, rng, straddle):
    """Points and labels of what is met in as many directions of a whole sphere, in the order of its rows."""
    along, row = directions([shape.ball for shape in shapes], place, whole, rng)
    far, label = first_hits(shapes, place, along)
    points, outside = on_shapes(shapes, place, along, far, label)
    edge = np.flatnonzero((row[1:] == row[:-1]) & outside[1:] & outside[:-1])
    edge = edge[(np.abs(far[edge + 1] - far[edge]) > JUMP) & (rng.uniform(size=len(edge)) < straddle)]
    share = rng.uniform(size=len(edge))
    points[edge] = place + ((1 - share) * far[edge] + share * far[edge + 1])[:, None] * along[edge]
    label[edge] = -1
    return points[outside], label[outside]


def directions(balls, place, whole, rng):
    """Unit vectors (m, 3) even in solid angle, `whole` to a sphere, and their rows about a pole: those toward balls."""
    rows = max(round(np.sqrt(np.pi * whole) / 2), 1)
    polar = (np.arange(rows) + 0.5) * np.pi / rows
    counts = np.maximum(np.round(whole * (np.cos(polar - np.pi / rows / 2) - np.cos(polar + np.pi / rows / 2)) / 2), 1)
    counts = counts.astype(int)
    row = np.repeat(np.arange(rows), counts)
    turn = np.arange(len(row)) - (np.cumsum(counts) - counts)[row] + rng.uniform(size=rows)[row]
    turn, polar = 2 * np.pi * turn / counts[row], polar[row]
    along = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1)
    low, high = np.min([m - r for m, r in balls], axis=0), np.max([m + r for m, r in balls], axis=0)
    to, radius = (low + high) / 2 - place, norm(high - low) / 2
    if norm(to) > radius:
        toward = along @ normalized(to) >= np.sqrt(1 - (radius / norm(to)) ** 2)
        along, row = along[toward], row[toward]
    return along, row


def first_hits(shapes, place, along):
    """How far (m,) along directions the first shape is, and which: inf and -1 where none."""
    far = np.stack([shape.hits(place, along) for shape in shapes], axis=1)
    label = far.argmin(axis=1)
    nearest = far[np.arange(len(far)), label]
    return nearest, np.where(np.isfinite(nearest), label, -1)


def on_shapes(shapes, place, along, far, label):
    """The points (m, 3) of hits, exactly on their shapes, and whether a ray hits from outside.

    What it hits inside of an open end is as if there were a lid: it is in the way, but not told.
    """
    points, outside = np.zeros_like(along), np.zeros(len(along), bool)
    for k, shape in enumerate(shapes):
        rows = np.flatnonzero(label == k)
        points[rows], normals = shape.at(shape.coordinates(place + far[rows, None] * along[rows]))
        outside[rows] = (shape.kind == "plane") | (dot(normals, along[rows]) < 0)
    return points, outside
