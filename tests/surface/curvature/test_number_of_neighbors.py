"""Errors of curvature over the number of neighbors (Chaperon 2002, B.3.3), beside the scale that is chosen."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm

P = sm.primitives
HALF_ANGLE = 0.3
COUNTS = (8, 20, 60, 170, 500, 1200)


def about_axis(points):
    return np.hypot(points[:, 0], points[:, 1])


SURFACES = {
    "sphere": (
        P.Sphere([0, 0, 0], 2.0),
        [[0, 2.5], [-0.5, 1.0]],
        lambda points: (np.full(len(points), 0.5), np.full(len(points), 0.25)),
    ),
    "cylinder": (
        P.Cylinder([0, 0, 0], [0, 0, 1], 2.0),
        [[0, 2.5], [-3, 3]],
        lambda points: (np.full(len(points), 0.25), np.zeros(len(points))),
    ),
    "cone": (
        P.Cone([0, 0, 0], [0, 0, 1], HALF_ANGLE),
        [[0, 2.5], [5, 10]],
        lambda points: (np.cos(HALF_ANGLE) / (2 * about_axis(points)), np.zeros(len(points))),
    ),
    "torus": (
        P.Torus([0, 0, 0], [0, 0, 1], 4.0, 1.0),
        [[0, 2.5], [-2, 2]],
        lambda points: (1 - 2 / about_axis(points), 1 - 4 / about_axis(points)),
    ),
}
"""Parts of primitives, and their mean and Gaussian curvature (table of B.2, outward normals)."""


@pytest.mark.parametrize("kind", SURFACES)
def test_the_scale_that_is_chosen_is_as_good_as_the_best_number_of_neighbors(kind):
    """Protocol P13: few neighbors give noise, many bias, and the best number differs by the surface."""
    primitive, ends, curvatures = SURFACES[kind]
    (low, high), size = np.array(ends, float).T, primitive.n_parameters
    part = primitive.with_fit(P.Fit(0.0, 0.0, np.zeros((size, size)), np.array(ends, float), 1)).sampled(3000, rng=0)
    share = (primitive.coordinates(part.points) - low) / (high - low)
    inner = np.flatnonzero((np.abs(share - 0.5) < 0.3).all(axis=1))[:300]
    truth = np.array(curvatures(part.points[inner]))
    noise = 0.003 * np.random.default_rng(1).normal(size=(len(part.points), 1))
    cloud = sm.PointCloud(part.points + noise * part.normals, part.normals)

    def errors(*method, **options):
        found = sm.curvature(cloud, *method, at=inner, **options)
        return np.sqrt(np.mean((np.array([found.mean, found.gauss]) - truth) ** 2, axis=1))

    tried = np.array([errors("extended_quadric", neighborhood=sm.nearest(count)) for count in COUNTS])
    assert tried[0, 0] > 5 * tried[:, 0].min()
    assert tried[-1, 0] > 1.2 * tried[:, 0].min()
    chosen = errors()
    assert chosen[0] < 0.7 * tried[:, 0].min()
    assert chosen[1] < 1.5 * tried[:, 1].min()
