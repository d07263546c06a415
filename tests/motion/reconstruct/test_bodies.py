"""Closed triangles of several bodies: the largest is made alone along its edges, where no other one crosses it."""

import itertools
import warnings
from dataclasses import replace

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.data.cutting.boolean import united
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.reconstruct.sharpen import largest_body
from simplexmesh.motion.targets.inward import without_inside_out

CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
BOX = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])


def boxes(*centers_and_sides):
    """Return boxes of half sides around centers, all outward."""
    vertices = np.concatenate([np.array(sides) * CORNERS + np.array(center) for center, sides in centers_and_sides])
    faces = np.concatenate([BOX + 8 * k for k in range(len(centers_and_sides))])
    return sm.TriangleMesh(vertices, faces)


LARGE = ((0.3, 0.2, 0.1), (1.0, 0.8, 0.6))


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(((0.3, 0.2, 0.1), (0.3, 0.2, 0.4)), id="cavity"),
        pytest.param(((4, 0, 0), (0.5, 0.5, 0.5)), id="beside"),
        pytest.param(((2, 0, 0), (0.1, 2, 2)), id="more area"),
    ],
)
def test_the_largest_body_is_found_where_the_others_are_clear_of_it(other):
    found = largest_body(boxes(other, LARGE), 0.05)
    assert found.n_faces == 12
    assert found.volume == pytest.approx(8 * np.prod(LARGE[1]))


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(((1.2, 0.9, 0.6), (0.5, 0.4, 0.3)), id="across a corner"),
        pytest.param(((0.3, 0.2, 0.1), (0.1, 0.1, 3)), id="through, with all corners outside"),
        pytest.param(((1.8, 0.2, 0.1), (0.5, 0.4, 0.3)), id="wall to wall"),
        pytest.param(((1.35, 0.2, 0.1), (0.03, 0.03, 0.03)), id="nearer than an edge"),
    ],
)
def test_a_body_that_another_one_crosses_or_touches_is_not_alone(other):
    assert largest_body(boxes(LARGE, other), 0.05) is None


def test_a_small_body_that_crosses_is_seen_beside_one_of_great_area():
    plate, small = ((100, 0, 0), (1e-6, 500, 500)), ((1.3, 0.2, 0.1), (0.02, 0.02, 0.02))
    assert largest_body(boxes(LARGE, plate), 0.05) is not None
    assert largest_body(boxes(LARGE, plate, small), 0.05) is None


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (
            ((0.3, 0.2, 0.1), (0.5, 0.4, 0.3)),
            "of the data is inside of the model, .*'all' keeps inner bodies and walls of cavities",
        ),
        (
            ((3, 0.2, 0.1), (0.5, 0.4, 0.3)),
            r"data is far from the model, as near \(.*\); components='all' keeps",
        ),
        (((3, 0.2, 0.1), (0.03, 0.03, 0.03)), "smaller bodies are left out; components='all' keeps them"),
    ],
)
def test_the_largest_body_is_made_along_its_edges(other, told):
    """It was moved to samples of all of them: six times slower, and rounded at its corners."""
    with pytest.warns(sm.SimplexMeshWarning, match=told):
        model = sm.reconstruct(replace(boxes(LARGE, other), unit="mm"), vertices=600)
    assert model.mesh.unit == "mm"
    assert len(model.creases) == 12
    assert model.mesh.volume == pytest.approx(8 * np.prod(LARGE[1]), rel=1e-6)


def test_a_start_that_has_all_bodies_leaves_none_out():
    both = boxes(LARGE, ((3, 0.2, 0.1), (0.4, 0.4, 0.4)))
    start = sm.reconstruct(both, vertices=600, components="all", creases="none").mesh
    assert sm.reconstruct(both, init=start, creases="none").mesh.n_components == 2  # without a warning


@pytest.mark.parametrize(
    ("other", "shared"),
    [
        pytest.param(((1.2, 0.2, 0.1), (0.5, 0.4, 0.3)), 0.6 * 0.8 * 0.6, id="across"),
        pytest.param(((1.8, 0.2, 0.1), (0.5, 0.4, 0.3)), 0, id="wall to wall"),
    ],
)
def test_bodies_that_cross_or_touch_are_made_as_one_along_their_edges(other, shared):
    """They were moved to samples of all of them, those of walls within too: rounded at their corners."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = sm.reconstruct(replace(boxes(LARGE, other), unit="mm"), vertices=600)
    volume = 8 * (np.prod(LARGE[1]) + np.prod(other[1])) - shared
    assert model.mesh.volume == pytest.approx(volume, rel=1e-6)
    assert len(model.creases) == 24  # a ring of edges more where they meet
    assert model.mesh.unit == "mm"


def test_what_is_within_bodies_that_cross_goes():
    across, within = ((1.2, 0.2, 0.1), (0.5, 0.4, 0.3)), ((0, 0, 0), (0.1, 0.1, 0.1))
    found = united(boxes(LARGE, across, within))
    assert found.volume == pytest.approx(8 * (np.prod(LARGE[1]) + 0.06) - 0.288)
    assert found.n_components == 1


def test_bodies_that_do_not_cross_are_not_changed():
    for other in (((0.3, 0.2, 0.1), (0.5, 0.4, 0.3)), ((3, 0.2, 0.1), (0.5, 0.4, 0.3))):
        given = boxes(LARGE, other)
        assert united(given) is given


def test_walls_of_cavities_are_kept_with_all_components():
    """They were turned outward: of a box with a cavity the model had 1.17 times the volume."""
    cavity = boxes(LARGE, ((0.3, 0.2, 0.1), (0.5, 0.4, 0.3)))
    hollow = sm.TriangleMesh(cavity.vertices, np.concatenate([cavity.faces[:12], cavity.faces[12:, ::-1]]))
    model = sm.reconstruct(hollow, vertices=600, components="all")
    assert model.mesh.volume == pytest.approx(hollow.volume, rel=1e-6)
    with pytest.warns(sm.SimplexMeshWarning, match="^flipped 24 of 24 triangles$"):
        turned = sm.reconstruct(replace(hollow, faces=hollow.faces[:, ::-1]), vertices=600, components="all")
    assert turned.mesh.volume == pytest.approx(hollow.volume, rel=1e-6)


@pytest.mark.nightly
def test_a_round_cavity_is_kept_by_the_motion():
    outer, inner = sm.sphere(10).triangulated(), sm.sphere(10, radius=0.6, center=(0.1, 0, 0)).triangulated()
    faces = np.concatenate([outer.faces, inner.faces[:, ::-1] + outer.n_vertices])
    hollow = sm.TriangleMesh(np.concatenate([outer.vertices, inner.vertices]), faces)
    model = sm.reconstruct(hollow, vertices=800, components="all", creases="none")
    assert (model.mesh.n_components, model.tangled, model.strayed) == (2, 0, 0)
    assert model.mesh.volume == pytest.approx(hollow.volume, rel=0.03)


def test_an_inverted_body_that_crosses_another_is_no_cavity():
    """By one point in front of one face it was one or none, by the last bit."""
    cube, other = ((0, 0, 0), (1, 1, 1)), ((1.1, 0.05, 0.07), (0.5, 0.5, 0.5))
    mesh = boxes(cube, other)
    mesh = sm.TriangleMesh(mesh.vertices, np.concatenate([mesh.faces[:12], mesh.faces[12:, ::-1]]))
    for seed in range(4):
        moved = mesh.vertices + 1e-12 * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
        with pytest.warns(sm.SimplexMeshWarning, match="^flipped 12 of 24 triangles$"):
            assert without_inside_out(replace(mesh, vertices=moved)).volume == pytest.approx(9)


def test_an_open_sheet_beside_an_inverted_body_keeps_its_side():
    ball, sheet = sm.sphere(6).triangulated(), sm.plane(8, 8).triangulated().scaled(4)
    ball = sm.TriangleMesh(ball.vertices + np.array([0, 0, 3.0]), ball.faces[:, ::-1])
    both = np.concatenate([sheet.vertices, ball.vertices]), np.concatenate([sheet.faces, ball.faces + sheet.n_vertices])
    with pytest.warns(sm.SimplexMeshWarning, match="closed components that face inward"):
        found = as_input(both, components="all").source
    assert found.face_vectors[: sheet.n_faces, 2].min() > 0
    assert sm.TriangleMesh(found.vertices, found.faces[sheet.n_faces :]).volume > 0
