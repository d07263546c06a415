"""The end of a reconstruction alone: distances, what is enclosed or bare, and when what is said of poor models."""

from __future__ import annotations

import re
import sys
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.reconstruct import measure, restore
from simplexmesh.motion.reconstruct.run import MOST_POINTS, Run

POINTS = sm.sphere(20).vertices  # 8,000


def run(n_holes=0, components="largest", dropped=0, lost="", alone=False, layered=False):
    found, data = SimpleNamespace(components_dropped=dropped), SimpleNamespace(components=components, layered=layered)
    mesh = SimpleNamespace(n_holes=n_holes)
    return SimpleNamespace(mesh=mesh, data=data, found=found, lost=lost, diverged="", alone=alone, points=POINTS)


def said(run, unseen=0.0, *, stray=0.0, together=0.0):
    """Return what is said of a model far from shares of the data that are anywhere and at the north pole."""
    rank = np.argsort(np.argsort(-POINTS[:, 2])) / len(POINTS)
    missed = (rank < together) | (np.random.default_rng(0).permutation(len(POINTS)) < stray * len(POINTS))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        measure._warn_of_poor_fit(run, unseen, missed, measure.together(cKDTree(POINTS), missed))
    return [str(each.message) for each in caught]


def test_a_quarter_of_the_model_and_a_twentieth_of_the_data_may_be_far():
    assert said(run(), 0.24, stray=0.049) == []
    far, missed = said(run(), 0.26, stray=0.051)
    assert far == "26% of the model is far from any data"
    assert missed == "5% of the data is far from the model; more vertices or another start may reach it"


@pytest.mark.parametrize("scale", [1e-3, 1e4])
def test_data_that_is_far_together_is_told_with_a_place(monkeypatch, scale):
    monkeypatch.setattr(sys.modules[__name__], "POINTS", scale * POINTS)
    assert said(run(), stray=0.03, together=0.008) == said(run(), together=0.008) == []
    (told,) = said(run(), together=0.015)
    start, numbers, hint = re.split("[()]", told)
    assert (start, hint) == (
        "2% of the data is far from the model, as near ", "; more vertices or another start may reach it"
    )  # fmt: skip
    found = np.array([float(each) for each in numbers.split(", ")])
    np.testing.assert_allclose(found / scale, [0, 0, 1], atol=0.3)
    assert said(run(layered=True), together=0.015) == []  # which may be specks of noise in a volume


def pitted(share, noise=0.0, depth=0.3, frequency=10, radius=1.05, *, accepted=True):
    """Return the message about a model around POINTS and those of the share at the north pole and of 1 % at random."""
    mesh, rank = sm.sphere(frequency, radius=radius), np.argsort(np.argsort(-POINTS[:, 2])) / len(POINTS)
    topology = SimpleNamespace(handles=[SimpleNamespace(accepted=accepted)])
    away = np.where((rank < share) | (np.random.default_rng(0).random(len(POINTS)) < 0.01), depth, 0.01)
    target = SimpleNamespace(noise=noise)
    made = SimpleNamespace(mesh=mesh, tree=cKDTree(POINTS), target=target, topology=topology)
    return measure.filled_message(made, POINTS, away)


def test_data_of_a_tunnel_is_told_with_a_place():
    """Less than a twentieth of the data within 4 % of the diagonal of the model was lost without a word."""
    told = pitted(0.01)
    assert re.match(r"1\.\d% of the data is deeper than 0\.0\d+ inside of the model, most near \(.*, (0\.9|1)", told)
    assert pitted(0.01, radius=0.95) == ""  # outside, as corners of smooth models
    assert pitted(0.01, accepted=False) == ""  # refused
    assert pitted(0.0) == ""  # stray points
    assert pitted(0.001) == pitted(0.004, frequency=4) == ""  # no more than two vertices stand for
    assert pitted(0.01, depth=0.04) == ""  # no farther than an edge
    assert pitted(0.01, noise=0.1) == ""  # noise


def test_a_bore_too_narrow_for_the_start_is_told():
    rng = np.random.default_rng(0)
    turn, along = rng.uniform(0, 2 * np.pi, 300), rng.uniform(-1, 1, 300)
    bore = np.column_stack([0.02 * np.cos(turn), 0.02 * np.sin(turn), along])
    with pytest.warns(sm.SimplexMeshWarning, match=r"1\.\d% of the data is deeper than .* a tunnel or a gap"):
        model = sm.reconstruct(np.concatenate([sm.sphere(30).vertices, bore]), vertices=2000)
    assert model.mesh.genus == 0


def test_data_that_the_mesh_strayed_from_is_told_once():
    assert said(run(lost="strayed"), together=0.04) == ["strayed"]
    assert [message[:2] for message in said(run(lost="strayed"), stray=0.06)] == ["6%"]


def test_hints_are_of_what_may_help():
    lost = "6% of the data is far from the model; components='all' keeps all its pieces"
    assert said(run(dropped=1), stray=0.06) == said(run(alone=True), stray=0.06) == [lost]
    for other in (run(components="all", dropped=1), run(dropped=0)):
        assert said(other, stray=0.06) != [lost]


def test_shares_are_of_area():
    tube = sm.cylinder(12, 9, height=3.0)
    assert measure.share_of_area(tube, np.ones(tube.n_vertices, bool)) == 1
    assert measure.share_of_area(tube, tube.vertices[:, 2] > 0) == pytest.approx(0.5)
    ring = sm.torus(24, 12, radius=1.0, tube_radius=0.5)  # its outer half has the share 1/2 + r / (pi R)
    outer = np.hypot(*ring.vertices[:, :2].T) > 1
    assert measure.share_of_area(ring, outer) == pytest.approx(0.5 + 0.5 / np.pi, abs=0.02)


@pytest.mark.parametrize("count", [MOST_POINTS, MOST_POINTS + 1])
def test_of_very_many_points_some_are_drawn_once_each(count):
    points = np.arange(3.0 * count).reshape(-1, 3)
    found = Run.points.func(SimpleNamespace(data=SimpleNamespace(points=points)))
    assert len(np.unique(found[:, 0])) == MOST_POINTS
    assert set(found[:, 0]) <= set(points[:, 0])


def test_a_lid_is_over_open_points_only():
    ball, cloud = sm.sphere(3), type("Cloud", (), {"border": None})()
    assert measure.has_lid(cloud, ball, measure.LEAST_BARE)
    assert not measure.has_lid(cloud, ball, 0.99 * measure.LEAST_BARE)
    assert not measure.has_lid(cloud, sm.cylinder(6, 4), 1.0)
    assert not measure.has_lid(SimpleNamespace(), ball, 1.0)  # a target of the caller's own


def test_open_data_is_told_with_what_may_help():
    assert measure.openness_message(0, 0.0, opens=True) == measure.openness_message(0, 0.0, opens=False) == ""
    assert measure.openness_message(1, 0.0, opens=True).endswith("is kept open and ends where it does, at a hole")
    assert measure.openness_message(2, 0.0, opens=True).endswith("at 2 holes")
    lid = "30% of the model's area has no data nearby: the data is open there, or its walls are too thin; "
    remedy = "holes='auto' leaves it open, holes='none' closes it without this warning"
    assert measure.openness_message(0, 0.3, opens=False) == lid + remedy
    assert measure.openness_message(0, 0.3, opens=True) == lid + "nothing was found to cut off, more vertices may help"


def test_models_that_are_inside_out_are_told():
    ball = sm.sphere(4).triangulated("dual")
    inward = sm.dual((ball.vertices, ball.faces[:, ::-1]), outward=False)
    with pytest.warns(sm.SimplexMeshWarning, match="^the model is inside out; more vertices or another start may help"):
        model = sm.reconstruct(ball, init=inward, iterations=5, creases="none")
    assert model.mesh.volume < 0


def test_sheets_that_may_be_solids_are_told():
    assert measure.sides_message(measure.MOST_DOUBLED) == ""
    assert "whether 83% of the data is one sheet" in measure.sides_message(0.83)


def test_handles_that_noise_may_have_made_are_told():
    one, two = (0.123456, 2.0, -3e-7), (1.0, 1.0, 1.0)
    assert measure.handles_message(3, ()) == ""
    assert measure.handles_message(3, (one,)).startswith(
        "the genus, 3, may be wrong: near (0.123456, 2, -3e-07) a wall "
    )
    assert "near (0.123456, 2, -3e-07) and at 1 other place a wall " in measure.handles_message(3, (one, two))
    assert "and at 2 other places a wall " in measure.handles_message(3, (one, two, two))


@pytest.mark.parametrize(("wanted", "accepted", "said_of"), [(0, True, False), (1, True, True), (1, False, False)])
def test_missing_handles(wanted, accepted, said_of):
    surface = sm.torus(8, 6) if wanted else sm.sphere(3)
    message = measure.genus_message(surface, sm.sphere(4), [SimpleNamespace(accepted=accepted)])
    expected = "the data has genus 1, the model has 0; init='auto' finds all its handles"
    assert message == (expected if said_of else "")


BALL = sm.sphere(6)


def measured(gaps, points, *, reach=0.2, layered=False, holes="none", border=False):
    """What a run holds after its mesh, a ball, was measured, and the warnings."""
    gap = {"gap": staticmethod(lambda vertices, normals, reach: gaps.copy())} | ({"border": None} if border else {})
    told = []
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    run = Run(
        options=SimpleNamespace(holes=holes),
        data=SimpleNamespace(points=points, diagonal=diagonal, layered=layered, components="all", leaves_bodies=False),
        report=lambda share, message: told.append((share, message)),
        start=BALL,
        mesh=BALL,
        target=type("Given", (), gap)(),
        stages=[SimpleNamespace(reach=9.0), SimpleNamespace(reach=reach)],
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        measure.measure(run)
    assert told == [(0.95, "measuring"), (1.0, "done")]
    return run, [str(each.message) for each in caught]


class TestMeasuring:
    def test_distances_are_gaps_or_else_those_of_the_nearest_point(self):
        gaps = np.linspace(-0.1, 0.08, BALL.n_vertices)
        gaps[7] = np.nan
        run, told = measured(gaps, 1.3 * BALL.vertices)
        expected = np.abs(gaps)
        expected[7] = 0.3
        found = run.distance.mesh_to_data
        np.testing.assert_allclose(run.mesh.data["distance"], expected)
        np.testing.assert_allclose([found.mean, found.max], [expected.mean(), 0.3])
        np.testing.assert_allclose(found.rms, np.sqrt((expected**2).mean()))
        np.testing.assert_allclose(run.distance.data_to_mesh.mean, 0.3, atol=0.03)
        assert len(told) == 1
        assert told[0].startswith("100% of the data is far from the model, as near (")
        assert run.bare == 0

    @pytest.mark.parametrize(("layered", "reach"), [(True, 0.05), (False, 0.05)])
    def test_points_enclosed_are_told_apart(self, layered, reach):
        """Those deeper than the reach in data of layers, elsewhere only beyond any noise, 0.04 of the diagonal."""
        points = np.concatenate([BALL.vertices, np.outer([0.0, 0.5, 0.85, 0.99, 3.0], [1, 0, 0])])
        run, told = measured(np.zeros(BALL.n_vertices), points, reach=reach, layered=layered)
        enclosed = [1, 0.5, 0.15] if layered else [1, 0.5]
        diagonal = np.linalg.norm(np.ptp(points, axis=0))
        assert 0.15 < measure.FAR * diagonal < 0.5
        found = run.distance.enclosed
        np.testing.assert_allclose([found.mean, found.max], [np.mean(enclosed), 1], atol=0.03)
        assert told == []

    def test_a_model_half_of_which_is_bare(self):
        gaps = np.where(BALL.vertices[:, 2] > 0, 0.9, 0.3)
        run, told = measured(gaps, BALL.vertices)
        assert run.bare == pytest.approx(0.5, abs=0.03)  # some vertices are on the equator
        assert len(told) == 1
        assert told == ["100% of the model is far from any data"]
        for holes, border in (("open", False), ("none", True)):
            assert measured(gaps, BALL.vertices, holes=holes, border=border)[1] == told
        _, lid = measured(gaps, BALL.vertices, holes="open", border=True)
        assert lid == [measure.openness_message(0, run.bare, opens=False)]


def test_nothing_is_put_back_in_what_began_far_from_the_data_or_did_not_move():
    for init, iterations in (("sphere", 9), ("auto", 0)):
        run = SimpleNamespace(
            options=SimpleNamespace(init=init),
            stages=[SimpleNamespace(iterations=9), SimpleNamespace(iterations=iterations)],
        )
        restore.restore(run)  # would need the data
    run.stages[-1].iterations = 1
    with pytest.raises(AttributeError):
        restore.restore(run)
