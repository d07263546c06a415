"""Scores of models: their formulas by other roads, and the model they select."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from simplexmesh.cloud.validation import selection
from tests.cloud.validation.fitted import told


def test_noise_is_unbiased():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(20, 6))
    Q = np.linalg.qr(X)[0]
    squares = [float(((y - Q @ (Q.T @ y)) ** 2).sum()) for y in rng.normal(0, 3.0, (4000, 20))]
    assert np.mean([selection.noise(s, 20, 6) ** 2 for s in squares]) == pytest.approx(9.0, rel=0.03)
    assert np.mean([selection.rms(s, 20) ** 2 for s in squares]) == pytest.approx(9.0 * 14 / 20, rel=0.03)


def test_as_many_parameters_as_points_show_no_noise():
    with pytest.raises(ValueError, match="count must be more than the 5 parameters, not 5"):
        selection.noise(1.0, 5, 5)


def test_likelihoods_are_those_of_normal_residuals():
    one, other = np.random.default_rng(1).normal(0, [[1.0], [1.3]], (2, 50))
    gain = sum(norm(0, np.sqrt(np.mean(d**2))).logpdf(d).sum() * sign for d, sign in ((one, 1), (other, -1)))
    squares = [float(d @ d) for d in (one, other)]
    assert selection.bic(squares[1], 50, 5) - selection.bic(squares[0], 50, 6) == pytest.approx(2 * gain - np.log(50))


def test_nested_models():
    """Degrees 0 to 6, the true one is 2: how often each criterion says so; e' is the one that overfits."""
    right, n, trials = np.zeros(2, int), 200, 200
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        x = rng.uniform(-1, 1, n)
        y = 1 + x - x**2 + rng.normal(0, 0.1, n)
        squares = [float(((y - np.polyval(np.polyfit(x, y, k), x)) ** 2).sum()) for k in range(7)]
        scores = [[score(s, n, k + 1) for k, s in enumerate(squares)] for score in (selection.noise, selection.bic)]
        right += np.argmin(scores, axis=1) == 2
    told(f"e' {right[0] / trials:.0%}, bic {right[1] / trials:.0%}")
    assert right[0] < right[1]
    assert right[1] > 0.9 * trials
