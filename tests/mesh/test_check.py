"""The check of a mesh finds the defects planted, and none on a valid mesh."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh.mesh import shapes
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangles.self_intersection import crossing_triangles, self_intersections
from simplexmesh.mesh.triangulation import fan
from tests.mesh import reference as reference
from tests.mesh.families import ALL, flipped, shaken, together

BALL = shapes.sphere(6)
seeds = st.integers(0, 2**32 - 1)


def planted(mesh, moves):
    vertices = mesh.vertices.copy()
    for i, where in moves.items():
        vertices[i] = where
    return mesh.moved(vertices).check(self_intersections=True)


class TestPlanted:
    def test_inside_out(self):
        report = BALL.moved(-BALL.vertices).check()
        assert str(report).startswith("the mesh is inside out: it encloses a volume of -4.1")
        assert not flipped(BALL).check()

    def test_edge_without_length(self):
        i, k = BALL.connectivity.edge_vertices[77]
        report = planted(BALL, {i: BALL.vertices[k]})
        assert_array_equal(report.where["flat_edges"], [77])
        assert "1 edge has no length: 77" in str(report)

    def test_neighbors_on_one_line(self):
        a, b, c = BALL.neighbors[50]
        report = planted(BALL, {c: (BALL.vertices[a] + BALL.vertices[b]) / 2})
        assert 50 in report.where["collinear"]

    def test_face_without_area(self):
        face = BALL.faces[20]
        on_line = {i: BALL.vertices[face[0]] + 0.01 * k * np.array([1.0, 2, 3]) for k, i in enumerate(face)}
        assert 20 in planted(BALL, on_line).where["flat_faces"]

    def test_vertex_pushed_through_the_other_side(self):
        report = planted(BALL, {123: -1.5 * BALL.vertices[123]})
        around = set(BALL.connectivity.vertex_faces[123])
        assert len(report.where["crossing"])
        assert all(around & set(pair) for pair in report.where["crossing"].tolist())
        assert "pairs of faces cross" in str(report)
        assert not report.ok

    def test_fold(self):
        i = 200
        _, b, c = BALL.vertices[BALL.neighbors[i]]
        report = planted(BALL, {i: 1.5 * (b + c) - 2 * BALL.vertices[i]})
        assert "folded" in report.where
        assert set(report.where["folded"]) & set(BALL.connectivity.vertex_faces[i])

    def test_inverted_vertices(self):
        order = BALL.neighbors[300]
        report = planted(BALL, {order[0]: BALL.vertices[order[1]], order[1]: BALL.vertices[order[0]]})
        assert 300 in report.where["inverted"]

    def test_faces_that_share_two_edges(self):
        # A ladder of three rungs closed with a twist: K3,3 on a torus, where faces share several edges.
        neighbors = [[3, 4, 5], [3, 4, 5], [3, 4, 5], [0, 1, 2], [0, 1, 2], [0, 1, 2]]
        c = Connectivity.from_neighbors(neighbors)
        report = SimplexMesh(np.random.default_rng(0).normal(size=(6, 3)), c).check()
        assert "edges join two faces that already share another edge" in str(report)

    def test_an_edge_with_one_face(self):
        theta = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]  # K4 with one vertex turned: not the tetrahedron
        report = SimplexMesh(np.eye(4)[:, :3], Connectivity.from_neighbors(theta)).check()
        assert "edges have the same face on both sides" in str(report)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_nothing_is_found_on_valid_meshes_of_any_size_anywhere(name, scale):
    mesh = ALL[name]
    report = mesh.moved(scale * (mesh.vertices + np.array([3, 5, 7]))).check(self_intersections=True)
    assert report, str(report)
    assert report.problems == ()
    assert str(report) == "nothing wrong"


class TestCrossings:
    @given(seed=seeds, n=st.integers(2, 25), corners=st.integers(4, 40))
    def test_equal_exact_arithmetic_on_random_triangles(self, seed, n, corners):
        rng = np.random.default_rng(seed)
        points = rng.normal(size=(corners, 3))
        triangles = np.array([rng.permutation(corners)[:3] for _ in range(n)])
        assert_array_equal(crossing_triangles(points, triangles), reference.crossing_triangles(points, triangles))

    @given(seed=seeds)
    def test_equal_exact_arithmetic_on_points_of_a_grid(self, seed):
        """Many coplanar, touching and overlapping triangles."""
        rng = np.random.default_rng(seed)
        points = np.unique(rng.integers(0, 4, (20, 3)), axis=0).astype(float)
        triangles = np.array([rng.permutation(len(points))[:3] for _ in range(12)])
        assert_array_equal(crossing_triangles(points, triangles), reference.crossing_triangles(points, triangles))

    @given(seed=seeds)
    def test_equal_exact_arithmetic_on_triangles_of_many_sizes(self, seed):
        rng = np.random.default_rng(seed)
        centers, sizes = rng.normal(size=(12, 1, 3)), 10 ** rng.uniform(-3, 0.5, (12, 1, 1))
        points = (centers + sizes * rng.normal(size=(12, 3, 3))).reshape(-1, 3)
        triangles = np.arange(36).reshape(-1, 3)
        assert_array_equal(crossing_triangles(points, triangles), reference.crossing_triangles(points, triangles))

    def test_two_spheres_cross_along_their_circle(self):
        second = BALL.moved(BALL.vertices + np.array([0.7, 0.02, 0.01]))
        both = together(BALL, second)
        pairs = self_intersections(both.vertices, both.connectivity)
        half = BALL.n_faces
        assert (pairs[:, 0] < half).all()
        assert (pairs[:, 1] >= half).all()
        centers = np.array([both.vertices[face].mean(axis=0) for face in both.faces])
        assert (np.abs(centers[pairs.ravel(), 0] - 0.35) < 0.2).all()
        assert len(pairs) > 30
        apart = together(BALL, BALL.moved(BALL.vertices + np.array([2.2, 0, 0])))
        assert not len(self_intersections(apart.vertices, apart.connectivity))

    def test_crossings_do_not_depend_on_position_or_order(self):
        rng = np.random.default_rng(1)
        mesh = shaken(BALL, rng, 0.9)
        pairs = self_intersections(mesh.vertices, mesh.connectivity)
        assert len(pairs)
        moved = 5 * mesh.vertices[:, [1, 2, 0]] + 3
        assert_array_equal(self_intersections(moved, mesh.connectivity), pairs)

    @given(seed=seeds)
    def test_faces_cross_whose_triangles_do(self, seed):
        mesh = shaken(BALL, np.random.default_rng(seed), 0.9)
        c = mesh.connectivity
        owner = np.repeat(np.arange(BALL.n_faces), c.face_sizes)
        pairs = np.sort(owner[crossing_triangles(*fan(mesh.vertices, c))], axis=1)
        found = self_intersections(mesh.vertices, c)
        itself = found[:, 0] == found[:, 1]
        assert_array_equal(found[~itself], np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0))
        assert set(found[itself, 0]) <= set(pairs[pairs[:, 0] == pairs[:, 1], 0])

    @given(seed=seeds, share=st.floats(0.0, 1.0))
    def test_among_some_faces_all_of_their_crossings_are_found_and_no_others(self, seed, share):
        rng = np.random.default_rng(seed)
        mesh = shaken(BALL, rng, 0.9)
        pairs = self_intersections(mesh.vertices, mesh.connectivity)
        among = rng.random(BALL.n_faces) < share**4
        found = self_intersections(mesh.vertices, mesh.connectivity, among)
        assert_array_equal(found[among[found].any(axis=1)], pairs[among[pairs].any(axis=1)])
        assert {tuple(pair) for pair in found.tolist()} <= {tuple(pair) for pair in pairs.tolist()}

    def test_holes_are_not_there(self):
        c = BALL.connectivity
        open_ball = Connectivity(c.twin, c.face_darts[:1])
        center = BALL.vertices[BALL.faces[0]].mean(axis=0)
        vertices = BALL.vertices.copy()
        vertices[(vertices @ center).argmin()] = 1.5 * center + [
            0.011,
            0.023,
            -0.007,
        ]  # from behind, out through face 0
        closed = self_intersections(vertices, BALL.connectivity)
        assert 0 in closed
        assert 0 not in self_intersections(vertices, open_ball)

    def test_nothing_to_cross(self):
        assert crossing_triangles(np.zeros((3, 3)), np.zeros((0, 3), int)).shape == (0, 2)
        assert crossing_triangles(np.zeros((6, 3)), np.arange(6).reshape(2, 3)).shape == (0, 2)


@pytest.mark.parametrize("value", ["yes", "", 1, 0, None])
def test_flags_must_be_true_or_false(value):
    with pytest.raises(TypeError, match=r"^self_intersections must be true or false, not "):
        BALL.check(self_intersections=value)
