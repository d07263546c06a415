"""Fits with outliers."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh._base import vectors
from simplexmesh.cloud.fitting import refine
from simplexmesh.cloud.fitting.solver import solve
from tests.cloud.fitting.clouds import PRIMITIVES, exact, noisy, same, with_outliers
from tests.nightly.marks import nightly

every = pytest.mark.parametrize("kind", PRIMITIVES)


@every
@pytest.mark.parametrize("share", [*nightly(0.0, 0.1), 0.3])
@pytest.mark.parametrize("seed", [0, *nightly(1)])
def test_outliers_do_no_harm(kind, share, seed):
    """The points that are no outliers are as near as to their own least squares, within a tenth of the noise."""
    primitive, points = noisy(kind, 500, 0.01, seed)
    cloud, out = with_outliers(points, share, np.random.default_rng(seed))
    found = sm.fit_primitive(cloud, kind, robust=True, rng=seed)
    inner = points[~out]
    least = np.sqrt(np.mean(solve(primitive, inner).distance(inner) ** 2))
    assert np.sqrt(np.mean(found.distance(inner) ** 2)) < 1.05 * least
    assert abs(found.fit.count - len(inner)) < 0.05 * len(points)
    assert found.fit.noise == pytest.approx(0.01, rel=0.12)


@every
def test_plain_least_squares_do_not_bear_them(kind):
    primitive, points = noisy(kind, 500, 0.01)
    cloud, out = with_outliers(points, 0.3, np.random.default_rng(0))
    found = solve(primitive, cloud)
    assert np.sqrt(np.mean(found.distance(points[~out]) ** 2)) > 2 * 0.01


@every
def test_exact_points_with_outliers(kind):
    primitive, points = exact(kind, 300)
    cloud, _ = with_outliers(points, 0.2, np.random.default_rng(0))
    assert same(sm.fit_primitive(cloud, kind, robust=True), primitive, 1e-5)


def test_known_parameters_with_outliers():
    _, points = noisy("torus", 600, 0.01)
    cloud, _ = with_outliers(points, 0.3, np.random.default_rng(0))
    found = sm.fit_primitive(cloud, "torus", tube_radius=1.0, robust=True)
    assert found.tube_radius == 1.0
    assert found.radius == pytest.approx(4, abs=0.01)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "cone", *nightly("torus"), "circle"])
def test_a_wall_is_not_followed(kind):
    """Outliers that are on a plane draw the fit that starts from all points; those of random subsets do not follow."""
    primitive, points = noisy(kind, 500, 0.01)
    rng = np.random.default_rng(0)
    out = rng.random(len(points)) < 0.35
    wall = points.mean(axis=0) + [1.5, 0, -1] + rng.uniform(-3, 3, (len(points), 2)) @ [[1, 0, 0.5], [0, 1, 0.2]]
    found = sm.fit_primitive(np.where(out[:, None], wall, points), kind, robust=True)
    inner = points[~out]
    least = np.sqrt(np.mean(solve(primitive, inner).distance(inner) ** 2))
    assert np.sqrt(np.mean(found.distance(inner) ** 2)) < 1.1 * least


@pytest.mark.parametrize("kept", [120, *nightly(160)])
@pytest.mark.parametrize("draws", [*nightly(1, 3), 10])
@pytest.mark.parametrize(("kind", "size"), [("plane", 3), ("sphere", 4), ("cylinder", 3), ("cone", 4)])
def test_subsets_find_a_primitive_as_often_as_one_has_no_outlier(kind, size, draws, kept, monkeypatch):
    """Protocol P12: 1 - (1 - p^q)^K, where p^q is the chance that q of the points, drawn at random, are all on it."""
    monkeypatch.setattr(refine, "SAMPLES", {size: draws})
    primitive, true = exact(kind, 200)
    normals, true = primitive.gradient(true), true - true.mean(axis=0)
    true /= np.linalg.norm(true, axis=1).max()
    hits, trials = 0, 200
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        out = np.isin(np.arange(200), rng.choice(200, 200 - kept, replace=False))[:, None]
        points = np.where(out, rng.uniform(-1, 1, (200, 3)), true)
        away = np.where(out, vectors.normalized(rng.normal(size=(200, 3))), normals)
        with np.errstate(all="ignore"):
            found = refine._of_subsets(kind, refine.Cloud(points, points, away, {}, rng))
        hits += bool(found) and np.abs(found[0].distance(true)).max() < 1e-6
    one = np.prod((kept - np.arange(size)) / (200 - np.arange(size)))
    expected = 1 - (1 - one) ** draws
    assert abs(hits / trials - expected) < 4 * np.sqrt(expected * (1 - expected) / trials) + 1 / trials


@pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")
@pytest.mark.parametrize(("kind", "count"), [("torus", 8), ("beam", 10), ("cone", 7)])
def test_fewer_points_than_parameters_determine_nothing(kind, count):
    """Of hardly more points than parameters some are left out as outliers: those that remain are met by many."""
    refused = 0
    for seed in range(10):
        points = np.random.default_rng(seed).normal(size=(count, 3))
        try:
            found = sm.fit_primitive(points, kind, robust=True)
        except ValueError as error:
            refused += f"of {count} are near the one found: give more points, or leave out robust" in str(error)
        else:
            assert found.fit.count >= found.n_parameters
    assert refused
