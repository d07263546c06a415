"""What is said of poor models: whether it is, and where the threshold lies."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.reconstruct import measure


def run(n_holes=0, components="largest", dropped=0):
    found = SimpleNamespace(components_dropped=dropped)
    return SimpleNamespace(
        mesh=SimpleNamespace(n_holes=n_holes), data=SimpleNamespace(components=components), found=found
    )


def said(*arguments):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        measure._warn_of_poor_fit(*arguments)
    return [str(each.message) for each in caught]


def test_a_quarter_of_the_model_and_a_twentieth_of_the_data_may_be_far():
    assert said(run(), 0.24, 0.049) == []
    far, missed = said(run(), 0.26, 0.051)
    assert far == "26% of the model is far from any data; where the data is an open surface, give init='plane'"
    assert missed == "5% of the data is far from the model; more vertices or another start may reach it"


def test_hints_are_of_what_may_help():
    assert said(run(n_holes=1), 0.26, 0.0) == ["26% of the model is far from any data"]
    lost = "6% of the data is far from the model; components='all' keeps all its pieces"
    assert said(run(dropped=1), 0.0, 0.06) == [lost]
    for other in (run(components="all", dropped=1), run(dropped=0)):
        assert said(other, 0.0, 0.06) != [lost]


def test_shares_are_of_area():
    tube = sm.cylinder(12, 9, height=3.0)
    assert measure.share_of_area(tube, np.ones(tube.n_vertices, bool)) == 1
    assert measure.share_of_area(tube, tube.vertices[:, 2] > 0) == pytest.approx(0.5)
    ring = sm.torus(24, 12, radius=1.0, tube_radius=0.5)  # its outer half has the share 1/2 + r / (pi R)
    outer = np.hypot(*ring.vertices[:, :2].T) > 1
    assert measure.share_of_area(ring, outer) == pytest.approx(0.5 + 0.5 / np.pi, abs=0.02)


@pytest.mark.parametrize("count", [measure.MOST_POINTS, measure.MOST_POINTS + 1])
def test_of_very_many_points_some_are_drawn_once_each(count):
    points = np.arange(3.0 * count).reshape(-1, 3)
    found = measure.drawn_points(SimpleNamespace(points=points))
    assert len(np.unique(found[:, 0])) == measure.MOST_POINTS
    assert set(found[:, 0]) <= set(points[:, 0])


def test_a_lid_is_over_open_points_only():
    ball, cloud = sm.sphere(3), type("Cloud", (), {"border": None})()
    assert measure.has_lid(cloud, ball, measure.LEAST_BARE)
    assert not measure.has_lid(cloud, ball, 0.99 * measure.LEAST_BARE)
    assert not measure.has_lid(cloud, sm.cylinder(6, 4), 1.0)
    assert not measure.has_lid(SimpleNamespace(), ball, 1.0)  # a target of the caller's own


@pytest.mark.parametrize(("wanted", "accepted", "said_of"), [(0, True, False), (1, True, True), (1, False, False)])
def test_missing_handles(wanted, accepted, said_of):
    surface = sm.torus(8, 6) if wanted else sm.sphere(3)
    message = measure.genus_message(surface, sm.sphere(4), [SimpleNamespace(accepted=accepted)])
    expected = "the data has genus 1, the model has 0; init='auto' finds all its handles"
    assert message == (expected if said_of else "")
