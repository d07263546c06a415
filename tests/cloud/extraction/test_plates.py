"""Plates as those of steel columns: a decimetre wide, with sides, and curved parts that are as narrow."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from tests.nightly.marks import nightly

SPACING = 0.006
"""Between points."""


def strip(rng, width, height, x, y):
    """Points of a strip of a width whose section is told by x and y of a place between -1/2 and 1/2."""
    place = rng.uniform(-0.5, 0.5, int(width * height / SPACING**2))
    return np.column_stack([x(place), y(place), rng.uniform(0, height, len(place))])


def found(rng, parts, noise):
    """The kinds of what is found of parts above a floor, but for that, and their radii."""
    floor = np.append(rng.uniform(-1, 1, (20000, 2)), np.full((20000, 1), -0.2), axis=1)
    points = np.concatenate([floor, *parts])
    shapes = sm.extract_primitives(points + rng.normal(0, noise, points.shape)).primitives[1:]
    return [each.kind for each in shapes], [each._shape[-1] for each in shapes if each.kind != "plane"]


@pytest.mark.parametrize("seed", [0, 1, *nightly(2, 3)])
def test_with_sides_are_no_wide_cylinders(seed):
    """Half of the points of sides of 10 mm drew least squares to radii of 1.1 to 1.4 metres."""
    rng, width = np.random.default_rng(seed), 0.1
    front = strip(rng, width, 2.0, lambda t: width * t, np.zeros_like)
    sides = [
        strip(rng, 0.005, 2.0, lambda t, s=s: np.full_like(t, s * width / 2), lambda t: 0.01 * (t + 0.5))
        for s in (-1, 1)
    ]
    assert found(rng, [front, *sides], 0.002) == (["plane"], [])


@pytest.mark.parametrize("radius", [0.08, 0.2, *nightly(0.4)])
@pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
def test_what_bends_more_than_its_noise_is_a_cylinder(seed, radius):
    rng, width = np.random.default_rng(seed), 0.15
    turn = width / radius
    arc = strip(rng, width, 2.0, lambda t: radius * np.sin(turn * t), lambda t: radius * np.cos(turn * t))
    kinds, radii = found(rng, [arc], 0.002)
    assert kinds == ["cylinder"]
    assert_allclose(radii, [radius], rtol=0.03)
