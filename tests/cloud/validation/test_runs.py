"""Runs of one sign along an order."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.cloud.validation.runs import helix_order, runs_test
from simplexmesh.cloud.validation.unfolding import unfolded
from tests.cloud.validation.fitted import cone_points, cylinder_fit, is_rate, told


def test_statistic_is_normal():
    rows = np.random.default_rng(0).normal(size=(3000, 200))
    found = [runs_test(row) for row in rows]
    S = np.array([each.statistic for each in found])
    assert abs(S.mean()) < 4 / np.sqrt(3000)
    assert S.std() == pytest.approx(1.0, abs=0.06)
    for level in (0.05, 0.2):  # the number of runs is whole: the test keeps below its level, not far
        rate = np.mean([each.p_value < level for each in found])
        assert 0.6 * level < rate < 1.2 * level


def test_uneven_signs():
    rows = np.random.default_rng(1).uniform(size=(2000, 300)) - 0.2
    S = np.array([runs_test(row).statistic for row in rows])
    assert abs(S.mean()) < 0.1
    assert S.std() == pytest.approx(1.0, abs=0.08)


def test_statistic_is_bounded():
    n = 1332
    assert runs_test(np.arange(n) - 665.5).statistic == pytest.approx(-np.sqrt(n), rel=0.01)
    assert runs_test((-1.0) ** np.arange(n)).statistic == pytest.approx(np.sqrt(n), rel=0.01)
    assert runs_test(np.ones(40)).p_value == 1.0


def test_helix_follows_itself():
    """In its order, the way along the helix grows; each of four turns is gone once from end to end."""
    at = np.random.default_rng(2).uniform(-1, 1, (500, 2))
    order = helix_order(at)
    assert np.array_equal(np.sort(order), np.arange(500))
    along, across = ((at[order] + 1) / 2).T
    back = np.flatnonzero(np.diff(along) < 0)
    assert len(back) == 4
    turn = np.cumsum(np.append(0, np.diff(along) < 0))
    assert np.all(np.abs(4 * across - along - turn + 0.5) <= 0.5 + 1e-12)


def test_order_matters_and_relief_is_found():
    rejected = np.zeros(2, int)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        for k, how in enumerate(((5.6, 0.0), (1.4, np.radians(6)))):
            fit = cylinder_fit(cone_points(rng, *how, count=400))
            order = helix_order(unfolded(fit.coordinates, (True, False)))
            outcome = runs_test(fit.residuals[order])
            assert abs(outcome.statistic) < np.sqrt(400)
            rejected[k] += not outcome.passed
    told(f"rejected of 40: {rejected[0]} cylinders, {rejected[1]} cones")
    assert is_rate(rejected[0], 40, 0.05)
    assert rejected[1] == 40
