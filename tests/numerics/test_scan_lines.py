"""Points that are dense along lines: how many are left of them, so that they are as dense along as across."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from simplexmesh.numerics.plane_fits import planes
from simplexmesh.numerics.scan_lines import even, steps, without_piles
from tests.nightly.marks import nightly


def lines(gap, noise=0.0, *, up=False):
    """12,000 points one apart on lines, in random order; `up` has noise along the normal only, as scanners do."""
    count = max(12, round((12000 / gap) ** 0.5))
    x, y = (each.ravel() for each in np.meshgrid(np.arange(12000.0 // count), gap * np.arange(count)))
    points = np.stack([x, y, 0 * x], axis=1)
    rng = np.random.default_rng(0)
    return rng.permutation(points + noise * rng.normal(size=points.shape) * ([0, 0, 1] if up else [1, 1, 1]))


@pytest.mark.parametrize("noise", [0, 0.2, 1])
@pytest.mark.parametrize("gap", [1, 2])
def test_points_hardly_on_lines_are_left_as_they_are(gap, noise):
    assert (steps(cKDTree(lines(gap, noise))) == 1).all()


@pytest.mark.parametrize("up", [*nightly(False), True])
@pytest.mark.parametrize(("gap", "noise"), [(5, 0), (10, 0.2), (10, 0.5), (25, 0.2), (25, 2), (50, 0), (50, 2)])
def test_points_are_left_as_far_apart_along_lines_as_across(gap, noise, up):
    left = 1 / steps(cKDTree(lines(gap, noise, up=up)))
    assert 1 < gap * np.median(left) < 5


def test_near_noise_that_looks_like_a_surface_is_seen_from_afar():
    points = lines(10, 2, up=True)  # the nearest are in a plane across the lines
    assert np.median(steps(cKDTree(points))) == 4
    assert np.median(np.abs(planes(points).normals[:, 2])) > 0.9


def test_a_wire_has_nothing_beside_it_and_keeps_its_points():
    wire = np.arange(3000.0)[:, None] * [1, 2, 3]
    assert not steps(cKDTree(wire)).any()
    assert len(even(cKDTree(wire)).rows) == 3000


def test_two_lines_beside_each_other_are_a_strip():
    strip = np.stack([np.arange(1000) // 2, np.arange(1000) % 2, np.zeros(1000)], axis=1)
    assert (steps(cKDTree(strip)) == 1).all()


def test_places_have_steps_of_their_own():
    dense = lines(10) - [0, 1000, 0]
    found = steps(cKDTree(np.concatenate([lines(1), dense])))
    assert (found[:12000] == 1).mean() > 0.98
    assert (found[12000:] == 4).mean() > 0.98


def test_small_things_on_lines_are_found_in_a_large_cloud():
    """Posts scanned in rings on a floor of 200,000 points, each one in five hundred of them."""
    rng, n = np.random.default_rng(0), 400
    floor = np.column_stack([rng.random((188_000, 2)) * 10, np.zeros(188_000)])
    around, up = np.arange(n) % 40 * (2 * np.pi / 40), np.arange(n) // 40 * 0.0628
    post = np.column_stack([0.05 * np.cos(around), 0.05 * np.sin(around), 0.2 + up])
    posts = [post + np.array([1 + 1.6 * i, 1 + 1.6 * j, 0]) for i in range(6) for j in range(5)]
    found = steps(cKDTree(np.concatenate([floor, *posts])))
    assert (found[188_000:] > 1).mean() > 0.7
    assert (found[:188_000] == 1).mean() > 0.99


@pytest.mark.parametrize("away", [0.2, 1])
def test_a_thin_pipe_before_a_wall_is_no_line(away):
    """It is as narrow as one, and with the wall it spans a surface, but what is beside it is on no lines."""
    rng, n = np.random.default_rng(0), 1200
    wall = np.column_stack([rng.uniform(0, 10, (40_000, 2)), np.zeros(40_000)])
    around = rng.uniform(0, np.pi, n)
    pipe = np.column_stack([rng.uniform(0, 10, n), 5 + 0.025 * np.cos(around), away + 0.025 * np.sin(around)])
    assert (steps(cKDTree(np.concatenate([wall, pipe]))) == 1).all()


@pytest.mark.parametrize("gap", [1, 25])
def test_each_point_is_the_first_of_its_neighbors_and_the_others_are_even(gap):
    points = lines(gap)
    points[7] = points[8]
    found = even(cKDTree(points))
    places = np.arange(len(points))
    distance, near = found.near(places, 9)
    np.testing.assert_array_equal(near[:, 0], places)
    assert np.isin(near[:, 1:], found.rows).all()
    assert (np.diff(np.sort(near, axis=1), axis=1) > 0).all()
    np.testing.assert_allclose(distance, np.linalg.norm(points[near] - points[:, None], axis=2))
    for place in places[::97]:
        others = points[found.rows[found.rows != place]]
        expected = np.sort(np.linalg.norm(others - points[place], axis=1))[:8]
        np.testing.assert_allclose(distance[place, 1:], expected)


@pytest.mark.parametrize("count", [1, 2, 5, 30])
def test_few_points_are_taken_as_they_are(count):
    corners = np.random.default_rng(0).normal(size=(count, 3))
    _, near = even(cKDTree(corners)).near(np.arange(count), 40)
    np.testing.assert_array_equal(np.sort(near, axis=1), [np.arange(count)] * count)


@pytest.mark.parametrize("gap", [1, 10, 25])
def test_planes_of_lines_of_a_scanner_face_up(gap):
    assert np.abs(planes(lines(gap, 0.2)).normals[:, 2]).min() > 0.8


def test_points_that_beams_take_in_turn_are_as_those_of_one_beam_after_the_other():
    x, y = np.meshgrid(np.arange(2000.0), 20 * np.append(-20, np.arange(15)))  # the first apart
    points, at = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), np.arange(x.size).reshape(x.shape)
    one_by_one, in_turn = (steps(cKDTree(points[rows.ravel()])) for rows in (at, at.T))
    assert (in_turn == one_by_one[at.T.ravel()]).mean() > 0.9


def test_of_many_points_at_one_place_few_are_left():
    """They are one leaf, which every search near them takes one by one."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(size=(2000, 3)), np.zeros((5000, 3)), np.full((7, 3), 3.0)])
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    rows = without_piles(tree)
    assert len(rows) < 2100
    assert np.isin([*range(2000), *range(7000, 7007)], rows).all()  # a leaf may hold seven
    found = even(tree)
    assert np.isin(found.rows, rows).all()
    np.testing.assert_array_equal(found.tree.data, points[found.rows])
