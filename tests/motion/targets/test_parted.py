"""Points in parts, each with a surface of its own."""

import numpy as np

from simplexmesh.motion.targets.parted import PartedPoints
from simplexmesh.motion.targets.points import SurfelTarget
from simplexmesh.motion.targets.surfels import surfels

UP = np.array([0.0, 0.0, 1.0])


def sheets(counts, apart, noise=0.0):
    """Waves above each other, as many points on each, all with normals up."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-1, 1, (n, 3)) * [1, 1, 0] + k * apart * UP for k, n in enumerate(counts)])
    points[:, 2] += 0.1 * np.sin(3 * points[:, 0]) + noise * rng.normal(size=len(points))
    return points, np.tile(UP, (len(points), 1)), np.split(np.arange(len(points)), np.cumsum(counts)[:-1])


def test_each_vertex_sees_the_surface_of_its_part_alone():
    points, normals, parts = sheets([3000, 3000, 400], 0.003)
    target = PartedPoints(points, normals, parts, None)
    at = np.random.default_rng(1).uniform(-0.9, 0.9, (300, 3)) * [1, 1, 0]
    at[:, 2] = 0.1 * np.sin(3 * at[:, 0])
    part = np.arange(300) % 3
    gaps = target.gap_to(part, at, np.tile(UP, (300, 1)), np.inf)
    np.testing.assert_allclose(gaps, 0.003 * part, atol=0.0015)
    _, away = target.facing(part, at, 0.5)
    np.testing.assert_allclose(away, gaps, atol=0.001)
    assert np.isnan(target.gap_to(part, at + 5 * UP, np.tile(UP, (300, 1)), np.inf)).all()  # or others would be seen


def test_parts_are_fitted_as_alone():
    points, normals, parts = sheets([4000, 4000], 0.01, noise=0.005)
    target = PartedPoints(points, normals, parts, None)
    at = np.random.default_rng(1).uniform(-0.9, 0.9, (300, 3)) * [1, 1, 0]
    for k, rows in enumerate(parts):
        alone = SurfelTarget(points[rows], normals[rows]).gap(at, np.tile(UP, (300, 1)), 1.0)
        np.testing.assert_allclose(target.gap_to(np.full(300, k), at, np.tile(UP, (300, 1)), 1.0), alone, atol=0.003)


def test_scales_are_looked_for_as_often_in_all_parts_as_in_one_cloud(monkeypatch):
    """That was a half of the time of models with creases, once more for each part."""
    points, normals, parts = sheets([3000] * 6, 0.5)
    looked, known = [], surfels.kernels.fit_scales
    monkeypatch.setattr(surfels.kernels, "fit_scales", lambda m, *rest: (looked.append(m), known(m, *rest)))
    SurfelTarget(points, normals)
    once = looked.pop()
    PartedPoints(points, normals, parts, None)
    assert len(looked) == 6
    assert 0.9 * once < sum(looked) < 1.1 * once
