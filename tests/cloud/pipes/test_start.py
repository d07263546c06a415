"""First cylinders: beside a floor, between other pipes, alone, and where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.cloud.pipes.chain import chain_of
from simplexmesh.cloud.pipes.follow import run
from simplexmesh.cloud.pipes.tracing.start import _confirmed, beginning
from simplexmesh.data.primitives import Cylinder
from tests.cloud.pipes.lines import sampled
from tests.nightly.marks import nightly

ANY = (0.0, np.inf)


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


@pytest.mark.parametrize("gap", [10, 40])
@pytest.mark.parametrize("noise", [0.5, 1.0, 2.0])
def test_beside_a_floor_the_radius_is_that_of_the_pipe(gap, noise):
    """Protocol P7; of 20 at the largest noise and the smallest gap one is not, of the thesis's 12 or 13."""
    for seed in range(2):
        points, pick = half_pipe(seed, gap, noise)
        assert beginning(cKDTree(points), pick, ANY, 5.0).around.radius == pytest.approx(50, rel=0.05)


@pytest.mark.parametrize("points", [np.zeros((50, 3)), np.eye(3)[[0, 0, 0, 1, 1, 1]]], ids=["one place", "two places"])
def test_there_is_no_cylinder_in_few_places(points):
    with pytest.raises(ValueError, match=r"^pick must be on a pipe"):
        beginning(cKDTree(np.array(points, float)), np.zeros(3), ANY, 5.0)


def test_between_parallel_pipes_a_pick_is_on_its_own():
    rng = np.random.default_rng(1)
    rack = [sampled(chain_of([[0, 2.7 * k, 0], [30, 2.7 * k, 0]], [], 1.0), rng, 25.0, 0.02)[0] for k in range(3)]
    points, view = np.concatenate(rack), np.array([0.2, 0.3, 0.9])
    places = [[x, 2.7 * k + view[1], view[2]] for k in range(3) for x in (5.0, 15.0, 25.0)]
    for place in places:
        begun = beginning(cKDTree(points), np.array(place), ANY, 5.0)
        assert begun.around.radius == pytest.approx(1, rel=0.05)
        assert abs(begun.direction[0]) > 0.99


def test_a_lonely_pipe_is_found():
    rng = np.random.default_rng(0)
    turn, height = rng.uniform([0, 0], [2 * np.pi, 12], (6000, 2)).T
    points = np.stack([np.cos(turn), np.sin(turn), height], axis=1)
    assert beginning(cKDTree(points), np.array([1, 0, 6.0]), ANY, 5.0).around.radius == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("along", [-30.0, 0.3, 30.0])
def test_where_on_the_axis_a_cylinder_is_said_to_be_does_not_matter(along):
    rng = np.random.default_rng(0)
    turn, height = rng.uniform([0, 0], [2 * np.pi, 12], (3000, 2)).T
    tree = cKDTree(np.stack([np.cos(turn), np.sin(turn), height], axis=1))
    given = Cylinder(np.array([0.02, 0, along]), np.array([0, 0, 1.0]), 1.05)
    found = _confirmed(tree, np.array([1, 0, 6.0]), given, np.inf)
    assert found.radius == pytest.approx(1, abs=1e-4)
    np.testing.assert_allclose(found.point, [0, 0, 6], atol=1e-3)


def smooth_body(count):
    """Points with a noise of 0.003 on a body of the size of 1 that is as round as a pipe here and there."""
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(count, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    x, y, z = ways.T
    out = 1 + 0.2 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.15 * np.sin(4 * z)
    return ways * out[:, None] * [1, 1.3, 0.8] + rng.normal(0, 0.003, (count, 3))


@pytest.mark.parametrize(
    ("pick", "loose", "noise", "why"),
    [
        (7, 0.05, 0.003, "no cylinder fits"),
        (9, np.inf, 0.003, "points deviate by"),
        *nightly((7, 0.05, np.inf, "no cylinder fits"), (22, 0.05, 0.003, "no cylinder fits")),
    ],
)
def test_a_body_is_no_pipe_for_its_noise(pick, loose, noise, why):
    """The noise is told, or that of the points about the pick."""
    points = smooth_body(6000)
    tree = cKDTree(points)
    run(beginning(tree, points[pick], ANY, 5.0, loose))
    with pytest.raises(ValueError, match=rf"^pick must be on a pipe, but .*{why}"):
        run(beginning(tree, points[pick], ANY, 5.0, noise))


def test_what_goes_on_over_its_own_points_is_no_pipe():
    points = smooth_body(6000)
    with pytest.raises(ValueError, match=r"^pick must be on a pipe, but .* longer than its points are many$"):
        beginning(cKDTree(points), points[9], ANY, 5.0, 0.05)


@pytest.mark.parametrize(("noise", "why"), [(0.002, "no cylinder fits"), (0.01, r"on a ball of radius 0\.3")])
@pytest.mark.parametrize("seen", [-1.0, 0.2])
def test_a_ball_is_no_pipe(seen, noise, why):
    """It is as round as one all about; also where it lies on a floor, or is seen in part."""
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(5000, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    points = 0.3 * ways[ways[:, 0] > seen]
    floor = rng.uniform(-1, 1, (3000, 3)) * [1, 1, 0] - [0, 0, 0.3]
    with pytest.raises(ValueError, match=rf"^pick must be on a pipe, .*{why}"):
        sm.follow_pipe(np.concatenate([points, floor]) + rng.normal(0, noise, (len(points) + 3000, 3)), points[0])


def rack(seed, gap):
    """Two pipes of different radii along x, seen from above and one side, and picks on the one that is seen aslant."""
    rng = np.random.default_rng(seed)
    one, other = rng.uniform(0.5, 0.9, 2)
    view, y = np.array([0, -0.2, 1.0]), one + other + gap
    pipes = [chain_of([[0, 0, 0], [40, 0, 0]], [], one), chain_of([[0, y, 0], [40, y, 0]], [], other)]
    seen = [sampled(pipe, rng, 40 * pipe.radii[0] ** 2, 0.02 / pipe.radii[0], view, 150.0)[0] for pipe in pipes]
    picks = seen[1][rng.choice(np.flatnonzero(np.abs(seen[1][:, 0] - 20) < 10), 4)]
    return np.concatenate(seen), picks, other


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("gap", [0.1, 0.2])
def test_in_a_rack_the_next_pipe_takes_no_part(gap, told):
    for seed in range(2):
        points, picks, radius = rack(seed, gap)
        for pick in picks:
            begun = beginning(cKDTree(points), pick, (radius, radius) if told else ANY, 5.0)
            assert begun.around.radius == pytest.approx(radius, rel=0.05)
            assert begun.direction[0] > 0.99
            off = begun.point[1:] - pick[1:]
            assert np.hypot(*off) == pytest.approx(radius, rel=0.15)  # the axis is that of the pick
