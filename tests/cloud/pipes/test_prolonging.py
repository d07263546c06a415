"""Straights that thin out go on as far as points are on them, not over what is beside or across them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from tests.cloud.pipes.test_no_bends import along_z
from tests.nightly.marks import nightly


def thinning(rng, hidden=(0.0, 0.0)):
    """A pipe of radius 1, dense up to 20, then with two points to a radius up to 70, but for what is hidden."""
    far = along_z(rng, 100, 50) + np.array([0, 0, 20])
    return np.concatenate([along_z(rng, 1500, 20), far[(far[:, 2] < hidden[0]) | (far[:, 2] > hidden[1])]])


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_a_pipe_is_followed_where_it_thins_out(seed):
    line = sm.follow_pipe(thinning(np.random.default_rng(seed)), pick=(1, 0, 10))
    assert [element.kind for element in line.elements] == ["straight"]
    assert_allclose(line.length, 70, atol=6)
    assert_allclose(np.abs(line.chain.directions[0]), [0, 0, 1], atol=1e-3)


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_the_gap_is_the_longest_that_is_passed(seed):
    points = thinning(np.random.default_rng(seed), hidden=(40, 52))
    assert_allclose(sm.follow_pipe(points, pick=(1, 0, 10)).length, 39, atol=3)
    assert_allclose(sm.follow_pipe(points, pick=(1, 0, 10), gap=20).length, 69, atol=4)


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
@pytest.mark.parametrize("what", ["volume", "plate along it", "plate aslant", "wider pipe"])
def test_what_is_not_on_it_is_not_of_it(what, seed):
    rng = np.random.default_rng(seed)
    x, y, z = rng.uniform([-2, -2, 20], [2, 2, 50], (1500, 3)).T
    if what == "plate along it":
        x = np.full(len(x), 0.8)
    elif what == "plate aslant":
        x = 0.5 * (z - 25)
    elif what == "wider pipe":
        x, y = 1.15 * np.array([x, y]) / np.hypot(x, y)
    strays = np.column_stack([x, y, z]) + rng.normal(0, 0.01, (len(x), 3))
    line = sm.follow_pipe(np.concatenate([along_z(rng, 1500, 20), strays]), pick=(1, 0, 10))
    assert line.elements[0].end[2] < 21.5
    assert line.elements[0].start[2] < 21.5
