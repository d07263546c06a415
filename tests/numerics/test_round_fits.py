"""Round surfaces and circles from points that are exactly on them, or nearly."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.numerics import circle_fits, round_fits
from simplexmesh.numerics.robust import weighted_quantiles

RNG = np.random.default_rng(0)
AXIS = np.array([2.0, -1, 2]) / 3
ON = np.array([0.3, 0.2, -0.4])
TURNED = round_fits.across_normals(np.linalg.svd(AXIS[None])[2][1:])


def spread(n, least=0.0, most=6.0):
    """Radial unit directions around the axis."""
    angle = np.linspace(least, most, n)
    return np.cos(angle)[:, None] * TURNED[0] + np.sin(angle)[:, None] * TURNED[1]


def test_the_axis_is_what_no_normal_is_along():
    assert_allclose(abs(TURNED[2] @ AXIS), 1)
    assert_allclose(TURNED @ TURNED.T, np.eye(3), atol=1e-14)


@pytest.mark.parametrize("d", [2, 3])
def test_a_ball_through_points(d):
    points = RNG.normal(size=(20, d))
    points *= 0.7 / np.linalg.norm(points, axis=1)[:, None]
    center, radius = round_fits.ball(points + ON[:d])
    assert_allclose([*center, radius], [*ON[:d], 0.7])


def test_a_short_noisy_arc_is_not_drawn_to_a_smaller_circle():
    angle = np.linspace(-0.25, 0.25, 400)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1) * (1 + 0.002 * RNG.normal(size=(400, 1)))
    assert_allclose(round_fits.ball(4 * (arc - [1, 0]))[1], 4, rtol=0.05)


def test_a_flat_is_a_ball_without_end():
    flat = np.concatenate([np.eye(3)[:2], -np.eye(3)[:2]])
    assert not round_fits.ball(flat)[1] < 1e6


def test_the_apex_is_on_all_tangent_planes():
    radial = spread(20)
    slant, normals = 0.8 * AXIS + 0.6 * radial, 0.8 * radial - 0.6 * AXIS
    points = ON + RNG.uniform(1, 2, (20, 1)) * slant
    assert_allclose(round_fits.cone_apex(points, normals), ON)
    place, axis = round_fits.met_axis(points, normals)
    assert_allclose(abs(axis @ AXIS), 1)
    assert_allclose(np.cross(place - ON, AXIS), 0, atol=1e-9)


def test_normals_in_planes_that_turn_about_nothing_meet_no_axis():
    assert round_fits.met_axis(RNG.normal(size=(20, 3)), spread(20)) is None


def test_places_about_an_axis():
    away, along = round_fits.from_axis(ON + 2 * AXIS + 3 * spread(7), ON, AXIS)
    assert_allclose(away, 3)
    assert_allclose(along, 2)


def test_lines_that_pass_each_other():
    u, v, p = TURNED[0], 0.6 * TURNED[0] + 0.8 * TURNED[1], ON
    q = p + 2 * u + 3 * v + 0.5 * TURNED[2]
    ahead, back, apart, across = round_fits.between_axes(p, u, q, v)
    assert_allclose([ahead, back, abs(apart)], [2, 3, 0.5])
    assert_allclose(apart * across, 0.5 * TURNED[2], atol=1e-12)


class TestCircles:
    def test_distances_and_derivatives(self):
        at, radius = RNG.normal(size=(30, 3)), 0.7
        found, rows = circle_fits.circle_residuals(at, ON, AXIS, radius)
        height = (at - ON) @ AXIS
        assert_allclose(found[:, 0], np.linalg.norm(at - ON - height[:, None] * AXIS, axis=1) - radius)
        assert_allclose(found[:, 1], height)
        u, v = circle_fits.tangents(AXIS)
        for k, x in enumerate(1e-6 * np.eye(6)):
            ahead, behind = (
                circle_fits.circle_residuals(
                    at,
                    ON + s * x[:3],
                    circle_fits.normalized(AXIS + s * (x[3] * u + x[4] * v)),
                    radius + s * x[5],
                )[0]
                for s in (1, -1)
            )
            assert_allclose((ahead - behind) / 2e-6, rows[:, :, k], atol=1e-8)

    @pytest.mark.parametrize("count", [3, 60, 2500])
    def test_is_found_among_outliers_without_weight(self, count):
        at, weight = ON + 0.7 * spread(count), np.ones(count)
        if count > 3:
            at[::4] += RNG.normal(size=at[::4].shape)
            weight[::4] = 0.2
        center, normal, radius = circle_fits.sampled_circle(at, weight)
        assert_allclose([*center, abs(normal @ AXIS), radius], [*ON, 1, 0.7], atol=1e-9)

    def test_points_without_weight_complete_a_triple(self):
        at, weight = ON + 0.7 * spread(20), np.zeros(20)
        weight[[3, 9]] = 1
        assert_allclose(circle_fits.sampled_circle(at, weight)[2], 0.7)

    def test_points_of_a_line_are_on_none(self):
        assert circle_fits.sampled_circle(np.arange(5.0)[:, None] * AXIS, np.ones(5)) is None

    def test_gets_exact_from_nearby(self):
        at, weight = ON + 0.7 * spread(50), np.ones(50)
        at[::5] += 0.2 * RNG.normal(size=(10, 3))
        center, normal, radius, scale = circle_fits.robust_circle(at, weight, ON + 0.1, TURNED[2] + 0.05, 0.8)
        assert_allclose([*center, abs(normal @ AXIS), radius], [*ON, 1, 0.7], atol=1e-9)
        assert scale < 1e-8

    def test_weights_count_as_repetitions(self):
        at = ON + spread(12) * RNG.uniform(0.6, 0.8, (12, 1))
        weight = RNG.integers(1, 4, 12)
        start = ON, AXIS, 0.7
        found = circle_fits.robust_circle(at, weight / 1.0, *start)[:3]
        median = weighted_quantiles(np.arange(4.0), np.array([1.0, 1, 1, 4]), 0.5)
        assert median == 3
        assert_allclose(found[2], 0.7, atol=0.1)
