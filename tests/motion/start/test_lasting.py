"""The level at which an indicator is cut: where the genus lasts, though noise opens holes at other levels."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.motion.start.lasting import lasting_level
from simplexmesh.motion.start.topology import genus


def plate(*holes):
    """Return an indicator of a plate that has another value in columns through it, each far from the others."""
    field = np.full((12 * len(holes) + 6, 12, 10), -0.5, np.float32)
    field[3:-3, 3:-3, 3:-3] = 0.4
    for k, value in enumerate(holes):
        field[8 + 12 * k : 10 + 12 * k, 5:7, 3:-3] = value
    return field


@pytest.mark.parametrize("value", [-0.4, -0.06, 0.06, 0.35])
def test_a_genus_that_is_the_same_nearby_is_believed(value):
    level, doubtful = lasting_level(plate(value))
    assert level == 0
    assert not len(doubtful)


def test_holes_that_open_one_after_the_other_are_closed():
    field = plate(-0.02, -0.01, 0.01, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24)
    assert genus(field > 0) == 2
    level, doubtful = lasting_level(field)
    assert level == pytest.approx(-0.025)
    assert genus(field > level) == 0
    assert not len(doubtful)


def test_gaps_that_fill_one_after_the_other_are_opened():
    field = plate(-0.24, -0.2, -0.16, -0.12, -0.08, -0.04, -0.01, 0.01)
    level, doubtful = lasting_level(field)
    assert level == pytest.approx(0.025)
    assert genus(field > level) == 8
    assert not len(doubtful)


@pytest.mark.parametrize("margin", [0, 4])
def test_places_are_told_where_two_genera_last(margin):
    field = np.pad(plate(-0.02, 0.4, -0.01, 0.02), margin, constant_values=-0.5)
    level, doubtful = lasting_level(field)
    assert level == 0
    np.testing.assert_allclose(np.sort(doubtful[:, 0]), margin + np.array([8.5, 32.5, 44.5]), atol=1)
    np.testing.assert_allclose(doubtful[:, 1], margin + 5.5, atol=1)
    np.testing.assert_allclose(doubtful[:, 2], margin + 4.5, atol=2)


def test_a_genus_of_few_levels_says_nothing():
    field = plate(*np.arange(-0.29, 0.3, 0.025))
    level, doubtful = lasting_level(field)
    assert level == 0
    assert len(doubtful) == 4
