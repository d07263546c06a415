"""From data to a surface model in one call: topology, accuracy, places, budgets, interruptions, refusals."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.motion.crossings import outer_crossings
from simplexmesh.motion.initial.primitives import primitive_around, principal_frame
from simplexmesh.motion.scans import joined_scans
from simplexmesh.motion.subjects import otsu_threshold
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance
from simplexmesh.motion.untangle import tangled_vertices, untangled


def torus_distance(points, ring=1.0, tube=0.35):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - ring, points[:, 2]) - tube


def torus_points(count, rng, noise=0.0):
    """Area-uniform points of the torus R = 1, r = 0.35; noise in shares of the diagonal of its box."""
    u, v = rng.uniform(0, 2 * np.pi, (2, 4 * count))
    keep = rng.uniform(0, 1.35, 4 * count) < 1 + 0.35 * np.cos(v)
    u, v = u[keep][:count], v[keep][:count]
    around = 1 + 0.35 * np.cos(v)
    points = np.column_stack([around * np.cos(u), around * np.sin(u), 0.35 * np.sin(v)])
    return points + rng.normal(scale=noise * TORUS_DIAGONAL, size=points.shape) if noise else points


TORUS_DIAGONAL = float(np.linalg.norm([2.7, 2.7, 0.7]))


def ball_volume(radius=8.3, half=11, **place):
    axis = np.arange(-half, half + 1.0)
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    return sm.Volume(radius - r, **place)


@pytest.fixture(scope="module")
def noisy_torus():
    return sm.reconstruct(torus_points(20_000, np.random.default_rng(1), noise=0.01), vertices=4000)


def test_a_ball_becomes_a_ball():
    model = sm.reconstruct(ball_volume(origin=(-11, -11, -11)), level=0.0, vertices=600)
    assert model.mesh.genus == 0
    assert model.mesh.n_holes == 0
    assert model.mesh.check(self_intersections=True).ok
    assert_allclose(np.linalg.norm(model.mesh.vertices, axis=1), 8.3, atol=0.06)
    assert model.distance.mesh_to_data.rms < 0.02
    assert model.distance.data_to_mesh.rms < 0.1  # flat faces of 600 vertices: their sagitta
    assert model.converged
    assert model.tangled == 0
    assert model.mesh.volume > 0


def test_the_mesh_lies_where_the_file_says():
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    for direction in (turn, -turn):  # one of the two is left-handed
        axis = np.arange(-11, 12.0)
        x, y, z = np.meshgrid(axis * 0.5, axis * 0.8, axis * 1.2, indexing="ij")
        volume = sm.Volume(
            1 - np.sqrt((x / 4) ** 2 + (y / 5) ** 2 + (z / 7) ** 2),
            spacing=(0.5, 0.8, 1.2),
            origin=np.array([100.0, -50, 7]),
            direction=direction,
        )
        center = volume.to_world([11, 11, 11])
        mesh = sm.reconstruct(volume, level=0.0, vertices=800).mesh
        local = (mesh.vertices - center) @ direction
        assert_allclose(np.sqrt(((local / [4, 5, 7]) ** 2).sum(axis=1)), 1, atol=0.03)
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * 4 * 5 * 7, rel=0.03)


def test_dark_objects_are_found_below_the_level():
    volume = ball_volume(origin=(-11, -11, -11))
    dark = sm.Volume(-volume.values, origin=(-11, -11, -11))
    bright = sm.reconstruct(volume, level=0.0, vertices=400).mesh
    below = sm.reconstruct(dark, level=0.0, vertices=400, inside="below").mesh
    assert_allclose(below.vertices, bright.vertices, atol=1e-6)


def test_a_mask_gives_a_smooth_ball_of_the_right_size():
    values = (ball_volume().values > 0).astype(np.uint8)
    model = sm.reconstruct(sm.Volume(values, origin=(-11, -11, -11)), vertices=800)
    radius = np.linalg.norm(model.mesh.vertices, axis=1)
    assert abs(radius.mean() - 8.3) < 0.05
    assert radius.std() < 0.08  # the voxels' corners scatter by 0.3


def test_noise_is_removed_from_points_about_which_nothing_is_told(noisy_torus):
    mesh = noisy_torus.mesh
    assert mesh.genus == 1
    assert mesh.n_holes == 0
    assert mesh.check(self_intersections=True).ok
    assert np.abs(torus_distance(mesh.vertices)).mean() < 0.0014 * TORUS_DIAGONAL
    surface = mesh.triangulated()
    middle = surface.vertices[surface.faces].mean(axis=1)
    assert np.abs(torus_distance(middle)).mean() < 0.0014 * TORUS_DIAGONAL
    corners = surface.vertices[surface.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    around = np.hypot(middle[:, 0], middle[:, 1])[:, None]
    truth = middle - np.column_stack([middle[:, :2] / around, np.zeros(len(middle))])
    cosine = (normal * truth).sum(axis=1) / np.linalg.norm(normal, axis=1) / np.linalg.norm(truth, axis=1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() < 8.5


def test_the_budget_is_kept(noisy_torus):
    assert abs(noisy_torus.mesh.n_vertices - 4000) <= 400
    for vertices in (200, 1501):
        mesh = sm.reconstruct(torus_points(4000, np.random.default_rng(3)), vertices=vertices).mesh
        assert abs(mesh.n_vertices - vertices) <= 0.1 * vertices


def test_the_distances_are_those_of_the_mesh(noisy_torus):
    points = torus_points(20_000, np.random.default_rng(1), noise=0.01)
    surface = noisy_torus.mesh.triangulated()
    away = surface_distance(points, surface.vertices, surface.faces)
    spread = noisy_torus.distance.data_to_mesh
    assert (spread.mean, spread.max) == pytest.approx((away.mean(), away.max()))
    assert spread.rms == pytest.approx(np.sqrt((away**2).mean()))
    assert json.loads(json.dumps(noisy_torus.distance.as_dict()))["data_to_mesh"]["count"] == len(points)


def test_a_run_repeats_itself():
    points = torus_points(3000, np.random.default_rng(5))
    first, second = (sm.reconstruct(points, vertices=500) for _ in range(2))
    assert_array_equal(first.mesh.vertices, second.mesh.vertices)


def test_triangles_and_their_files_are_reconstructed(tmp_path):
    ball = sm.sphere(6, radius=2.0, center=(5, 0, 0)).triangulated()
    path = tmp_path / "ball.ply"
    sm.sphere(6, radius=2.0, center=(5, 0, 0)).save(path)
    for data in (ball, (ball.vertices, ball.faces), path, str(path)):
        mesh = sm.reconstruct(data, vertices=400).mesh
        assert mesh.genus == 0
        assert_allclose(np.linalg.norm(mesh.vertices - [5, 0, 0], axis=1), 2, atol=0.05)


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
    with pytest.raises(ValueError, match=r"poses must hold one for scan1.xyz"):
        joined_scans(files, {"scan0": poses[0]})
    with pytest.raises(ValueError, match="poses must be one per scan"):
        joined_scans(files, poses[:1])


def test_components_are_kept_or_dropped():
    two = np.concatenate([sm.sphere(12).vertices, sm.sphere(10, radius=0.8, center=(3, 0, 0)).vertices])
    with pytest.warns(sm.SimplexMeshWarning, match=r"4\d% of the data is far from the model; components='all'"):
        assert sm.reconstruct(two, vertices=600).mesh.n_components == 1
    both = sm.reconstruct(two, vertices=600, components="all").mesh
    assert both.n_components == 2
    assert both.genus == 0


def test_tunnels_narrower_than_asked_are_sealed():
    axis = np.arange(-14, 15.0)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    drilled = np.minimum(11.3 - np.sqrt(x * x + y * y + z * z), np.hypot(x, y) - 3.2)
    volume = sm.Volume(drilled, spacing=0.5)
    for tunnels, genus in ((0.0, 1), (2.0, 1), (5.0, 0)):
        model = sm.reconstruct(volume, level=0.0, vertices=1200, tunnels=tunnels)
        assert model.mesh.genus == genus
        assert model.found.tunnels_removed == 1 - genus


@pytest.mark.parametrize("init", ["sphere", "ellipsoid"])
def test_closed_primitives_find_a_body_from_outside(init):
    x, y, z = np.meshgrid(*[np.arange(-16, 17.0)] * 3, indexing="ij")
    egg = sm.Volume(1 - np.sqrt((x / 12) ** 2 + (y / 9) ** 2 + (z / 7) ** 2), origin=(-16, -16, -16))
    model = sm.reconstruct(egg, level=0.0, init=init, vertices=1000)
    assert model.mesh.check(self_intersections=True).ok
    assert_allclose(np.sqrt(((model.mesh.vertices / [12, 9, 7]) ** 2).sum(axis=1)), 1, atol=0.03)
    assert abs(model.mesh.n_vertices - 1000) <= 100


def test_a_torus_finds_a_torus_and_a_mesh_keeps_its_topology(tmp_path):
    points = torus_points(8000, np.random.default_rng(7))
    model = sm.reconstruct(points, init="torus", vertices=1500)
    assert model.mesh.genus == 1
    assert np.abs(torus_distance(model.mesh.vertices)).mean() < 0.003
    model.start.save(tmp_path / "start.vtp")
    again = sm.reconstruct(points, init=tmp_path / "start.vtp")
    assert_array_equal(again.mesh.connectivity.twin, model.start.connectivity.twin)
    assert np.abs(torus_distance(again.mesh.vertices)).mean() < 0.003


def test_a_cylinder_and_a_plane_lie_on_open_data():
    rng = np.random.default_rng(8)
    angle, along = rng.uniform(0, 2 * np.pi, 6000), rng.uniform(-2, 2, 6000)
    bulged = (1 + 0.1 * np.cos(along))[:, None]
    pipe = np.column_stack([bulged * np.cos(angle)[:, None], bulged * np.sin(angle)[:, None], along])
    mesh = sm.reconstruct(pipe, init="cylinder", vertices=1000).mesh
    assert (mesh.n_holes, mesh.genus) == (2, 0)
    inner = np.abs(mesh.vertices[:, 2]) < 1.8
    radius = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
    assert np.abs(radius - 1 - 0.1 * np.cos(mesh.vertices[:, 2]))[inner].max() < 0.02
    x, y = rng.uniform(-1, 1, (2, 6000))
    hill = np.column_stack([x, y, 0.3 * np.exp(-4 * (x**2 + y**2))])
    mesh = sm.reconstruct(hill, init="plane", vertices=1000).mesh
    assert (mesh.n_holes, mesh.genus) == (1, 0)
    inner = (np.abs(mesh.vertices[:, :2]) < 0.85).all(axis=1)
    expected = 0.3 * np.exp(-4 * (mesh.vertices[:, :2] ** 2).sum(axis=1))
    assert np.abs(mesh.vertices[:, 2] - expected)[inner].mean() < 0.004


def test_progress_is_reported_and_an_interrupt_keeps_the_last_state():
    said = []
    sm.reconstruct(torus_points(2000, np.random.default_rng(9)), vertices=300, progress=lambda *now: said.append(now))
    shares = [share for share, _ in said]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)

    def impatient(share, message):
        if share > 0.3:
            raise KeyboardInterrupt

    model = sm.reconstruct(torus_points(2000, np.random.default_rng(9)), vertices=300, progress=impatient)
    assert model.interrupted
    assert not model.converged
    assert 0 < len(model.history) < 300
    assert np.isfinite(model.mesh.vertices).all()
    assert "interrupted" in repr(model)


@pytest.mark.parametrize(
    ("data", "options", "error", "message"),
    [
        (ball_volume(), {}, ValueError, r"level must be given for a volume of intensities \(.*\); Otsu's threshold"),
        (ball_volume(), {"level": 99.0}, ValueError, "level must be between .* the range of the volume, not 99"),
        (ball_volume(), {"level": "high"}, TypeError, "level must be a number, not str"),
        (ball_volume(), {"level": 0.0, "label": 1}, ValueError, "give level or label, not both"),
        (ball_volume(), {"level": 0.0, "vertices": 3}, ValueError, "vertices must be at least 20, not 3"),
        (ball_volume(), {"level": 0.0, "vertices": 1e3}, TypeError, "vertices must be a whole number, not float"),
        (ball_volume(), {"level": 0.0, "init": "cube"}, ValueError, "init must be one of 'auto', 'sphere'"),
        (ball_volume(), {"level": 0.0, "init": 3}, TypeError, "init must be a name, a path or a SimplexMesh, not int"),
        (ball_volume(), {"level": 0.0, "init": "nowhere.vtp"}, OSError, "nowhere.vtp"),
        (ball_volume(), {"level": 0.0, "inside": "left"}, ValueError, "inside must be one of 'above', 'below'"),
        (ball_volume(), {"level": 0.0, "components": "two"}, ValueError, "components must be one of 'largest', 'all'"),
        (
            ball_volume(),
            {"level": 0.0, "init": "sphere", "components": "all"},
            ValueError,
            "components='all' needs init",
        ),
        (
            sm.sphere(4).vertices,
            {"inside": "below"},
            ValueError,
            "inside is for a level of a volume, not for PointCloud",
        ),
        (ball_volume(), {"level": 0.0, "tunnels": -1}, ValueError, "tunnels must be at least 0, not -1"),
        (ball_volume(), {"level": 0.0, "adaptation": 2}, ValueError, "adaptation must be between 0 and 0.25, not 2"),
        (np.zeros((3, 3)), {}, ValueError, "points"),
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


def test_labels_are_asked_for_by_name():
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


def test_crossings_are_the_outer_ones():
    axis = np.arange(-9, 10.0)
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    hollow = sm.Volume(np.minimum(7.2 - r, r - 3.1), origin=(-9, -9, -9))
    points = outer_crossings(hollow, 0.0)
    assert_allclose(np.linalg.norm(points, axis=1), 7.2, atol=0.05)
    cut = sm.Volume(hollow.values[9:], origin=(0, -9, -9))
    flat = outer_crossings(cut, 0.0)
    on_cut = flat[:, 0] == -0.5  # the object ends half a voxel beyond the border
    assert on_cut.sum() > 100
    radius = np.linalg.norm(flat[~on_cut & (flat[:, 0] > 0)], axis=1)
    assert np.minimum(np.abs(radius - 7.2), np.abs(radius - 3.1)).max() < 0.05  # the cut opens the cavity
    assert len(outer_crossings(hollow, 99.0)) == 0


def test_otsu_splits_two_heaps():
    rng = np.random.default_rng(0)
    heaps = np.concatenate([rng.normal(10, 1, 4000), rng.normal(30, 2, 1000)])
    assert 13 < otsu_threshold(heaps) < 25


def test_principal_frames_are_right_handed_and_primitives_enclose():
    rng = np.random.default_rng(2)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = rng.uniform(-1, 1, (2000, 3)) * [5, 3, 1] @ turn + [1, 2, 3]
    center, axes = principal_frame(points)
    assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) > 0
    assert_allclose(np.ptp((points - center) @ axes.T, axis=0), [10, 6, 2], rtol=0.04)
    for kind in ("sphere", "ellipsoid"):
        surface = primitive_around(points, kind, 2000).triangulated()
        assert inside_surface(points, surface.vertices, surface.faces).all()
    assert np.ptp(primitive_around(points, "plane", 500).vertices @ axes.T, axis=0)[:2].max() < 10.5
    square = rng.uniform(-1, 1, (2000, 3)) * [1, 1, 0.01]
    assert primitive_around(square, "plane", 500).area < 4.5  # and not 8, that of the square on its corner
    up = axes[2]
    for sign in (1, -1):
        sheet = primitive_around(points, "plane", 500, facing=sign * up)
        assert (sheet.normals @ (sign * up)).min() > 0.99


def test_the_distances_of_a_volume_count_all_that_the_background_reaches():
    """A ball with a well; a sphere around it that does not move misses the well's walls, and says so."""
    axis = np.arange(-12, 13.0)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    well = np.minimum(10.3 - np.sqrt(x * x + y * y + z * z), np.maximum(np.hypot(x, y) - 4.2, -2 - z))
    volume = sm.Volume(well, origin=(-12, -12, -12))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sm.SimplexMeshWarning)
        model = sm.reconstruct(volume, level=0.0, init="sphere", vertices=720, iterations=0)
    points = outer_crossings(volume, 0.0)
    surface = model.mesh.triangulated()
    away = surface_distance(points, surface.vertices, surface.faces)
    assert model.distance.data_to_mesh.rms == pytest.approx(np.sqrt((away**2).mean()))
    assert model.distance.data_to_mesh.count == len(points)
    assert_allclose(model.mesh.data["distance"].max(), model.distance.mesh_to_data.max)


def test_data_that_faces_the_wrong_way_is_turned_and_reported():
    ball = sm.sphere(12)
    right = sm.reconstruct(sm.PointCloud(ball.vertices, ball.normals), vertices=400)
    with pytest.warns(sm.SimplexMeshWarning, match="look inwards and were turned"):
        wrong = sm.reconstruct(sm.PointCloud(ball.vertices, -ball.normals), vertices=400)
    assert wrong.distance.mesh_to_data.rms == pytest.approx(right.distance.mesh_to_data.rms, rel=0.2)
    signs = np.random.default_rng(0).choice([-1, 1], (ball.n_vertices, 1))
    with pytest.warns(sm.SimplexMeshWarning, match=r"contradict each other \(\d+%\); they were left out"):
        mixed = sm.reconstruct(sm.PointCloud(ball.vertices, signs * ball.normals), vertices=400)
    assert_allclose(np.linalg.norm(mixed.mesh.vertices, axis=1), 1, atol=0.01)


def test_scans_may_be_arrays_and_a_mesh_may_be_fitted_to_a_mesh():
    ball = sm.sphere(12)
    front, back = ball.vertices[ball.vertices[:, 0] > -0.1], ball.vertices[ball.vertices[:, 0] < 0.1]
    for scans, poses in (([front, back], None), ((front, back), [np.eye(4), np.eye(4)]), ([ball.vertices], None)):
        mesh = sm.reconstruct(scans, poses=poses, vertices=400).mesh
        assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=0.01)
    with pytest.raises(ValueError, match="poses must be one per scan; there are 3 for 2 scans"):
        sm.reconstruct([front, back], poses=[np.eye(4)] * 3)
    mesh = sm.reconstruct(ball, vertices=400).mesh
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=0.02)


def test_an_interrupt_while_measuring_keeps_the_model():
    def impatient(share, message):
        if message == "measuring":
            raise KeyboardInterrupt

    model = sm.reconstruct(sm.sphere(12).vertices, vertices=300, progress=impatient)
    assert model.interrupted
    assert model.tangled == 0
    assert np.isnan(model.distance.mesh_to_data.rms)
    assert_allclose(np.linalg.norm(model.mesh.vertices, axis=1), 1, atol=0.01)


def test_a_fold_is_smoothed_away_and_the_rest_stays():
    ball = sm.sphere(8)
    vertices = np.array(ball.vertices)
    pushed = np.linalg.norm(vertices - [0, 0, 1], axis=1) < 0.15
    vertices[pushed] -= [0, 0, 2.3]  # through the opposite side
    torn = ball.moved(vertices)
    assert tangled_vertices(torn).sum() > 5

    class Sphere:
        def gap(self, vertices, normals, reach):
            gap = 1 - np.linalg.norm(vertices, axis=1)
            return np.where(np.abs(gap) < reach, gap, np.nan)

    mended, left = untangled(torn, Sphere(), reach=0.3)
    assert left == 0
    assert mended.check(self_intersections=True).ok
    far = np.linalg.norm(ball.vertices - [0, 0, 1], axis=1) > 1.2
    far &= np.linalg.norm(ball.vertices - [0, 0, -1], axis=1) > 1.2
    assert_array_equal(mended.vertices[far], ball.vertices[far])
