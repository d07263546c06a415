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
    assert selection.aic(squares[1], 50, 5) - selection.aic(squares[0], 50, 6) == pytest.approx(2 * gain - 2)
    assert selection.bic(squares[1], 50, 5) - selection.bic(squares[0], 50, 6) == pytest.approx(2 * gain - np.log(50))


def test_geometric_aic_of_cylinder_and_cone_with_squares():
    """N (e_cylinder^2 - e_cone^2) - 2 N e_cone^2 / (N - 6)."""
    n, cylinder, cone = 7946, 2.30**2, 2.29**2
    noise = selection.noise(n * cone, n, 6)
    found = selection.geometric_aic(n * cylinder, n, 5, noise) - selection.geometric_aic(n * cone, n, 6, noise)
    assert found == pytest.approx(n * (cylinder - cone) - 2 * n * cone / (n - 6))
    surface, curve = (selection.geometric_aic(1.0, 100, 5, 0.1, dimension=d) for d in (2, 1))
    assert surface - curve == pytest.approx(2 * 100 * 0.01)


CRITERIA = {
    "e'": lambda s, n, p, noise: selection.noise(s, n, p),
    "aic": lambda s, n, p, noise: selection.aic(s, n, p),
    "bic": lambda s, n, p, noise: selection.bic(s, n, p),
    "geometric aic": lambda s, n, p, noise: selection.geometric_aic(s, n, p, noise),
}


def test_nested_models():
    """Degrees 0 to 6, the true one is 2: how often each criterion says so; e' is the one that overfits."""
    right, n, trials = dict.fromkeys(CRITERIA, 0), 200, 200
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        x = rng.uniform(-1, 1, n)
        y = 1 + x - x**2 + rng.normal(0, 0.1, n)
        squares = [float(((y - np.polyval(np.polyfit(x, y, k), x)) ** 2).sum()) for k in range(7)]
        noise = selection.noise(squares[-1], n, 7)
        for name, score in CRITERIA.items():
            right[name] += int(np.argmin([score(s, n, k + 1, noise) for k, s in enumerate(squares)]) == 2)
    told(str({name: f"{count / trials:.0%}" for name, count in right.items()}))
    assert right["e'"] < right["aic"] < right["bic"]
    assert right["bic"] > 0.9 * trials
    assert right["geometric aic"] > 0.5 * trials
