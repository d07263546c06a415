"""Bends between pipes that were found: which pairs have one."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh.cloud.extraction.bends import between, proposed
from simplexmesh.cloud.extraction.growth import Grown
from simplexmesh.cloud.extraction.patches import Limits
from simplexmesh.cloud.extraction.working import working
from simplexmesh.cloud.fitting.selection import SURFACES
from simplexmesh.data.primitives import Cylinder

RADIUS, BEND, NOISE = 0.1, 0.25, 0.005
LIMITS = Limits(SURFACES, (0.0, np.inf), 50)


def elbow():
    """Two pipes and the bend between, and how far (n,) along each point is: the bend is between 0 and 1."""
    rng, n = np.random.default_rng(0), 3000
    along, around = rng.uniform(-1, 2, n), rng.uniform(0, 2 * np.pi, n)
    turn = np.clip(along, 0, 1) * np.pi / 2
    outward, forward = (
        np.stack([s, c, 0 * turn], 1) for s, c in ((-np.cos(turn), np.sin(turn)), (np.sin(turn), np.cos(turn)))
    )
    radius = RADIUS + rng.normal(0, NOISE, n)
    across = BEND * outward + radius[:, None] * (
        np.cos(around)[:, None] * outward + np.sin(around)[:, None] * [0, 0, 1]
    )
    return across + (along - np.clip(along, 0, 1))[:, None] * forward, along


def test_a_piece_of_a_bend_has_no_bends_to_the_pipes():
    points, along = elbow()
    work = working(points, NOISE, np.random.default_rng(0))
    one, other = Cylinder([-BEND, 0, 0], [0, 1, 0], RADIUS), Cylinder([0, BEND, 0], [1, 0, 0], RADIUS)
    piece = Cylinder([0, BEND + 0.01, 0], [1, 0.01, 0], 0.9 * RADIUS)  # of the last points of the bend
    parts = zip((one, other, piece), (along < 0, along > 1, np.abs(along - 0.9) < 0.1), strict=True)
    found = [Grown(primitive, np.flatnonzero(at), NOISE, 1.0) for primitive, at in parts]
    assert between(work, cKDTree(work.points), found, (0, 2), LIMITS) is None
    assert [(bend.first, bend.second) for bend in proposed(work, found, LIMITS)] == [(0, 1)]
