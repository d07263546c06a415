"""Decimating: what stays, how near the surface the result is, and what is refused."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.errors import SimplexMeshWarning, TopologyError
from simplexmesh.mesh import _kernels_decimate as kernels
from simplexmesh.mesh import _kernels_quadrics as quadrics
from simplexmesh.mesh import shapes
from simplexmesh.mesh.decimate import WEIGHTS, decimate
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.least import least_vertices
from simplexmesh.mesh.nearest import Nearest
from tests.reference_decimate import Decimation, planes_around
from tests.reference_operators import Loops
from tests.test_mesh_editing import MESHES, complete

names = st.sampled_from(["sphere", "torus", "two tori", "plane", "cylinder", "torus with holes"])
parts = st.floats(0.2, 1.0)


def topology(mesh):
    """The numbers that stay."""
    return mesh.genus, mesh.n_holes, mesh.n_components


@pytest.mark.filterwarnings("ignore:.*fold or cross")
@settings(max_examples=30)
@given(name=names, part=parts)
def test_topology_stays(name, part):
    mesh = MESHES[name]
    wanted = max(2 * round(part * mesh.n_vertices / 2), least_vertices(mesh.connectivity) + 40)
    out = decimate(mesh, vertices=min(wanted, mesh.n_vertices))
    assert complete(out.mesh.connectivity)
    assert topology(out.mesh) == topology(mesh)
    assert out.mesh.n_vertices == min(wanted, mesh.n_vertices)
    assert np.isfinite(out.mesh.vertices).all()


def test_maps_tell_where_everything_went():
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
    assert out.largest < 1e-12


@pytest.mark.parametrize(
    ("given_", "error", "says"),
    [
        ({}, TypeError, "give vertices or tolerance"),
        ({"vertices": 100, "tolerance": 0.1}, TypeError, "not both"),
        ({"vertices": 101}, ValueError, "vertices must be even.*not 101"),
        ({"vertices": 1000}, ValueError, "at most 320, as many as the mesh has, not 1000"),
        ({"vertices": 2}, TopologyError, "at least 4, the fewest with genus 0, 0 holes, not 2"),
        ({"vertices": 10.0}, TypeError, "vertices must be a whole number"),
        ({"tolerance": 0.0}, ValueError, "tolerance must be above 0"),
        ({"tolerance": np.nan}, ValueError, "tolerance must be finite"),
    ],
)
def test_bad_input_is_told(given_, error, says):
    with pytest.raises(error, match=says):
        decimate(shapes.sphere(4), **given_)


def test_only_a_mesh_is_decimated():
    with pytest.raises(TypeError, match="mesh must be a SimplexMesh, not list"):
        decimate([], vertices=4)


def shaken(mesh, seed, size=0.15):
    """The mesh with its vertices moved at random by a part of the edges, so that no two costs are equal."""
    rng = np.random.default_rng(seed)
    a, b = mesh.vertices[mesh.connectivity.edge_vertices.T]
    length = np.linalg.norm(a - b, axis=1).mean()
    return mesh.moved(mesh.vertices + size * length * rng.uniform(-1, 1, mesh.vertices.shape))


STRICT = (
    {},
    {"turn": 0.99},
    {"bend": 0.5},
    {"shape": 0.8},
    {"sizes": 3.0},
    {"piece": 40},
    {"most": 7},
    {"spread": 0.1},
)


@pytest.mark.parametrize("strict", STRICT, ids=str)
@settings(max_examples=3, deadline=None)
@given(name=names, seed=st.integers(0, 2**16), count=st.integers(10, 20))
def test_the_order_is_that_of_the_plain_telling(strict, name, seed, count):
    mesh = shaken(MESHES[name], seed)
    weights = WEIGHTS._replace(**strict)
    edit = EditableMesh(mesh)
    edit._reserve(count)
    d, c = edit._darts, mesh.connectivity
    points, rim = quadrics.face_points(d.face, d.face_hole, mesh.vertices, 3)
    twin = Decimation(mesh, points.copy(), rim.copy(), weights, 1.0)
    planes = quadrics.face_quadrics(d.face, d.twin, d.face_hole, mesh.vertices, points, 1.0)
    into = np.arange(len(points), dtype=np.int32)
    corners = kernels.Corners(points, planes, rim, into, c.components, np.bincount(c.components))
    done = kernels.collapse_cheapest(d, corners, weights, count)
    assert done == twin.run(count)
    assert Loops(edit.result().mesh.connectivity).canonical() == twin.loops.canonical(edit.result().vertex_map)
    for f, loop in twin.loops.faces.items():
        if f not in twin.loops.holes:
            dart = next(x for x in range(3 * loop[0], 3 * loop[0] + 3) if d.twin[x] // 3 == loop[1])
            assert_allclose(points[d.face[dart]], twin.points[f], atol=1e-8)


def collapsed(mesh, count, weights):
    """How many edges were removed, and the mesh."""
    edit = EditableMesh(mesh)
    edit._reserve(count)
    d, c = edit._darts, mesh.connectivity
    points, rim = quadrics.face_points(d.face, d.face_hole, mesh.vertices, 3)
    planes = quadrics.face_quadrics(d.face, d.twin, d.face_hole, mesh.vertices, points, 1.0)
    into = np.arange(len(points), dtype=np.int32)
    corners = kernels.Corners(points, planes, rim, into, c.components, np.bincount(c.components))
    return kernels.collapse_cheapest(d, corners, weights, count), edit.result().mesh


@pytest.mark.parametrize("necks", [False, True])
def test_no_three_faces_make_a_thin_neck(necks):
    tube = shapes.cylinder(6, 16)
    tube = shaken(tube.moved(tube.vertices * (0.3, 0.3, 3.0)), 0)
    lax = WEIGHTS._replace(turn=-1.0, bend=-1.0, shape=0.0, spread=0.0, necks=necks, most=100)
    _, mesh = collapsed(tube, 60, lax)
    c = mesh.connectivity
    beside = {f: set() for f in np.flatnonzero(~c.face_is_hole).tolist()}
    for a, b in c.edge_faces[~c.face_is_hole[c.edge_faces].any(axis=1)].tolist():
        beside[a].add(b)
        beside[b].add(a)
    rings = {frozenset((a, b, x)) for a in beside for b in beside[a] for x in beside[a] & beside[b]}
    assert bool(rings - {frozenset(faces) for faces in c.face.tolist()}) == necks


@pytest.mark.parametrize("name", ["sphere", "plane"])
def test_quadrics_are_squared_distances_to_planes(name):
    mesh = shaken(MESHES[name], 1)
    d = EditableMesh(mesh)._darts
    points, rim = quadrics.face_points(d.face, d.face_hole, mesh.vertices, 3)
    found = quadrics.face_quadrics(d.face, d.twin, d.face_hole, mesh.vertices, points, 2.0)
    x = np.random.default_rng(0).normal(size=3)
    for f, plain in planes_around(mesh, points, 2.0).items():
        q = found[f]
        a = np.array([[q[0], q[3], q[4]], [q[3], q[1], q[5]], [q[4], q[5], q[2]]])
        assert_allclose(x @ a @ x + 2 * q[6:9] @ x + q[9], np.append(x, 1) @ plain @ np.append(x, 1), atol=1e-12)
    assert rim.any() == (name == "plane")


def test_the_corners_of_a_dual_are_found_again():
    ball = shapes.sphere(6)
    bumpy = ball.triangulated("dual").vertices * np.random.default_rng(0).uniform(0.9, 1.1, (ball.n_faces, 1))
    mesh = dual((bumpy, ball.triangulated("dual").faces))
    d = EditableMesh(mesh)._darts
    errors = [
        np.abs(quadrics.face_points(d.face, d.face_hole, mesh.vertices, rounds)[0] - bumpy).max()
        for rounds in (0, 3, 200)
    ]
    assert errors[0] > 1.2 * errors[1] > 0
    assert errors[2] < 0.1 * errors[0]


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


def test_the_nearest_of_a_surface_is_that_of_libigl():
    ball, torus = shapes.sphere(6), shapes.torus(30, 12)
    for one, other in ((ball, shaken(ball, 0, 0.5)), (torus, shaken(torus, 1, 0.5))):
        fan, there = one.triangulated(), other.triangulated()
        a, b, c = (there.vertices[there.faces[:, k]] for k in range(3))
        points = np.concatenate([there.vertices, (a + b) / 2, (b + c) / 2, (c + a) / 2])
        corners, faces = np.array(fan.vertices), np.array(fan.faces, np.int64)
        squared = igl.point_mesh_squared_distance(points, corners, faces)[0]
        assert_allclose(Nearest(one).largest(other), np.sqrt(squared.max()), rtol=1e-9)
        pulled = Nearest(one).pulled(other, 0.0)
        squared = igl.point_mesh_squared_distance(pulled, corners, faces)[0]
        assert squared.max() < 1e-24


def farthest(one, other):
    """The largest distance of random points of a triangulation to another one, by libigl."""
    rng = np.random.default_rng(0)
    a, b, c = (one.vertices[one.faces[:, k]] for k in range(3))
    share = rng.dirichlet((1, 1, 1), 10)
    points = np.concatenate([s[0] * a + s[1] * b + s[2] * c for s in share])
    squared = igl.point_mesh_squared_distance(points, np.array(other.vertices), np.array(other.faces, np.int64))[0]
    return float(np.sqrt(squared.max()))


def test_what_is_left_tangled_is_told():
    flat = shapes.sphere(10)
    flat = flat.moved(flat.vertices * (1, 1, 1e-3))
    crossed = flat.moved(flat.vertices * (1, 1, -1))
    with pytest.warns(SimplexMeshWarning, match="vertices of the decimated mesh are on faces that fold or cross"):
        decimate(crossed, vertices=200)


def test_no_more_is_removed_than_can_be():
    torus = MESHES["torus"]
    least = least_vertices(torus.connectivity)
    with pytest.warns(SimplexMeshWarning) as told:
        out = decimate(torus, vertices=least)
    assert complete(out.mesh.connectivity)
    assert topology(out.mesh) == topology(torus)
    if out.mesh.n_vertices > least:
        assert any(f"{out.mesh.n_vertices} vertices are left, not {least}" in str(w.message) for w in told)
