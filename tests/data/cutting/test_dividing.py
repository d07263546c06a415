"""Dividing long edges: the same shape, vertices that keep their numbers, and what CAD files tell then."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.bench.truth.noise import noisy
from simplexmesh.data.cutting.dividing import bisected
from simplexmesh.surface.saliency.unsampled_faces import unsampled_share
from simplexmesh.surface.sampled_surface import as_sampled_surface
from tests.nightly.marks import nightly

CUBE = np.array([[i, j, k] for i in (-1.0, 1) for j in (-1.0, 1) for k in (-1.0, 1)])
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
BOX = sm.TriangleMesh(CUBE, [[a, b, c] for a, b, c, _ in SIDES] + [[a, c, d] for a, _, c, d in SIDES])
BALL = sm.sphere(6).triangulated("dual")
SLIVER = sm.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], [[0, 1, 2], [0, 2, 3]])


def prism(sides=24, height=3.0):
    """A cylinder as CAD writes it: vertices on its two rims."""
    angle = np.arange(sides) / sides * 2 * np.pi
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    wall = np.concatenate([np.stack([i, j, sides + j], axis=1), np.stack([i, sides + j, sides + i], axis=1)])
    caps = [[0, k + 1, k] for k in range(1, sides - 1)] + [
        [sides, sides + k, sides + k + 1] for k in range(1, sides - 1)
    ]
    return sm.TriangleMesh(np.concatenate([rim, rim + np.array([0, 0, height])]), np.concatenate([wall, caps]))


def longest(mesh):
    return np.linalg.norm(mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)], axis=2).max()


class TestDivided:
    @pytest.mark.parametrize("mesh", [BOX, sm.sphere(2).triangulated("dual"), prism()])
    @given(share=st.floats(0.1, 0.9))
    def test_edges_are_short_and_the_body_the_same(self, mesh, share):
        length = share * longest(mesh)
        fine = sm.divided(mesh, length)
        assert longest(fine) <= length
        assert (fine.vertices[: mesh.n_vertices] == mesh.vertices).all()
        assert (fine.area, fine.volume) == (pytest.approx(mesh.area), pytest.approx(mesh.volume))
        assert fine.is_closed
        assert (fine.genus, fine.n_components) == (0, 1)
        unit = fine.face_vectors / np.linalg.norm(fine.face_vectors, axis=1, keepdims=True)
        old = mesh.face_vectors / np.linalg.norm(mesh.face_vectors, axis=1, keepdims=True)
        assert (unit @ old.T).max(axis=1).min() > 1 - 1e-9

    def test_what_is_short_already_stays(self):
        fine = sm.divided(BALL, 10.0)
        assert fine.faces.tolist() == BALL.faces.tolist()
        assert fine.n_vertices == BALL.n_vertices

    def test_every_vertex_is_where_three_lines_or_more_meet_and_borders_stay_borders(self):
        sheet = sm.TriangleMesh([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0.0]], [[0, 1, 2], [0, 2, 3]])
        fine = sm.divided(sheet, 0.3)
        assert fine.n_borders == 1
        assert np.unique(fine.faces).tolist() == list(range(fine.n_vertices))
        corner = fine.vertices[:, :2]
        inside = (corner > 0).all(axis=1) & (corner < [4, 1]).all(axis=1)
        assert as_sampled_surface(fine).one_ring.closed.tolist() == inside.tolist()

    def test_default_is_a_sixtieth_of_the_diagonal(self):
        fine = sm.divided(BOX)
        assert BOX.diagonal / 120 < longest(fine) <= BOX.diagonal / 60

    def test_slivers_are_cut_lengthwise_and_sizes_that_overflow_are_refused(self):
        assert longest(sm.divided(SLIVER, 0.01)) <= 0.01
        with pytest.raises(ValueError, match="surface must be within 1e-60 and 1e\\+60"):
            sm.divided(sm.TriangleMesh(1e200 * CUBE, BOX.faces))

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.divided(BOX, 0), "longest must be above 0, not 0"),
            (lambda: sm.divided(BOX, np.nan), "longest must be finite, not nan"),
            (
                lambda: sm.divided(BOX, 1e-6),
                "longest must be at least 0.00166 for at most 20,000,000 faces, not 1e-06",
            ),
            (
                lambda: sm.divided(SLIVER, 1e-9),
                "longest must be at least 2.5e-07 for at most 20,000,000 faces, not 1e-09",
            ),
            (
                lambda: sm.divided(sm.TriangleMesh(1e-6 * CUBE + 1e9, BOX.faces)),
                "longest must be at least 4.77e-07 at coordinates this large, not 5.50604e-08",
            ),
        ],
    )
    def test_bad_lengths_are_refused(self, call, words):
        with pytest.raises(ValueError, match="longest") as caught:
            call()
        assert str(caught.value) == words


def test_parts_of_a_face_are_told():
    body = prism()
    fine, of = bisected(body, 0.2)
    assert fine.n_faces > 10 * body.n_faces
    assert_allclose(
        np.bincount(of, np.linalg.norm(fine.face_vectors, axis=1)), np.linalg.norm(body.face_vectors, axis=1)
    )
    inside = np.einsum(
        "ij,ij->i", fine.vertices[fine.faces[:, 0]] - body.vertices[body.faces[of, 0]], body.face_vectors[of]
    )
    assert_allclose(inside, 0, atol=1e-12)


class TestBareFaces:
    @pytest.mark.parametrize(
        "function", [sm.hk_classes, sm.saliency, sm.salient_points, sm.inversion_lines, sm.curvature]
    )
    def test_one_warning_at_the_line_of_the_caller(self, function):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            function(prism())
        bare = [each for each in caught if "divided" in str(each.message)]
        assert all(each.filename == __file__ for each in caught)
        assert len(bare) == (function is not sm.curvature)
        for each in bare:
            assert str(each.message).startswith("100% of the surface has no vertices between sharp edges to measure ")

    @pytest.mark.parametrize("function", [sm.hk_classes, sm.saliency, sm.salient_points, sm.vertex_normals, sm.spread])
    def test_failures_too_are_reported_at_the_line_of_the_caller(self, function):
        mesh = sm.TriangleMesh(np.vstack([BALL.vertices, [[9.0, 9, 9]]]), BALL.faces)
        with pytest.warns(sm.SimplexMeshWarning, match="at 1 of 363 vertices") as caught:
            function(mesh)
        assert {each.filename for each in caught} == {__file__}

    def test_divided_they_are_distinguished(self):
        fine = sm.divided(BOX)
        kinds = np.array(sm.hk_classes(fine).names)[sm.hk_classes(fine).labels]
        beside = np.sort(np.abs(fine.vertices), axis=1)  # the two smaller tell how near an edge is
        assert (kinds == "flat")[beside[:, 1] < 0.7].all()
        edge = (beside[:, 1] == 1) & (beside[:, 0] < 0.8)
        assert (kinds == "ridge")[edge].mean() > 0.95
        assert (kinds == "peak")[beside[:, 0] == 1].all()

    def test_share_is_that_of_the_area(self):
        assert unsampled_share(as_sampled_surface(BOX)) == 1
        assert unsampled_share(as_sampled_surface(BALL)) == 0
        top = BOX.vertices[BOX.faces].mean(axis=1)[:, 2] == 1
        lid = sm.divided(sm.TriangleMesh(BOX.vertices, BOX.faces[top]), 0.3)
        both = sm.TriangleMesh(
            np.vstack([BOX.vertices, lid.vertices + 5]), np.vstack([BOX.faces, lid.faces + BOX.n_vertices])
        )
        assert unsampled_share(as_sampled_surface(both)) == pytest.approx(24 / 28)
        assert unsampled_share(as_sampled_surface(sm.divided(BOX, 0.5))) < 0.1
        assert unsampled_share(as_sampled_surface(sm.sphere(4))) == unsampled_share(as_sampled_surface(CUBE)) == 0

    @pytest.mark.parametrize("noise", [0.1, 0.2, 0.4])
    def test_rough_scans_have_sharp_edges_and_give_no_warning(self, noise):
        assert unsampled_share(as_sampled_surface(noisy(BALL, noise, rng=0))) == 0

    @pytest.mark.parametrize("name", ["coupling.off", *nightly("abc8.stl", "angle_block.stl", "featuretype.stl")])
    def test_cad_files_give_a_warning_and_can_be_divided(self, data_folder, name):
        mesh = sm.read(data_folder / name)
        with pytest.warns(sm.SimplexMeshWarning, match="as in files from CAD"):
            before = sm.hk_classes(mesh).counts
        after = sm.hk_classes(sm.divided(mesh))
        assert before["flat"] > 0.3 * mesh.n_vertices
        own = np.bincount(after.labels[: mesh.n_vertices], minlength=9)  # they lie on edges and corners
        assert own[4] < 0.4 * mesh.n_vertices
        assert own[4] < before["flat"]

    @pytest.mark.parametrize("name", ["lion_head.off", "femur.off", "fran_face.vtk", "eight.off", "fandisk.off"])
    def test_scans_are_not(self, data_folder, name):
        assert unsampled_share(as_sampled_surface(sm.read(data_folder / name))) < 0.45
