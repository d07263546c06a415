"""Beams and flanges: which side is inside, that zones meet, sizes of meshes, what is no beam or flange."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.data.primitives.test_primitives import KINDS, P, around, bounded

COMPOSED = ["beam", "flange", "flange pair"]


def within(primitive, points):
    """Whether points are in the solid, by its boxes, or by its discs."""
    x, y, z = ((points - primitive._pose[0]) @ primitive.frame.T).T
    if primitive.kind == "beam":
        x, y = np.abs([x, y])
        web = x < primitive.web_thickness / 2
        flange = (x < primitive.width / 2) & (y > primitive.depth / 2 - primitive.flange_thickness)
        return (y < primitive.depth / 2) & (web | flange)
    disc = (np.hypot(x, y) < primitive.radius) & (z > 0) & (z < primitive.thickness)
    return disc | ((np.hypot(x, y) < primitive.neck_radius) & ((z < 0.1) | (primitive.kind == "flange pair")))


@pytest.mark.parametrize("kind", COMPOSED)
def test_the_solid_has_distances_below_0(kind):
    inside = within(KINDS[kind], around(5000))
    assert 0.05 < inside.mean() < 0.5
    assert np.array_equal(KINDS[kind].distance(around(5000)) < 0, inside)


@pytest.mark.parametrize("kind", COMPOSED)
def test_distances_go_on_from_zone_to_zone(kind):
    starts, ways = around(200), np.random.default_rng(1).normal(size=(200, 1, 3))
    steps = np.linspace(0, 1, 500)[:, None] * ways / np.linalg.norm(ways, axis=2, keepdims=True)
    distance = KINDS[kind].distance((starts[:, None] + steps).reshape(-1, 3)).reshape(200, 500)
    assert np.abs(np.diff(distance, axis=1)).max() < 1.0001 / 499


@pytest.mark.parametrize("kind", COMPOSED)
def test_meshes_have_the_corners_of_the_profile(kind):
    primitive = bounded(KINDS[kind])
    mesh = primitive.triangulated(0.13)
    corners = primitive._knots[(primitive._knots > -3) & (primitive._knots < 4.4)]
    assert set(corners.round(9)) <= set(primitive.coordinates(mesh.vertices)[:, 1].round(9))


def test_the_area_of_a_beam_is_that_of_its_sides():
    beam = KINDS["beam"]
    around_it = 2 * beam.depth + 4 * beam.width - 2 * beam.web_thickness
    assert_allclose(beam._knots[-1], around_it)
    assert_allclose(bounded(beam, [[0, 2], [0, around_it]]).triangulated().area, 2 * around_it)


@pytest.mark.parametrize("kind", ["flange", "flange pair"])
def test_necks_are_exact_where_they_begin(kind):
    """Long pieces were measured from their far ends, to a millionth of a millionth of those."""
    primitive = KINDS[kind]
    near = primitive.at([[0.3, 0.2], [0.3, 0.0], [0.3, -1e-9]])
    assert_allclose(primitive.distance(near), 0, atol=1e-15)


def test_representations_and_dictionaries_have_all_measures():
    pair = P.FlangePair([0, 0, 0], [0, 0, 1], 0.1, 0.04, 0.05)
    assert repr(pair) == "FlangePair(center (0, 0, 0), axis (0, 0, 1), radius 0.1, thickness 0.04, neck_radius 0.05)"
    assert pair.as_dict()["kind"] == "flange pair"
    assert KINDS["beam"].as_dict()["across"] == KINDS["beam"].across.tolist()


def test_a_beam_that_is_no_other_way_up_is_itself_again():
    beam = P.Beam([0, 0, 0], [0, 0, 1], 0.2, 0.1, 0.01, 0.006, across=[1, 0, 0])
    turned = P.Beam([0, 0, 0], [0, 0, -1], 0.2, 0.1, 0.01, 0.006, across=[-1, 0, 0])
    assert_allclose(beam.distance(around()), turned.distance(around()), atol=1e-15)


def test_a_beam_may_turn_so_that_its_width_is_where_its_axis_was():
    beam, turn = P.Beam([0, 0, 0], [0, 0, 1], 0.2, 0.1, 0.01, 0.006, across=[1, 0, 0]), np.eye(4)[[2, 1, 0, 3]]
    assert_allclose(beam.transformed(turn).distance(around() @ turn[:3, :3].T), beam.distance(around()), atol=1e-15)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: P.Beam([0, 0, 0], [0, 0, 1], 0.2, 0.1, 0.1, 0.006), "flange_thickness must be below half the depth"),
        (lambda: P.Beam([0, 0, 0], [0, 0, 1], 0.2, 0.1, 0.01, 0.1), "web_thickness must be below the width, 0.1, not"),
        (lambda: P.Beam([0, 0, 0], [0, 0, 1], 0.2, 0.1, 0.01, 0.01, across=[0, 0, 2]), "across must not be along"),
        (lambda: P.Flange([0, 0, 0], [0, 0, 1], 0.1, 0.02, 0.1), "neck_radius must be below the radius, 0.1, not 0.1"),
        (lambda: P.FlangePair([0, 0, 0], [0, 0, 1], 0.1, 0, 0.05), "thickness must be above 0"),
        (lambda: KINDS["flange"].mesh(), "a flange without a fit has no ends"),
    ],
)
def test_what_is_wrong_is_told(make, said):
    with pytest.raises(ValueError, match=said):
        make()
