"""The mesh class: immutable, with shared connectivity, checked arguments."""

from __future__ import annotations

import copy
import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from tests.mesh.families import ALL, together

BALL = sm.sphere(3)


def test_says_what_it_is():
    assert repr(ALL["torus"]) == "SimplexMesh(168 vertices, 84 faces, genus 1, 0 holes)"
    assert repr(together(BALL, ALL["least plane"])).endswith("genus 0, 1 holes, 2 components)")
    assert repr(BALL.connectivity) == "Connectivity(180 vertices, 92 faces, 0 holes)"


def test_nothing_can_be_written_to():
    vertices = BALL.vertices.copy()
    mesh = sm.SimplexMesh(vertices, BALL.connectivity, {"weight": np.ones(180)})
    vertices[0] = 99
    assert_array_equal(mesh.vertices, BALL.vertices)
    with pytest.raises(FrozenInstanceError):
        mesh.vertices = vertices
    with pytest.raises(TypeError):
        mesh.data["weight"] = np.zeros(180)
    for values in (mesh.vertices, mesh.normals, mesh.metric, mesh.data["weight"], mesh.bounds, mesh.face_areas):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0


def test_moving_shares_the_connectivity_and_renews_the_geometry():
    mesh = BALL.with_data(weight=np.arange(180))
    curvature = mesh.sphere_curvature
    other = mesh.moved(2 * mesh.vertices)
    assert other.connectivity is mesh.connectivity
    assert other.data["weight"] is mesh.data["weight"]
    assert mesh.sphere_curvature is curvature
    assert_allclose(other.sphere_curvature, curvature / 2)
    assert_array_equal(other.bounds, 2 * mesh.bounds)


def test_mean_curvature_is_that_of_the_surface_also_where_spheres_through_neighbors_have_another():
    for around in (48, 96):
        ring = sm.torus(around, around // 3 // 2 * 2, radius=1.0, tube_radius=0.35)
        cosine = (np.hypot(*ring.vertices[:, :2].T) - 1) / 0.35
        exact = (1 + 0.7 * cosine) / (0.7 * (1 + 0.35 * cosine))
        assert np.abs(ring.mean_curvature - exact).mean() < 0.01
        assert np.abs(ring.sphere_curvature - exact).mean() > 0.3  # on a finer mesh, too
    assert ring.mean_curvature is ring.mean_curvature
    with pytest.raises(ValueError, match="read-only"):
        ring.mean_curvature[0] = 0


def test_mean_curvature_is_unknown_with_a_warning_on_the_smallest_mesh():
    with pytest.warns(sm.SimplexMeshWarning, match="4 of 4 vertices: 4 with too few neighbors"):
        assert np.isnan(sm.sphere(1, "tetrahedron").mean_curvature).all()


def test_data_are_added_replaced_and_dropped():
    mesh = BALL.with_data(a=np.ones(180), b=np.zeros((180, 3)))
    assert list(mesh.data) == ["a", "b"]
    assert mesh.with_data(a=2 * np.ones(180)).data["a"][0] == 2
    assert list(mesh.with_data(a=None).data) == ["b"]
    assert list(BALL.data) == []


def test_a_copy_is_the_same_mesh():
    mesh = ALL["cylinder"].with_data(a=np.arange(ALL["cylinder"].n_vertices))
    for other in (copy.copy(mesh), copy.deepcopy(mesh), pickle.loads(pickle.dumps(mesh))):
        assert_array_equal(other.vertices, mesh.vertices)
        assert_array_equal(other.connectivity.twin, mesh.connectivity.twin)
        assert_array_equal(other.connectivity.hole_darts, mesh.connectivity.hole_darts)
        assert_array_equal(other.data["a"], mesh.data["a"])
        assert not other.connectivity.twin.flags.writeable


@pytest.mark.parametrize("method", ["fan", "curved", "dual"])
def test_triangulated(method):
    triangles = BALL.triangulated(method)
    assert len(triangles.faces) == {"fan": 540, "curved": 540, "dual": 180}[method]
    assert sm.dual(triangles).genus == 0


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (lambda n: sm.ellipsoid((3, 2, 1), n), 8 * np.pi),
        (lambda n: sm.torus(8 * n, 4 * n, radius=2.0, tube_radius=0.7), 2 * np.pi**2 * 2 * 0.7**2),
    ],
)
def test_the_curved_fan_has_the_volume_of_the_smooth_body_to_fourth_order(shape, volume):
    coarse, fine = shape(5), shape(10)
    off = [abs(each.triangulated("curved").volume / volume - 1) for each in (coarse, fine)]
    assert off[0] < 0.1 * abs(coarse.volume / volume - 1)
    assert off[1] < off[0] / 11


def test_the_curved_fan_leaves_holes_open_and_vertices_on_edges_of_few_where_they_are():
    assert len(ALL["plane"].triangulated("curved").faces) == len(ALL["plane"].triangulated("fan").faces)
    cube = sm.sphere(1, "octahedron")
    assert_array_equal(cube.triangulated("curved").vertices, cube.triangulated("fan").vertices)


def test_the_curved_fan_takes_nothing_from_normals_on_creases_and_holes():
    creased = BALL.with_data(crease=np.ones(BALL.n_vertices, np.uint8))
    assert_array_equal(creased.triangulated("curved").vertices, BALL.triangulated("fan").vertices)
    tube = sm.cylinder(24, 10)
    away = [np.abs(np.linalg.norm(tube.triangulated(m).vertices[:, :2], axis=1) - 1).max() for m in ("fan", "curved")]
    assert away[1] < 0.5 * away[0]


def test_saved_and_read_back(tmp_path):
    mesh = ALL["plane"].with_data(weight=np.arange(ALL["plane"].n_vertices))
    mesh.save(tmp_path / "plane.vtp")
    other = sm.read(tmp_path / "plane.vtp")
    assert_array_equal(other.vertices, mesh.vertices)
    assert_array_equal(other.connectivity.twin, mesh.connectivity.twin)
    assert other.n_holes == 1
    assert mesh.to_pyvista().n_points == mesh.n_vertices


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: sm.SimplexMesh(np.zeros((5, 3)), BALL.connectivity),
            ValueError,
            r"vertices must have shape \(180, 3\)",
        ),
        (lambda: BALL.moved(np.full((180, 3), np.nan)), ValueError, "vertices must be finite"),
        (lambda: sm.SimplexMesh(BALL.vertices, BALL.neighbors), TypeError, "connectivity must be a Connectivity"),
        (lambda: BALL.with_data(a=np.ones(3)), ValueError, "data 'a' must have 180 rows"),
        (lambda: BALL.with_data(a=["x"] * 180), TypeError, "data 'a' must be numbers"),
        (lambda: BALL.with_data(a=[[1], [2, 3]]), ValueError, "^data 'a' must be an array, but its rows have"),
        (lambda: sm.SimplexMesh(BALL.vertices, BALL.connectivity, 5), TypeError, "^data must be a Mapping, not int$"),
        (lambda: sm.SimplexMesh(BALL.vertices, BALL.connectivity, np.ones(3)), TypeError, "^data must be a Mapping"),
        (lambda: BALL.triangulated("cut"), ValueError, "method must be one of 'fan', 'curved', 'dual', not 'cut'"),
    ],
)
def test_bad_input(make, error, message):
    with pytest.raises(error, match=message):
        make()
