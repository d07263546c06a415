"""Signatures: what they are made of, that they are the object's own, and their files."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.recognition.sai.sphere_domain import mobius_map, sphere_domain
from simplexmesh.recognition.sai.sphere_fitting import centered, vertex_areas
from tests.nightly.marks import nightly
from tests.recognition import reference as reference


@pytest.fixture(scope="module")
def body():
    return reference.lumpy()


@pytest.fixture(scope="module")
def signature(body):
    return sm.sai(body, frequency=7)


class TestSignature:
    def test_is_a_sphere_at_rest_on_the_object(self, body, signature):
        assert signature.angles.shape == (980,)
        assert np.array_equal(signature.mesh.connectivity.twin, sm.sphere(7).connectivity.twin)
        assert signature.distance.max() < 0.06 * np.ptp(body.vertices)
        assert signature.area == pytest.approx(body.area, rel=0.03)
        assert not signature.hidden.any()
        assert signature.visible_fraction == pytest.approx(1)
        assert signature.visible_area == pytest.approx(signature.area)

    def test_metric_parameters_are_nearly_a_third(self, signature):
        assert np.median(np.abs(signature.mesh.metric - 1 / 3)) < 0.02

    def test_area_is_balanced_on_the_sphere(self, signature):
        areas = vertex_areas(signature.mesh)
        assert np.linalg.norm(areas @ signature.directions / areas.sum()) < 0.03

    def test_angles_are_those_of_the_mesh(self, signature):
        assert np.array_equal(signature.angles, signature.mesh.simplex_angle)

    def test_what_is_visible_is_told_by_area(self, body):
        here = sphere_domain(5)
        direction = np.array([0.6, 0.0, 0.8])
        hidden = here.vertices @ direction < 0.3
        slid = here.mesh.moved(mobius_map(here.vertices, np.array([0.3, -0.2, 0.1])) * [2, 1, 1])
        one = sm.SAI(5, slid, hidden)
        assert one.visible_fraction == pytest.approx(here.cell_areas[~hidden].sum() / (4 * np.pi))
        areas = vertex_areas(slid)
        assert one.visible_area == pytest.approx(slid.area * areas[~hidden].sum() / areas.sum())
        assert one.center @ direction > np.cos(np.radians(3))
        assert np.array_equal(sm.SAI(5, slid).center, [1, 0, 0])

    def test_any_kind_of_data_gives_the_same(self, body, signature):
        triangles = body.triangulated()
        cloud = triangles.sampled(6000, rng=1)
        for data in (triangles, cloud, [cloud.points[:3000], cloud.points[3000:]]):
            other = sm.sai(data, frequency=7)
            (found, *_) = sm.match(other, signature)
            assert found.distance < 0.06
            assert reference.angle(found.T_target_source[:3, :3], np.eye(3)) < 1.5

    def test_a_volume(self):
        at = np.stack(np.meshgrid(*[np.arange(-14.0, 15.0)] * 3, indexing="ij"), axis=-1)
        field = 1 - np.sqrt(((at / [12.0, 9.0, 7.0]) ** 2).sum(axis=-1)) + 0.05 * at[..., 0] * at[..., 1] / 81
        volume = sm.Volume(field, origin=(-14, -14, -14))
        found = sm.sai(volume, frequency=5, level=0.0)
        labels = sm.sai(sm.Volume((field > 0).astype(np.uint8), origin=(-14, -14, -14)), frequency=5, label=1)
        assert labels.area == pytest.approx(found.area, rel=0.05)
        assert sm.match(labels, found)[0].distance < 0.1


class TestInvariance:
    @pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
    def test_to_pose_size_and_sampling(self, body, signature, seed):
        rng = np.random.default_rng(seed)
        R, t, size = reference.random_rotation(rng), rng.normal(size=3) * 10, rng.uniform(0.01, 100)
        points = body.triangulated().sampled(8000, rng=rng).points
        other = sm.sai(size * (points @ R.T + t), frequency=7)
        with pytest.warns(sm.SimplexMeshWarning, match="times as large as source in the best match"):
            (found, second, *_) = sm.match(signature, other)
        assert found.distance < 0.5 * second.distance
        shrunk = sm.SAI(7, other.mesh.moved(other.mesh.vertices / size), other.hidden)
        found = sm.match(signature, shrunk)[0]
        assert reference.angle(found.T_target_source[:3, :3], R) < 1.5
        assert np.allclose(found.T_target_source[:3, :3] @ [0, 0, 0] + found.T_target_source[:3, 3], t, atol=0.05)

    def test_centering_forgets_where_the_motion_began(self):
        here = sphere_domain(7)
        egg = here.mesh.moved(here.vertices * [1.3, 1.0, 0.8])
        slid = mobius_map(here.vertices, np.array([0.2, 0.1, -0.15]))
        other = here.mesh.moved(here.interpolated(egg.vertices, here.locate(slid)))
        one, two = centered(egg, 7, 7), centered(other, 7, 7)
        assert np.linalg.norm(one.vertices - two.vertices, axis=1).max() < 0.05  # chords lie below
        assert np.linalg.norm(egg.vertices - other.vertices, axis=1).max() > 0.2

    @pytest.mark.parametrize("slide", [(0.5, 0.3, -0.2), (-0.1, 0.6, 0.3)])
    def test_centering_balances_what_was_far_out_of_balance(self, slide):
        here = sphere_domain(7)
        mesh = here.mesh.moved(mobius_map(here.vertices * 1.0, np.array(slide)) * [1.5, 1.2, 0.7])
        found = centered(mesh, 7, 7)
        areas = vertex_areas(found)
        assert np.linalg.norm(areas @ here.vertices / areas.sum()) < 0.02


class TestHidden:
    def test_films_are_taut_only_where_they_bulge_the_wrong_way(self, body, monkeypatch):
        from simplexmesh.recognition.sai import sphere_fitting

        seen = []

        class Watched(sphere_fitting.DeformableModel):
            def step(self):
                gaps = super().step()
                free, codes = np.isnan(gaps), np.asarray(self.constraint)
                seen.append(
                    (
                        int((codes[~free] == sphere_fitting.ORIENTATION).sum()),
                        int((codes[free] == sphere_fitting.CURVATURE).sum()),
                    )
                )
                return gaps

        monkeypatch.setattr(sphere_fitting, "DeformableModel", Watched)
        cloud = body.triangulated().sampled(6000, rng=0).points
        sm.sai(cloud[cloud[:, 2] > 0.1], frequency=5)
        taut, smooth = np.array(seen)[-200:].T
        assert np.median(taut) <= 5
        assert np.median(smooth) > 20  # a film that is not hollow goes on smoothly

    def test_the_threshold_is_by_samples_or_by_edges(self):
        from simplexmesh.motion.model.state import mean_edge
        from simplexmesh.recognition.sai.sai import visibility_threshold

        edge = mean_edge(sphere_domain(5).mesh)
        for spacing in (0.01, 1.0):
            grid = np.arange(20) * spacing
            points = np.stack([*(each.ravel() for each in np.meshgrid(grid, grid)), np.zeros(400)], axis=1)
            found = visibility_threshold(points, cKDTree(points), sphere_domain(5).mesh)
            corner = 3 * spacing * np.array([1.0, np.sqrt(2), 2.0])  # to the fourth neighbor; farther on borders
            assert found == pytest.approx(0.75 * edge) if spacing < edge / 8 else np.isclose(found, corner).any()

    def test_one_view_labels_what_it_did_not_see(self, body):
        triangles = body.triangulated()
        cloud = triangles.sampled(12000, rng=0)
        front = cloud.points[cloud.points[:, 2] > 0.1]
        view = sm.sai(front, frequency=7)
        behind = view.mesh.vertices[:, 2] < -0.1
        assert view.hidden[behind].all() or not behind.any()
        assert 0.3 < view.visible_fraction < 0.95
        assert 0 < view.visible_area < view.area
        near = view.mesh.vertices[~view.hidden]
        assert (near[:, 2] > -0.2).all()

    def test_a_threshold_of_ones_own(self, body):
        points = body.triangulated().sampled(3000, rng=0).points
        all_seen, few = sm.sai(points, 5, tolerance=10.0), sm.sai(points, 5, tolerance=0.035)
        assert not all_seen.hidden.any()
        assert np.array_equal(few.hidden, few.distance > 0.035)


class TestFiles:
    def test_come_back_as_they_were(self, signature, tmp_path):
        hidden = signature.directions[:, 0] > 0.5
        one = sm.SAI(7, signature.mesh, hidden, signature.distance, 0.25)
        one.save(tmp_path / "one.npz")
        other = sm.SAI.load(tmp_path / "one.npz")
        assert other.frequency == 7
        assert np.array_equal(other.mesh.vertices, one.mesh.vertices)
        assert np.array_equal(other.hidden, hidden)
        assert np.array_equal(other.distance, one.distance)
        assert other.threshold == 0.25
        assert [path.name for path in tmp_path.iterdir()] == ["one.npz"]

    @pytest.mark.parametrize("keep", [0, 3, 100, 5000, -1, -100])
    def test_cut_short(self, signature, tmp_path, keep):
        signature.save(tmp_path / "one.npz")
        whole = (tmp_path / "one.npz").read_bytes()
        (tmp_path / "one.npz").write_bytes(whole[:keep])
        with pytest.raises(OSError, match=r"one\.npz is not a whole signature written by SAI\.save"):
            sm.SAI.load(tmp_path / "one.npz")

    def test_damaged_inside(self, signature, tmp_path):
        signature.save(tmp_path / "one.npz")
        whole = bytearray((tmp_path / "one.npz").read_bytes())
        whole[len(whole) // 2] ^= 0xFF
        (tmp_path / "one.npz").write_bytes(whole)
        with pytest.raises(OSError, match=r"one\.npz is not a whole signature"):
            sm.SAI.load(tmp_path / "one.npz")

    def test_something_else(self, tmp_path):
        np.savez(tmp_path / "other.npz", vertices=np.zeros(3))
        (tmp_path / "text.npz").write_text("not a signature")
        for name in ("other.npz", "text.npz"):
            with pytest.raises(OSError, match="is not a whole signature"):
                sm.SAI.load(tmp_path / name)

    def test_absent_file_and_folder(self, signature, tmp_path):
        with pytest.raises(FileNotFoundError, match="there is no file"):
            sm.SAI.load(tmp_path / "absent.npz")
        with pytest.raises(FileNotFoundError, match="path must be in an existing folder"):
            signature.save(tmp_path / "absent" / "one.npz")

    def test_a_failed_write_leaves_the_old_file(self, signature, tmp_path, monkeypatch):
        signature.save(tmp_path / "one.npz")
        before = (tmp_path / "one.npz").read_bytes()
        monkeypatch.setattr(np, "savez_compressed", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
        with pytest.raises(OSError, match="disk full"):
            signature.save(tmp_path / "one.npz")
        assert (tmp_path / "one.npz").read_bytes() == before
        assert len(list(tmp_path.iterdir())) == 1


class TestDoor:
    @pytest.mark.parametrize("frequency", [4, 13, 0])
    def test_frequency_out_of_range(self, frequency):
        with pytest.raises(ValueError, match=f"frequency must be at .* not {frequency}"):
            sm.sai(np.zeros((200, 3)), frequency)

    def test_too_small(self):
        points = np.random.default_rng(0).normal(size=(30, 3))
        with pytest.raises(ValueError, match="data must hold at least 100 points to carry a signature, not 30"):
            sm.sai(points)

    def test_flat(self):
        points = np.random.default_rng(0).normal(size=(300, 3)) * [1, 1, 0] + [0, 0, 5]
        with pytest.raises(ValueError, match="its points lie in a plane"):
            sm.sai(points)

    def test_level_for_points(self):
        with pytest.raises(ValueError, match="level and label are for volumes"):
            sm.sai(np.random.default_rng(0).normal(size=(300, 3)), level=1.0)

    def test_mesh_of_another_connectivity(self):
        with pytest.raises(ValueError, match="mesh must have the connectivity of the sphere of frequency 5"):
            sm.SAI(5, sm.torus())
        with pytest.raises(TypeError, match="mesh must be a SimplexMesh, not ndarray"):
            sm.SAI(5, np.zeros((500, 3)))

    @pytest.mark.parametrize("hidden", [np.zeros(3, bool), np.zeros(500), np.zeros((500, 1), bool)])
    def test_hidden_of_another_shape(self, hidden):
        with pytest.raises(ValueError, match="hidden must be 500 booleans"):
            sm.SAI(5, sm.sphere(5), hidden)

    @pytest.mark.parametrize("apart", [2.1, *nightly(3.0)])
    def test_that_data_is_not_in_the_signature_is_told(self, apart):
        """Two balls had the signature of something between them."""
        ball = sm.sphere(12).triangulated("dual")
        both = np.concatenate([ball.vertices, ball.vertices + np.array([apart, 0, 0])])
        with pytest.warns(sm.SimplexMeshWarning, match=r"^[1-6]\d% of the data is far from the sphere fitted to it"):
            sm.sai((both, np.concatenate([ball.faces, ball.faces + ball.n_vertices])))


class TestPicture:
    def test_radius_is_pi_and_the_angle(self, signature):
        hidden = signature.directions[:, 2] > 0.7
        one = sm.SAI(7, signature.mesh, hidden)
        plotter = sm.plot.signature(one, fitted=True, view="xy", title="lumps")
        things = [each.mapper.dataset for each in plotter.renderers[1].actors.values() if hasattr(each, "mapper")]
        shown = max(things, key=lambda each: each.n_points)
        radius = np.linalg.norm(shown.points[: one.n_vertices], axis=1)
        assert np.allclose(radius, np.pi + np.where(hidden, 0, one.angles), atol=1e-5)
        plotter.close()

    def test_of_something_else(self):
        with pytest.raises(TypeError, match="sai must be an SAI"):
            sm.plot.signature(sm.sphere(5))


def test_a_phase_does_no_more_iterations_than_it_has(monkeypatch):
    from simplexmesh.recognition.sai import sphere_fitting

    steps = []
    step = sphere_fitting.DeformableModel.step
    monkeypatch.setattr(sphere_fitting.DeformableModel, "step", lambda model: [steps.append(model), step(model)][1])
    mesh, target = sphere_domain(3).mesh, sm.targets.Triangles(sm.sphere(6, radius=1.3).triangulated())
    box = sphere_fitting.Box.around(mesh.vertices)
    sphere_fitting._run_phase(mesh, 3, target, sphere_fitting.Phase(1, 1.0, 23, 0.2, 0.6, 0.0), box, 3)
    assert len(steps) == 23


class TestFilms:
    def test_that_come_loose_are_not_kept(self, body, monkeypatch):
        from simplexmesh.recognition.sai import sphere_fitting

        moved, after = sphere_fitting._run_phase, []

        def loosened(mesh, *rest):
            after.append(moved(mesh, *rest))
            return after[-1].moved(after[-1].vertices * (2.0 if len(after) > 6 else 1.0))

        monkeypatch.setattr(sphere_fitting, "_run_phase", loosened)
        found = sm.sai(body, frequency=5)
        assert np.array_equal(found.mesh.vertices, after[5].vertices)

    def test_are_taut_outside_of_the_data(self):
        from simplexmesh.recognition.sai.sphere_fitting import Box

        points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)) * [3, 2, 1]
        R = reference.random_rotation(np.random.default_rng(1))
        box = Box.around(points @ R.T + [5, 0, 0])
        probes = np.array([[0, 0, 0], [2.7, 1.7, 0.8], [3.3, 0, 0], [0, 2.3, 0], [0, 0, -1.2]])
        assert box.outside(probes @ R.T + [5, 0, 0]).tolist() == [False, False, True, True, True]
