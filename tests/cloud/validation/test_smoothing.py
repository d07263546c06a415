"""The ratio of smoothed residuals."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.cloud.validation import smoothing
from tests.cloud.validation.fitted import are_uniform, is_rate, told


def cloud(seed, n=300):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (n, 2)), rng.normal(size=n), rng


def test_means_and_medians_are_those_of_the_nearest():
    at, d, _ = cloud(0, 80)
    near = smoothing.nearest_neighbors(at, 7)
    nearest = np.argsort(np.linalg.norm(at[:, None] - at[None], axis=2), axis=1)[:, :7]
    assert_allclose(smoothing.means(d, near), d[nearest].mean(axis=1))
    assert_allclose(smoothing.medians(d, near), np.median(d[nearest], axis=1))
    both = np.stack([d, -2 * d], axis=1)
    assert_allclose(smoothing.medians(both, near), np.stack([1, -2])[None] * smoothing.medians(d, near)[:, None])


@pytest.mark.parametrize("k", [5, 10, 20])
def test_ratio_of_independent_residuals(k):
    ratios = []
    for seed in range(60):
        at, d, _ = cloud(seed, 600)
        ratios.append(smoothing.smoothed_ratio(d, smoothing.means(d, smoothing.nearest_neighbors(at, k))))
    assert np.mean(ratios) == pytest.approx(1 / (k - 1), rel=0.05)


def test_without_themselves_the_printed_share_exceeds_one():
    """1 + 1 / k of the squares, and rho 1 / (k + 1)."""
    printed, ratios = [], []
    for seed in range(60):
        at, d, _ = cloud(seed, 600)
        smooth = (11 * smoothing.means(d, smoothing.nearest_neighbors(at, 11)) - d) / 10
        printed.append(((d - smooth) ** 2).sum() / (d**2).sum())
        ratios.append(smoothing.smoothed_ratio(d, smooth))
    assert np.mean(printed) == pytest.approx(1.1, rel=0.02)
    assert np.mean(ratios) == pytest.approx(1 / 11, rel=0.05)


def test_limits():
    at, d, _ = cloud(2)
    d -= d.mean()
    all_points, one = (smoothing.means(d, smoothing.nearest_neighbors(at, k)) for k in (300, 1))
    assert smoothing.smoothed_ratio(d, all_points) < 1e-20
    assert smoothing.smoothed_ratio(d, one) > 1e20


def test_a_median_is_not_moved_by_outliers():
    at, d, rng = cloud(3, 1000)
    d = 0.1 * d + np.sin(3 * at[:, 0])
    spoilt = np.where(rng.uniform(size=1000) < 0.03, 30.0, d)
    near = smoothing.nearest_neighbors(at)
    clean = np.abs(smoothing.medians(d, near) - np.sin(3 * at[:, 0])).max()
    assert np.abs(smoothing.medians(spoilt, near) - np.sin(3 * at[:, 0])).mean() < clean
    assert np.abs(smoothing.means(spoilt, near) - np.sin(3 * at[:, 0])).mean() > 2 * clean


@pytest.mark.parametrize("smooth", [smoothing.means, smoothing.medians])
def test_threshold_keeps_its_level(smooth):
    """For noise of any law and deviations that vary, with neighbors on the surface."""
    found = []
    trials = 150
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        n = 150
        coordinates = np.stack([rng.uniform(-np.pi, np.pi, n), rng.uniform(0, 3, n)], axis=1)
        noise = (rng.normal(size=n), rng.standard_t(3, n), rng.exponential(size=n) - 1)[seed % 3]
        noise = noise * (1 + coordinates[:, 1])
        on_surface = np.column_stack([np.cos(coordinates[:, 0]), np.sin(coordinates[:, 0]), coordinates[:, 1]])
        near = smoothing.nearest_neighbors(on_surface)
        found.append(smoothing.smoothness_test(noise, near, rng, smooth=smooth, trials=99).p_value)
    told(f"{smooth.__name__}: rejected {np.mean(np.less_equal(found, 0.05)):.3f}")
    assert is_rate(int(np.sum(np.less_equal(found, 0.05))), trials, 0.05)
    assert are_uniform(found)


def test_p_values_of_trials():
    law = np.array([1.0, 2.0, 3.0])
    assert [smoothing.at_least(x, law) for x in (0.0, 2.0, 9.0)] == [1.0, 0.75, 0.25]


def test_relief_is_found_at_any_scale():
    at, d, rng = cloud(4)
    d = d + 1.5 * np.sin(7 * at[:, 0])
    for scale in (1e-6, 1.0, 1e6):
        assert smoothing.smoothness_test(scale * d, smoothing.nearest_neighbors(scale * at), rng).p_value == 1 / 400
