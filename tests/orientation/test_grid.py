"""The grid around points: as few samples as the margin needs, centered on them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.orientation.poisson import Grid

POINTS = np.array([[0, 0, 0], [10, 4, 1.5]])


@pytest.mark.parametrize(("fast", "shape"), [(False, (27, 15, 10)), (True, (27, 15, 10))])
def test_has_a_margin_all_around(fast, shape):
    grid = Grid.around(POINTS, 0.5, margin=3, fast=fast)
    assert grid.shape == shape
    assert_allclose(grid.to_index(POINTS), [[3, 3, 3], np.array(shape) - 4])


def test_fast_ones_have_lengths_without_large_primes():
    assert Grid.around(np.array([[0, 0, 0], [10.3, 4, 1.4]]), 0.5, margin=2, fast=True).shape == (27, 15, 8)
