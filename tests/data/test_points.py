"""Point clouds and their normals."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.points import PointCloud, distinct

RNG = np.random.default_rng(3)
TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


def pose(angles, shift):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    T[:3, 3] = shift
    return T


def test_normals_come_out_at_length_one():
    normals = RNG.normal(size=(20, 3)) * 7
    cloud = PointCloud(RNG.normal(size=(20, 3)), normals)
    assert_allclose(cloud.normals, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def test_arrays_are_read_only_copies():
    given_points = TETRAHEDRON.copy()
    cloud = PointCloud(given_points)
    given_points[0] = 9
    assert cloud.points[0, 0] == 0
    assert not cloud.points.flags.writeable


def test_bounds_and_diagonal():
    cloud = PointCloud(TETRAHEDRON * [1, 2, 2])
    assert_array_equal(cloud.bounds, [[0, 0, 0], [1, 2, 2]])
    assert cloud.diagonal == pytest.approx(3)


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-9, 9)] * 3))
def test_a_pose_moves_points_and_turns_normals(angles, shift):
    cloud = PointCloud(TETRAHEDRON, TETRAHEDRON + 0.1)
    T = pose(angles, shift)
    moved = cloud.transformed(T)
    assert_allclose(moved.points, cloud.points @ T[:3, :3].T + shift, atol=1e-12)
    assert_allclose(moved.normals, cloud.normals @ T[:3, :3].T, atol=1e-12)
    assert_allclose(moved.transformed(np.linalg.inv(T)).points, cloud.points, atol=1e-9)


def test_normals_stay_perpendicular_and_outward_under_any_affine_map():
    directions = RNG.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    T = np.eye(4)
    T[:3, :3] = np.diag([-3.0, 1.0, 0.5])
    moved = PointCloud(directions, directions).transformed(T)
    gradient = moved.points / np.array([3.0, 1.0, 0.5]) ** 2
    assert_allclose(moved.normals, gradient / np.linalg.norm(gradient, axis=1, keepdims=True), atol=1e-12)


def test_joined_clouds_keep_normals_only_if_all_have_them():
    bare, full = PointCloud(TETRAHEDRON), PointCloud(TETRAHEDRON + 5, np.ones((4, 3)))
    assert_array_equal(PointCloud.joined([bare, full]).points, np.vstack([TETRAHEDRON, TETRAHEDRON + 5]))
    assert PointCloud.joined([bare, full]).normals is None
    assert len(PointCloud.joined([full, full]).normals) == 8
    with pytest.raises(TypeError, match=r"^clouds\[0\] must be a PointCloud, not ndarray$"):
        PointCloud.joined([TETRAHEDRON])
    with pytest.raises(ValueError, match="clouds must be at least one"):
        PointCloud.joined([])


def test_duplicates_are_merged_in_order_and_reported():
    points = np.vstack([TETRAHEDRON, TETRAHEDRON[[2, 2, 0]]])
    normals = np.array([[0, 0, 1.0], [0, 1, 0], [1, 0, 0], [0, 0, -1], [1, 0, 0], [1, 0, 0], [1, 0, 0]])
    with pytest.warns(SimplexMeshWarning, match="merged 3 duplicate points of 7"):
        merged = PointCloud(points, normals).merged()
    assert_array_equal(merged.points, TETRAHEDRON)
    assert_allclose(merged.normals[0], np.array([1, 0, 1]) / np.sqrt(2))
    assert_allclose(merged.normals[1:], normals[1:4])


def test_a_cloud_without_duplicates_is_left_alone():
    cloud = PointCloud(TETRAHEDRON)
    assert cloud.merged() is cloud


@pytest.mark.parametrize(
    ("points", "normals", "error", "message"),
    [
        (np.zeros((0, 3)), None, ValueError, "points must be at least 4, not 0"),
        (TETRAHEDRON[:3], None, ValueError, "points must be at least 4, not 3"),
        (np.zeros((4, 2)), None, ValueError, r"points must have shape \(\*, 3\), not \(4, 2\)"),
        (np.where(TETRAHEDRON > 0, np.nan, 0), None, ValueError, "points must be finite; 3 of 4 have NaN or infinite"),
        (TETRAHEDRON.astype(complex), None, TypeError, "points must be numbers"),
        ([["a"] * 3] * 4, None, TypeError, "points must be numbers"),
        (TETRAHEDRON, "up", TypeError, r"normals must be numbers of shape \(\*, 3\), not str of <U2"),
        (TETRAHEDRON, TETRAHEDRON, ValueError, "normals must have a direction; 1 of 4 are zero"),
        (TETRAHEDRON, np.ones((3, 3)), ValueError, r"normals must have shape \(4, 3\), not \(3, 3\)"),
        (TETRAHEDRON, np.full((4, 3), np.inf), ValueError, "normals must be finite; 4 of 4"),
    ],
)
def test_refusals(points, normals, error, message):
    with pytest.raises(error, match=message):
        PointCloud(points, normals)


@pytest.mark.parametrize(
    ("T", "message"),
    [
        (np.eye(3), r"T_target_source must have shape \(4, 4\)"),
        (np.ones((4, 4)), "T_target_source must have the last row"),
        (np.diag([1.0, 1, 0, 1]), "T_target_source must be invertible"),
        (np.diag([0.0, 0, 0, 1]), "T_target_source must be invertible"),
    ],
)
def test_refused_transforms(T, message):
    with pytest.raises(ValueError, match=message):
        PointCloud(TETRAHEDRON).transformed(T)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_units_can_be_changed_by_any_factor(scale):
    cloud = PointCloud(TETRAHEDRON, TETRAHEDRON - 0.3).transformed(np.diag([scale, scale, scale, 1]))
    assert_allclose(cloud.points, scale * TETRAHEDRON)
    assert_allclose(cloud.normals, PointCloud(TETRAHEDRON, TETRAHEDRON - 0.3).normals)


@given(st.lists(st.tuples(*[st.sampled_from([0.0, -0.0, 1.0, 1e-300])] * 3), min_size=1, max_size=30))
def test_distinct_positions_come_in_order_of_appearance(rows):
    first, place = distinct(np.array(rows))
    seen = list(dict.fromkeys(rows))
    assert [rows[i] for i in first] == seen
    assert [seen[i] for i in place] == rows
    assert (np.diff(first) > 0).all()


@pytest.mark.parametrize("length", [1e-300, 1e-200, 1.0, 1e200, 1e300])
def test_normals_of_any_length(length):
    directions = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1], [1, 1, 1]])
    normals = sm.PointCloud(np.eye(4)[:, :3], length * directions).normals
    assert_allclose(normals, directions / np.linalg.norm(directions, axis=1, keepdims=True))


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
def test_copies_are_frozen_too(copied):
    surface = sm.sphere(2).triangulated()
    volume = sm.Volume(np.arange(24).reshape(2, 3, 4), spacing=2.0)
    cloud = sm.PointCloud(surface.vertices, surface.vertices)
    for thing in (surface, volume, cloud):
        again = copied(thing)
        assert repr(again) == repr(thing)
        arrays = [value for value in vars(again).values() if isinstance(value, np.ndarray)]
        assert len(arrays) >= 2
        assert not any(values.flags.writeable for values in arrays)


def test_views_of_writable_arrays_are_copied():
    positions = TETRAHEDRON.copy()
    view = positions[:]
    view.setflags(write=False)
    cloud = sm.PointCloud(view)
    positions[:] = 7
    assert_array_equal(cloud.points, TETRAHEDRON)
    assert sm.PointCloud(cloud.points).points is cloud.points
