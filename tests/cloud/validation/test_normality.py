"""Kolmogorov and Smirnov's test, against scipy's and against trials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest, norm

from simplexmesh.cloud.validation.normality import (
    LAW,
    estimated_law,
    largest_difference,
    normality_test,
)
from tests.cloud.validation.fitted import are_uniform, cone_points, cylinder_fit, is_rate, told

ESTIMATED = {0.15: 0.775, 0.10: 0.819, 0.05: 0.895, 0.025: 0.955, 0.01: 1.035}


@pytest.mark.parametrize("n", [1, 7, 500])
def test_difference_is_that_of_scipy(n):
    values = np.random.default_rng(n).normal(0.3, 1.2, n)
    assert largest_difference(norm.cdf(values)) == pytest.approx(kstest(values, "norm").statistic)


def test_levels_of_the_table_of_estimated_laws():
    """Trials are up to 0.02 above it; the printed 0.995 at 2.5 % is for 0.955."""
    for level, value in ESTIMATED.items():
        assert estimated_law(value + 0.02) < level < estimated_law(value) * 1.001
    assert estimated_law(0.995) < 0.02


def test_beyond_the_table_the_law_goes_on_as_it_ends():
    """The logarithm is linear in the square of the statistic, from the last but one row on."""
    before, last = LAW[-2:, 0] ** 2
    beyond = np.sqrt(2 * last - before)
    assert estimated_law(beyond) == pytest.approx(LAW[-1, 1] ** 2 / LAW[-2, 1], rel=1e-9)


def test_law_falls_from_one_to_nothing():
    values = np.array([estimated_law(x) for x in np.linspace(0.0, 4.0, 401)])
    assert np.all(np.diff(values) <= 0)
    assert values[0] == 1.0
    assert 0 < values[-1] < 1e-12


@pytest.mark.parametrize("n", [20, 1000])
def test_rates_of_estimated_laws(n):
    trials = 4000
    found = [normality_test(row).p_value for row in np.random.default_rng(5).normal(7.0, 3.0, (trials, n))]
    assert are_uniform(found) or n == 20  # where the law is that of many values to a tenth
    for level in (0.15, 0.05, 0.01):
        assert 0.85 * level < np.mean(np.less(found, level)) < 1.15 * level or is_rate(
            int(np.sum(np.less(found, level))), trials, level
        )


def test_shift_and_scale_do_not_matter():
    values = np.random.default_rng(7).uniform(size=300)
    assert normality_test(1e6 - 50 * values).statistic == pytest.approx(normality_test(-values).statistic)
    assert normality_test(np.full(50, 3.0)).statistic == 0.5
    assert normality_test(np.array([-1.0, 0.0, 1.0])).statistic == pytest.approx(1 / 3 - norm.cdf(-1.0))


def test_experiment_of_the_thesis():
    """Residuals of a cylinder: noise passes in 19 of 20 cases, a cone never, though D_n looks small in both."""
    noise, cone = (
        [normality_test(cylinder_fit(cone_points(np.random.default_rng(s), *how)).residuals) for s in range(20)]
        for how in ((5.6, 0.0), (1.4, np.radians(6)))
    )
    for name, rows in (("SynthCyl2", noise), ("SynthCone1", cone)):
        D = [row.statistic for row in rows]
        told(f"{name}: D_n {np.mean(D):.3f} ({min(D):.3f} to {max(D):.3f}), sqrt(n) D_n {36.5 * np.mean(D):.2f}")
    assert sum(row.passed for row in noise) >= 16
    assert all(0.010 < row.statistic < 0.032 for row in noise)
    assert all(row.p_value < 1e-4 and 0.045 < row.statistic < 0.085 for row in cone)
