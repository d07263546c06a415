"""Surface coordinates cut open and scaled."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.cloud.validation.unfolding import unfolded


@pytest.mark.parametrize("turn", [0.0, 1.0, 2.5, np.pi, -7.0])
def test_a_turn_of_the_angles_changes_nothing(turn):
    rng = np.random.default_rng(0)
    angle, height = rng.uniform(-1.3, 1.3, 200), rng.uniform(5, 9, 200)
    wrapped = np.mod(angle + turn + np.pi, 2 * np.pi) - np.pi
    expected = np.stack([angle, height], axis=1)
    expected = 2 * (expected - expected.min(axis=0)) / np.ptp(expected, axis=0) - 1
    assert_allclose(unfolded(np.stack([wrapped, height], axis=1), (True, False)), expected, atol=1e-12)
    assert_allclose(unfolded(np.stack([height, wrapped], axis=1), (False, True)), expected[:, ::-1], atol=1e-12)


def test_equal_coordinates_are_at_zero():
    assert np.all(unfolded(np.full((5, 2), 3.0), (True, False)) == 0.0)
