"""Contours: their constructors, what they separate, and invalid ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import shapes
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.operators.cut_join import cut
from tests.mesh.families import ALL

BALL = shapes.sphere(6)
RING = shapes.torus(24, 12)
seeds = st.integers(0, 2**32 - 1)


class TestOfFaces:
    @given(seed=seeds, cosine=st.floats(0.3, 0.9))
    def test_the_outline_of_a_cap_has_it_on_its_left(self, seed, cosine):
        center = np.random.default_rng(seed).normal(size=3)
        center /= np.linalg.norm(center)
        c = BALL.connectivity
        centroids = np.add.reduceat(BALL.vertices[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes[:, None]
        inside = centroids @ center > cosine
        try:
            contours = Contour.of_faces(BALL, inside)
        except TopologyError as error:  # a face alone at the rim makes a chord
            if "all its three neighbors" not in str(error):
                raise
            return
        assert len(contours) == 1
        assert_array_equal(contours[0].left_faces, inside)
        assert_array_equal(contours[0].reversed().left_faces, ~inside)
        assert contours[0].separates
        face = c.face.reshape(-1)
        assert inside[face[contours[0].darts]].all()
        assert not inside[face[c.twin.reshape(-1)[contours[0].darts]]].any()

    def test_a_band_has_two_boundary_contours(self):
        c = BALL.connectivity
        z = (np.add.reduceat(BALL.vertices[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes[:, None])[:, 2]
        contours = Contour.of_faces(BALL, np.flatnonzero(np.abs(z) < 0.6))
        assert len(contours) == 2
        assert not (contours[0].left_faces & ~contours[1].left_faces)[np.abs(z) < 0.6].any()

    def test_of_one_face_is_its_outline(self):
        (contour,) = Contour.of_faces(BALL, [17])
        assert contour.is_face
        assert set(contour.vertices) == set(Contour.of_face(BALL, 17).vertices)
        assert contour.left_faces.nonzero()[0].tolist() == [17]

    def test_of_holes_are_the_rims(self):
        for name, count in {"cylinder": 2, "plane": 1, "torus": 0}.items():
            rims = Contour.of_holes(ALL[name])
            assert len(rims) == count
            for rim in rims:
                assert rim.is_face
                assert rim.left_faces.sum() == 1
                assert ALL[name].connectivity.face_is_hole[rim.left_faces].all()


class TestThrough:
    def test_around_the_tube_and_along_it_do_not_separate(self):
        x, y, z = RING.vertices.T
        along = Contour.through(RING, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
        near = np.where((x > 0) & (np.abs(y) < 0.2), 0, -np.inf)
        across = Contour.through(
            RING, [(x + near).argmax(), (z + near).argmax(), (-x + near).argmax(), (near - z).argmax()]
        )
        for contour in (along, across):
            assert not contour.separates
            assert contour.left_faces.all()
            out = cut(RING, contour)
            assert (out.mesh.genus, out.mesh.n_components, out.separated) == (0, 1, False)

    def test_passes_the_picked_vertices_in_order_and_is_short(self):
        picked = [int((BALL.vertices @ d).argmax()) for d in np.eye(3)]
        contour = Contour.through(BALL, picked)
        order = [contour.vertices.tolist().index(v) for v in picked]
        assert order == sorted(order)
        assert 3 * np.pi / 2 * 0.95 < contour.length < 3 * np.pi / 2 * 1.3
        assert 0.05 < contour.left_faces.mean() < 0.3  # an octant
        out = cut(BALL, contour)
        assert (out.separated, out.mesh.genus, out.mesh.n_components) == (True, 0, 2)

    def test_two_neighbors_are_joined_around_a_face(self):
        contour = Contour.through(BALL, [7, int(BALL.neighbors[7, 0])])
        assert contour.is_face
        assert len(contour) >= 5

    def test_legs_keep_away_from_each_other(self):
        mesh = ALL["torus"]
        contour = Contour.through(mesh, [0, 70, 130])  # the shortest paths come beside each other, a face apart
        assert set(contour.vertices) >= {0, 70, 130}

    def test_two_vertices_are_enough(self):
        a, b = int(BALL.vertices[:, 0].argmax()), int(BALL.vertices[:, 0].argmin())
        assert Contour.through(BALL, [a, b]).separates


class TestOpen:
    ENDS = int(BALL.vertices[:, 0].argmax()), int(BALL.vertices[:, 1].argmax())

    def test_goes_from_end_to_end_the_shortest_way(self):
        contour = Contour.through(BALL, self.ENDS, closed=False)
        assert (contour.vertices[0], contour.vertices[-1], contour.closed) == (*self.ENDS, False)
        assert np.pi / 2 * 0.95 < contour.length < np.pi / 2 * 1.4  # along hexagons at most 4/3 of a great circle
        assert len(contour.darts) == len(contour.steps) == len(contour) - 1
        assert_array_equal(BALL.connectivity.twin.reshape(-1)[contour.darts] // 3, contour.vertices[1:])

    def test_has_no_sides(self):
        contour = Contour.through(BALL, self.ENDS, closed=False)
        assert not contour.separates
        assert not contour.is_face
        assert contour.left_faces.all()
        assert not Contour(BALL, BALL.faces[0][:-1], closed=False).is_face

    def test_reversed_it_has_the_opposite_darts(self):
        contour = Contour.through(BALL, self.ENDS, closed=False)
        assert_array_equal(contour.reversed().darts, BALL.connectivity.twin.reshape(-1)[contour.darts][::-1])
        assert not contour.reversed().closed

    def test_is_not_cut_along(self):
        with pytest.raises(TopologyError, match="contour must be closed to be cut along, not open"):
            cut(BALL, Contour.through(BALL, self.ENDS, closed=False))

    def test_one_edge_is_enough(self):
        assert len(Contour(BALL, [7, int(BALL.neighbors[7, 0])], closed=False)) == 2
        with pytest.raises(TopologyError, match="must have at least 2 vertices, not 1"):
            Contour(BALL, [7], closed=False)


@given(seed=seeds)
def test_what_a_cut_separates_is_what_the_contour_says(seed):
    rng = np.random.default_rng(seed)
    mesh = RING if rng.random() < 0.5 else BALL
    try:
        contour = Contour.through(mesh, rng.choice(mesh.n_vertices, 3, replace=False))
        out = cut(mesh, contour)
    except TopologyError as error:
        if not str(error).startswith(("contour", "no path")):
            raise
        return
    assert out.separated == contour.separates
    assert out.mesh.genus == mesh.genus - (not contour.separates)
    assert out.mesh.n_vertices == mesh.n_vertices
    assert len(out.mesh.connectivity.face_sizes) == len(mesh.connectivity.face_sizes) + 2
    sizes = out.mesh.connectivity.face_sizes[list(out.faces)]
    assert sizes.sum() == len(contour)
    assert (out.face_map >= 0).all()


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        (lambda loop: loop[:2], "contour must have at least 3 vertices, not 2"),
        (lambda loop: [*loop, *loop], "contour must not touch itself, but visits vertex . twice"),
        (lambda loop: loop[:-1], "contour is not closed: vertices .* and .* are not neighbors"),
        (
            lambda loop: [loop[0], loop[2], *loop[3:]],
            "contour must run along edges; vertices .* and .* are not neighbors",
        ),
        (lambda loop: [0, 1, 720], r"contour\[2\] is 720, outside 0..719"),
    ],
)
def test_what_is_no_contour_is_refused(vertices, message):
    with pytest.raises(ValueError, match=message):
        Contour(BALL, vertices(BALL.faces[0].tolist()))


def test_a_chord_is_refused():
    pair = BALL.connectivity.edge_faces[0]
    with pytest.raises(TopologyError, match="has all three neighbors on the contour"):
        Contour.of_faces(BALL, pair)


def test_nothing_has_no_outline():
    with pytest.raises(ValueError, match="faces must be at least one, not none"):
        Contour.of_faces(BALL, [])
    with pytest.raises(ValueError, match="at must be at least 2 different vertices"):
        Contour.through(BALL, [3])
    assert Contour.of_faces(BALL, np.ones(362, bool)) == ()
