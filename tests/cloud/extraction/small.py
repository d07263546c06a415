"""Small scenes at random: a floor, two pipes with a bend between them, a ball and a cone above it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from tests.cloud.scenes.shapes import ball, bend, cone, perpendicular, pipe, plane, sampled

NOISE = 0.002


def scene(seed, noise=NOISE, outliers=0.05, count=9000):
    """Points, labels and shapes: floor, pipe, pipe, bend, ball, cone; sizes, turn and pose differ with the seed.

    Noise may be one for all, or one for each shape.
    """
    rng = np.random.default_rng(seed)
    radius, turn = rng.uniform(0.06, 0.1), np.radians(rng.uniform(40, 110))
    start = np.array([0.0, 0.0, 0.6])
    middle = np.array([rng.uniform(0.5, 0.8), 0.0, 0.6])
    elbow, at, way = bend(
        middle, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), rng.uniform(2, 4) * radius, radius, turn, (1, 2)
    )
    shapes = [
        plane((-0.5, -0.5, 0), (2, 0, 0), (0, 1.5, 0)),
        pipe(start, middle, radius),
        pipe(at, at + rng.uniform(0.4, 0.7) * way, radius),
        elbow,
        ball((0.2, -0.3, 0.3), rng.uniform(0.12, 0.2)),
        cone((0.9, -0.25, 0.5), perpendicular(np.array([0.0, 1, 0]), rng), np.radians(rng.uniform(15, 30)), (0.1, 0.4)),
    ]
    points, normals, labels = sampled(shapes, count, rng, np.array([0.4, 1, 1, 1.5, 1, 1]))
    points = points + (rng.normal(0, 1, count) * np.broadcast_to(noise, len(shapes))[labels])[:, None] * normals
    strays = rng.uniform(points.min(axis=0), points.max(axis=0), (round(outliers * count), 3))
    order = rng.permutation(count + len(strays))
    turned, shift = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-3, 3, 3)
    return SimpleNamespace(
        points=np.concatenate([points, strays])[order] @ turned.T + shift,
        labels=np.append(labels, np.full(len(strays), -1))[order],
        shapes=tuple(each.moved(turned, shift) for each in shapes),
    )
