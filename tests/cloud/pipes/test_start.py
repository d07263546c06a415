"""First cylinders: nested neighborhoods beside a floor, as corrected and as printed (Chaperon 2002, 6.1.2)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from simplexmesh.cloud.pipes.tracing.start import FEWEST, FINEST, MOST, RISE, first_cylinder, free_cylinder, nested


def half_pipe(seed, gap, noise):
    """A half-pipe of radius 50 above a floor, in mm, and a pick on top of it."""
    rng = np.random.default_rng(seed)
    turn, along = rng.uniform(0, np.pi, 2500), rng.uniform(-200, 200, 2500)
    pipe = np.stack([50 * np.cos(turn), along, 50 * np.sin(turn)], axis=1)
    pipe[:, [0, 2]] *= 1 + noise / 50 * rng.normal(size=(2500, 1))
    floor = rng.uniform([-200, -200, -50 - gap], [200, 200, -50 - gap], (6000, 3))
    floor[:, 2] += noise * rng.normal(size=6000)
    floor[:, 2] += 50  # the pipe is seen from above: its lower half is not there
    at = rng.uniform(-0.7, 0.7)
    return np.concatenate([pipe, floor]), np.array([50 * np.sin(at), rng.uniform(-50, 50), 50 * np.cos(at)])


def as_printed(fitted, most):
    """The rule of the thesis: the mean takes in the present error, and those of rejected sizes."""
    mean, i, size, low, high, expanding = 0.0, 0, FEWEST, FEWEST, 2 * FEWEST, True
    primitive = None
    while True:
        primitive, error = fitted(size)
        mean = (i * mean + error) / (i + 1)
        good = error < RISE * mean
        i += 1
        if expanding and good:
            low, high = size, 2 * size
            size = high
            if size > most:
                return primitive, error, low
        elif expanding:
            expanding, high, size = False, size, (low + size) // 2
        else:
            low, high = (size, high) if good else (low, size)
            if high - low < FINEST:
                return primitive, error, low
            size = (low + high) // 2


def successes(rule, cases):
    """How often the radius is within 5 %."""
    good = 0
    for seed, gap, noise in cases:
        points, pick = half_pipe(seed, gap, noise)
        near = points[cKDTree(points).query(pick, k=[*range(1, MOST + 1)])[1]]

        def fitted(size, near=near):
            cylinder = free_cylinder(near[:size][:: -(-size // 400)])
            if cylinder is None:
                return None, float("inf")
            return cylinder, float(np.sqrt((cylinder.distance(near[:size]) ** 2).mean()))

        found = rule(fitted, len(near))
        good += found is not None and found[0] is not None and abs(found[0].radius - 50) < 2.5
    return good


CASES = [(seed, gap, noise) for seed in range(4) for gap in (10, 40) for noise in (0.5, 1.0)]


def test_accepted_errors_alone_are_averaged():
    corrected, printed = successes(nested, CASES), successes(as_printed, CASES)
    assert corrected >= 0.9 * len(CASES)
    assert printed < 0.7 * len(CASES)


def test_sizes_double_then_bisect():
    asked = []

    def fitted(size):
        asked.append(size)
        return size, 1.0 if size <= 700 else 5.0

    assert nested(fitted, 2000)[2] in range(700 - FINEST, 701)
    assert asked[:4] == [100, 200, 400, 800]
    assert asked[4] == 600


def test_all_sizes_pass_on_one_surface():
    assert nested(lambda size: (size, 1.0), 2000) == (2000, 1.0, 2000)


@pytest.mark.parametrize("points", [np.zeros((50, 3)), np.eye(3)[[0, 0, 0, 1, 1, 1]]], ids=["one place", "two places"])
def test_there_is_no_cylinder_in_few_places(points):
    assert free_cylinder(np.array(points, float)) is None


def test_a_lonely_pipe_is_found():
    rng = np.random.default_rng(0)
    turn, height = rng.uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    cylinder, error, size = first_cylinder(
        cKDTree(np.stack([np.cos(turn), np.sin(turn), height], axis=1)), np.array([1, 0, 6.0])
    )
    assert abs(cylinder.radius - 1) < 1e-6
    assert error < 1e-2
    assert size == MOST
