"""Rigid motions: what was applied is recovered, derivatives are difference quotients."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from simplexmesh.numerics import rigid, robust

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(60, 3)) * [3, 2, 1] + 5
NORMALS = RNG.normal(size=(60, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1)[:, None]


def moved(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def motion(angle):
    return rigid.small_motion(angle * np.array([2.0, -1, 2]) / 3, np.array([0.3, 0.2, -0.4]), np.array([4.0, 5, 6]))


@pytest.mark.parametrize("angle", [0.0, 0.1, 3.0])
def test_a_small_motion_turns_about_its_center_and_shifts(angle):
    T, center = motion(angle), np.array([4.0, 5, 6])
    assert_allclose(rigid.rotation_angle(T), angle, atol=1e-12)
    assert_allclose(moved(T, center), center + np.array([0.3, 0.2, -0.4]))
    assert_allclose(T[:3, :3], Rotation.from_rotvec(angle * np.array([2.0, -1, 2]) / 3).as_matrix())
    assert_allclose(T[3], [0, 0, 0, 1])


@pytest.mark.parametrize("angle", [0.0, 0.1, 3.0])
@pytest.mark.parametrize("flat", [False, True])
def test_what_was_applied_is_recovered(angle, flat):
    points = POINTS * [1, 1, 0] if flat else POINTS
    assert_allclose(rigid.rigid_fit(points, moved(motion(angle), points)), motion(angle), atol=1e-12)


@pytest.mark.parametrize(("wrong", "off"), [(0, 1e-9), (8, 0.05)])
def test_planes_pull_points_back_onto_them_in_spite_of_outliers(wrong, off):
    target, T = POINTS.copy(), np.linalg.inv(motion(0.2))
    source = moved(T, target)
    target[:wrong] += 2
    found = rigid.point_to_plane_fit(source, target, NORMALS, np.eye(4))
    assert_allclose(found @ T, np.eye(4), atol=off)


def test_tangential_distances_decide_what_normals_do_not():
    """Points of a plane shifted along it: only the weak pull along it brings them back."""
    flat = POINTS * [1, 1, 0]
    away = flat + [0.5, 0, 0] + 1e-3 * RNG.normal(size=(60, 1)) * [0, 0, 1]
    found = rigid.point_to_plane_fit(away, flat, np.tile([0, 0, 1.0], (60, 1)), np.eye(4))
    assert_allclose(moved(found, away)[:, :2], flat[:, :2], atol=1e-3)


def test_distances_to_planes_change_by_their_jacobian():
    rows = rigid.plane_jacobian(POINTS, NORMALS)
    for k, x in enumerate(1e-6 * np.eye(6)):
        step = moved(rigid.small_motion(x[:3], x[3:], np.zeros(3)), POINTS) - POINTS
        assert_allclose((step * NORMALS).sum(axis=1) / 1e-6, rows[:, k], atol=1e-5)


def test_weights_fall_with_distance_in_terms_of_twice_the_deviation():
    residuals = np.array([-3.0, -1, 0, 1, 2])
    assert_allclose(robust.robust_scale(residuals, 0.1), 2 * 1.4826)
    assert robust.robust_scale(residuals, 5.0) == 5
    assert_allclose(robust.robust_weights(residuals, 5.0), 1 / (1 + residuals**2 / 25) ** 2)


def test_extents_are_relative_to_the_longest():
    assert_allclose(rigid.relative_extents(np.concatenate([np.diag([4, 3, 1.0]), -np.diag([4, 3, 1.0])]) + 7),
                    [1, 3 / 4, 1 / 4])  # fmt: skip
    assert_allclose(rigid.relative_extents(np.zeros((3, 3))), 0)


@pytest.mark.parametrize("pairs", [[POINTS], [POINTS, POINTS, POINTS], {"a": POINTS, "b": POINTS}, 7])
def test_what_is_no_pair_is_refused(pairs):
    with pytest.raises(TypeError, match=r"^pairs must be two arrays of points, of a and of b$"):
        rigid.point_pairs(pairs, "of a and of b")
    first, second = rigid.point_pairs([POINTS, 2 * POINTS], "of a and of b")
    assert_allclose(second, 2 * first)
