"""Tunnels detected in points and volumes, and starts that enclose the data."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion import films
from simplexmesh.motion.initial.primitives import primitive_around
from simplexmesh.motion.missing_topology import with_missing_tunnels
from simplexmesh.motion.rim import Rim
from simplexmesh.motion.sampling import closed_samples
from simplexmesh.motion.shell import shell_of
from simplexmesh.motion.subjects import as_subject
from simplexmesh.motion.tunnel_homology import TunnelHomology

PLAIN = {"level": None, "label": None, "inside": "above", "components": "largest"}


def frame_of_a_cube(step=0.05):
    """Return points on the frame of a cube, its twelve bars square and a fifth of its side wide."""
    grid = np.arange(-0.5 + step / 2, 0.5, step)
    cells = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1)
    solid = (np.abs(cells) > 0.3).sum(axis=-1) >= 2
    out = []
    for axis in range(3):
        for side in (-1, 1):
            shift = np.zeros(3)
            shift[axis] = side * step / 2
            bare = solid & ~np.roll(np.pad(solid, 1), -side, axis=axis)[1:-1, 1:-1, 1:-1]
            out.append(cells[bare] + shift)
    return np.concatenate(out)


def torus(count, tube, noise=0.0):
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 3 * count))
    kept = np.flatnonzero(rng.uniform(size=3 * count) < (1 + tube * np.cos(v)) / (1 + tube))[:count]
    away = 1 + tube * np.cos(v[kept])
    points = np.stack([away * np.cos(u[kept]), away * np.sin(u[kept]), tube * np.sin(v[kept])], axis=1)
    return points + noise * rng.normal(size=points.shape)


class TestShell:
    @pytest.mark.parametrize(
        ("points", "genus"),
        [
            (sm.sphere(10).vertices, 0),
            (torus(500, 0.35), 1),
            (torus(4000, 0.2, 0.01), 1),
            (frame_of_a_cube(), 5),
            (torus(2000, 0.35) @ np.diag([1, 1, -2.0]) * 1e-4 + 7.0, 1),
        ],
    )
    def test_the_genus_that_stays(self, points, genus):
        shell = shell_of(points)
        surface = sm.TriangleMesh(shell.vertices, shell.faces).topology
        assert (shell.genus, surface.genus, surface.n_borders, surface.n_components) == (genus, genus, 0, 1)

    @pytest.mark.parametrize("count", [1000, 5000])
    def test_the_last_gap_of_a_wall_is_no_tunnel(self, count):
        rng = np.random.default_rng(0)  # 5,000 points of these leave one gap until balls are 1.8 spacings large
        u, v = rng.uniform(0, 2 * np.pi, (2, 2 * count))
        kept = np.flatnonzero(rng.uniform(size=2 * count) < (1 + 0.45 * np.cos(v)) / 1.45)[:count]
        away = 1 + 0.45 * np.cos(v[kept])
        points = np.stack([away * np.cos(u[kept]), away * np.sin(u[kept]), 0.45 * np.sin(v[kept])], axis=1)
        assert shell_of(points).genus == 1

    def test_gaps_as_wide_as_tunnels_give_no_shell(self):
        assert shell_of(torus(60, 0.6)) is None
        assert shell_of(np.zeros((5, 3))) is None

    def test_large_balls_without_tunnels_give_no_shell(self):
        assert shell_of(torus(500, 0.6)) is None
        assert shell_of(torus(500, 0.6)[:, [2, 0, 1]] * 1e3) is None
        assert shell_of(torus(4000, 0.6)).genus == 1

    def test_it_lies_on_the_points_not_around_them(self):
        points = torus(4000, 0.35)
        shell = shell_of(points)
        off = np.abs(np.hypot(np.hypot(*shell.vertices[:, :2].T) - 1, shell.vertices[:, 2]) - 0.35)
        around = np.hypot(np.hypot(*shell.offset_vertices[:, :2].T) - 1, shell.offset_vertices[:, 2]) - 0.35
        assert off.mean() < 0.01
        assert around.mean() == pytest.approx(shell.radius, rel=0.25)

    def test_few_points_lie_on_it(self):
        points = torus(300, 0.4)
        shell = shell_of(points)
        surface = sm.targets.Triangles(sm.TriangleMesh(shell.vertices, shell.faces))
        outward = points - np.stack(
            [*(points[:, :2] / np.hypot(*points[:, :2].T)[:, None]).T, 0 * points[:, 0]], axis=1
        )
        gaps = surface.gap(points, outward / np.linalg.norm(outward, axis=1)[:, None], 0.3)
        assert np.nanmean(np.abs(gaps)) < 0.01
        assert np.isfinite(gaps).mean() > 0.9


class TestKnownTunnels:
    def test_of_points(self):
        samples = closed_samples(as_subject(torus(4000, 0.35), **PLAIN))
        assert (samples.genus, samples.oriented, len(samples.homology.tunnels)) == (1, True, 1)
        (loop,) = samples.homology.tunnels
        assert loop.length == pytest.approx(2 * np.pi * 0.65, rel=0.1)

    def test_of_volumes_are_those_of_their_start(self):
        x, y, z = np.mgrid[-1.6:1.6:33j, -1.6:1.6:33j, -0.8:0.8:17j]
        deep = 0.4 - np.hypot(np.hypot(x, y) - 1.0, z)
        level = as_subject(sm.Volume(deep, spacing=0.1), **{**PLAIN, "level": 0.0})
        labels = as_subject(sm.Volume((deep > 0).astype(np.uint8), spacing=0.1), **PLAIN)
        for subject in (level, labels):
            samples = closed_samples(subject, 1000)
            assert (samples.genus, len(samples.homology.tunnels)) == (1, 1)


class TestFilmsJoined:
    """Six windows of a cavity: five of their loops are independent, and the sum of all six is zero."""

    WINDOWS = (*np.eye(5, dtype=int), -np.ones(5, int))

    def asked(self, joined, monkeypatch, one, other):
        """Return the class of a handle between films whose boundaries are sums of windows."""
        totals = iter([np.sum([self.WINDOWS[k] for k in film], axis=0) for film in (one, other)])
        monkeypatch.setattr(films, "boundary_loops", lambda mesh, film: [np.arange(3)])
        homology = type("Homology", (), {"winding": lambda self, line, edge: next(totals)})()
        flat = type("Flat", (), {"mesh": sm.sphere(3), "near_data": np.ones(200, bool), "edge": 1.0})()
        return joined.handle_class(
            flat, homology, films.FilmPair(np.zeros(0, int), np.zeros(0, int), (one, other), 1.0)
        )

    def test_each_window_is_joined_to_the_others_once(self, monkeypatch):
        joined = films.JoinedFilms()
        for film in range(1, 6):
            found = self.asked(joined, monkeypatch, list(range(film)), [film])
            assert found is not None
            joined.add(*found)
        assert np.linalg.matrix_rank(joined.windings) == 5

    def test_films_that_are_connected_already_are_not(self, monkeypatch):
        joined = films.JoinedFilms()
        joined.add(*self.asked(joined, monkeypatch, [0], [1]))
        joined.add(*self.asked(joined, monkeypatch, [2], [3]))
        for one, other in (([0], [1]), ([0, 1], [0]), ([3], [2, 3])):
            assert self.asked(joined, monkeypatch, one, other) is None
        joined.add(*self.asked(joined, monkeypatch, [1], [2]))
        assert self.asked(joined, monkeypatch, [0], [3]) is None
        assert self.asked(joined, monkeypatch, [0, 1, 2, 3], [4]) is not None

    def test_both_ends_of_a_bore(self, monkeypatch):
        joined = films.JoinedFilms()
        monkeypatch.setattr(self, "WINDOWS", (np.array([1, 0]), np.array([-1, 0])), raising=False)
        joined.add(*self.asked(joined, monkeypatch, [0], [1]))
        assert self.asked(joined, monkeypatch, [0], [1]) is None


def test_tunnels_are_measured_at_their_places():
    mesh = sm.torus(48, 24, tube_radius=0.4).triangulated()
    (loop,) = TunnelHomology(mesh.vertices, mesh.faces, 2 * mesh.vertices + np.array([0, 0, 9.0])).tunnels
    (usual,) = TunnelHomology(mesh.vertices, mesh.faces).tunnels
    assert loop.length == pytest.approx(2 * usual.length)
    assert loop.center[2] == pytest.approx(9.0 + 2 * usual.center[2])


def test_a_sphere_finds_the_handles_of_a_frame():
    model = sm.reconstruct(frame_of_a_cube(), init="sphere", vertices=1500, iterations=60)
    assert (model.mesh.genus, sum(proposal.accepted for proposal in model.topology.handles)) == (5, 5)
    assert model.tangled == 0


def test_no_handles_where_points_show_none():
    dent = sm.sphere(14).vertices
    dent = dent * (1 - 0.6 * np.exp(-8 * (1 - np.abs(dent[:, 2]))))[:, None]
    model = sm.reconstruct(dent, init="sphere", vertices=700, iterations=40)
    assert model.mesh.genus == 0
    assert not any(proposal.accepted for proposal in model.topology.handles)


def test_missing_tunnels_of_points_are_reported():
    samples = closed_samples(as_subject(torus(3000, 0.35), **PLAIN))
    proposals, said = with_missing_tunnels(samples, (), sm.sphere(8))
    assert said.startswith("the points have genus 1, the model has 0; left out: the tunnel of girth ")
    assert [proposal.faces for proposal in proposals] == [(-1, -1)]


def test_the_eight_from_its_bare_vertices(data_folder):
    points = sm.read_triangles(data_folder / "eight.off").vertices
    assert len(points) == 315
    model = sm.reconstruct(points, init="sphere", vertices=1500)
    assert (model.mesh.genus, model.tangled) == (2, 0)
    assert model.distance.data_to_mesh.mean < 0.005 * np.linalg.norm(np.ptp(points, axis=0))


class TestOpenData:
    """A triangulated dome with inward normals: the start defines the outside."""

    def dome(self):
        ball = sm.sphere(16).triangulated()
        kept = (ball.vertices[ball.faces, 2] > -0.1).all(axis=1)
        return sm.TriangleMesh(ball.vertices, ball.faces[kept][:, ::-1])

    @pytest.mark.parametrize("init", ["sphere", "torus", "cylinder"])
    def test_a_start_around_it_ends_right_side_out(self, init):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sm.SimplexMeshWarning)
            mesh = sm.reconstruct(self.dome(), init=init, vertices=200, iterations=20).mesh
        assert ((mesh.normals * mesh.vertices).sum(axis=1) > 0).mean() > 0.9

    def test_a_closed_model_of_it_is_reported(self):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            model = sm.reconstruct(self.dome(), init="sphere", vertices=20, iterations=20)
        assert model.mesh.n_holes == 0
        assert any("but the model is closed" in str(warning.message) for warning in said)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            sm.reconstruct(self.dome(), init="sphere", vertices=20, iterations=20, holes="none")
        assert not any("but the model is closed" in str(warning.message) for warning in said)


class TestTubesCutOffAslant:
    """Points without normals of tubes with oblique ends: beyond an end there is only the far side."""

    def tube(self, one, other, count=3000):
        rng = np.random.default_rng(6)
        u, z = rng.uniform(0, 2 * np.pi, 4 * count), rng.uniform(-5, 5, 4 * count)
        kept = np.flatnonzero((z > np.tan(one) * np.cos(u) - 3) & (z < np.tan(other) * np.cos(u) + 3))[:count]
        return np.stack([np.cos(u), np.sin(u), z], axis=1)[kept]

    @pytest.mark.parametrize("ends", [(30, 30), (40, -40), (45, 0)])
    def test_a_cylinder_lies_on_them(self, ends):
        points = self.tube(*np.radians(ends))
        model = sm.reconstruct(points, init="cylinder", vertices=1000, holes="none", handles="none", refine="none")
        assert (model.mesh.n_holes, model.tangled) == (2, 0)
        assert max(model.distance.mesh_to_data.rms, model.distance.data_to_mesh.rms) < 0.05

    def test_their_sides_are_not_reported(self):
        rng = np.random.default_rng(3)
        u, s = 2 * np.pi * rng.random(5000), rng.random(5000)
        radius = 0.5 + 0.1 * np.sin(3 * np.pi * s) + 0.08 * np.cos(u) * s
        points = np.stack([radius * np.cos(u), radius * np.sin(u), 2 * s + 0.4 * np.sin(u)], axis=1)
        model = sm.reconstruct(points, init="cylinder", vertices=2000, holes="none", handles="none", refine="none")
        assert max(model.distance.mesh_to_data.rms, model.distance.data_to_mesh.rms) < 0.05

    def test_it_ends_where_they_end(self):
        start = primitive_around(self.tube(np.radians(35.0), np.radians(-35.0)), "cylinder", 1000)
        rim = start.vertices[np.isin(np.arange(start.n_vertices), Rim.of(start.connectivity).vertices)]
        ends = np.sign(rim[:, 2]) * (3 - np.tan(np.radians(35.0)) * rim[:, 0])
        assert np.abs(rim[:, 2] - ends).max() < 0.15


def test_a_knot_is_reported(data_folder):
    surface = sm.read_triangles(data_folder / "knot1.off")
    samples = closed_samples(as_subject(surface, **PLAIN))
    assert (samples.genus, samples.homology) == (1, None)
    said = with_missing_tunnels(samples, (), sm.sphere(8))[1]
    assert "knotted" in said
    assert "init='auto'" in said
    whole = sm.reconstruct(surface, vertices=1500, iterations=40).mesh
    assert with_missing_tunnels(samples, (), whole) == ((), "")
