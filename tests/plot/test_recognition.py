"""Plots of recognition: peaks where signatures agree, positions after a motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.plot.signature import HIGH
from simplexmesh.recognition.sai.distance_maps import NODES, around_rotation, over_patch, over_sphere, rotation_plane
from simplexmesh.recognition.sai.flat_domains import domain
from simplexmesh.recognition.sai.match_result import Match
from simplexmesh.recognition.sai.rotations import rotations
from simplexmesh.recognition.sai.sphere_domain import sphere_domain
from tests.recognition import reference as reference


def signature(seed=0, hidden=None):
    body = reference.lumpy(5, seed)
    return sm.SAI(5, body, hidden)


def drawn(renderer):
    """The points of everything drawn in a panel, the largest first."""
    things = [each.mapper.dataset for each in renderer.actors.values() if getattr(each, "mapper", None)]
    return [np.asarray(each.points) for each in sorted(things, key=lambda each: -each.n_points)]


class TestNumbers:
    def test_the_least_distance_is_where_the_pole_goes(self):
        g = 17
        table, one = rotations(5), signature()
        other = sm.SAI(5, one.mesh.moved(one.mesh.vertices[table.turns[g]]))  # phi_b(p) = phi_a(R p)
        pole = sphere_domain(5).vertices[123]
        values = over_sphere(one, other, pole)
        assert values.shape == (len(sphere_domain(NODES).vertices),)
        assert sphere_domain(NODES).vertices[values.argmin()] @ (table.group[g] @ pole) > np.cos(np.radians(8))

    def test_of_parts_only_what_both_show_is_compared(self):
        whole, half = signature(), signature(hidden=sphere_domain(5).vertices[:, 0] > 0.2)
        values = over_sphere(whole, half, np.array([0, 0, 1.0]))
        assert np.isfinite(values).all()
        assert around_rotation(whole, half, np.eye(3), np.zeros((1, 3)))[0] < 0.5 * np.median(values)

    def test_nearly_complete_signatures_are_compared_as_in_match(self):
        one, other = signature(), signature(hidden=np.arange(500) == 7)
        found = sm.match(other, one)[0]
        assert not found.scaled
        assert around_rotation(one, other, found.rotation, np.zeros((1, 3)))[0] == pytest.approx(
            found.distance, abs=1e-9
        )

    def test_parts_are_scaled_as_in_match(self):
        one, other = signature(), signature(hidden=sphere_domain(5).vertices[:, 0] > 0.2)
        found = sm.match(other, one, scale=1.0)[0]
        assert found.scaled == "source"
        distance = around_rotation(one, other, found.rotation, np.zeros((1, 3)))[0]
        assert distance == pytest.approx(found.distance, abs=1e-9)

    def test_around_is_the_plain_distance(self):
        one, other = signature(), signature(1)
        R = reference.random_rotation(np.random.default_rng(0))
        vectors = np.random.default_rng(1).normal(size=(4, 3))
        found = around_rotation(one, other, R, vectors)
        a, b = (np.clip(reference.smooth(each.angles, each.mesh.neighbors, 2), -0.3, 0.3) for each in (one, other))
        for value, turn in zip(found, Rotation.from_rotvec(vectors).as_matrix(), strict=True):
            assert value**2 == pytest.approx(reference.distance(5, a, b, turn @ R), rel=1e-6)

    def test_the_plane_holds_the_first_three(self):
        nothing = np.zeros((0, 3))
        turns = Rotation.from_rotvec(np.array([[0.1, 0.2, 0.3], [1, 0, 0.5], [0, 2, 0.1]])).as_matrix()
        found = [Match(R, 0.0, 1.0, 1.0, "", nothing, nothing, nothing, nothing, nothing) for R in turns]
        axes = rotation_plane(found)
        assert np.allclose(axes @ axes.T, np.eye(2))
        for R in turns[1:]:
            w = Rotation.from_matrix(R @ turns[0].T).as_rotvec()
            assert np.linalg.norm(axes @ w) == pytest.approx(np.linalg.norm(w))
        assert rotation_plane(found[:1]).shape == (2, 3)

    def test_over_a_torus_it_is_least_at_the_shift(self):
        patch = domain("torus", 5)
        at = patch.coordinates * 2 * np.pi
        mesh = patch.mesh.moved(patch.vertices * (1 + 0.1 * np.cos(at[:, :1]) + 0.05 * np.sin(2 * at[:, :1] + 1)))
        one = sm.SAI(5, mesh, topology="torus")
        values = over_patch(one, one)
        x, y = (patch.coordinates[values.argmin()] + 0.5) % 1 - 0.5
        assert max(abs(x), abs(y)) < 0.06
        assert values.min() < 0.2 * values.max()


class TestLandscape:
    def test_peaks_are_as_high_as_signatures_are_near(self):
        one, other = signature(), signature(1)
        with pytest.warns(sm.SimplexMeshWarning, match="times as large as source"):
            found = sm.match(other, one, best=2)
        plotter = sm.plot.landscape(other, one, found=found, title="two bodies")
        hills, *balls = drawn(plotter.renderers[0])
        assert np.linalg.norm(hills, axis=1).max() <= 1 + HIGH
        assert len(balls) == len(found)
        relief, *balls = drawn(plotter.renderers[1])
        top = relief[np.linalg.norm(relief[:, :2], axis=1).argmin()]
        assert top[2] == pytest.approx(relief[:, 2].max(), abs=0.01)
        assert np.linalg.norm(balls[0].mean(axis=0) - top) < 0.1
        plotter.close()

    @pytest.mark.parametrize("topology", ["torus", "cylinder", "plane"])
    def test_of_other_topologies(self, topology):
        one = sm.SAI(5, domain(topology, 5).mesh, topology=topology)
        plotter = sm.plot.landscape(one, one, title="shifts")
        assert len(drawn(plotter.renderer)[0]) > one.n_vertices
        plotter.close()

    def test_of_two_topologies(self):
        ring = sm.SAI(5, domain("torus", 5).mesh, topology="torus")
        found = sm.match(signature(), signature())
        for pair, said in (((ring, signature()), "torus, not sphere"), ((signature(), ring), "sphere, not torus")):
            with pytest.raises(ValueError, match=f"target must have the topology of source, {said}"):
                sm.plot.landscape(*pair, found=found)

    def test_without_hypotheses(self):
        with pytest.raises(ValueError, match="found must hold at least one hypothesis"):
            sm.plot.landscape(signature(), signature(), found=[])


class TestOverlay:
    @pytest.mark.parametrize("kind", ["mesh", "triangles", "points", "disks"])
    def test_the_source_is_moved_on_the_right_only(self, kind):
        body = reference.lumpy(5)
        things = {"mesh": body, "triangles": body.triangulated(), "points": body.vertices,
                  "disks": sm.PointCloud(body.vertices, body.normals)}  # fmt: skip
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = reference.random_rotation(np.random.default_rng(0)), [0.2, 0.1, 0]
        plotter = sm.plot.overlay(things[kind], body, T, titles=("as it came", "as it lies"))
        panels = [drawn(each) for each in plotter.renderers]
        pairs = [(source, moved) for source in panels[0] for moved in panels[1] if source.shape == moved.shape]
        assert any(np.allclose(source @ T[:3, :3].T + T[:3, 3], moved, atol=1e-5) for source, moved in pairs)
        plotter.close()

    def test_a_source_far_away_is_fetched_before(self):
        body = sm.ellipsoid((3, 2, 1), 5)
        away = body.moved(body.vertices + np.array([100.0, 0, 0]))
        plotter = sm.plot.overlay(away, body, np.eye(4))
        left, right = (max(np.abs(points).max() for points in drawn(each)) for each in plotter.renderers)
        assert left < 4
        assert right > 90
        plotter.close()

    def test_a_motion_that_is_none(self):
        with pytest.raises(ValueError, match="T_target_source must"):
            sm.plot.overlay(sm.sphere(4), sm.sphere(4), np.eye(3))
