"""Miters: two straights that are cut aslant and joined in a corner of one line, without a bend."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.cloud.pipes import tube
from simplexmesh.cloud.pipes.chain import chain_of
from simplexmesh.cloud.pipes.elements import elements_of
from tests.cloud.pipes.lines import sampled, unit
from tests.nightly.marks import nightly

SQUARE = chain_of([[-8.0, 0, 0], [0, 0, 0], [0, 8, 0]], [0], 1.0)
MIXED = chain_of([[0.0, 0, 0], [8, 0, 0], [11, 6, 0], [11, 6, 8]], [0, 2.5], 1.0)


def seen(angle, seed, noise=0.01):
    """Two straights of a miter at the origin that turns by an angle, seen from one side, and the turned direction."""
    rng = np.random.default_rng(seed)
    along = np.array([[1.0, 0, 0], [np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0]])
    out, view = [], unit(np.array([0.3, -0.4, 1]))
    for way, sign in zip(along, (-1, 1), strict=True):
        chain = chain_of([(4 * sign - 8) * way, (4 * sign + 8) * way], [], 1.0)
        points = sampled(chain, rng, 25.0, noise, view, 200.0)[0]
        out.append(points[sign * points @ along.sum(axis=0) > 0])
    return np.concatenate(out), along[1]


@pytest.mark.parametrize("seed", [0, *nightly(2, 3)])  # at 90 degrees lines end at the miters of seeds 1 and 7
@pytest.mark.parametrize("angle", [45, 60, 90])
def test_is_one_line_of_two_straights_that_meet(angle, seed):
    points, along = seen(angle, seed)
    line = sm.follow_pipe(points, pick=points[np.abs(points[:, 0] + 6).argmin()])
    assert [element.kind for element in line.elements] == ["straight", "straight"]
    assert_allclose(line.elements[0].end, line.elements[1].start, atol=1e-12)
    assert_allclose(line.elements[0].end, 0, atol=0.02)
    assert_allclose(sorted(abs(element.primitive.axis @ along) for element in line.elements)[1], 1, atol=1e-4)
    assert_allclose([element.length for element in line.elements], 12, atol=0.3)
    assert line.elements[0].deviations.end < 0.02


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_straights_that_meet_in_a_ball_are_no_miter(seed):
    points, _ = seen(90, seed)
    ball = np.random.default_rng(seed).normal(size=(2500, 3))
    ball *= 1.25 / np.linalg.norm(ball, axis=1)[:, None]
    points = np.concatenate([points[np.linalg.norm(points, axis=1) > 1.25], ball])
    line = sm.follow_pipe(points, pick=points[np.abs(points[:, 0] + 6).argmin()])
    assert [element.kind for element in line.elements] == ["straight"]


def test_distances_are_those_of_the_cylinder_on_the_same_side():
    points = np.random.default_rng(0).uniform([-6, -3, -3], [3, 6, 3], (4000, 3))
    before = points[:, 0] + points[:, 1] < 0
    off = np.where(before, np.hypot(points[:, 1], points[:, 2]), np.hypot(points[:, 0], points[:, 2])) - 1
    near = np.abs(off) < 0.5
    assert_allclose(SQUARE.distance(points[near]), off[near], atol=1e-12)


def test_derivatives_are_difference_quotients_and_the_corner_stays_sharp():
    points, _ = sampled(MIXED, np.random.default_rng(1), 10.0, 0.05)
    matrix, _, _ = MIXED.normal_equations(points)
    rows = np.stack(
        [MIXED.moved(e).distance(points) - MIXED.moved(-e).distance(points) for e in 1e-6 * np.eye(len(matrix))], axis=1
    )
    rows[:, np.diagonal(matrix) == 0] = 0
    assert (np.diagonal(matrix) == 0).sum() == 1
    assert_allclose(matrix, rows.T @ rows / 4e-12, atol=2e-3)
    moved = MIXED.stepped(0.01 * np.random.default_rng(2).normal(size=MIXED.n_parameters) * (np.diagonal(matrix) > 0))
    assert moved.are_miters.tolist() == [True, False]


def test_elements_and_tubes_meet_in_the_corner():
    elements, _ = elements_of(MIXED, np.zeros((0, 3)), np.zeros((MIXED.n_parameters,) * 2), np.zeros(3))
    assert [element.kind for element in elements] == ["straight", "straight", "bend", "straight"]
    assert_allclose(elements[0].length, 8)
    vertices, faces = tube.swept(SQUARE, None)
    assert_allclose(np.abs(SQUARE.distance(vertices)).max(), 0, atol=1e-12)
    half = vertices[np.abs(vertices @ [1, 1, 0]) < 1e-9]
    assert_allclose(np.abs(half[:, 0]).max(), 1, atol=0.01)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals, middle = np.cross(b - a, c - a), (a + b + c) / 3
    outward = SQUARE.measured(middle)[1]
    assert ((normals * outward).sum(axis=1) > 0).all() or ((normals * outward).sum(axis=1) < 0).all()


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_a_slight_bend_that_is_tight_is_none(seed):
    turn = np.radians(19)
    chain = chain_of([[-9.0, 0, 0], [0, 0, 0], [9 * np.cos(turn), 9 * np.sin(turn), 0]], [1.3], 1.0)
    points = sampled(chain, np.random.default_rng(seed), 25.0, 0.02, unit(np.array([0.3, -0.4, 1])), 200.0)[0]
    line = sm.follow_pipe(points, pick=points[np.abs(points[:, 0] + 5).argmin()])
    assert [element.kind for element in line.elements] == ["straight", "bend", "straight"]
