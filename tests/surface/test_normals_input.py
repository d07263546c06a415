"""Normals of clouds and of damaged surfaces: orientation, failures and their warnings, options."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.bench.truth.discretized import torus
from simplexmesh.surface.normals.estimate import METHODS, found_normals
from simplexmesh.surface.reasons import DEGENERATE, FEW
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface
from tests.surface.reference_normals import ringed

NAMES = sorted(name for name in METHODS if not METHODS[name].own_scale)
OF_FACES = [name for name in NAMES if METHODS[name].needs_faces]
OF_NEIGHBORS = [name for name in NAMES if not METHODS[name].needs_faces]


@pytest.fixture(scope="module")
def ring():
    """A torus with its exact values."""
    return torus(60, 30)


def degrees(normals, truth):
    return np.degrees(np.arccos(np.clip((normals * truth).sum(axis=1), -1, 1)))


class TestClouds:
    @pytest.mark.parametrize("method", OF_NEIGHBORS)
    def test_own_normals_give_the_orientation(self, ring, method):
        for side in (1, -1):
            cloud = sm.PointCloud(ring.vertices, side * ring.exact.normals)
            normals = sm.vertex_normals(cloud, method, neighborhood=sm.nearest(8))
            assert degrees(side * normals, ring.exact.normals).max() < 12

    @pytest.mark.parametrize("method", OF_NEIGHBORS)
    def test_bare_points_of_a_convex_body_look_outward(self, method):
        ball = sm.sphere(12).triangulated("dual").vertices * [3, 2, 1]
        outside = ball / np.array([9, 4, 1])
        outside /= np.linalg.norm(outside, axis=1)[:, None]
        assert degrees(sm.vertex_normals(ball + 5, method), outside).max() < 10

    @pytest.mark.parametrize("method", [*OF_NEIGHBORS, "adaptive"])
    def test_bare_points_of_other_bodies_look_outward(self, ring, method):
        asked = {} if method == "adaptive" else {"neighborhood": sm.nearest(8)}
        assert degrees(sm.vertex_normals(ring.vertices, method, **asked), ring.exact.normals).max() < 12
        some = np.arange(0, len(ring.vertices), 7)
        normals = sm.vertex_normals(ring.vertices, method, at=some, **asked)
        assert degrees(normals, ring.exact.normals[some]).max() < 12

    @pytest.mark.parametrize("method", ["sine", "extended_quadric", "taubin"])
    def test_curvatures_of_bare_points_have_the_signs_of_the_body(self, ring, method):
        around = sm.nearest(12)
        expected = sm.curvature(sm.PointCloud(ring.vertices, ring.exact.normals), method, neighborhood=around).mean
        assert_allclose(sm.curvature(ring.vertices, method, neighborhood=around).mean, expected, atol=0.3)

    def test_own_normals_that_contradict_each_other_are_told(self, ring):
        signs = np.random.default_rng(0).choice([-1, 1], (len(ring.vertices), 1))
        mixed = sm.PointCloud(ring.vertices, signs * ring.exact.normals)
        for measure in (sm.curvature, sm.vertex_normals):
            with pytest.warns(sm.SimplexMeshWarning, match=r"^normals of .* contradict each other \(5\d%\)"):
                measure(mixed, "quadric")
            measure(mixed, "quadric", normals=ring.exact.normals)  # those given count
        measure(sm.PointCloud(mixed.points), "quadric")

    def test_given_directions_are_orientation_and_initial_normals(self, ring):
        given_ = -7 * ring.exact.normals
        for method in OF_NEIGHBORS:
            normals = sm.vertex_normals(ring.vertices, method, neighborhood=sm.nearest(8), normals=given_)
            assert degrees(-normals, ring.exact.normals).max() < 12

    @pytest.mark.parametrize("method", OF_FACES)
    def test_have_no_faces(self, ring, method):
        with pytest.raises(ValueError, match=rf"^method must be one of .* for points without faces, not '{method}'$"):
            sm.vertex_normals(ring.vertices, method)

    @pytest.mark.parametrize("method", NAMES)
    def test_rings_given_in_order_stand_for_faces(self, method):
        mesh = sm.torus(20, 12).triangulated("dual")
        around = as_sampled_surface(mesh).one_ring
        start = {} if method in OF_FACES else {"normals": mesh.vertex_normals}
        expected = sm.vertex_normals(mesh, method, **start)
        assert_allclose(sm.vertex_normals(mesh.vertices, method, neighborhood=around, **start), expected, atol=1e-12)


class TestMeshes:
    @pytest.mark.parametrize("method", OF_NEIGHBORS)
    def test_wider_rings_resist_noise(self, ring, method):
        step = np.linalg.norm(ring.vertices[1] - ring.vertices[0])
        noisy = ring.vertices + 0.1 * step * np.random.default_rng(0).normal(size=ring.vertices.shape)
        near, far = (sm.vertex_normals((noisy, ring.faces), method, neighborhood=sm.rings(k)) for k in (1, 3))
        assert degrees(far, ring.exact.normals).mean() < 0.75 * degrees(near, ring.exact.normals).mean()

    @pytest.mark.parametrize("method", ["area", "mean", "angle", "plane"])
    def test_of_a_simplex_mesh_are_those_of_its_three_neighbors(self, method):
        mesh = sm.sphere(6)
        near = {"area": 1e-12, "plane": 0.05}.get(method, 0.1)
        assert np.abs(sm.vertex_normals(mesh, method) - mesh.normals).max() < near

    @pytest.mark.parametrize("method", NAMES)
    def test_at_a_border_are_one_sided_but_found(self, method):
        x, y = (part.ravel() for part in np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21)))
        corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
        faces = np.concatenate(
            [np.stack(three, 1) for three in [(corner, corner + 1, corner + 22), (corner, corner + 22, corner + 21)]]
        )
        points = np.stack([x, y, 0.3 * x + 0.1 * y], axis=1)
        wide = {} if method in OF_FACES else {"neighborhood": sm.rings(2)}
        normals = sm.vertex_normals((points, faces), method, **wide)
        assert_allclose(normals, np.tile(np.array([-0.3, -0.1, 1]) / np.sqrt(1.1), (441, 1)), atol=1e-12)

    @pytest.mark.parametrize("method", OF_FACES)
    @pytest.mark.parametrize("asked", [sm.rings(2), sm.nearest(9), sm.ball(1.0)])
    def test_means_of_faces_take_no_neighborhood(self, method, asked):
        with pytest.raises(TypeError, match=rf"^neighborhood must be left out: method '{method}' takes the faces"):
            sm.vertex_normals(sm.torus(20, 12).triangulated("dual"), method, neighborhood=asked)
        sm.vertex_normals(sm.torus(20, 12).triangulated("dual"), method, neighborhood=sm.rings(1))

    @pytest.mark.parametrize("method", OF_FACES)
    def test_means_of_faces_refuse_other_neighborhoods_made_before(self, method):
        mesh = sm.torus(20, 12).triangulated("dual")
        samples = as_sampled_surface(mesh)
        some = samples.around(sm.rings(1), [7, 3])
        assert_allclose(sm.vertex_normals(mesh, method, neighborhood=some), sm.vertex_normals(mesh, method)[[7, 3]])
        with pytest.raises(ValueError, match=rf"^neighborhood must be rings\(1\) for method '{method}'"):
            sm.vertex_normals(mesh, method, neighborhood=samples.around(sm.rings(2)))


class TestFailures:
    def test_too_few_neighbors_are_zero_with_one_warning(self):
        faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 5, 5]]
        for method in NAMES:
            failed = 5 if method in ("quadric", "extended_sine") else 1
            text = f"a normal could not be estimated at {failed} of 5 vertices: {failed} with too few neighbors"
            with pytest.warns(sm.SimplexMeshWarning, match=f"^{text}$") as seen:
                normals = sm.vertex_normals((points, faces), method)
            assert len(seen) == 1
            assert seen[0].filename == __file__
            assert_array_equal(normals.any(axis=1), [failed == 1] * 4 + [False])

    @pytest.mark.parametrize("line", [[1, 0, 0], [0.3, 0.7, -0.2]])
    @pytest.mark.parametrize("method", NAMES)
    def test_collinear_neighbors_are_reported(self, method, line):
        points = np.zeros((9, 3))
        points[1:] = np.outer([1, 2, 3, 4, -1, -2, -3, -4], line)
        start = None if method in OF_FACES else np.tile([0, 0, 1.0], (9, 1))
        found = found_normals(*ringed(points), method, normals=start)
        assert found.reasons.tolist() == [DEGENERATE]
        assert not found.normals.any()

    @pytest.mark.parametrize("method", NAMES)
    def test_copies_of_the_point_are_reported(self, method):
        start = None if method in OF_FACES else np.tile([0, 0, 1.0], (9, 1))
        found = found_normals(*ringed(np.ones((9, 3))), method, normals=start)
        assert found.reasons[0] in (DEGENERATE, FEW)
        assert not found.normals.any()

    @pytest.mark.parametrize("method", NAMES)
    @pytest.mark.parametrize("extra", ["copy of a neighbor", "copy of the center"])
    def test_one_copy_changes_nothing(self, method, extra):
        t = 2 * np.pi * np.arange(8) / 8
        points = np.concatenate([np.zeros((1, 3)), np.stack([np.cos(t), np.sin(t), 0.2 * np.cos(2 * t)], 1)])
        points = np.concatenate([points, points[[8 if extra == "copy of a neighbor" else 0]]])
        start = None if method in OF_FACES else np.tile([0.1, 0, 0.995], (10, 1))
        found = found_normals(*ringed(points), method, normals=start)
        assert found.reasons.tolist() == [0]
        assert found.normals[0, 2] > 0.95

    def test_slivers_have_no_weight(self):
        points, faces = (
            np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, -1, 0], [0.5, 1e-13, 1e-12]]),
            [
                [0, 1, 2],
                [0, 2, 3],
                [0, 3, 1],
                [0, 4, 1],
            ],
        )
        for method in OF_FACES:
            assert_allclose(sm.vertex_normals((points, faces), method, at=[0])[0], [0, 0, 1], atol=1e-12)

    def test_where_faces_cancel_planes_point_away_from_the_center(self):
        ball = sm.sphere(6).triangulated("dual")
        both = np.concatenate([ball.faces, ball.faces[:, ::-1]])
        normals = sm.vertex_normals((ball.vertices, both), "plane")
        assert ((normals * ball.vertices).sum(axis=1) > 0.9).all()

    def test_faces_that_cancel_have_no_normal(self):
        points, faces = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1.0]]), [[0, 1, 2], [0, 2, 1]]
        for method in OF_FACES:
            found = found_normals(
                SampledSurface(points, np.array(faces)), as_sampled_surface((points, faces)).one_ring, method
            )
            assert found.reasons[0] == DEGENERATE

    @given(seed=st.integers(0, 2**31 - 1))
    @pytest.mark.parametrize("method", OF_NEIGHBORS)
    def test_normals_are_unit_or_zero_whatever_the_points(self, method, seed):
        rng = np.random.default_rng(seed)
        points = rng.integers(-2, 3, (40, 3)) * rng.choice([0, 1e-9, 1, 1e6], 3)
        points[:10] *= 10.0 ** rng.integers(-200, 20)
        found = found_normals(as_sampled_surface(points), as_sampled_surface(points).around(sm.nearest(9)), method)
        length = np.linalg.norm(found.normals, axis=1)
        assert_allclose(length, found.reasons == 0, atol=1e-12)


class TestOptions:
    @pytest.mark.parametrize(
        ("method", "options", "error", "message"),
        [
            ("normal", {}, ValueError, "method must be one of 'a"),
            ("plane", {"passes": 2}, TypeError, "method 'plane' has no option 'passes'; its options: variant"),
            ("plane", {"variant": "svd"}, ValueError, "variant must be one of 'pca', 'svd4', not 'svd'"),
            ("quadric", {"passes": 0}, ValueError, "passes must be at least 1, not 0"),
            ("extended_sine", {"solver": "secant"}, ValueError, "solver must be one of 'newton', 'ternary', not"),
            ("extended_sine", {"tolerance": 0.0}, ValueError, "tolerance must be above 0, not 0"),
            ("extended_sine", {"iterations": 2.5}, TypeError, "iterations must be a whole number, not float 2.5"),
            ("plane", {"normals": np.ones((3, 3))}, ValueError, "normals must have shape (240, 3), not (3, 3)"),
            ("plane", {"normals": "up"}, ValueError, "normals must be one of 'a"),
            (["plane"], {}, ValueError, "method must be one of 'a"),
            ("area", {"weighting": "max"}, TypeError, "method 'area' has no option 'weighting'; its options: none"),
            ("chen_schmitt", {"normalized": "no"}, TypeError, "normalized must be true or false, not str 'no'"),
            ("area", {"normals": "mean"}, TypeError, "normals must be left out: method 'area' starts from none"),
            ("plane", {"at": [240]}, ValueError, "at[0] is 240, outside 0..239"),
        ],
    )
    def test_wrong_ones_are_refused(self, method, options, error, message):
        with pytest.raises(error, match="^" + re.escape(message)):
            sm.vertex_normals(sm.torus(20, 12).triangulated("dual"), method, **options)

    @pytest.mark.parametrize("solver", ["newton", "ternary"])
    def test_a_huge_tolerance_keeps_the_initial_normal(self, solver):
        mesh = sm.torus(20, 12).triangulated("dual")
        start = sm.vertex_normals(mesh, "area")
        kept = sm.vertex_normals(mesh, "extended_sine", solver=solver, tolerance=1e3)
        assert_allclose(kept, start, atol=1e-15)
        assert np.abs(sm.vertex_normals(mesh, "extended_sine", solver=solver) - start).max() > 1e-4

    @pytest.mark.parametrize("solver", ["newton", "ternary"])
    def test_without_convergence_it_is_the_quadric(self, solver):
        mesh = sm.torus(20, 12).triangulated("dual")
        given_up = sm.vertex_normals(mesh, "extended_sine", solver=solver, iterations=1)
        assert_allclose(given_up, sm.vertex_normals(mesh, "quadric"), atol=1e-12)
        assert np.abs(sm.vertex_normals(mesh, "extended_sine", solver=solver) - given_up).max() > 1e-6

    def test_a_method_can_be_named_to_start_from(self):
        mesh = sm.torus(20, 12).triangulated("dual")
        named = sm.vertex_normals(mesh, "quadric", normals="max")
        given_ = sm.vertex_normals(mesh, "quadric", normals=sm.vertex_normals(mesh, "max"))
        assert_allclose(named, given_, atol=1e-14)
        assert np.abs(named - sm.vertex_normals(mesh, "quadric")).max() > 1e-6

    def test_names_are_checked_before_anything_is_read(self):
        with pytest.raises(ValueError, match=r"^method must be one of"):
            sm.vertex_normals("no such file.ply", "planes")
        with pytest.raises(FileNotFoundError, match=r"no such file.ply"):
            sm.vertex_normals("no such file.ply", "plane")

    def test_points_of_a_file_keep_their_rows(self, tmp_path):
        ball = sm.sphere(4).triangulated("dual").vertices
        twice = np.concatenate([ball, ball[:5]])
        np.savetxt(tmp_path / "ball.xyz", twice)
        assert len(sm.read(tmp_path / "ball.xyz").points) == len(twice)
        assert len(sm.vertex_normals(tmp_path / "ball.xyz", "plane")) == len(twice)

    @pytest.mark.parametrize(
        ("surface", "error", "message"),
        [
            (3, TypeError, "surface must be triangles, a simplex mesh, points or a path to them, not int"),
            (None, TypeError, "surface must be triangles, a simplex mesh, points or a path to them, not NoneType"),
            ({"x": 1}, TypeError, "surface must be triangles, a simplex mesh, points or a path to them, not dict"),
            (
                np.ones((9, 2)),
                ValueError,
                "surface must have shape (*, 3) for points or (*, 6) with normals, not (9, 2)",
            ),
            ([], ValueError, "surface must have shape (*, 3) for points or (*, 6) with normals, not (0,)"),
            (np.ones((2, 9, 3)), ValueError, "surface must have shape (*, 3) for points or (*, 6) with normals, not"),
            (sm.Volume(np.ones((4, 4, 4))), TypeError, "surface must be triangles, a simplex mesh, points"),
        ],
        ids=lambda v: None if isinstance(v, str | type) else type(v).__name__,
    )
    def test_other_objects_are_no_surface(self, surface, error, message):
        with pytest.raises(error, match="^" + re.escape(message)):
            sm.vertex_normals(surface)
        with pytest.raises(error, match="^" + re.escape(message)):
            sm.curvature(surface)
