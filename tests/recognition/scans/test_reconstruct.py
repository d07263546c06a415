"""Scans are reconstructed with poses that are found; frames that agree stay, and contradictions are told."""

from __future__ import annotations

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.recognition.scans.reconstruct import posed_scans
from tests.recognition import reference as reference
from tests.recognition.scans.test_register_all import views

pytestmark = pytest.mark.usefixtures("coarse_starts")


@pytest.fixture(scope="module")
def scans():
    scans, poses = views(4, np.random.default_rng(8))
    return [scan[::2] for scan in scans], poses


def in_one_frame(scans, poses):
    """The scans, all in the frame of the first."""
    relative = np.linalg.solve(poses[0], poses)
    return [scan @ T[:3, :3].T + T[:3, 3] for scan, T in zip(scans, relative, strict=True)]


@pytest.mark.nightly
def test_poses_found_are_as_good_as_those_given(scans):
    seen = []
    usual = {"vertices": 800, "creases": "none"}
    found = sm.reconstruct(
        scans[0], poses="auto", progress=lambda share, message: seen.append((share, message)), **usual
    )
    given = sm.reconstruct(in_one_frame(*scans), poses=[np.eye(4)] * 4, **usual)
    assert found.mesh.genus == given.mesh.genus
    assert found.distance.data_to_mesh.rms < 1.3 * given.distance.data_to_mesh.rms
    shares = [share for share, _ in seen]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert any(message == "registering pairs" for _, message in seen)


@pytest.mark.nightly
def test_frames_that_contradict_each_other_are_told_and_poses_found(scans):
    clouds = [scan - scan.mean(axis=0) for scan in scans[0]]  # as of a body turned before a scanner that stays
    with pytest.warns(sm.SimplexMeshWarning, match="in different frames: scans.* turned by .* all were registered"):
        told = sm.reconstruct(clouds, vertices=800)
    silent = sm.reconstruct(clouds, poses="auto", vertices=800)
    np.testing.assert_array_equal(told.mesh.vertices, silent.mesh.vertices)


def test_frames_that_agree_stay_as_they_are(scans):
    together = in_one_frame(*scans)
    kept, found = posed_scans(together, None, lambda fraction, message: None)
    assert found is None
    assert all(np.array_equal(sm.PointCloud(one).points, other) for one, other in zip(kept, together, strict=True))


@pytest.mark.parametrize("groups", [((0, 1, 2, 3),), ((0, 1), (2, 3))])
def test_a_contradiction_is_told_unless_other_scans_join_the_two(scans, groups, monkeypatch):
    module = "simplexmesh.recognition.scans.reconstruct"
    monkeypatch.setattr(f"{module}._contacts", lambda prepared: ({(0, 1), (1, 2), (2, 3)}, [(0, 2)]))
    monkeypatch.setattr(f"{module}.registered", lambda *_: SimpleNamespace(edges=(), groups=groups))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert posed_scans(scans[0], None, lambda fraction, message: None)[1] is None
    assert ["scans[0] and scans[2] contradict" in str(each.message) for each in told] == [True] * (len(groups) - 1)


def test_parts_that_only_adjoin_stay_as_they_are():
    """The halves of a ball fit each other in other poses much better than where they belong."""
    ball = sm.sphere(20).vertices
    parts = [ball[ball[:, 0] < 0.05], ball[ball[:, 0] > -0.05]]
    model = sm.reconstruct(parts, vertices=400)
    np.testing.assert_allclose(np.linalg.norm(model.mesh.vertices, axis=1), 1, atol=0.03)


@pytest.mark.parametrize("shift", [[10.0, 0, 0], [0, 7.0, 0]])
def test_bodies_that_do_not_meet_keep_their_frames_and_this_is_told(shift):
    body = sm.ellipsoid((3, 2, 1), 20).vertices
    body = body + 0.1 * body**2
    with pytest.warns(sm.SimplexMeshWarning, match="not all scans meet in their frames, which are kept"):
        kept, found = posed_scans([body, body + shift], None, lambda fraction, message: None)
    assert len(kept) == 2
    assert found is None


@pytest.mark.nightly
def test_a_scan_of_something_else_is_left_out_by_name(scans, tmp_path):
    paths = []
    for k, scan in enumerate([*scans[0], sm.torus(radius=2.0, tube_radius=0.5).vertices]):
        paths.append(tmp_path / f"scan{k}.xyz")
        np.savetxt(paths[-1], scan)
    with pytest.warns(sm.SimplexMeshWarning, match="no pose among them: scan4.xyz"):
        model = sm.reconstruct(paths, poses="auto", vertices=400, creases="none")
    assert model.mesh.genus == 0


def test_scans_that_do_not_fit_at_all_are_refused():
    rng = np.random.default_rng(0)
    bodies = [reference.lumpy(12), sm.torus(radius=2.0, tube_radius=0.3)]
    parts = [body.triangulated().sampled(2000, rng=rng).points for body in bodies]
    with (
        pytest.warns(sm.SimplexMeshWarning, match="fit none of the others"),
        pytest.raises(ValueError, match="no two of the 2 scans fit each other"),
    ):
        sm.reconstruct(parts, poses="auto")


@pytest.mark.parametrize("data", [sm.sphere(8), [sm.sphere(8).vertices]])
def test_automatic_poses_need_scans(data):
    with pytest.raises(ValueError, match="poses='auto' needs several scans, in a list"):
        sm.reconstruct(data, poses="auto")


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ({"init": "cube"}, "init must be one of"),
        ({"vertices": 3}, "vertices must be at least 20"),
        ({"level": 0.5}, "level and label are for volumes, not for PointCloud"),
    ],
)
def test_options_are_checked_before_poses_are_searched(scans, option, said):
    seen = []
    with pytest.raises(ValueError, match=said):
        sm.reconstruct(scans[0], poses="auto", progress=lambda share, message: seen.append(message), **option)
    assert seen == []


@pytest.mark.nightly
def test_a_scan_with_normals_the_other_way_does_not_spoil_the_model(scans):
    clouds = [sm.PointCloud(scan, sm.vertex_normals(scan)) for scan in scans[0]]
    right = sm.reconstruct(clouds, poses="auto", vertices=400)
    clouds[2] = replace(clouds[2], normals=-clouds[2].normals)
    with pytest.warns(sm.SimplexMeshWarning, match=r"normals that are opposite .* were turned over: scans\[2\]$"):
        turned = sm.reconstruct(clouds, poses="auto", vertices=400)
    np.testing.assert_allclose(turned.mesh.vertices, right.mesh.vertices, atol=1e-6)


def test_the_signature_is_that_of_the_pipeline():
    with pytest.raises(TypeError, match="unexpected keyword argument 'pose'"):
        sm.reconstruct(sm.sphere(4), pose="auto")
