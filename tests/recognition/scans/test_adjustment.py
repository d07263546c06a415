"""Poses refined together come back to the truth from which they were moved, and err about as much as is stated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.recognition.register.oriented_points import oriented_points
from simplexmesh.recognition.scans import assembly
from simplexmesh.recognition.scans.adjustment import adjusted
from simplexmesh.recognition.scans.pose_graph import motions
from tests.recognition.scans.test_register_all import off, views


def angles(one, other):
    return np.degrees(Rotation.from_matrix(np.swapaxes(one[:, :3, :3], 1, 2) @ other[:, :3, :3]).magnitude())


@pytest.mark.nightly
def test_poses_that_were_moved_come_back():
    rng = np.random.default_rng(3)
    scans, poses = views(5, rng)
    true = np.linalg.solve(poses[0], poses)
    moved = motions(0.004 * rng.normal(size=(5, 6))) @ true
    moved[0] = np.eye(4)
    found = adjusted([oriented_points(scan, "scan") for scan in scans], moved)
    np.testing.assert_array_equal(found[0], np.eye(4))
    assert angles(true, moved)[1:].min() > 0.2
    assert angles(true, found).max() < 0.15


@pytest.mark.nightly
def test_errors_are_about_those_stated_and_less_than_from_pairs_alone(monkeypatch):
    scans, poses = views(5, np.random.default_rng(4), samples=16_000)
    found = sm.register_all(scans)
    monkeypatch.setattr(assembly, "adjusted", lambda scans, poses: poses)
    of_pairs = sm.register_all(scans)
    stated = np.degrees(np.sqrt(np.trace(found.covariance[1:, :3, :3], axis1=1, axis2=2)))
    errors = np.array([off(each, poses, range(5))[0][1:] for each in (found, of_pairs)])
    assert 0.2 < np.sqrt(np.mean((errors[0] / stated) ** 2)) < 3
    together, alone = np.sqrt(np.mean(errors**2, axis=1))
    assert together < 0.8 * alone
