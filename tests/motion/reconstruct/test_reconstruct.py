"""Reconstruction in one call: topology, accuracy, coordinates, budgets, interruption, invalid input."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.motion.start.grid_crossings import outer_crossings
from simplexmesh.motion.targets.triangles import surface_distance
from tests.nightly.marks import nightly


def torus_distance(points, ring=1.0, tube=0.35):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - ring, points[:, 2]) - tube


def torus_points(count, rng, noise=0.0):
    """Area-uniform points of the torus R = 1, r = 0.35; noise relative to the diagonal of its box."""
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
    assert model.distance.data_to_mesh.rms < 0.1  # the sagitta of flat faces
    assert model.converged
    assert model.tangled == 0
    assert model.mesh.volume > 0


def test_the_mesh_is_in_the_coordinates_of_the_file():
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


@pytest.mark.parametrize(("inside", "init"), [("below", "auto"), ("above", "sphere")])
def test_a_constant_added_to_values_and_level_does_not_matter(inside, init):
    volume = ball_volume(origin=(-11, -11, -11))
    values = volume.values if inside == "above" else -volume.values
    high = sm.Volume(values.astype(float) + 1e8, origin=(-11, -11, -11))
    mesh = sm.reconstruct(high, level=1e8, vertices=400, inside=inside, init=init).mesh
    assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 8.3, atol=0.05)


def test_a_mask_gives_a_smooth_ball_of_the_right_size():
    values = (ball_volume().values > 0).astype(np.uint8)
    model = sm.reconstruct(sm.Volume(values, origin=(-11, -11, -11)), vertices=800)
    radius = np.linalg.norm(model.mesh.vertices, axis=1)
    assert abs(radius.mean() - 8.3) < 0.05
    assert radius.std() < 0.08  # the voxels' corners scatter by 0.3


def test_noise_is_removed_from_points_of_which_nothing_is_known(noisy_torus):
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


@pytest.mark.parametrize("vertices", [20, *nightly(23)])
def test_the_smallest_budgets_suffice_for_a_primitive(vertices):
    model = sm.reconstruct(sm.sphere(16).vertices, init="sphere", vertices=vertices, creases="none")
    assert model.mesh.n_vertices <= vertices


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


def test_components_are_kept_or_dropped():
    two = np.concatenate([sm.sphere(12).vertices, sm.sphere(10, radius=0.8, center=(3, 0, 0)).vertices])
    with pytest.warns(sm.SimplexMeshWarning, match=r"4\d% of the data is far from the model, .*; components='all'"):
        assert sm.reconstruct(two, vertices=600).mesh.n_components == 1
    both = sm.reconstruct(two, vertices=600, components="all").mesh
    assert both.n_components == 2
    assert both.genus == 0


@pytest.mark.parametrize("kind", [*nightly("triangles"), "points"])
def test_an_inner_wall_is_told_of(kind):
    outer, inner = sm.sphere(14).triangulated(), sm.sphere(14).triangulated().scaled(0.82)
    n = len(outer.vertices)
    hollow = sm.TriangleMesh(np.r_[outer.vertices, inner.vertices], np.r_[outer.faces, inner.faces + n])
    data = hollow if kind == "triangles" else hollow.sampled(12_000, rng=1).points
    with pytest.warns(sm.SimplexMeshWarning, match=r"(39|4\d)% of the data is inside of"):  # 0.67 / 1.67
        model = sm.reconstruct(data, vertices=600)
    assert model.mesh.volume == pytest.approx(outer.volume, rel=0.03)
    assert model.creases == ()


@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_points_on_a_line_are_refused(shift):
    line = np.random.default_rng(0).normal(size=(500, 1)) * [1.0, 2.0, -0.5] + shift
    with pytest.raises(ValueError, match="those given lie on a line"):
        sm.reconstruct(line)


def test_tunnels_below_the_given_width_are_sealed():
    axis = np.arange(-14, 15.0)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    drilled = np.minimum(11.3 - np.sqrt(x * x + y * y + z * z), np.hypot(x, y) - 3.2)
    volume = sm.Volume(drilled, spacing=0.5)
    for tunnels, genus in ((None, 1), (0.0, 1), (2.0, 1), (5.0, 0)):
        model = sm.reconstruct(volume, level=0.0, vertices=500, tunnels=tunnels)
        assert model.mesh.genus == genus
        assert model.found.tunnels_removed == 1 - genus


@pytest.mark.parametrize("init", [*nightly("sphere"), "ellipsoid"])
def test_closed_primitives_find_a_body_from_outside(init):
    x, y, z = np.meshgrid(*[np.arange(-16, 17.0)] * 3, indexing="ij")
    egg = sm.Volume(1 - np.sqrt((x / 12) ** 2 + (y / 9) ** 2 + (z / 7) ** 2), origin=(-16, -16, -16))
    model = sm.reconstruct(egg, level=0.0, init=init, vertices=1000)
    assert model.mesh.check(self_intersections=True).ok
    assert_allclose(np.sqrt(((model.mesh.vertices / [12, 9, 7]) ** 2).sum(axis=1)), 1, atol=0.03)
    assert abs(model.mesh.n_vertices - 1000) <= 100


def test_a_torus_finds_a_torus_and_a_mesh_keeps_its_topology(tmp_path):
    points = torus_points(8000, np.random.default_rng(7))
    model = sm.reconstruct(points, init="torus", vertices=1500, creases="none")
    assert model.mesh.genus == 1
    assert np.abs(torus_distance(model.mesh.vertices)).mean() < 0.003
    model.start.save(tmp_path / "start.vtp")
    again = sm.reconstruct(points, init=tmp_path / "start.vtp", creases="none")
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

    with pytest.warns(sm.SimplexMeshWarning, match="interrupted"):
        model = sm.reconstruct(torus_points(2000, np.random.default_rng(9)), vertices=300, progress=impatient)
    assert model.interrupted
    assert not model.converged
    assert 0 < len(model.history) < 300
    assert np.isfinite(model.mesh.vertices).all()
    assert "interrupted" in repr(model)


def test_the_distances_of_a_volume_count_all_that_the_background_reaches():
    """A ball with a well: a sphere around it that does not move misses the walls of the well, with a warning."""
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


def test_an_interrupt_while_measuring_keeps_the_model():
    def impatient(share, message):
        if message == "measuring":
            raise KeyboardInterrupt

    with pytest.warns(sm.SimplexMeshWarning, match="interrupted"):
        model = sm.reconstruct(sm.sphere(12).vertices, vertices=300, progress=impatient)
    assert model.interrupted
    assert model.tangled == 0
    assert np.isnan(model.distance.mesh_to_data.rms)
    assert_allclose(np.linalg.norm(model.mesh.vertices, axis=1), 1, atol=0.01)


def test_an_interrupt_between_stages_keeps_the_last_one(monkeypatch):
    made = []

    class Impatient(sm.DeformableModel):
        def __init__(self, *arguments, **options):
            made.append(arguments[0])
            if len(made) == 2:
                raise KeyboardInterrupt
            super().__init__(*arguments, **options)

    monkeypatch.setattr("simplexmesh.motion.reconstruct.run.DeformableModel", Impatient)
    with pytest.warns(sm.SimplexMeshWarning, match="interrupted"):
        model = sm.reconstruct(sm.sphere(12).vertices, vertices=300)
    assert model.interrupted
    assert_array_equal(model.mesh.vertices, made[1].vertices)


BOX = pv.Box((-1, 1, -0.7, 0.7, -0.5, 0.5)).triangulate().subdivide(3)


@pytest.fixture(scope="module")
def adaptive():
    return sm.reconstruct(BOX, vertices=600, creases="none")


@pytest.fixture(scope="module")
def even():
    return sm.reconstruct(BOX, vertices=600, placement="even", creases="none")


class TestPlacement:
    """Redistribution on a box: vertices concentrate at edges and corners."""

    def test_is_adaptive_by_default_and_a_quarter_nearer_with_no_more_vertices(self, adaptive, even):
        points = sm.TriangleMesh(np.array(BOX.points, float), BOX.regular_faces).sampled(20_000, rng=0).points
        rms = []
        for model in (even, adaptive):
            surface = model.mesh.triangulated(method="fan")
            rms.append(np.sqrt((surface_distance(points, surface.vertices, surface.faces) ** 2).mean()))
        assert adaptive.mesh.n_vertices <= even.mesh.n_vertices
        assert rms[1] < 0.75 * rms[0]

    def test_keeps_the_mesh_valid(self, adaptive):
        mesh = adaptive.mesh
        assert mesh.check(self_intersections=True).ok
        assert (mesh.genus, mesh.n_holes, adaptive.tangled) == (0, 0, 0)

    def test_is_reported(self, adaptive):
        record = adaptive.topology
        sizes = adaptive.mesh.connectivity.face_sizes
        assert record.exchanged > 10
        assert record.swapped > 10
        assert record.exceptions == tuple(np.flatnonzero((sizes < 5) | (sizes > 7)))
        assert len(record.exceptions) <= 0.02 * len(sizes)

    def test_even_keeps_the_faces_of_the_start_and_spaces_vertices_evenly(self, even):
        assert_array_equal(even.mesh.neighbors, even.start.neighbors)
        assert (even.topology.exchanged, even.topology.swapped) == (0, 0)
        model = sm.reconstruct(BOX, vertices=600, adaptation=0.0, creases="none")
        assert_array_equal(model.mesh.vertices, even.mesh.vertices)

    def test_faces_of_a_given_start_are_kept_by_default(self, even):
        start = even.mesh
        assert_array_equal(sm.reconstruct(BOX, init=start, creases="none").mesh.neighbors, start.neighbors)
        asked = sm.reconstruct(BOX, init=start, placement="adaptive", creases="none")
        assert asked.topology.exchanged > 10
        assert asked.mesh.n_vertices == start.n_vertices

    def test_works_from_a_sphere_and_counts_all_swaps(self):
        model = sm.reconstruct(BOX, init="sphere", vertices=600, handles="none", holes="none", creases="none")
        assert model.topology.refined > 0
        assert model.topology.exchanged > 0
        assert model.mesh.check(self_intersections=True).ok

    def test_without_iterations_nothing_is_exchanged(self):
        assert sm.reconstruct(BOX, vertices=600, iterations=0).topology.exchanged == 0

    def test_an_interrupt_keeps_a_whole_state(self):
        def impatient(share, message):
            if share > 0.1 + 0.8 * 0.8:
                raise KeyboardInterrupt

        with pytest.warns(sm.SimplexMeshWarning, match="interrupted"):
            model = sm.reconstruct(BOX, vertices=600, creases="none", progress=impatient)
        assert model.interrupted
        assert model.topology.exchanged > 0
        assert model.mesh.check().ok

    def test_an_interrupt_counts_the_vertices_added_until_then(self):
        def impatient(share, message):
            if share > 0.1 + 0.8 * 0.5:
                raise KeyboardInterrupt

        options = {"init": "sphere", "vertices": 1500, "handles": "none", "holes": "none", "progress": impatient}
        with pytest.warns(sm.SimplexMeshWarning, match="interrupted"):
            model = sm.reconstruct(BOX, **options)
        assert model.interrupted
        assert model.topology.refined == model.mesh.n_vertices - model.start.n_vertices > 0

    def test_of_another_name_is_refused(self):
        with pytest.raises(ValueError, match=r"^placement must be .*adaptive.*even.*odd"):
            sm.reconstruct(BOX, placement="odd")


def test_the_bar_moves_while_a_sphere_is_wrapped_around_closed_data():
    shares = []
    points = torus_points(3000, np.random.default_rng(9))
    sm.reconstruct(points, init="sphere", vertices=700, progress=lambda share, _: shares.append(share))
    assert shares == sorted(shares)
    wrapping = {share for share in shares if 0.1 < share < 0.3}
    assert len(wrapping) > 10
