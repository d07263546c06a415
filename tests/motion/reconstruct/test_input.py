"""Input that `reconstruct` accepts, repairs with a warning, or refuses."""

from __future__ import annotations

import itertools
import json
import re
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.motion.reconstruct.conversion import as_input, joined_scans, without_stray_points
from tests.nightly.marks import nightly

pytestmark = pytest.mark.usefixtures("coarse_starts")


def ball_volume(radius=8.3, half=11, **place):
    axis = np.arange(-half, half + 1.0)
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    return sm.Volume(radius - r, **place)


def test_triangles_and_their_files_are_reconstructed(tmp_path):
    ball = sm.sphere(6, radius=2.0, center=(5, 0, 0)).triangulated()
    path = tmp_path / "ball.ply"
    sm.sphere(6, radius=2.0, center=(5, 0, 0)).save(path)
    mesh = sm.reconstruct(str(path), vertices=200, creases="none").mesh
    assert mesh.genus == 0
    assert_allclose(np.linalg.norm(mesh.vertices - [5, 0, 0], axis=1), 2, atol=0.1)
    for data in (ball, (ball.vertices, ball.faces), path):
        assert_allclose(np.linalg.norm(as_input(data).points - [5, 0, 0], axis=1), 2, atol=0.1)


def test_scans_are_put_together_by_their_poses(tmp_path):
    ball = sm.sphere(20).vertices
    parts = [ball[ball[:, 0] > -0.1], ball[ball[:, 0] < 0.1]]
    poses = []
    for k, part in enumerate(parts):
        turn = np.linalg.qr(np.random.default_rng(k).normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = turn, [k, 2, 3]
        np.savetxt(tmp_path / f"scan{k}.xyz", (part - pose[:3, 3]) @ turn)
        poses.append(pose)
    files = [tmp_path / "scan0.xyz", tmp_path / "scan1.xyz"]
    (tmp_path / "poses.json").write_text(json.dumps({f"scan{k}": pose.tolist() for k, pose in enumerate(poses)}))
    by_file, by_order = joined_scans(files, tmp_path / "poses.json"), joined_scans(files, poses)
    assert_allclose(by_file.points, by_order.points)
    assert_allclose(np.linalg.norm(by_file.points, axis=1), 1, atol=1e-9)
    mesh = sm.reconstruct(files, poses=tmp_path / "poses.json", vertices=500).mesh
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=0.02)
    with pytest.raises(ValueError, match=r"poses must have an entry for scan1.xyz"):
        joined_scans(files, {"scan0": poses[0]})
    with pytest.raises(ValueError, match="poses must be one per scan"):
        joined_scans(files, poses[:1])
    with pytest.raises(TypeError, match="poses must be a path, matrices by name or one per scan, not int"):
        joined_scans(files, 3)


@pytest.mark.parametrize(
    ("data", "options", "error", "message"),
    [
        (ball_volume(), {}, ValueError, r"level must be given for a volume of intensities \(.*\); Otsu's threshold"),
        (
            ball_volume(),
            {"label": 0},
            ValueError,
            r"volume holds intensities \(.*\), not labels; give level \(--level\), ",
        ),
        (ball_volume(), {"level": 99.0}, ValueError, "level must be above .* the range of the volume, not 99"),
        (ball_volume(), {"level": "high"}, TypeError, "level must be a number, not str"),
        (ball_volume(), {"level": 0.0, "label": 1}, ValueError, "give level or label, not both"),
        (
            sm.sphere(4).vertices * 1e160,
            {},
            ValueError,
            r"data must be within 1e-60 and 1e\+60 .*, not reach to 9",
        ),
        (sm.sphere(4).vertices * 1e-310, {}, ValueError, r"data must be within 1e-60 and .*, not be 1.9\de-310 long"),
        (
            ball_volume(spacing=1e90),
            {"level": 0.0},
            ValueError,
            r"data must be within 1e-60 and 1e\+60 .*, not reach to",
        ),
        (ball_volume(), {"level": 0.0, "vertices": 1e3}, TypeError, "vertices must be a whole number, not float"),
        (ball_volume(), {"level": 0.0, "init": "cube"}, ValueError, "init must be one of 'auto', 'sphere'"),
        (ball_volume(), {"level": 0.0, "init": "nowhere.vtp"}, OSError, "nowhere.vtp"),
        (ball_volume(), {"level": 0.0, "inside": "left"}, ValueError, "inside must be one of 'above', 'below'"),
        (
            ball_volume(),
            {"level": 0.0, "components": "two"},
            ValueError,
            "components must be one of 'auto', 'largest', 'all'",
        ),
        (
            sm.sphere(4).vertices,
            {"inside": "below"},
            ValueError,
            "inside is for a level of a volume, not for PointCloud",
        ),
        (np.zeros((3, 3)), {}, ValueError, "points"),
        (np.zeros((5, 5, 5)), {"level": 0.5}, ValueError, "volume must hold an object and its surroundings; it is 0"),
        (np.ones((5, 5, 5)), {}, ValueError, "volume must hold an object and its surroundings; it is 1"),
        (np.full((30, 3), np.nan), {}, ValueError, "finite"),
        (np.zeros((30, 2)), {}, ValueError, "shape"),
        (np.zeros((0, 3)), {}, ValueError, "points"),
        (np.random.default_rng(0).normal(size=(50, 3)), {"level": 1.0}, ValueError, "level and label are for volumes"),
        ("nowhere.nii", {}, OSError, "nowhere.nii"),
        ([], {}, ValueError, "data must be at least one scan, not an empty list"),
        (None, {}, TypeError, "data must be"),
    ],
)
def test_bad_input_gets_one_sentence(data, options, error, message):
    with pytest.raises(error, match=message) as caught:
        sm.reconstruct(data, **options)
    assert "\n" not in str(caught.value)


def test_a_label_must_be_given_and_present():
    values = np.zeros((20, 20, 20), dtype=np.uint8)
    values[4:10, 4:14, 4:14] = 1
    values[10:16, 4:14, 4:14] = 7
    volume = sm.Volume(values)
    with pytest.raises(ValueError, match=r"label must be given, one of \[1, 7\]"):
        sm.reconstruct(volume)
    with pytest.raises(ValueError, match="label must be present in the volume, 3 is not"):
        sm.reconstruct(volume, label=3)
    mesh = sm.reconstruct(volume, label=7, vertices=300).mesh
    assert_allclose(mesh.vertices.mean(axis=0), [12.5, 8.5, 8.5], atol=0.3)


def test_inward_and_inconsistent_normals_are_reported():
    ball = sm.sphere(12)
    with pytest.warns(sm.SimplexMeshWarning, match="point inwards and were flipped"):
        wrong = sm.reconstruct(sm.PointCloud(ball.vertices, -ball.normals), vertices=400)
    assert_allclose(np.linalg.norm(wrong.mesh.vertices, axis=1), 1, atol=0.01)
    signs = np.random.default_rng(0).choice([-1, 1], (ball.n_vertices, 1))
    with pytest.warns(sm.SimplexMeshWarning, match=r"contradict each other \(\d+%\); they were left out"):
        mixed = sm.reconstruct(sm.PointCloud(ball.vertices, signs * ball.normals), vertices=400)
    assert_allclose(np.linalg.norm(mixed.mesh.vertices, axis=1), 1, atol=0.01)


def test_triangles_are_repaired():
    ball = sm.sphere(4).triangulated()
    turned = np.where(np.arange(len(ball.faces))[:, None] % 3 == 0, ball.faces[:, ::-1], ball.faces)
    for faces in (turned, ball.faces[:, ::-1]):
        with pytest.warns(sm.SimplexMeshWarning, match=r"flipped [\d,]+ of 960 triangles"):
            model = sm.reconstruct(sm.TriangleMesh(ball.vertices, faces), vertices=200, creases="none")
        assert model.mesh.genus == 0
        assert_allclose(np.linalg.norm(model.mesh.vertices, axis=1), 1, atol=0.05)
    fin = np.concatenate([ball.faces, [[ball.faces[0, 0], ball.faces[0, 1], ball.faces[-1, 2]]]])
    with pytest.warns(sm.SimplexMeshWarning, match="1 edge has more than two triangles: .* were taken apart"):
        model = sm.reconstruct((ball.vertices, fin), vertices=400, creases="none")
    assert model.mesh.genus == 0


@pytest.mark.parametrize("least", [-2.0, -0.01])
def test_arrays_of_stl_are_reconstructed_as_the_triangles_that_they_are(least):
    """Their triangles share no vertices: each was a border, a box had open models and half a ball tangled ones."""
    ball = sm.sphere(8).triangulated()
    corners = ball.vertices[ball.faces]
    corners = corners[(corners[:, :, 2] > least).all(axis=1)]
    soup = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the data is an open surface")
        model = sm.reconstruct(soup, vertices=600, creases="none")
    assert (model.mesh.n_holes, model.tangled, model.strayed) == (int(least > -1), 0, 0)
    assert model.mesh.area == pytest.approx(sm.TriangleMesh(*soup).area, rel=0.03)
    small = sm.decimate(soup, vertices=200).mesh
    assert (small.n_vertices, small.n_components, small.n_holes) == (200, 1, int(least > -1))


def test_sheets_that_meet_in_a_line_stay_apart_if_they_share_no_vertices():
    grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0)), axis=2).reshape(-1, 2)
    k = (np.arange(8)[:, None] * 9 + np.arange(8)).reshape(-1, 1)
    faces = np.concatenate([k + np.array([0, 1, 10]), k + np.array([0, 10, 9])])
    turns = [(np.cos(a), np.sin(a)) for a in (0.0, 2.0, 4.0)]
    sheets = [np.column_stack([c * grid[:, 0], s * grid[:, 0], grid[:, 1]]) for c, s in turns]
    rows = len(grid) * np.arange(3)[:, None, None]
    found = sm.decimate((np.concatenate(sheets), (faces + rows).reshape(-1, 3)), vertices=100).mesh
    assert (found.n_components, found.n_holes) == (3, 3)


def test_bodies_that_touch_at_an_edge_are_modeled():
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    box = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    both = np.concatenate([corners, corners + np.array([1.0, 1.0, 0.0])])
    two = sm.TriangleMesh(both, np.concatenate([box, box + 8])).welded(report=False)
    with pytest.warns(sm.SimplexMeshWarning, match="1 edge has more than two triangles: .* were taken apart"):
        model = sm.reconstruct(two, vertices=600, components="all", creases="none")
    assert model.mesh.volume == pytest.approx(2, rel=0.05)


@pytest.mark.filterwarnings("ignore:.*of the data is (inside of|deeper than)")  # the walls of the tunnel
def test_lost_handles_are_reported():
    thin = sm.torus(40, 40, radius=1.0, tube_radius=0.999).triangulated()
    with pytest.warns(sm.SimplexMeshWarning, match="has genus 1, the start of the model 0: finer handles are lost"):
        sm.reconstruct(thin, vertices=200, creases="none")


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")  # it has no inside
def test_handles_where_a_surface_crosses_itself_are_not_called_lost():
    """Of a Bohemian dome, a circle moved around a larger one."""
    flat = sm.torus(40, 40).triangulated()
    x, y, z = flat.vertices.T
    u, v = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y) - 1)
    dome = np.column_stack([0.5 * np.cos(u), 1.5 * np.cos(v) + 0.5 * np.sin(u), np.sin(v)])
    with pytest.warns(sm.SimplexMeshWarning, match=r"genus 1, the start of the model [2-9]: handles came about"):
        as_input((dome, flat.faces)).start(2000, None)


@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")  # the ball has no such handle
def test_pairs_of_faces_may_be_an_array():
    ball = sm.sphere(12).vertices
    model = sm.reconstruct(ball, init=sm.sphere(4), handles=np.array([[3, 60]]), iterations=5, creases="none")
    assert [proposal.accepted for proposal in model.topology.handles] == [True]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rigidity": 1001}, "rigidity must be .* 1000, not 1001"),
        ({"holes": [[0, 10**6]]}, r"holes\[0\]\[1\] is 1000000, outside"),
        ({"holes": [[0], [0]]}, r"holes must not overlap; face 0 is in holes\[1\]"),
        ({"handles": [[3, 3]]}, r"handles must not share a face; face 3 is in handles\[0\] twice"),
        ({"holes": [[3, 4]], "handles": [[3, 60]]}, "holes and handles must not share a face of the start"),
    ],
)
def test_faces_and_rigidity_are_checked_before_any_motion(monkeypatch, options, message):
    monkeypatch.setattr("simplexmesh.motion.reconstruct.pipeline.settle", None)
    with pytest.raises(ValueError, match=message):
        sm.reconstruct(sm.sphere(12).triangulated(), init=sm.sphere(4), **options)


@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")
def test_zones_of_holes_are_faces_of_the_start_also_beside_handles():
    ball = sm.sphere(6, radius=1.05)
    cap = [face for face, corners in enumerate(ball.faces) if (ball.vertices[corners, 0] > 0.8).all()]
    pair = [int(np.argmax([s * ball.vertices[corners, 2].mean() for corners in ball.faces])) for s in (1, -1)]
    model = sm.reconstruct(sm.sphere(12).vertices, init=ball, holes=[cap], handles=[pair], iterations=5, creases="none")
    (zone,) = model.topology.holes
    assert len(zone.faces) == len(cap)
    assert zone.contour.mesh.vertices[zone.vertices][:, 0].min() > 0.6


def test_a_function_that_is_never_asked_for_handles_is_told_why():
    ball = sm.sphere(12).vertices
    for data, vertices, reason in ((ball, 40, "model has too few"), (ball[ball[:, 2] > 0], 200, "data is open")):
        with pytest.warns(sm.SimplexMeshWarning, match=f"no handles are looked for, as the {reason}"):
            sm.reconstruct(data, init="sphere", vertices=vertices, handles=callable, iterations=5)


def test_scans_may_be_arrays_and_a_mesh_may_be_fitted_to_a_mesh():
    ball = sm.sphere(12)
    front, back = ball.vertices[ball.vertices[:, 0] > -0.1], ball.vertices[ball.vertices[:, 0] < 0.1]
    mesh = sm.reconstruct((front, back), poses=[np.eye(4), np.eye(4)], vertices=400, creases="none").mesh
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=0.01)
    assert_allclose(as_input([ball.vertices]).points, ball.vertices)
    with pytest.raises(ValueError, match="poses must be one per scan; there are 3 for 2 scans"):
        sm.reconstruct([front, back], poses=[np.eye(4)] * 3)
    mesh = sm.reconstruct(ball, vertices=400).mesh
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=0.02)


def test_omitted_components_of_a_volume_are_reported():
    axis = np.arange(-10, 11.0)
    x, y, z = np.meshgrid(np.arange(-10, 33.0), axis, axis, indexing="ij")
    two = np.maximum(8 - np.sqrt(x * x + y * y + z * z), 7.4 - np.sqrt((x - 21) ** 2 + y * y + z * z))
    with pytest.warns(sm.SimplexMeshWarning, match=r"4\d% of the surface is on smaller pieces that are left out"):
        assert sm.reconstruct(sm.Volume(two), level=0.0, vertices=400).mesh.n_components == 1
    with pytest.warns(sm.SimplexMeshWarning, match=r"4\d% of the surface is on smaller pieces"):
        sm.reconstruct(sm.Volume((two > 0).astype(np.uint8)), label=1, vertices=400, components="largest")
    assert sm.reconstruct(sm.Volume(two), level=0.0, vertices=400, components="all").mesh.n_components == 2


def test_all_pieces_of_a_label_are_kept_and_those_too_small_for_a_mesh_are_told_with_their_share():
    axis = np.arange(-10, 11.0)
    x, y, z = np.meshgrid(np.arange(-10, 33.0), axis, axis, indexing="ij")
    two = (np.hypot(np.hypot(x, y), z) < 8) | (np.hypot(np.hypot(x - 21, y), z) < 7.4)
    model = sm.reconstruct(sm.Volume(two.astype(np.uint8)), vertices=400)
    assert model.mesh.n_components == 2
    assert (model.found.components_dropped, model.found.share_dropped) == (0, 0.0)
    specks = two.copy()
    specks[10:12, 0:2, 0:2] = specks[30, 20, 20] = specks[42, 0, 0] = True
    share = 10 / specks.sum()
    told = re.escape(f"left out 3 pieces of the label, {100 * share:.2g} % of its samples: too small for a mesh of 400")
    with pytest.warns(sm.SimplexMeshWarning, match=told):
        noisy = sm.reconstruct(sm.Volume(specks.astype(np.uint8) * 7), label=7, vertices=400)
    assert noisy.mesh.n_components == 2
    assert (noisy.found.components_dropped, noisy.found.share_dropped) == (3, share)
    assert "3 smaller pieces left out (0.2" in str(noisy.found)
    assert noisy.distance.data_to_mesh.max < 1.5  # not measured to the pieces left out
    assert noisy.distance.data_to_mesh.count == model.distance.data_to_mesh.count
    with pytest.warns(sm.SimplexMeshWarning, match=told.replace("label", "object")):
        level = sm.reconstruct(sm.Volume(specks.astype(float)), level=0.5, vertices=400, components="all")
    assert (level.found.components_dropped, level.found.share_dropped) == (3, share)


@pytest.mark.parametrize(("given", "whole"), [({"label": 1}, "label"), *nightly(({"level": 0.5}, "object"))])
def test_cavities_that_are_filled_are_told_with_their_share(given, whole):
    """A hollow ball came out solid, 1.27 times its voxels, without a word; a hole of a voxel is noise."""
    x, y, z = np.indices((28, 28, 28)) - 13.5
    square = x * x + y * y + z * z
    ball = square < 140
    hollow, ball[14, 14, 14] = ball & (square > 90), False
    share = (square <= 90).sum() / hollow.sum()
    told = f"filled cavities inside of the {whole}, of {share:.0%} of its volume"
    with pytest.warns(sm.SimplexMeshWarning, match=told):
        model = sm.reconstruct(sm.Volume(hollow.astype(np.float32)), vertices=400, **given)
    assert model.mesh.volume == pytest.approx((square < 140).sum(), rel=0.04)
    sm.reconstruct(sm.Volume(ball.astype(np.float32)), vertices=400, **given)


def test_a_start_that_is_given_keeps_the_largest_piece_of_a_label():
    x, y, z = np.mgrid[-9:10, -9:10, -9:10]
    ball = np.pad((x * x + y * y + z * z < 60).astype(np.uint8), ((0, 12), (0, 0), (0, 0)))
    ball[26:29, 8:11, 8:11] = 1
    model = sm.reconstruct(sm.Volume(ball), init="sphere", vertices=300)
    assert model.mesh.n_components == 1
    assert model.distance.data_to_mesh.max < 2


@pytest.mark.parametrize(("other", "kind"), [(sm.Volume(np.zeros((4, 4, 4))), "Volume"), (sm.sphere(5), "SimplexMesh")])
def test_what_is_no_scan_among_scans_is_named(other, kind):
    scan = sm.PointCloud(sm.sphere(6).vertices)
    with pytest.raises(TypeError, match=rf"^scans must be point clouds or surfaces; scan 1 is a {kind}$"):
        sm.reconstruct([scan, other])


def test_scans_with_opposed_normals_are_fitted_without_them():
    ball = sm.sphere(16)
    upper = ball.vertices[:, 2] > -0.05
    halves = [sm.PointCloud(ball.vertices[upper], ball.normals[upper])]
    halves.append(sm.PointCloud(ball.vertices[~upper], -ball.normals[~upper]))
    with pytest.warns(sm.SimplexMeshWarning, match="the points' normals bound no solid and were left out"):
        mesh = sm.reconstruct(halves, vertices=400).mesh
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=0.01)


@pytest.mark.parametrize(
    ("unit", "init"), [(1e-50, "sphere"), (1e50, "auto"), *nightly((1e-50, "auto"), (1e50, "sphere"))]
)
def test_units_beyond_single_precision_give_the_same_model(unit, init):
    egg = sm.sphere(14).vertices * [3, 2, 1]
    model = sm.reconstruct(unit * egg, vertices=400, init=init)
    assert model.mesh.genus == 0
    assert model.tangled == 0
    assert model.distance.data_to_mesh.rms < 0.02 * unit


@pytest.mark.parametrize("init", ["auto", "sphere"])
def test_values_beyond_single_precision_give_the_same_model(init):
    ball = ball_volume()
    missing = np.where(ball.values > -3, ball.values, -np.finfo(float).max)
    for values in (missing, 1e300 * ball.values, 1e-200 * ball.values):
        model = sm.reconstruct(sm.Volume(values, origin=(-11, -11, -11)), level=0.0, vertices=400, init=init)
        assert_allclose(np.linalg.norm(model.mesh.vertices, axis=1), 8.3, atol=0.1)
        assert model.distance.data_to_mesh.rms < 0.15


def test_stray_points_far_from_all_others_are_left_out_with_a_warning():
    egg = sm.sphere(14).vertices * [3, 2, 1]
    points = np.vstack([[1e6, 0, 0], egg, [0, -600, 0]])
    for data, init in ((points, "sphere"), (sm.PointCloud(points, points), "auto")):
        with pytest.warns(sm.SimplexMeshWarning, match="left out 2 of 3,922 points, isolated and far"):
            model = sm.reconstruct(data, vertices=400, init=init, creases="none")
        assert model.distance.data_to_mesh.max < 0.1
    with pytest.warns(sm.SimplexMeshWarning, match="left out 2"):
        found = sm.register(points, egg + np.array([7, 0, 0]))
    assert_allclose(np.abs(found.T_target_source @ [0, 0, 0, 1]), [7, 0, 0, 1], atol=0.01)


def test_small_dense_pieces_far_away_are_no_stray_points():
    ball, crumb = sm.sphere(20), sm.sphere(1, radius=0.02, center=(30, 0, 0))
    cloud = sm.PointCloud(np.vstack([ball.vertices, crumb.vertices]))
    assert without_stray_points(cloud) is cloud


@pytest.mark.parametrize("kind", ["points", *nightly("triangles")])
def test_a_lid_over_open_data_is_told_unless_it_is_wanted(kind):
    ball = sm.sphere(20).triangulated("dual")
    faces = ball.faces[(ball.vertices[ball.faces][:, :, 2] > -0.5).all(axis=1)]
    bowl = sm.TriangleMesh(ball.vertices[np.unique(faces)], np.unique(faces, return_inverse=True)[1].reshape(-1, 3))
    data = bowl if kind == "triangles" else bowl.vertices
    with pytest.warns(sm.SimplexMeshWarning, match=r"^\d+% of the model's area has no data nearby: the data") as told:
        closed = sm.reconstruct(data, vertices=600, creases="none")
    assert len(told) == 1
    assert closed.mesh.n_holes == 0
    assert 0.05 < closed.bare < 0.75 / 3.75  # the disk, its rim near the data
    assert f"{closed.bare:.0%} of its area without data" in repr(closed)
    assert sm.reconstruct(data, vertices=600, holes="none", creases="none").mesh.n_holes == 0
    opened = sm.reconstruct(data, vertices=600, holes="auto", creases="none")
    assert opened.mesh.n_holes == 1
    assert opened.bare < 0.05


def test_a_small_lid_and_data_that_is_missed_are_both_told():
    tall = sm.ellipsoid((1, 1, 5), 24).vertices
    data = np.vstack([tall[tall[:, 2] > 0], sm.sphere(16, center=(6, 0, 3)).vertices])
    with pytest.warns(sm.SimplexMeshWarning) as told:
        model = sm.reconstruct(data, vertices=600)
    sentences = [str(each.message) for each in told]
    assert len(sentences) == 2
    assert re.search(r"% of the data is far from the model, as near \(.*\); components='all' keeps", sentences[0])
    assert "of the model's area has no data nearby" in sentences[1]
    assert 0.025 < model.bare < 0.1  # the lid is a tenth, its rim near the data


@pytest.mark.parametrize("noise", [*nightly(0.0), 0.02])
@pytest.mark.parametrize("body", [sm.sphere(16), sm.ellipsoid((4, 2, 1), 16), sm.torus(40, 16)], ids=repr)
def test_a_model_of_closed_data_has_data_everywhere(body, noise):
    points = body.vertices + noise * np.random.default_rng(0).normal(size=body.vertices.shape)
    model = sm.reconstruct(points, vertices=300, creases="none")
    assert model.bare == 0
    assert "without data" not in repr(model)


@pytest.mark.parametrize("count", [4, 8, 24])
def test_points_too_few_to_show_a_surface_are_refused(count):
    with pytest.raises(ValueError, match="data must have more points"):
        sm.reconstruct(sm.sphere(10).vertices[:: 200 // count][:count], vertices=500)


def test_corners_of_a_cube_show_no_surface():
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    with pytest.raises(ValueError, match="those given show no surface"):
        sm.reconstruct(corners)


def test_nearly_all_that_is_left_out_is_99_percent():
    cubes = np.zeros((42, 42, 42), np.uint8)
    cubes[np.ix_(*[np.arange(42) % 6 < 3] * 3)] = 1
    with pytest.warns(sm.SimplexMeshWarning, match="left out 342 pieces of the label, 99 % of its samples"):
        sm.reconstruct(cubes, vertices=200, iterations=20)
