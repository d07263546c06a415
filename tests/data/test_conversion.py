"""Conversion of arguments to data types."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.conversion import as_data, as_points, as_triangles, as_volume
from simplexmesh.motion.reconstruct.conversion import are_scans
from simplexmesh.surface.sampled_surface import _converted

POINTS = np.random.default_rng(0).normal(size=(30, 3))


def test_own_types_pass_through():
    ball = sm.sphere(3)
    for value in (sm.Volume(np.zeros((2, 2, 2))), sm.PointCloud(POINTS), ball.triangulated(), ball):
        assert as_data(value) is value


def test_arrays():
    assert_array_equal(as_data(POINTS).points, POINTS)
    assert_array_equal(as_data(POINTS.tolist()).points, POINTS)
    assert as_data(np.hstack([POINTS, POINTS])).normals is not None
    assert as_data(np.zeros((4, 5, 6))).shape == (4, 5, 6)
    assert as_triangles((POINTS, [[0, 1, 2]])).n_faces == 1


@pytest.mark.parametrize("kind", [np.uint8, np.int64, np.float64, "shares"])
@pytest.mark.parametrize("take", [as_data, as_points, lambda rows: _converted(rows)], ids=["data", "points", "surface"])
def test_colors_beside_points_are_colors_and_told(take, kind):
    colors = np.random.default_rng(1).integers(0, 256, (30, 3)).astype(np.uint8)
    colors[0] = 0
    beside = colors / 255 if kind == "shares" else colors.astype(kind)
    with pytest.warns(SimplexMeshWarning, match=r"^\w+ of shape \(\*, 6\) are points and colors"):
        cloud = take(np.hstack([POINTS, beside]))
    assert cloud.normals is None
    assert cloud.data["colors"].dtype == np.uint8
    assert_array_equal(cloud.data["colors"], colors)


@pytest.mark.parametrize("beside", [np.eye(3)[np.arange(30) % 3], 0.1 * POINTS, 300 * np.abs(POINTS)])
def test_normals_beside_points_are_normals(beside):
    cloud = as_data(np.hstack([POINTS, beside]))
    assert not cloud.data
    assert_array_equal(cloud.normals, sm.PointCloud(POINTS, beside).normals)


def test_pyvista():
    import pyvista

    assert as_data(pyvista.PolyData(POINTS.astype(float))).points.shape == (30, 3)
    ball = as_data(pyvista.Sphere())
    assert isinstance(ball, sm.TriangleMesh)
    assert ball.is_closed
    cube = as_data(pyvista.Cube().clean())
    assert cube.volume == pytest.approx(1)
    grid = pyvista.ImageData(dimensions=(3, 4, 5), spacing=(1, 2, 3))
    grid["a"] = np.arange(60)
    volume = as_volume(grid)
    del grid
    assert volume.shape == (3, 4, 5)
    assert volume.values[1, 2, 3] == 1 + 3 * (2 + 4 * 3)
    with pytest.raises(TypeError, match=r"data must be a VTK image or polygons .*, not vtkUnstructuredGrid"):
        as_data(pyvista.UnstructuredGrid())


def test_pyvista_samples_are_not_frozen_nor_shared():
    import pyvista

    grid = pyvista.ImageData(dimensions=(3, 4, 5))
    grid["a"] = np.zeros(60)
    volume = as_volume(grid)
    grid["a"][:] = 1
    assert volume.range == (0, 0)


def test_trimesh():
    import trimesh

    box = as_data(trimesh.creation.box())
    assert isinstance(box, sm.TriangleMesh)
    assert box.volume == pytest.approx(1)
    assert as_data(trimesh.PointCloud(POINTS)).points.shape == (30, 3)


def test_paths(tmp_path):
    sm.sphere(2).save(tmp_path / "ball.vtp")
    assert as_data(str(tmp_path / "ball.vtp")).n_vertices == 80
    assert as_triangles(tmp_path / "ball.vtp").is_closed
    with pytest.raises(TypeError, match=r"volume must be a volume, not the SimplexMesh in ball.vtp"):
        as_volume(tmp_path / "ball.vtp")


def test_surfaces_give_their_points():
    ball = sm.sphere(3)
    assert_array_equal(as_points(ball).points, ball.vertices)
    assert_array_equal(as_points(ball.triangulated("dual")).points, ball.triangulated("dual").vertices)


@pytest.mark.parametrize("kind", [float, int, np.float32])
def test_vertices_and_faces_are_a_surface_wherever_one_is_taken(kind):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], kind)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert as_data((corners, faces)).is_closed
    assert as_data((corners.tolist(), faces.tolist())).is_closed
    assert kind is int or as_data([corners, faces]).is_closed
    assert as_data((corners, faces[:1])).n_faces == 1
    assert len(sm.deviation((corners, faces), (corners, faces)).distances) == 4


def test_scans_of_whole_numbers_are_scans_unless_one_numbers_the_other():
    points = np.arange(12).reshape(4, 3)
    assert are_scans([points, points])
    assert are_scans((points, points))
    assert are_scans([points, points % 4])  # of a grid, say
    assert not are_scans((points, points % 4))
    assert not are_scans([points.astype(float), points % 4])


def test_duplicates_are_merged_and_reported():
    with pytest.warns(SimplexMeshWarning, match="merged 2 duplicate points of 32"):
        assert len(as_data(np.vstack([POINTS, POINTS[:2]]))) == 30
    with pytest.warns(SimplexMeshWarning, match="merged 1 duplicate point of 31"):
        assert len(as_data(sm.PointCloud(np.vstack([POINTS, POINTS[:1]])))) == 30


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (None, TypeError, "data must be a Volume, .* or path, not NoneType"),
        (3.0, TypeError, "data must be a Volume"),
        (np.zeros((5, 2)), ValueError, r"data must have shape \(\*, 3\) for points, .*, not \(5, 2\)"),
        (np.zeros(0), ValueError, "data must have shape"),
        ([], ValueError, "data must have shape"),
        ([[1, 2, 3], [4, 5]], ValueError, "data must be an array, but its rows have different lengths"),
        (np.array([["a"] * 3] * 4), TypeError, "data must be numbers, not ndarray of <U1"),
        (np.full((4, 3), np.nan), ValueError, "points must be finite; 4 of 4"),
        (np.ma.masked_less(POINTS, 0.0), ValueError, "data must have no masked values, [0-9]+ of 90 are"),
        ("nowhere.ply", FileNotFoundError, "'nowhere.ply' does not exist"),
    ],
)
def test_refusals(value, error, message):
    with pytest.raises(error, match=message):
        as_data(value)


@pytest.mark.parametrize(
    ("convert", "value", "message"),
    [
        (as_volume, POINTS, "volume must be a volume, not ndarray read as PointCloud"),
        (
            as_points,
            sm.Volume(np.zeros((2, 2, 2))),
            "points must be points, not a Volume, of which reconstruct makes a surface",
        ),
        (as_triangles, sm.PointCloud(POINTS), "triangles must be a surface of triangles, not a PointCloud"),
    ],
)
def test_the_wrong_kind(convert, value, message):
    with pytest.raises(TypeError, match=message):
        convert(value)


def test_a_simplex_mesh_becomes_what_is_wanted(tmp_path):
    ball = sm.sphere(3)
    assert as_data(ball) is ball
    assert np.array_equal(as_points(ball).points, ball.vertices)
    assert np.allclose(as_points(ball).normals, ball.normals, rtol=0, atol=1e-15)
    assert as_triangles(ball).n_faces == ball.triangulated().n_faces
    ball.save(tmp_path / "ball.vtp")
    assert np.array_equal(sm.read_points(tmp_path / "ball.vtp").points, ball.vertices)


@pytest.mark.parametrize("convert", [as_data, as_triangles])
def test_a_ragged_pair_is_called_by_the_name_of_the_argument(convert):
    with pytest.raises(ValueError, match=r"^source must be an array, but its rows have different lengths$"):
        convert(([[0, 0, 0], [1]], [[0, 1, 2]]), "source")


@pytest.mark.parametrize("kind", [tuple, list])
@pytest.mark.parametrize(
    ("second", "found"),
    [
        (np.ones((5, 3)), r"\(5, 3\) float64 and \(5, 3\) float64"),
        (np.ones((2, 3)), r"\(5, 3\) float64 and \(2, 3\) float64"),
    ],
    ids=["normals", "faces"],
)
def test_a_pair_that_is_not_vertices_and_faces_is_no_volume(kind, second, found):
    with pytest.raises(ValueError, match=r"data must be \(vertices, faces\), the latter .*, not a pair of " + found):
        as_data(kind([np.random.default_rng(0).random((5, 3)), second]))


def test_quadrangles_are_refused_by_their_shape():
    with pytest.raises(ValueError, match=r"not a pair of \(5, 3\) float64 and \(1, 4\) int64"):
        as_data((np.random.default_rng(0).random((5, 3)), [[0, 1, 2, 3]]))
