"""Groups of scans alone: which pairs are tried, which poses are believed, and what poses of groups imply."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.recognition.scans import assembly
from simplexmesh.recognition.scans.assembly import Assembly, Hypothesis, is_sound
from simplexmesh.recognition.scans.pose_graph import motions
from simplexmesh.recognition.scans.register_all import _edges
from simplexmesh.recognition.scans.rivals import contradicting
from simplexmesh.recognition.scans.scan_pairs import Measured

TRUE = motions(np.random.default_rng(0).normal(size=(5, 6)))


class Side:
    """A scan of which only the side of its normals is known."""

    def __init__(self, *, turned=False):
        self.turned, self.extent = turned, 4.0

    @property
    def flipped(self):
        return Side(turned=not self.turned)


def grouped(*groups):
    """Scans whose poses are true within each group, whose first is the frame."""
    out = Assembly.of([Side() for _ in TRUE])
    out.groups = [list(group) for group in groups]
    for group in groups:
        out.poses[list(group)] = np.linalg.inv(TRUE[group[0]]) @ TRUE[list(group)]
    return out


def relative(i, j):
    return np.linalg.solve(TRUE[j], TRUE[i])


def pose(score, T=None, equivalent=False):
    T = np.eye(4) if T is None else T
    return SimpleNamespace(score=score, T=T, is_equivalent=lambda other: equivalent)


def hypothesis(i, j, opposite=False, **options):
    return Hypothesis((i, j), pose(0.5, relative(i, j), **options), 0.5, True, opposite)


def test_neighbors_are_tried_first_and_no_pair_of_one_group():
    all_pairs = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 2), (1, 3), (2, 4), (0, 3), (1, 4), (0, 4)]
    assert list(grouped([0], [1], [2], [3], [4])._untried()) == all_pairs
    assert list(grouped([0, 2], [1], [3, 4])._untried()) == [pair for pair in all_pairs if pair not in ((0, 2), (3, 4))]


def test_pairs_that_come_together_while_others_are_tried_are_left_out():
    some, tried = grouped([0], [1], [2], [3], [4]), []
    for pair in some._untried():
        tried.append(pair)
        some.groups = [[0, 1, 2], [3], [4]]
    assert tried == [(0, 1), (2, 3), (3, 4), (1, 3), (2, 4), (0, 3), (1, 4), (0, 4)]


def test_a_pose_between_groups_is_one_between_all_their_scans():
    some = grouped([0, 2], [1, 3, 4])
    assert_allclose(some.relative(4, 3), relative(4, 3))
    found = dict(some._across(hypothesis(2, 3)))
    assert list(found) == [(i, j) for i in (0, 2) for j in (1, 3, 4)]
    for (i, j), T in found.items():
        assert_allclose(T, relative(i, j), atol=1e-12)


@pytest.mark.parametrize("opposite", [False, True])
@pytest.mark.parametrize("turned", [False, True])
def test_the_group_of_a_source_is_turned_over_where_a_pose_needs_that(opposite, turned):
    some = grouped([0, 2], [1, 3])
    some.scans[2], some.scans[3] = Side(turned=turned), Side(turned=True)
    some._face(hypothesis(2, 3, opposite=opposite))
    needed = opposite != (not turned)
    assert [each.turned for each in some.scans[:4]] == [needed, False, turned != needed, True]


@pytest.mark.parametrize(
    ("scores", "near", "agreement", "kept", "certain"),
    [
        ([0.41], 0.5, 0.9, [0.41], True),
        ([0.39], 0.5, 0.9, [0.39], False),
        ([0.29], 0.5, 0.9, [], False),
        ([0.6, 0.41, 0.5], 0.5, 0.9, [0.6, 0.5], False),
        ([0.6, 0.41], 0.5, 0.9, [0.6], True),
        ([0.6], 0.05, 0.9, [0.6], True),
        ([0.6], 0.03, 0.9, [], False),
        ([0.6], 0.5, 0.81, [0.6], True),
        ([0.6], 0.5, 0.79, [], False),
    ],
)
def test_poses_that_are_possible_and_certain(scores, near, agreement, kept, certain, monkeypatch):
    some = grouped([0], [1])
    monkeypatch.setattr(assembly, "search", lambda source, target: [pose(score) for score in scores])
    monkeypatch.setattr(assembly, "contact", lambda source, target, T: (near, agreement))
    found = some._searched((0, 1), opposite=False)
    assert [each.found.score for each in found] == kept
    assert [each.certain for each in found] == [certain] * len(found)
    assert not any(each.opposite for each in found)
    assert some.hypotheses == found
    turned = some._searched((0, 1), opposite=True)
    assert all(each.opposite for each in turned)
    assert len(turned) == len(found)


def test_support_is_what_agrees_less_what_does_not(monkeypatch):
    some = grouped([0], [1, 3])
    known = {0.2: 0.9, 0.5: 0.25}
    monkeypatch.setattr(assembly, "contact", lambda *_, wider: known_contacts.pop(0))
    known_contacts = list(known.items())
    assert some._support(hypothesis(0, 1)) == pytest.approx(0.2 * 0.8 - 0.5 * 0.5)


def test_the_best_supported_pose_without_an_equal_comes_first(monkeypatch):
    some = grouped([0], [1], [2, 3])
    one, two, rival, other = (hypothesis(*pair, equivalent=True) for pair in ((0, 1), (0, 2), (0, 2), (1, 3)))
    support = {id(one): 0.3, id(two): 0.9, id(rival): 0.9 * (1 - assembly.SAME_SCORE / 2), id(other): 0.5}
    some.hypotheses = [one, two, rival, other, hypothesis(2, 3)]
    monkeypatch.setattr(Assembly, "_support", lambda self, each: support[id(each)])
    assert [(id(each), equal) for each, equal in some._supported()] == [
        (id(other), False), (id(one), False), (id(two), True), (id(rival), True)
    ]  # fmt: skip
    support[id(rival)] = 0.9 * (1 - 2 * assembly.SAME_SCORE)
    assert [equal for each, equal in some._supported() if each is two] == [False]


@pytest.mark.parametrize(
    ("near", "agreement", "known", "sound"),
    [(0.05, 0.81, 1.0, True), (0.03, 0.81, 1.0, False), (0.05, 0.79, 1.0, False), (0.05, 0.81, np.inf, False)],
)
def test_sound_measurements(near, agreement, known, sound):
    assert is_sound(Measured(np.eye(4), known * np.ones((6, 6)), 0.0, near, agreement)) == sound


class TestJoining:
    """Two groups, between which a measurement says what `near` and `agreement` are told for each pair."""

    def joined(self, monkeypatch, told, equal=False):
        some = grouped([0, 2], [1, 3])
        some.measured = {pair: Measured(relative(*pair), 1e-4 * np.eye(6), 0.0, 0.5, 0.9) for pair in ((2, 0), (3, 1))}
        near = {pair: each[0] for pair, each in told.items()}
        monkeypatch.setattr(Assembly, "_near", lambda self, pair, T: near[pair])
        place = {id(scan): k for k, scan in enumerate(some.scans)}
        seen = []

        def measure(source, target, T, wider):
            pair = place[id(source)], place[id(target)]
            seen.append(pair)
            return Measured(T, 1e-4 * np.eye(6), 0.0, *told[pair])

        monkeypatch.setattr(assembly, "measure", measure)
        monkeypatch.setattr(assembly, "slides", lambda *_: False)
        return some, some._join(hypothesis(0, 1), equal=equal), seen

    def test_what_touches_is_measured_and_all_poses_found(self, monkeypatch):
        told = {(0, 1): (0.5, 0.9), (0, 3): (0.3, 0.9), (2, 1): (0.4, 0.9), (2, 3): (0.03, 0.1)}
        some, done, seen = self.joined(monkeypatch, told)
        assert done
        assert some.groups == [[0, 1, 2, 3]]
        assert seen == [(0, 1), (2, 1), (0, 3)]
        assert set(some.measured) == {*seen, (2, 0), (3, 1)}
        assert not some.ambiguous
        for k in range(4):
            assert_allclose(some.relative(k, 0), relative(k, 0), atol=1e-6)

    def test_an_equal_pose_makes_a_pair_ambiguous(self, monkeypatch):
        some, done, _ = self.joined(
            monkeypatch, dict.fromkeys([(0, 1), (0, 3), (2, 1), (2, 3)], (0.5, 0.9)), equal=True
        )
        assert done
        assert some.ambiguous == {(0, 1), (1, 0)}

    @pytest.mark.parametrize(
        ("agreement", "against", "done"),
        [(0.9, 0.64, False), (0.9, 0.66, True), (0.79, 0.9, False)],
    )
    def test_what_contradicts_keeps_groups_apart(self, monkeypatch, agreement, against, done):
        told = {(0, 1): (0.3, agreement), (0, 3): (0.5, against), (2, 1): (0.01, 0.0), (2, 3): (0.01, 0.0)}
        some, found, _ = self.joined(monkeypatch, told)
        assert found == done
        assert (len(some.groups) == 1) == done

    def test_groups_are_joined_once(self):
        assert not grouped([0, 1])._join(hypothesis(0, 1))


def test_poses_that_contradict_are_told_apart_with_their_own_error():
    """A pair measured, a pose of it that agrees with that, and one that does not."""
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])
    points = SimpleNamespace(points=np.random.default_rng(0).normal(size=(50, 3)))
    scans = [SimpleNamespace(matched=[points], center=np.zeros(3), unit=1.0) for _ in range(2)]
    group = Assembly(scans, np.tile(np.eye(4), (2, 1, 1)), [[0, 1]], np.zeros((2, 6, 6)))
    group.measured[0, 1] = Measured(np.eye(4), np.eye(6), 0.01, 0.5, 1.0)
    for T in (np.eye(4), turned):
        group.hypotheses.append(Hypothesis((0, 1), SimpleNamespace(T=T, error=0.2), 0.4, True, False))
    (right, wrong), residuals = _edges(group, contradicting(group))
    assert (right.accepted, right.error, right.overlap) == (True, 0.01, 0.5)
    assert (wrong.accepted, wrong.error, wrong.overlap) == (False, 0.2, 0.4)
    assert_allclose(wrong.T_target_source, turned)
    assert residuals[0] == 0 < residuals[1]
