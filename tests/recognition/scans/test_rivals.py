"""Scans that fit the others about as well in another pose are told, however their pairs were joined."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from simplexmesh.recognition.scans import rivals
from simplexmesh.recognition.scans.assembly import Assembly, Hypothesis
from simplexmesh.recognition.scans.pose_graph import motions
from simplexmesh.recognition.scans.rivals import MOST, rivaled

TURNED = motions(np.array([[0, 0, 1, 0.1, 0, 0]]))[0]


def pair(i, j, T, score=0.5):
    return Hypothesis((i, j), SimpleNamespace(T=T, score=score), 0.5, True, False)


def group(monkeypatch, agreement):
    """Three scans in their places and one apart; of what is near another, turned as `TURNED`, a share agrees."""
    out = Assembly.of([SimpleNamespace() for _ in range(4)])
    out.groups = [[0, 1, 2], [3]]

    def contact(source, target, T):
        return 0.5, 1.0 if np.allclose(T, np.eye(4)) else agreement if np.allclose(T, TURNED) else 0.5

    monkeypatch.setattr(rivals, "contact", contact)
    return out


@pytest.mark.parametrize(("agreement", "doubtful"), [(0.96, (0,)), (0.94, ())])
def test_from_nine_tenths_of_the_support_on(monkeypatch, agreement, doubtful):
    """Support is what agrees less what does not: 0.92 and 0.88 of that of the pose taken."""
    assert rivaled(group(monkeypatch, agreement), [pair(0, 1, TURNED)]) == doubtful
    assert rivaled(group(monkeypatch, agreement), [pair(1, 0, np.linalg.inv(TURNED))]) == doubtful


def test_all_of_the_group_count_but_the_likeliest_poses_only(monkeypatch):
    """A pose on one scan that another one supports as it supports its own, and poses that none supports."""
    some = group(monkeypatch, 1.0)
    some.poses[2] = TURNED
    on_another, on_none = TURNED @ TURNED, TURNED @ TURNED @ TURNED
    assert rivaled(some, [pair(0, 1, on_none)]) == ()
    likelier = [pair(0, 1, on_none, score=0.6)] * MOST
    assert rivaled(some, [pair(0, 1, on_another), *likelier[1:]]) == (0,)
    assert rivaled(some, [pair(0, 1, on_another), *likelier]) == ()


def test_scans_of_pairs_that_have_equal_poses(monkeypatch):
    some = group(monkeypatch, 0.0)
    some.ambiguous = {(0, 2), (2, 0)}
    assert rivaled(some, []) == (0, 2)
