"""The chi-square test."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.cloud.validation.known_noise import chi_square_test
from tests.cloud.validation.fitted import are_uniform, linear_fit, places


def test_p_values_are_uniform():
    found = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        fit = linear_fit(*places(rng, 60), rng.normal(0, 2.0, 60))
        found.append(chi_square_test(fit.residuals, 2.0, 5).p_value)
    assert are_uniform(found)
    assert not are_uniform([chi_square_test(np.sqrt(60 / 55) * np.ones(60) * 2.0, 2.0, 5).p_value] * 300)


def test_parameters_count():
    """55 unit squares are the expectation of 55 degrees of freedom, and much of 30."""
    assert chi_square_test(np.ones(55), 1.0, 0).p_value == pytest.approx(0.475, abs=0.01)
    assert chi_square_test(np.ones(55), 1.0, 25).p_value < 0.005


def test_noise_of_each_point():
    rng = np.random.default_rng(3)
    noise = rng.uniform(0.1, 4.0, 400)
    residuals = rng.normal(0, noise)
    assert chi_square_test(residuals, noise, 0).statistic == pytest.approx(float(((residuals / noise) ** 2).sum()))
    assert chi_square_test(residuals, noise, 0).passed
    assert not chi_square_test(1.3 * residuals, noise, 0).passed
    assert chi_square_test(7 * residuals, 7 * noise, 0).p_value == pytest.approx(
        chi_square_test(residuals, noise, 0).p_value
    )
