"""Chains: distances, derivatives, tangency, ends, motions."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from simplexmesh.cloud.pipes import refining
from simplexmesh.cloud.pipes.chain import Chain, chain_of
from simplexmesh.cloud.pipes.elements import elements_of
from simplexmesh.cloud.pipes.ends import reversed_chain, without_bends
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tube import swept
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.duality import dual
from tests.cloud.pipes.lines import meeting, random_chain

CORNERS = np.array([[0, 0, 0], [10, 0, 1], [10, 8, 2], [18, 8, 3.0]])
PLAIN = chain_of(CORNERS, [3.0, 2.0], 1.0)
REDUCED = Chain(CORNERS, np.array([3.0, 2.0]), np.array([1.0, 0.6]), np.array([[1, 4.0, 5.0]]))
ACROSS = np.cross(CORNERS[2] - CORNERS[1], [1.0, 0, 0])
ECCENTRIC = replace(REDUCED, offsets=0.4 * ACROSS[None] / np.linalg.norm(ACROSS)).moved(np.zeros(18))
LOOP = np.array([[3, 0, 0], [10, 0, 0], [10, 0, 12], [-1, 12, 0], [-1, 0, 0], [3, 0, 0.0]])
CLOSED = chain_of(LOOP, [3.0, 2.0, 2.5, 1.5], 1.0)
kinds = {"plain": PLAIN, "reduced": REDUCED, "eccentric": ECCENTRIC, "closed": CLOSED}
every = pytest.mark.parametrize("chain", kinds.values(), ids=kinds)
both = pytest.mark.parametrize("chain", [PLAIN, REDUCED], ids=["plain", "reduced"])


def around(chain, count=1000, seed=0):
    """Points about the axis, nearer to it than bends' centers; on the surface where only that has exact gradients."""
    rng = np.random.default_rng(seed)
    points = chain.at(rng.uniform(-1, chain.stations[-1] + 1, count))[0] + rng.normal(0, 0.4, (count, 3))
    for _ in range(8 * bool(chain.offsets.any())):
        distance, normal = chain.measured(points)
        points = points - distance[:, None] * normal
    return points


def test_feet_are_the_nearest_of_dense_samples():
    points = around(PLAIN)
    samples = PLAIN.at(np.arange(-4, PLAIN.stations[-1] + 4, 1e-3))[0]
    near = cKDTree(samples).query(points)[0]
    exact = PLAIN.distance(points) + 1
    assert (exact <= near + 1e-12).all()
    assert_allclose(exact, near, atol=1e-5)


def test_stations_are_lengths_along_the_axis():
    lengths = np.linspace(0, PLAIN.stations[-1], 20_001)
    axis, along = PLAIN.at(lengths)
    assert_allclose(np.linalg.norm(np.diff(axis, axis=0), axis=1), np.diff(lengths), rtol=1e-6)
    assert_allclose(PLAIN.feet(axis).station, lengths, atol=1e-9)
    assert_allclose(np.diff(axis, axis=0) / np.diff(lengths)[:, None], along[:-1], atol=1e-3)


@every
@pytest.mark.parametrize("loss_scale", [None, 0.3])
def test_normal_equations_are_those_of_difference_quotients(chain, loss_scale):
    points, weights, h = around(chain), np.random.default_rng(1).uniform(0, 2, 1000), 1e-6
    units = h * np.eye(chain.n_parameters)
    rows = np.stack([chain.moved(e).distance(points) - chain.moved(-e).distance(points) for e in units], axis=1) / (
        2 * h
    )
    off = chain.distance(points)
    less = 1 / (1 + (off / (loss_scale or np.inf)) ** 2)
    matrix, downhill, cost = chain.normal_equations(points, weights, loss_scale)
    assert_allclose(matrix, rows.T @ ((weights * less**2)[:, None] * rows), atol=1e-6)
    assert_allclose(downhill, -rows.T @ (weights * less**2 * off), atol=1e-6)
    assert_allclose(cost, weights @ (off**2 * less))


@every
def test_gradients_are_difference_quotients(chain):
    points = around(chain)
    steps = [(chain.distance(points + h) - chain.distance(points - h)) / 2e-6 for h in 1e-6 * np.eye(3)]
    assert_allclose(chain.measured(points)[1], np.stack(steps, axis=1), atol=1e-7)


@pytest.mark.parametrize("seed", range(5))
def test_elements_meet_tangentially_after_any_step(seed):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng)
    count = chain.n_parameters
    moved = chain.stepped(0.05 * rng.normal(size=count))
    elements, _ = elements_of(moved, moved.at(np.linspace(0, moved.stations[-1], 50))[0], np.eye(count), np.zeros(3))
    assert len(elements) == 13
    for one, other in itertools.pairwise(elements):
        assert max(meeting(one, other)) < 1e-11
    for element in elements[1::2]:
        for neighbor in (elements[0], elements[2]) if element is elements[1] else ():
            away = element.primitive.center - neighbor.start
            axis = neighbor.primitive.axis
            assert_allclose(np.linalg.norm(away - (away @ axis) * axis), element.bend_radius, rtol=1e-12)


def test_tangency_is_seen_when_it_is_missing():
    elements, _ = elements_of(PLAIN, PLAIN.at([1.0, 8.0, 14.0])[0], np.eye(PLAIN.n_parameters), np.zeros(3))
    turned = replace(elements[1], primitive=replace(elements[1].primitive, axis=elements[1].primitive.axis + 0.01))
    assert meeting(elements[0], elements[1])[1] < 1e-12
    assert meeting(elements[0], turned)[1] > 1e-3


def test_primitives_of_elements_are_the_surface():
    elements, labels = elements_of(REDUCED, (points := around(REDUCED)), np.eye(16), np.zeros(3))
    station = REDUCED.feet(points).station
    inside = (station > 0) & (station < REDUCED.stations[-1])
    kinds = ["straight", "bend", "straight", "reducer", "straight", "bend", "straight"]
    assert [element.kind for element in elements] == kinds
    for k, element in enumerate(elements):
        here = inside & (labels == k)
        assert here.sum() > 5
        assert_allclose(element.primitive.distance(points[here]), REDUCED.distance(points[here]), atol=1e-9)


def test_sections_of_an_eccentric_reducer_are_circles_across_its_axis():
    chain = Chain([[0, 0, 0], [9, 0, 0.4]], [], [1, 0.6], [[0, 3.0, 5.0]], [[0, 0, 0.4]])
    for height, middle, radius in [
        (2.0, 0.0, 1.0),
        (3.5, 0.1, 0.9),
        (4.0, 0.2, 0.8),
        (4.9, 0.38, 0.62),
        (7.0, 0.4, 0.6),
    ]:
        turn = np.linspace(0, 6, 9)
        circle = np.stack([np.full(9, height), radius * np.cos(turn), middle + radius * np.sin(turn)], axis=1)
        assert_allclose(chain.distance(circle), 0, atol=1e-12)
        assert_allclose(chain.at([height])[0], [[height, 0, middle]], atol=1e-12)
    assert_allclose(chain.measured([[4.0, 0, 1.3]])[0], 0.3, atol=1e-12)  # over the flush line


def test_an_eccentric_reducer_is_an_oblique_cone():
    points = around(ECCENTRIC)
    elements, labels = elements_of(ECCENTRIC, points, 1e-4 * np.eye(18), np.zeros(3))
    reducer, near = elements[3], labels == 3
    assert (reducer.kind, near.sum() > 5) == ("reducer", True)
    assert_allclose(reducer.offset, np.linalg.norm(ECCENTRIC.offsets))
    assert_allclose(reducer.deviations.offset, 0.01, rtol=1e-6)
    cone = reducer.primitive
    assert_allclose(cone.distance(points[near]), 0, atol=1e-12)
    assert_allclose(cone.gradient(points[near]), ECCENTRIC.measured(points[near])[1], atol=1e-9)
    assert_allclose(cone.projected(points[near]), points[near], atol=1e-12)
    turn = Rotation.random(random_state=1).as_matrix()
    T = np.block([[3 * turn, np.ones((3, 1))], [np.zeros((1, 3)), 1]])
    assert_allclose(cone.transformed(T).distance(3 * points @ turn.T + 1), 3 * cone.distance(points), atol=1e-12)
    assert_allclose(ECCENTRIC.distance(cone.triangulated().vertices), 0, atol=1e-12)
    with pytest.raises(TypeError, match="fitted with its line"):
        cone.derivatives(points)


def test_bends_are_kept_as_wide_as_the_pipe_and_off_each_other():
    tight = Chain(CORNERS, np.array([0.1, 20.0]), np.array([1.0]), np.zeros((0, 3))).fitting()
    assert tight.bend_radii[0] >= 1.0 - 1e-12
    assert (np.diff(tight.limits, axis=1) > -1e-9).all()


def test_changes_stay_longer_than_what_their_derivatives_are_differences_over():
    """The radius of a step changes over next to nothing, whose deviations are told all the same."""
    sooner = np.append(np.zeros(REDUCED.n_parameters - 1), -1.0)
    short = REDUCED.stepped((1 - 1e-4) * sooner)
    elements, _ = elements_of(short, around(short, 50), np.eye(short.n_parameters), np.zeros(3))
    assert [each.kind[0] for each in elements] == [*"sbsrsbs"]
    with pytest.raises(ValueError, match="some length"):
        REDUCED.stepped((1 - 5e-6) * sooner)


def test_the_part_between_short_bends_is_the_same_surface():
    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [20, 10, 0], [20, 20, 0.0]])
    changes = np.array([[0, 3.0, 4.0], [2, 4.0, 5.0], [3, 4.0, 5.0]])
    whole = Chain(corners, np.array([0.6, 3.0, 0.5]), np.array([1.0, 0.9, 0.8, 0.7]), changes)
    part = without_bends(whole, whole.are_short, np.array([15.0, 10, 0]))
    assert_allclose(part.corners, corners[1:4])
    assert_allclose(part.changes, [[1, 4.0, 5.0]])
    points = np.array([[10, 5, 2], [11, 9, 2], [13, 10, 2], [14.5, 10, 2], [17, 11, 2.0]])
    assert_allclose(part.distance(points), whole.distance(points), atol=1e-12)
    for place, kept in ((corners[0], slice(0, 2)), (corners[-1], slice(3, 5))):
        assert_allclose(without_bends(whole, whole.are_short, place).corners, corners[kept])


def test_offsets_are_one_for_each_change():
    with pytest.raises(ValueError, match="offsets must have shape"):
        replace(REDUCED, offsets=np.ones((2, 3)))


def test_bends_at_the_ends_of_a_line_have_room():
    """Their outer straights are drawn out, as nothing says that a line ends where its points do."""
    chain = chain_of([[0, 0, 0], [3.0, 0, 0], [3, 3, 0]], [3.0], 1.0)
    wider = chain.stepped(np.eye(chain.n_parameters)[-2])
    assert_allclose(wider.bend_radii, 4)
    assert_allclose([wider.corners[0], wider.corners[2]], [[-1, 0, 0], [3, 4, 0]], atol=1e-6)


@every
def test_reversal_keeps_the_surface(chain):
    points = around(chain)
    assert_allclose(reversed_chain(chain).distance(points), chain.distance(points), atol=1e-12)
    assert_allclose(reversed_chain(reversed_chain(chain)).changes, chain.changes, atol=1e-12)


@every
def test_motions_and_scales_move_along(chain):
    turn, shift, scale = Rotation.random(random_state=1).as_matrix(), np.array([3.0, -2.0, 5.0]), 7.0
    changes = chain.changes * [1, scale, scale]
    moved = Chain(scale * chain.corners @ turn.T + shift, scale * chain.bend_radii, scale * chain.radii, changes)
    moved = replace(moved, offsets=scale * chain.offsets @ turn.T)
    points = around(chain)
    assert_allclose(moved.distance(scale * points @ turn.T + shift), scale * chain.distance(points), atol=1e-10)


def test_a_straight_of_no_length_ends_in_no_bend():
    assert chain_of([[0.0, 0, 0], [1e-12, 0, 0]], [], 1.0).ends_in_bends == (False, False)


class TestClosed:
    @pytest.mark.parametrize("seed", range(3))
    def test_ones_meet_themselves_tangentially_after_any_step(self, seed):
        rng = np.random.default_rng(seed)
        moved = CLOSED.stepped(0.1 * rng.normal(size=CLOSED.n_parameters))
        chain = moved.begun(moved.reaches[-1] / np.linalg.norm(moved.corners[1] - moved.corners[-2]))
        assert chain.closed
        elements, _ = elements_of(chain, around(chain, 50), np.eye(chain.n_parameters), np.zeros(3))
        assert [element.kind for element in elements] == ["straight", "bend"] * 4
        for one, other in itertools.pairwise([*elements, elements[0]]):
            assert max(meeting(one, other)) < 1e-9

    def test_ones_are_the_same_wherever_they_begin(self):
        points = around(CLOSED)
        assert_allclose(CLOSED.begun(0.3).distance(points), CLOSED.begun(0.7).distance(points), atol=1e-12)

    def test_ones_stay_closed_as_they_move(self):
        moved = CLOSED.moved(0.1 * np.random.default_rng(0).normal(size=CLOSED.n_parameters))
        points = around(CLOSED)
        assert_allclose(moved.distance(points), moved.begun(0.5).distance(points), atol=1e-12)

    def test_tubes_have_no_ends(self):
        vertices, faces = swept(CLOSED, None)
        tube = TriangleMesh(vertices, faces)
        assert dual(tube, outward=False).n_holes == 0
        assert tube.volume == pytest.approx(np.pi * CLOSED.stations[-1], rel=0.02)
        across = np.sort(np.linalg.norm(np.diff(vertices[faces], axis=1), axis=2).max(axis=1))
        assert across[-1] < 1.7 * across[len(across) // 2]  # no ring is turned against the next one


def test_fits_that_leave_no_room_for_bends_are_refused(monkeypatch):
    """A bend tighter than the pipe is no torus."""
    corners = np.array([[0, 0, 0], [9, 0, 0], [9, 6, 0], [18, 6, 0.0]])
    start, short = (chain_of(corners * [1, share, 1], [1.0, 1.0], 1.0).fitting() for share in (1, 0.1))
    assert short.are_short.any()
    assert not start.are_short.any()
    points = np.zeros((1, 3))
    monkeypatch.setattr(refining, "solve", lambda *_, **__: short)
    assert refining.fitted(Surroundings(points, 1.0), start, points, 0.1) is start
