"""Decimation within a tolerance: it holds everywhere, measured densely, and few vertices are left."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from skimage.measure import marching_cubes

from simplexmesh._base.errors import SimplexMeshWarning
from simplexmesh.data.decimate import decimate
from simplexmesh.data.io.reading import read_triangles, read_volume
from simplexmesh.mesh import shapes
from simplexmesh.mesh.decimation import _kernels_fitting as kernels
from simplexmesh.mesh.decimation.certified import RESOLUTION, Surface
from simplexmesh.mesh.decimation.comparison import Corrections, Original, fan_owners, rims
from simplexmesh.mesh.decimation.tolerance import points_of, vertex_displacements
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.triangulation import fan
from tests.mesh.decimation.reference import apart, shaken
from tests.mesh.decimation.test_decimate import box
from tests.mesh.operators.test_editing import MESHES
from tests.nightly.marks import nightly

seeds = st.integers(0, 2**16)


def soup(seed, size):
    """Random triangles of all shapes: long, thin, small, and some degenerate to a segment or a point."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(size, 1, 3)) + rng.normal(size=(size, 3, 3)) * 10 ** rng.uniform(-2, 0.5, (size, 3, 1))
    corners[: size // 8, 2] = corners[: size // 8, 1]
    corners[: size // 16] = corners[: size // 16, :1]
    return corners.reshape(-1, 3), np.arange(3 * size).reshape(-1, 3)


class TestSurface:
    @given(seed=seeds, size=st.integers(1, 60))
    def test_distances_are_those_of_libigl(self, seed, size):
        there = soup(seed, size)
        points = np.random.default_rng(seed).normal(size=(50, 3)) * 2
        squared = igl.point_mesh_squared_distance(points, *there)[0]
        found, places, distances = Surface(*there).closest(points)
        assert_allclose(distances**2, squared, rtol=1e-9, atol=1e-12)
        assert_allclose(np.linalg.norm(places - points, axis=1), distances, atol=1e-9)
        weights = kernels.barycentric(*there, found, points)
        assert_allclose(np.einsum("pi,pik->pk", weights, there[0][there[1][found]]), places, atol=1e-9)

    @given(seed=seeds, size=st.integers(1, 30), part=st.floats(0.2, 1.1))
    def test_what_is_not_beyond_is_within_everywhere(self, seed, size, part):
        one, other = soup(seed, 20), soup(seed + 1, size)
        far = apart(*one, *other)
        distance = part * float(np.quantile(far, 0.9)) + 1e-6
        found, where = Surface(*other).beyond(*one, distance)
        inside = np.setdiff1d(np.arange(20), found)
        assert (far[inside] <= distance).all()
        assert (far[found] > 0.5 * (1 - RESOLUTION) * distance).all()
        squared = igl.point_mesh_squared_distance(where, *other)[0]
        assert (np.sqrt(squared) > (1 - RESOLUTION) * distance).all()
        for point, triangle in zip(where, found, strict=True):
            on = igl.point_mesh_squared_distance(point[None], one[0], one[1][triangle : triangle + 1])[0]
            assert on[0] < 1e-18

    def test_a_ridge_between_check_points_is_seen(self):
        """A wedge under a large triangle, whose corners, midpoints and centroid touch the ground."""
        ground = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])
        hill = np.array([[0.2, 0.1, 0], [0.24, 0.1, 0], [0.22, 0.1, 0.03]]), np.array([[0, 1, 2]])
        there = np.concatenate([ground[0], hill[0]]), np.array([[0, 1, 2], [3, 4, 5]])
        for distance, expected in ((0.0299, [1]), (0.0301, [])):
            assert_array_equal(Surface(*ground).beyond(*there, distance)[0], expected)

    def test_the_middle_of_a_triangle_is_as_far_from_its_corners_as_the_longest_side_by_the_root_of_3(self):
        """Three tiny triangles at the corners of a regular triangle are near its corners and far from its center."""
        corners = np.array([[1, 0, 0], [-0.5, 0.75**0.5, 0], [-0.5, -(0.75**0.5), 0]])
        specks = (corners[:, None] * np.array([1, 1.001, 1.002])[:, None]).reshape(-1, 3), np.arange(9).reshape(3, 3)
        for distance, expected in ((0.9, [0]), (1.001, [])):
            found, where = Surface(*specks).beyond(corners, np.array([[0, 1, 2]]), distance)
            assert_array_equal(found, expected)
            assert (np.linalg.norm(where, axis=1) < 0.2).all()


def within(one, other, tolerance):
    """Whether two meshes and their rims are within a tolerance either way, at 105 points of each triangle."""
    pairs = [(fan(m.vertices, m.connectivity) for m in (one, other))]
    if one.n_holes:
        pairs.append((rims(m)[0].points, rims(m)[0].triangles) for m in (one, other))
    far = [max(apart(*a, *b).max(), apart(*b, *a).max()) for a, b in map(tuple, pairs)]
    return max(far) <= tolerance * (1 + 1e-12)


SURFACES = {
    "box": lambda: box(10),
    "rough ball": lambda: shaken(shapes.sphere(9), 1, 0.1),
    "sheet": lambda: rolled(shapes.plane(16, 16)),
    "torus with holes": lambda: MESHES["torus with holes"],
}


def rolled(mesh):
    """A wavy sheet."""
    v = np.array(mesh.vertices)
    v[:, 2] = 0.1 * np.sin(9 * v[:, 0]) * np.cos(7 * v[:, 1])
    return mesh.moved(v)


@pytest.mark.filterwarnings("ignore:no vertex could be removed")
@pytest.mark.parametrize("part", [*nightly(0.004), 0.05])
@pytest.mark.parametrize("name", SURFACES)
def test_a_tolerance_holds_everywhere(name, part):
    mesh = SURFACES[name]()
    tolerance = part * float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    out = decimate(mesh, tolerance=tolerance)
    assert within(mesh, out.mesh, tolerance)
    assert out.rms <= out.largest <= tolerance


def loaded(folder, name):
    """A part with sharp edges, or an isosurface of a volume."""
    if name != "tooth":
        return dual(read_triangles(folder / f"{name}.off"))
    values = np.asarray(read_volume(folder / "tooth.nhdr").values, float)[::4, ::4, ::4]
    return dual(marching_cubes(np.pad(values, 1), 600)[:2])


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore:triangles repaired", "ignore:.* fold or cross")
@pytest.mark.parametrize(
    ("name", "part", "most"), [("fandisk", 0.01, 420), ("coupling", 0.01, 1400), ("tooth", 0.005, 1100)]
)
def test_a_tolerance_holds_on_data_and_few_vertices_stay(data_folder, name, part, most):
    mesh = loaded(data_folder, name)
    tolerance = part * float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    out = decimate(mesh, tolerance=tolerance)
    assert within(mesh, out.mesh, tolerance)
    assert out.mesh.n_vertices <= most


def test_largest_is_that_of_the_samples_exactly():
    ball = shapes.sphere(10)
    out = decimate(ball, tolerance=0.03)
    samples = Original(ball).samples
    points, triangles = fan(out.mesh.vertices, out.mesh.connectivity)
    squared = igl.point_mesh_squared_distance(samples.points, points, triangles)[0]
    assert_allclose(out.largest, np.sqrt(squared.max()))
    assert_allclose(out.rms, np.sqrt((samples.weights * squared).sum() / samples.weights.sum()))


def test_faces_that_are_too_far_are_found():
    ball = shapes.sphere(6)
    f = 20
    v = np.array(ball.vertices)
    loop = ball.connectivity.face_vertices[slice(*ball.connectivity.face_offsets[f : f + 2])]
    v[loop] *= 1.2
    faces = Original(ball).compare(ball.moved(v), np.arange(ball.n_faces), 0.15).faces
    assert faces[f]
    near = np.isin(ball.connectivity.vertex_faces, f).any(axis=1)
    around = np.unique(ball.connectivity.vertex_faces[near])
    assert set(np.flatnonzero(faces)) <= set(around)
    assert not Original(ball).compare(ball.moved(v), np.arange(ball.n_faces), 0.25).faces.any()


def test_a_thorn_on_either_surface_is_found():
    """A thorn is far from a ball, but everything on the ball is near the thorn's foot."""
    ball = shapes.sphere(6)
    v = np.array(ball.vertices)
    v[100] *= 1.5
    thorny, faces = ball.moved(v), np.arange(ball.n_faces)
    for one, other in ((ball, thorny), (thorny, ball)):
        there = Original(one).compare(other, faces, 0.4).faces
        assert set(np.flatnonzero(there)) == set(ball.connectivity.vertex_faces[100].tolist())
        assert not Original(one).compare(other, faces, 0.51).faces.any()


def test_rims_are_compared_with_rims():
    """A rim vertex moved inwards within the sheet is still on the sheet, but no longer on its rim."""
    sheet = shapes.plane(8, 8)
    c = sheet.connectivity
    middle = np.argmin(np.abs(sheet.vertices[:, 0] - 0.5) + np.abs(sheet.vertices[:, 1]))
    assert c.face_is_hole[c.vertex_faces[middle]].any()
    v = np.array(sheet.vertices)
    v[middle, 0] -= 0.08
    dented = sheet.moved(v)
    tip = rims(sheet)[0].closest(dented.vertices[[middle]])[2][0]
    assert_allclose(tip, 0.08)
    gap = rims(dented)[0].closest(sheet.vertices[[middle]])[2][0]
    assert gap < 0.9 * tip
    for one, other in ((sheet, dented), (dented, sheet)):
        compared = Original(one).compare(other, np.arange(len(c.face_sizes)), (gap + tip) / 2)
        assert compared.faces.any()
        assert set(np.flatnonzero(compared.faces)) <= set(
            c.vertex_faces[[middle, *c.neighbors[middle]]].ravel().tolist()
        )
        assert not Original(one).compare(other, np.arange(len(c.face_sizes)), 1.05 * tip).faces.any()


class TestCorrection:
    def test_centroids_are_weighted_means_of_vertices(self):
        for mesh in (shapes.sphere(3), MESHES["torus with holes"]):
            solid = np.concatenate([np.ones(mesh.n_vertices, bool), ~mesh.connectivity.face_is_hole])
            points, _ = fan(mesh.vertices, mesh.connectivity)
            assert_allclose((points_of(mesh.connectivity) @ mesh.vertices)[solid], points, atol=1e-12)

    @given(seed=seeds)
    def test_a_point_is_displaced_as_wanted_by_the_smallest_move(self, seed):
        rng, mesh = np.random.default_rng(seed), MESHES["torus with holes"]
        points, triangles = fan(mesh.vertices, mesh.connectivity)
        at = rng.integers(len(triangles), size=1)
        weights, way = rng.dirichlet((1, 1, 1), 1), rng.normal(size=(1, 3))
        steps = vertex_displacements(Corrections(at, weights, way), mesh, 0.1)
        there = fan(mesh.vertices + steps, mesh.connectivity)[0]
        moved = weights @ (there - points)[triangles[at[0]]]
        assert_allclose(moved, way * (1 + 0.1 / np.linalg.norm(way)))
        share = np.linalg.norm(steps, axis=1)
        face = fan_owners(mesh.connectivity)[at[0]]
        assert_array_equal(share > 0, (mesh.connectivity.vertex_faces == face).any(axis=1))
        assert_allclose(np.linalg.norm(np.cross(steps, way), axis=1), 0, atol=1e-9)


def test_a_tolerance_that_lets_no_vertex_go_is_reported():
    ball = shapes.sphere(8)
    with pytest.warns(
        SimplexMeshWarning, match=r"^no vertex could be removed within a tolerance of 1e-09: the mesh is"
    ):
        assert decimate(ball, tolerance=1e-9).mesh.n_vertices == ball.n_vertices


@pytest.mark.nightly
def test_slivers_and_folds_that_stay_are_reported():
    mesh = shapes.sphere(8).moved(shapes.sphere(8).vertices * [1, 1, 1e-12])
    with pytest.warns(SimplexMeshWarning, match="vertices of the decimated mesh are on faces that fold or cross"):
        out = decimate(mesh, tolerance=0.01)
    assert not out.mesh.check(self_intersections=True)
