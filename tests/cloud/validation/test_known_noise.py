"""The chi-square test."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.cloud.validation.validation import chi_square_test
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
