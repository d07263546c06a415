"""Stages of contact alone: gaps, the objective, steps, and what touches; between planes, by closed forms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.numerics.rigid import small_motion
from simplexmesh.recognition.contact import occlude
from simplexmesh.recognition.contact.constrained_least_squares import REGULARIZATION
from simplexmesh.recognition.contact.contact_limits import ContactLimits
from simplexmesh.recognition.contact.part_distances import part_distances

NONE, UP = np.zeros((0, 3)), np.array([0, 0, 1.0])
LIMITS = ContactLimits(0.1, 1.0, 0.05, NONE, NONE, np.inf)


def flat(points, outward, *, closed=True, areas=1.0):
    """A part whose surface is the plane z = 0, seen from where `outward` points."""
    points = np.asarray(points, float)
    return SimpleNamespace(
        points=points,
        normals=np.tile(outward, (len(points), 1)),
        areas=np.broadcast_to(areas, len(points)),
        closed=closed,
        signed_distance=lambda at: (at @ outward, np.tile(outward, (len(at), 1))),
    )


def distances(distance, area=1.0, rows=None):
    """Distances at places at the center, all upward."""
    n = len(distance)
    rows = np.tile([0, 0, 0, 0, 0, 1.0], (n, 1)) if rows is None else rows
    none = np.arange(0)
    return occlude.PartDistances(np.array(distance), rows, np.broadcast_to(area, n), np.zeros(3), 2.0, none, none)


def test_gaps_are_distances_but_for_the_depth_allowed():
    found = occlude._contact_gaps(distances([-0.2, -0.05, -0.01, 0.0, 0.3]), LIMITS)
    assert_allclose(found, [-0.15, 0, 0, 0, 0.3])


def test_the_objective_is_area_less_what_exceeds_the_limits():
    found, width = distances([0.3, 0.05, -0.2], 2.0), 0.1
    soft = 2 / (1 + 3.0**2) + 2 / (1 + 0.5**2) + 2 / (1 + 1.5**2)
    excess = 0.2 - 0.15 - occlude.LIMIT_TOLERANCE * 0.1
    relaxed = LIMITS._replace(penetration=0.15)
    assert_allclose(occlude._objective(found, np.eye(4), width, relaxed, LIMITS), soft - 6 * excess / width)
    inside = LIMITS._replace(penetration=0.2)
    assert_allclose(occlude._objective(found, np.eye(4), width, inside, LIMITS), soft)
    pairs = LIMITS._replace(moving_points=np.eye(3)[:1], fixed_points=np.eye(3)[:1] * 1.5, slack=0.3)
    excess = 0.5 - 0.3 - occlude.LIMIT_TOLERANCE * 0.1
    assert_allclose(occlude._objective(found, np.eye(4), width, inside, pairs), soft - 6 * excess / width)


@pytest.mark.parametrize("most", [1.0, 0.1])
def test_a_step_closes_a_gap_unless_that_is_too_far(most):
    T = small_motion(np.zeros(3), np.array([1.0, 2, 3]), np.zeros(3))
    found = distances([0.3])
    moved, size = occlude._step(T, found, np.ones(1), found.distance, LIMITS, most)
    far = min(0.3 / (1 + REGULARIZATION), most)
    assert_allclose(moved[:3, 3], [1, 2, 3 - far])
    assert_allclose(moved[:3, :3], np.eye(3), atol=1e-12)
    assert_allclose(size, far)


def test_a_step_turns_about_the_center_in_units_of_the_radius():
    found = distances([0.3], rows=np.array([[1.0, 0, 0, 0, 0, 0]]))
    moved, size = occlude._step(np.eye(4), found, np.ones(1), found.distance, LIMITS, 1.0)
    angle = 0.3 / (1 + REGULARIZATION)
    assert_allclose(moved, small_motion(np.array([-angle / 2, 0, 0]), np.zeros(3), np.zeros(3)), atol=1e-12)
    assert_allclose(size, angle)


def test_without_weight_a_step_goes_as_far_as_limits_ask_for():
    deep = distances([-0.25])
    moved, _ = occlude._step(np.eye(4), deep, np.zeros(1), deep.distance, LIMITS, 1.0)
    assert_allclose(moved[2, 3], 0.2, rtol=1e-5)
    apart = LIMITS._replace(moving_points=np.array([[1.0, 0, 0]]), fixed_points=np.zeros((1, 3)), slack=0.2)
    free = distances([9.0])._replace(center=np.array([1.0, 0, 0]))
    moved, _ = occlude._step(np.eye(4), free, np.zeros(1), free.distance, apart, 1.0)
    assert_allclose(moved[:3, 3], [-0.8, 0, 0], rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("n", [5, occlude.MAXIMUM_VERTICES, occlude.MAXIMUM_VERTICES + 50])
def test_of_many_vertices_some_attract(n):
    rows = occlude._attracting_rows(SimpleNamespace(points=np.zeros((n, 3))))
    assert len(rows) == min(n, occlude.MAXIMUM_VERTICES)
    assert (np.diff(rows) > 0).all()
    assert 0 <= rows[0] <= rows[-1] < n


def test_what_touches_is_near_and_faces_the_other_part():
    heights = np.array([0.1, 0.1002, 0.0, -0.149, -0.151])
    part = flat(np.column_stack([np.zeros((5, 2)), heights]), -UP)
    touching, distance = occlude._contact(part, flat(NONE, UP), np.eye(4), LIMITS)
    assert_allclose(distance, heights)
    assert touching.tolist() == [True, False, True, True, False]
    part.normals = np.array([[np.sin(a), 0, -np.cos(a)] for a in np.arccos([0.31, 0.29, 1, -1, 0.31])])
    part.points = np.zeros((5, 3))
    assert occlude._contact(part, flat(NONE, UP), np.eye(4), LIMITS)[0].tolist() == [True, False, True, False, True]
    turned = small_motion(np.array([np.pi, 0, 0]), np.zeros(3), np.zeros(3))
    assert occlude._contact(part, flat(NONE, UP), turned, LIMITS)[0].tolist() == [False, False, False, True, False]


@pytest.mark.parametrize("over", [0.5, 2.0])
def test_what_is_deeper_than_allowed_by_more_than_the_search_resolves_is_told(over, recwarn):
    depth = LIMITS.penetration + over * occlude.LIMIT_TOLERANCE * LIMITS.tolerance
    part = flat([[0, 0, -depth]], -UP)
    part.diagonal = 1.0
    found = occlude._result(part, flat(NONE, UP), np.eye(4), LIMITS, 0.0)
    assert_allclose(found.penetration, depth)
    assert any("penetrates target" in str(each.message) for each in recwarn) == (over > 1)


class TestDistances:
    moving = flat([[0, 0, 0], [3, 1, 0.2], [1, 2, 0.9], [0, 1, -0.4]], -UP, areas=[1.0, 2, 3, 4])
    fixed = flat([[0, 0, 0], [1, 1, 0.1], [2, 0, -2.0]], UP)
    T = small_motion(np.array([0.05, -0.02, 0.01]), np.array([0, 0, 0.3]), np.zeros(3))

    def test_are_of_both_parts_within_reach(self):
        found = part_distances(self.moving, self.fixed, self.T, 1.0, 0.5)
        here = self.moving.points @ self.T[:3, :3].T + self.T[:3, 3]
        back = -(self.fixed.points - self.T[:3, 3]) @ self.T[:3, :3] @ UP
        near, near_back = here[:, 2] <= 1.0, back <= 1.0
        assert_allclose(found.distance, [*here[near, 2], *back[near_back]])
        assert found.moving_rows.tolist() == np.flatnonzero(near).tolist()
        assert found.fixed_rows.tolist() == np.flatnonzero(near_back).tolist()
        assert_allclose(found.area, [*self.moving.areas[near], *np.zeros(near_back.sum())])
        places = np.concatenate([here[near], self.fixed.points[near_back]])
        assert_allclose(found.center, places.mean(axis=0))
        assert_allclose(found.radius, np.sqrt(((places - found.center) ** 2).sum(axis=1).mean()))

    def test_change_by_their_jacobian(self):
        found = part_distances(self.moving, self.fixed, self.T, 9.0, 9.0)
        for k, x in enumerate(1e-6 * np.eye(6)):
            step = small_motion(x[:3] / found.radius, x[3:], found.center)
            then = part_distances(self.moving, self.fixed, step @ self.T, 9.0, 9.0)
            assert_allclose((then.distance - found.distance) / 1e-6, found.jacobian[:, k], atol=1e-5)

    def test_of_open_parts_end_behind_them(self):
        for closed, count in ((True, 4), (False, 3)):
            fixed = flat(np.zeros((0, 3)), UP, closed=closed)
            assert len(part_distances(self.moving, fixed, np.eye(4), 1.0, 0.3).distance) == count

    def test_of_rows(self):
        rows = np.array([1, 3]), np.array([0])
        found = part_distances(self.moving, self.fixed, self.T, 1.0, 0.5, rows)
        whole = part_distances(self.moving, self.fixed, self.T, 1.0, 0.5)
        assert found.moving_rows.tolist() == [1, 3]
        assert_allclose(found.distance[:2], whole.distance[np.isin(whole.moving_rows, [1, 3]).nonzero()[0]])

    def test_that_do_not_face_each_other_have_no_area(self):
        found = part_distances(flat([[0, 0, 0.1]], UP), self.fixed, np.eye(4), 1.0, 0.5)
        assert not found.area.any()
        assert len(found.distance) == 4

    def test_of_none(self):
        found = part_distances(self.moving, self.fixed, small_motion(0 * UP, 9 * UP, 0 * UP), 1.0, 0.5)
        assert (len(found.distance), found.radius) == (0, 1.0)
