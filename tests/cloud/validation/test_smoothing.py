"""The ratio of smoothed residuals."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.cloud.validation import smoothing


def cloud(seed, n=300):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (n, 2)), rng.normal(size=n), rng


def test_means_are_those_of_the_nearest():
    at, d, _ = cloud(0, 80)
    near = smoothing.nearest_neighbors(at, 7)
    nearest = np.argsort(np.linalg.norm(at[:, None] - at[None], axis=2), axis=1)[:, :7]
    assert_allclose(near @ d, d[nearest].mean(axis=1))
    both = np.stack([d, -2 * d], axis=1)
    assert_allclose(near @ both, np.stack([1, -2])[None] * (near @ d)[:, None])


@pytest.mark.parametrize("k", [5, 10, 20])
def test_ratio_of_independent_residuals(k):
    ratios = []
    for seed in range(60):
        at, d, _ = cloud(seed, 600)
        ratios.append(smoothing.smoothed_ratio(d, smoothing.nearest_neighbors(at, k) @ d))
    assert np.mean(ratios) == pytest.approx(1 / (k - 1), rel=0.05)


def test_without_themselves_the_printed_share_exceeds_one():
    """1 + 1 / k of the squares, and rho 1 / (k + 1)."""
    printed, ratios = [], []
    for seed in range(60):
        at, d, _ = cloud(seed, 600)
        smooth = (11 * smoothing.nearest_neighbors(at, 11) @ d - d) / 10
        printed.append(((d - smooth) ** 2).sum() / (d**2).sum())
        ratios.append(smoothing.smoothed_ratio(d, smooth))
    assert np.mean(printed) == pytest.approx(1.1, rel=0.02)
    assert np.mean(ratios) == pytest.approx(1 / 11, rel=0.05)


def test_limits():
    at, d, _ = cloud(2)
    d -= d.mean()
    all_points, one = (smoothing.nearest_neighbors(at, k) @ d for k in (300, 1))
    assert smoothing.smoothed_ratio(d, all_points) < 1e-20
    assert smoothing.smoothed_ratio(d, one) > 1e20


def test_p_values_of_trials():
    law = np.array([1.0, 2.0, 3.0])
    assert [smoothing.at_least(x, law) for x in (0.0, 2.0, 9.0)] == [1.0, 0.75, 0.25]


def test_relief_is_found_at_any_scale():
    at, d, rng = cloud(4)
    d = d + 1.5 * np.sin(7 * at[:, 0])
    for scale in (1e-6, 1.0, 1e6):
        smooth = smoothing.nearest_neighbors(scale * at)
        trials = np.column_stack([scale * d, smoothing.sign_flips(scale * d, rng)])
        ratio, *law = smoothing.smoothed_ratio(trials, smooth @ trials)
        assert smoothing.at_least(ratio, np.array(law)) == 1 / 400
