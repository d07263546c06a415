"""Decimation: invariants, distance of the result from the surface, invalid input."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from skimage.measure import marching_cubes

from simplexmesh._base.errors import SimplexMeshWarning, TopologyError
from simplexmesh.data.decimate import decimate
from simplexmesh.data.io.reading import read_volume
from simplexmesh.mesh import shapes
from simplexmesh.mesh.decimation.vertex_bound import minimum_vertices
from simplexmesh.mesh.duality import dual
from tests.mesh.decimation.reference import shaken
from tests.mesh.operators.test_editing import MESHES, complete

names = st.sampled_from(["sphere", "torus", "two tori", "plane", "cylinder", "torus with holes"])
parts = st.floats(0.2, 1.0)


def topology(mesh):
    """The topological invariants."""
    return mesh.genus, mesh.n_holes, mesh.n_components


@pytest.mark.filterwarnings("ignore:.*fold or cross")
@given(name=names, part=parts)
def test_topology_stays(name, part):
    mesh = MESHES[name]
    wanted = max(2 * round(part * mesh.n_vertices / 2), minimum_vertices(mesh.connectivity) + 40)
    out = decimate(mesh, vertices=min(wanted, mesh.n_vertices))
    assert complete(out.mesh.connectivity)
    assert topology(out.mesh) == topology(mesh)
    assert out.mesh.n_vertices == min(wanted, mesh.n_vertices)
    assert np.isfinite(out.mesh.vertices).all()


def test_maps_of_vertices_and_faces():
    ball = shapes.sphere(8)
    out = decimate(ball, vertices=300)
    kept = out.vertex_map >= 0
    assert_array_equal(np.sort(out.vertex_map[kept]), np.arange(300))
    assert (out.face_map >= 0).sum() == out.mesh.n_faces
    sizes = out.mesh.connectivity.face_sizes
    assert_array_equal(out.exceptions, np.flatnonzero((sizes < 5) | (sizes > 7)))


def test_as_many_vertices_as_there_are_leave_the_mesh_as_it_is():
    ball = shapes.sphere(4)
    out = decimate(ball, vertices=ball.n_vertices)
    assert_array_equal(out.mesh.vertices, ball.vertices)
    assert_array_equal(out.mesh.neighbors, ball.neighbors)
    assert out.largest == out.rms == 0


def test_a_tolerance_below_rounding_holds_too():
    ball = shapes.sphere(3, center=(1e4, 0, 0))
    with pytest.warns(SimplexMeshWarning, match="no vertex could be removed within a tolerance of 1e-14"):
        out = decimate(ball, tolerance=1e-14)
    assert_array_equal(out.mesh.vertices, ball.vertices)
    assert out.largest <= 1e-14


@pytest.mark.filterwarnings("ignore:.*(fold or cross|are left|removed within)")
def test_a_surface_without_area_has_distances():
    ball = shapes.sphere(3)
    point = ball.moved(np.ones_like(ball.vertices))
    for out in (decimate(point, vertices=100), decimate(point, tolerance=0.1)):
        assert out.rms == out.largest == 0


@pytest.mark.parametrize(
    ("given_", "error", "says"),
    [
        ({}, TypeError, "give vertices or tolerance"),
        ({"vertices": 100, "tolerance": 0.1}, TypeError, "not both"),
        ({"vertices": 101}, ValueError, "vertices must be even.*not 101"),
        ({"vertices": 1000}, ValueError, "at most 320, as many as the mesh has, not 1000"),
        ({"vertices": 2}, TopologyError, "at least 4, the minimum for genus 0, 0 holes, not 2"),
        ({"vertices": 10.0}, TypeError, "vertices must be a whole number"),
        ({"tolerance": 0.0}, ValueError, "tolerance must be above 0"),
        ({"tolerance": np.nan}, ValueError, "tolerance must be finite"),
    ],
)
def test_bad_input(given_, error, says):
    with pytest.raises(error, match=says):
        decimate(shapes.sphere(4), **given_)


def test_a_plane_stays_flat_and_keeps_its_corners():
    plane = shapes.plane(20, 20)
    out = decimate(plane, vertices=100)
    assert np.abs(out.mesh.vertices[:, 2]).max() < 1e-12
    assert out.mesh.check(self_intersections=True)
    low, high = out.mesh.bounds
    assert_allclose((low[:2], high[:2]), ((-0.5, -0.5), (0.5, 0.5)), atol=5e-3)
    assert abs(out.mesh.area - plane.area) < 2e-3


def test_the_error_on_a_sphere_is_as_small_as_its_faces_allow():
    ball = shapes.sphere(20)
    for n in (200, 800):
        out = decimate(ball, vertices=n)
        radius = np.linalg.norm(out.mesh.triangulated().vertices, axis=1)
        assert out.mesh.check(self_intersections=True)
        assert len(out.exceptions) <= 0.02 * out.mesh.n_faces
        # a flat face of area 8 pi / n on the unit sphere is 4 / n high, and half of that from its mean
        assert out.rms < 2 / n
        assert abs(radius - 1).max() < 8 / n


@pytest.mark.parametrize(
    ("name", "tolerance"), [("sphere", 0.03), ("cylinder", 0.05), ("plane", 0.01), ("torus", 0.05)]
)
def test_a_tolerance_holds_both_ways(name, tolerance):
    mesh = {
        "sphere": lambda: shapes.sphere(8),
        "cylinder": lambda: shapes.cylinder(24, 14),
        "plane": lambda: shapes.plane(14, 14),
        "torus": lambda: shapes.torus(28, 14),
    }[name]()
    out = decimate(mesh, tolerance=tolerance)
    assert out.mesh.n_vertices < 0.6 * mesh.n_vertices
    assert topology(out.mesh) == topology(mesh)
    assert out.mesh.check(self_intersections=True)
    assert out.largest <= tolerance
    for one, other in ((mesh, out.mesh), (out.mesh, mesh)):
        assert farthest(one.triangulated(), other.triangulated()) <= tolerance


def box(k):
    """The dual of a cube whose sides are grids of k by k squares of two triangles each."""
    grid = np.stack(np.meshgrid(*[np.arange(k + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    number = {tuple(p): i for i, p in enumerate(grid.tolist())}
    triangles = []
    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, k):
            for i in range(k):
                for j in range(k):
                    square = []
                    for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)) if end else ((0, 0), (0, 1), (1, 1), (1, 0)):
                        p = [0, 0, 0]
                        p[axis], p[one], p[other] = end, i + x, j + y
                        square.append(number[tuple(p)])
                    turn = (i + j) % 2
                    square = square[turn:] + square[:turn]
                    triangles += [square[:3], [square[0], square[2], square[3]]]
    used, triangles = np.unique(triangles, return_inverse=True)
    return dual((grid[used] / k - 0.5, triangles.reshape(-1, 3)))


def farthest(one, other):
    """The largest distance of random points of a triangulation to another one, by libigl."""
    rng = np.random.default_rng(0)
    a, b, c = (one.vertices[one.faces[:, k]] for k in range(3))
    share = rng.dirichlet((1, 1, 1), 10)
    points = np.concatenate([s[0] * a + s[1] * b + s[2] * c for s in share])
    squared = igl.point_mesh_squared_distance(points, np.array(other.vertices), np.array(other.faces, np.int64))[0]
    return float(np.sqrt(squared.max()))


def test_faces_end_at_creases():
    """Each face of a decimated box lies on one side of it, except those along its edges."""
    out = decimate(box(12), vertices=200)
    assert out.mesh.check(self_intersections=True)
    assert len(out.exceptions) == 0
    assert out.rms < 4e-3
    c, v = out.mesh.connectivity, out.mesh.vertices
    middles = np.add.reduceat(v[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes[:, None]
    on_side = np.abs(np.abs(middles).max(axis=1) - 0.5) < 0.02
    assert on_side.mean() > 0.9


def test_a_fine_tolerance_lets_vertices_go_where_it_can():
    """A ball with an edge too sharp for the tolerance still loses vertices elsewhere."""
    ball = shapes.sphere(16)
    v = np.array(ball.vertices)
    v[v[:, 2] > 0.7, 2] = 0.7
    out = decimate(ball.moved(v), tolerance=0.01)
    assert out.largest <= 0.01
    assert out.mesh.n_vertices < 0.4 * ball.n_vertices
    assert out.mesh.check(self_intersections=True)


def test_what_folds_before_does_not_fold_after():
    ball = shaken(shapes.sphere(16), 0, 0.9)
    assert not ball.check(self_intersections=True)
    out = decimate(ball, vertices=600)
    assert out.mesh.check(self_intersections=True)


@pytest.mark.filterwarnings("ignore:triangles repaired")
@pytest.mark.nightly
@pytest.mark.parametrize("vertices", [4000, 5000, 8000])
def test_thin_walls_of_a_head_are_left_without_folds(data_folder, vertices):
    volume = read_volume(data_folder / "head_ct.mhd")
    corners, faces, _, _ = marching_cubes(np.pad(np.asarray(volume.values, float), 1), 500)
    head = dual((volume.to_world(corners - 1), faces))
    assert set(head.check(self_intersections=True).where) >= {"inverted", "folded", "crossing"}
    out = decimate(head, vertices=vertices)
    assert out.mesh.n_vertices == vertices
    assert out.mesh.check(self_intersections=True)
    assert out.rms < 0.0007 * np.linalg.norm(np.ptp(head.bounds, axis=0))


def test_tangled_vertices_are_reported():
    wild = shaken(shapes.sphere(6), 0, 20.0)
    with pytest.warns(SimplexMeshWarning, match="vertices of the decimated mesh are on faces that fold or cross"):
        decimate(wild, vertices=400)


def test_no_more_is_removed_than_can_be():
    torus = MESHES["torus"]
    least = minimum_vertices(torus.connectivity)
    with pytest.warns(SimplexMeshWarning) as caught:
        out = decimate(torus, vertices=least)
    assert complete(out.mesh.connectivity)
    assert topology(out.mesh) == topology(torus)
    if out.mesh.n_vertices > least:
        assert any(f"{out.mesh.n_vertices} vertices are left, not {least}" in str(w.message) for w in caught)
