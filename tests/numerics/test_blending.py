"""Weighted means of rows: numbers, colors as light adds up, and labels that cannot be averaged."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from simplexmesh.numerics.blending import blended

PAIR = np.array([[0, 1]])
HALVES = np.array([[0.5, 0.5]])


def test_half_the_light_of_white_is_188():
    ends = np.array([[0, 0, 0], [255, 255, 255]], np.uint8)  # IEC 61966-2-1: 255 (1.055 0.5^(1/2.4) - 0.055) = 187.5
    assert_array_equal(blended({"colors": ends}, PAIR, HALVES)["colors"], [[188, 188, 188]])


def test_opacity_is_no_light():
    ends = np.array([[9, 9, 9, 0], [9, 9, 9, 100]], np.uint8)
    assert_array_equal(blended({"any name": ends}, PAIR, HALVES)["any name"], [[9, 9, 9, 50]])


def test_every_color_is_its_own_mean():
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
    rows = np.repeat(np.arange(256)[:, None], 5, axis=1)
    assert_array_equal(blended({"c": ramp}, rows, np.random.default_rng(0).random((256, 5)) + 0.1)["c"], ramp)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_numbers_are_averaged_by_weight_without_those_that_are_missing(kind):
    values = np.array([[1, 10], [3, np.nan], [np.nan, np.nan]], kind)
    found = blended({"v": values}, np.array([[0, 1, 2], [2, 2, 2]]), np.array([[3.0, 1.0, 5.0]] * 2))["v"]
    assert found.dtype == kind
    assert_array_equal(found, [[1.5, 10], [np.nan, np.nan]])


@pytest.mark.parametrize("kind", [np.int64, np.uint8, bool])
def test_of_labels_the_one_of_most_weight_wins(kind):
    labels = np.array([1, 0, 1], kind)
    rows = np.array([[0, 1, 2]] * 2)
    found = blended({"label": labels}, rows, np.array([[2.0, 3.0, 2.0], [1.0, 3.0, 1.0]]))["label"]
    assert found.dtype == kind
    assert_array_equal(found, [1, 0])
