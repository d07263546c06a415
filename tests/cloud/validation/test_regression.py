"""The regression test, by the formulas of the thesis and its figures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import fdtrc

from simplexmesh.cloud.validation.regression import orthonormal, polynomial_terms
from simplexmesh.cloud.validation.unfolding import unfolded
from tests.cloud.validation.fitted import (
    are_uniform,
    is_rate,
    linear_fit,
    nested_model_test,
    places,
    regression_test,
    told,
)


def test_printed_p_value_is_that_of_15_terms():
    assert polynomial_terms(np.zeros((1, 2))).shape == (1, 15)
    assert fdtrc(14, 1332 - 15, 0.47) == pytest.approx(0.949, abs=5e-4)
    for terms in (16, 25):
        assert abs(fdtrc(terms - 1, 1332 - terms, 0.47) - 0.948) > 0.005


def test_terms_span_the_monomials():
    at = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    Q = orthonormal(polynomial_terms(at))
    for i in range(5):
        for j in range(5):
            values = at[:, 0] ** i * at[:, 1] ** j
            left = np.linalg.norm(values - Q @ (Q.T @ values)) / np.linalg.norm(values)
            assert (left < 1e-12) == (i + j <= 4)


def test_statistic_is_that_of_the_constraint():
    """Eq. 5.5 as of the constrained coefficients C b = 0, and eq. 5.6 for all but the constant."""
    rng = np.random.default_rng(1)
    at = rng.uniform(-1, 1, (80, 2))
    y, X = rng.normal(size=80) + at[:, 0], polynomial_terms(at)
    b, inverse, C = np.linalg.lstsq(X, y)[0], np.linalg.inv(X.T @ X), np.eye(15)[1:]
    b0 = b - inverse @ C.T @ np.linalg.solve(C @ inverse @ C.T, C @ b)
    left = float(((y - X @ b) ** 2).sum())
    expected = (float(((X @ (b - b0)) ** 2).sum()) / 14) / (left / 65)
    assert regression_test(y, at).statistic == pytest.approx(expected)
    assert 65 * float(((X @ b - y.mean()) ** 2).sum()) / (14 * left) == pytest.approx(expected)


def test_units_of_coordinates_do_not_matter():
    rng = np.random.default_rng(2)
    angle, z = places(rng, 100)
    y = rng.normal(size=100)
    near, far = (
        regression_test(y, unfolded(np.stack([angle, unit * z + shift], axis=1), (True, False)))
        for unit, shift in ((1.0, 0.0), (1e-3, 1e6))
    )
    assert near.statistic == pytest.approx(far.statistic, rel=1e-5)
    assert regression_test(1e-9 * y, np.stack([angle, z / 400], axis=1)).statistic == pytest.approx(near.statistic)


def test_dependent_columns_do_not_count():
    rng = np.random.default_rng(3)
    y, x = rng.normal(size=50), rng.uniform(-1, 1, 50)
    on_a_line = np.stack([x, x], axis=1)
    powers = np.stack([x**k for k in range(5)], axis=1)
    expected = nested_model_test(y, powers, np.ones((50, 1)))
    assert regression_test(y, on_a_line).p_value == pytest.approx(expected.p_value)


def test_law_with_derivatives_is_exact_and_without_timid():
    exact, plain = [], []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        fit = linear_fit(*places(rng, 120), rng.normal(0, 5.6, 120))
        flat = unfolded(fit.coordinates, (True, False))
        exact.append(nested_model_test(fit.residuals, polynomial_terms(flat), fit.derivatives))
        plain.append(regression_test(fit.residuals, flat))
    for name, found in (("derivatives", exact), ("constant", plain)):
        F = np.mean([each.statistic for each in found])
        told(f"null model {name}: F {F:.2f}, rejected {np.mean([not each.passed for each in found]):.3f}")
    assert are_uniform([each.p_value for each in exact])
    assert is_rate(sum(not each.passed for each in exact), 300, 0.05)
    assert not are_uniform([each.p_value for each in plain])
    assert sum(not each.passed for each in plain) <= 9
    assert 0.6 < np.mean([each.statistic for each in plain]) < 0.9
