"""Wrapping of spheres around closed data, the handles they gain, and starts that enclose open data."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.motion.model.contours import rims_of
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.measure import genus_message
from simplexmesh.motion.start.primitives import primitive_around
from simplexmesh.motion.topology.wrapping import GRADE, Wrapping, contacts, wrapped
from tests.mesh.triangles.test_homology import block
from tests.nightly.marks import nightly


def torus_points(count=6000, ring=1.0, tube=0.45):
    """Return random points on a torus of uniform density."""
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 2 * count))
    kept = np.flatnonzero(rng.uniform(size=2 * count) < (ring + tube * np.cos(v)) / (ring + tube))[:count]
    away = ring + tube * np.cos(v[kept])
    return np.stack([away * np.cos(u[kept]), away * np.sin(u[kept]), tube * np.sin(v[kept])], axis=1)


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


def test_contacts_against_all_pairs():
    rng = np.random.default_rng(1)
    ball = sm.sphere(10)
    pill = ball.moved(ball.vertices * [1, 1, 0.08] + 0.005 * rng.normal(size=ball.vertices.shape))
    V, N = pill.vertices, pill.normals
    edges = np.linalg.norm(V[pill.neighbors] - V[:, None], axis=2).mean(axis=1)
    rows = np.arange(0, len(V), 40)
    meets, depth = contacts(V, N, edges, rows)
    for i in rows:
        expected = (np.inf, -1)
        for j in range(len(V)):
            along = -(V[j] - V[i]) @ N[i]
            aside = np.sqrt(max((V[j] - V[i]) @ (V[j] - V[i]) - along**2, 0))
            inside = np.linalg.norm(V[j] - V[i] + 0.8 * edges[i] * N[i]) <= 1.2 * edges[i]
            if inside and N[j] @ N[i] < -0.3 and along > -0.4 * edges[i] and aside < 0.9 * edges[i]:
                expected = min(expected, (along, j))
        assert meets[i] == expected[1]
        if expected[1] >= 0:
            assert depth[i] == pytest.approx(expected[0])
    assert (np.delete(meets, rows) == -1).all()
    assert (meets[rows] >= 0).mean() > 0.3


class TestWrapping:
    def test_a_sphere_comes_to_a_cup(self):
        ball = sm.sphere(24)
        dent = ball.vertices.copy()
        inside = np.exp(-6 * (1 - dent[:, 2]))
        cup = ball.moved(dent * (1 - 0.7 * inside)[:, None])
        wrapping = Wrapping(sm.sphere(8, radius=1.2), cup, 800)
        wrapping.run(160)
        away = np.sort(cKDTree(wrapping.mesh.vertices).query(cup.vertices)[0])
        assert away[-20] < 2 * wrapping.edge  # surface to mesh, including the bottom of the dent
        assert not wrapping.free.any()
        assert wrapping.is_complete

    def test_edges_are_as_long_as_a_share_of_the_way_to_the_surface(self):
        wrapping = Wrapping(sm.sphere(12, radius=4.0), sm.sphere(12), 4000)
        for _ in range(5):
            wrapping.replace_mesh(wrapping._evened())
        assert 0.7 < mean_edge(wrapping.mesh) / (GRADE * 3.0) < 1.7

    def test_a_sphere_gains_the_handle_of_a_torus_and_its_films_are_offered_once(self):
        surface, asked = sm.torus(60, 30, tube_radius=0.45), []
        out = wrapped(sm.sphere(6, radius=1.6), surface, vertices=1000)
        assert (out.mesh.genus, out.replaced, [pair.accepted for pair in out.proposals]) == (1, False, [True])
        out = wrapped(sm.sphere(6, radius=1.6), surface, vertices=1000, accept=lambda pair: bool(asked.append(pair)))
        assert (out.mesh.genus, out.replaced, len(asked)) == (0, False, 1)
        assert [pair.reason for pair in out.proposals] == ["refused by accept"]

    def test_a_model_without_the_handles_of_the_data_is_reported(self):
        ball, ring = sm.sphere(8), sm.torus(24, 12)
        assert genus_message(ring, ball, ()).startswith("the data has genus 1, the model has 0; init='auto'")
        assert genus_message(ring, ring, ()) == ""


def test_a_sphere_becomes_a_torus():
    out = sm.reconstruct(torus_points(), init="sphere", vertices=900)
    assert out.mesh.genus == 1
    assert out.tangled == 0
    assert [proposal.accepted for proposal in out.topology.handles] == [True]
    x, y, z = out.mesh.vertices.T
    assert np.abs(np.hypot(np.hypot(x, y) - 1.0, z) - 0.45).max() < 0.05
    assert abs(out.mesh.n_vertices - 900) <= 90
    assert out.mesh.check(self_intersections=True).ok


@pytest.mark.nightly
def test_two_sides_of_a_flap_are_no_handle():
    rng = np.random.default_rng(0)
    gap, tube = 0.6, 0.3
    u = rng.uniform(gap, 2 * np.pi - gap, 5000)
    direction = rng.normal(size=(5000, 3))
    ring = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    along = np.stack([-np.sin(u), np.cos(u), 0 * u], axis=1)
    direction -= (direction * along).sum(axis=1)[:, None] * along
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    ends = []
    for end, sign in ((gap, -1), (2 * np.pi - gap, 1)):
        cap = rng.normal(size=(600, 3))
        cap /= np.linalg.norm(cap, axis=1)[:, None]
        out = sign * np.array([-np.sin(end), np.cos(end), 0])
        cap = cap[cap @ out > 0]
        ends.append((np.array([np.cos(end), np.sin(end), 0]) + tube * cap, cap))
    points = np.concatenate([ring + tube * direction, *(place for place, _ in ends)])
    normals = np.concatenate([direction, *(cap for _, cap in ends)])
    out = sm.reconstruct(sm.PointCloud(points, normals), init="sphere", vertices=1000, iterations=20, creases="none")
    assert (out.mesh.genus, out.tangled, out.topology.handles) == (0, 0, ())


@pytest.mark.parametrize("inside", [*nightly("above"), "below"])
def test_a_sphere_finds_the_handle_of_a_level_of_a_volume(inside):
    x, y, z = np.mgrid[-1.6:1.6:41j, -1.6:1.6:41j, -0.8:0.8:21j]
    deep = 0.45 - np.hypot(np.hypot(x, y) - 1.0, z)
    values = deep if inside == "above" else -deep
    volume = sm.Volume(values, spacing=0.08, origin=(-1.6, -1.6, -0.8))
    out = sm.reconstruct(volume, level=0.0, inside=inside, init="sphere", vertices=1000)
    assert (out.mesh.genus, out.tangled) == (1, 0)
    assert out.distance.data_to_mesh.rms < 0.01


def test_a_ball_gets_no_handle():
    out = sm.reconstruct(sm.sphere(14).vertices * [1.0, 0.6, 1.5], init="sphere", vertices=600, creases="none")
    assert out.mesh.genus == 0
    assert out.topology.handles == ()
    assert out.tangled == 0


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "genus"), [("torus.stl", 1), ("eight.off", 2)])
def test_a_sphere_finds_the_genus_of_what_it_encloses(data_folder, name, genus):
    surface = sm.read_triangles(data_folder / name)
    out = sm.reconstruct(surface, init="sphere", vertices=2000, creases="none")
    assert out.mesh.genus == genus == sum(proposal.accepted for proposal in out.topology.handles)
    assert out.tangled == 0
    diagonal = np.linalg.norm(np.ptp(surface.vertices, axis=0))
    assert out.distance.data_to_mesh.mean < 0.002 * diagonal


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore:.* in two layers")  # of so few vertices bars are thin walls
def test_a_sphere_comes_to_a_frame():
    model = sm.reconstruct(frame_of_a_cube(), init="sphere", vertices=1500, iterations=60, creases="none")
    assert (model.mesh.genus, model.tangled, model.found.genus) == (5, 0, 5)


def test_no_handles_where_points_show_none():
    dent = sm.sphere(14).vertices
    dent = dent * (1 - 0.6 * np.exp(-8 * (1 - np.abs(dent[:, 2]))))[:, None]
    model = sm.reconstruct(dent, init="sphere", vertices=700, iterations=40)
    assert model.mesh.genus == 0
    assert not any(proposal.accepted for proposal in model.topology.handles)


@pytest.mark.nightly
def test_a_sphere_finds_the_narrow_tunnels_of_triangles():
    model = sm.reconstruct(block([(2, 2), (4, 2)], (5, 3)), init="sphere", vertices=1500, iterations=60, creases="none")
    assert model.mesh.genus == 2


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "genus"), [("knot1.off", 1), ("coupling.off", 9)])
def test_bores_and_knots_are_found_from_a_sphere(data_folder, name, genus):
    model = sm.reconstruct(data_folder / name, init="sphere", vertices=4000, iterations=60, creases="none")
    assert (model.mesh.genus, model.tangled) == (genus, 0)


class TestOpenData:
    """A triangulated dome with inward normals: the start defines the outside."""

    def dome(self):
        ball = sm.sphere(16).triangulated()
        kept = (ball.vertices[ball.faces, 2] > -0.1).all(axis=1)
        return sm.TriangleMesh(ball.vertices, ball.faces[kept][:, ::-1])

    @pytest.mark.parametrize("init", ["sphere", *nightly("torus", "cylinder")])
    def test_a_start_around_it_ends_right_side_out(self, init):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sm.SimplexMeshWarning)
            mesh = sm.reconstruct(self.dome(), init=init, vertices=200, iterations=20).mesh
        assert ((mesh.normals * mesh.vertices).sum(axis=1) > 0).mean() > 0.9

    def test_a_closed_model_of_it_is_reported(self):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            model = sm.reconstruct(self.dome(), init="sphere", vertices=20, iterations=20, creases="none")
        assert model.mesh.n_holes == 0
        assert any("but the model is closed" in str(warning.message) for warning in said)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            sm.reconstruct(self.dome(), init="sphere", vertices=20, iterations=20, holes="none", creases="none")
        assert not any("but the model is closed" in str(warning.message) for warning in said)


class TestTubesCutOffAslant:
    """Points without normals of tubes with oblique ends: beyond an end there is only the far side."""

    def tube(self, one, other, count=3000):
        rng = np.random.default_rng(6)
        u, z = rng.uniform(0, 2 * np.pi, 4 * count), rng.uniform(-5, 5, 4 * count)
        kept = np.flatnonzero((z > np.tan(one) * np.cos(u) - 3) & (z < np.tan(other) * np.cos(u) + 3))[:count]
        return np.stack([np.cos(u), np.sin(u), z], axis=1)[kept]

    @pytest.mark.parametrize("ends", [(45, 0), *nightly(((30, 30),), ((40, -40),))])
    def test_a_cylinder_lies_on_them(self, ends):
        points = self.tube(*np.radians(ends))
        model = sm.reconstruct(points, init="cylinder", vertices=1000, holes="none", handles="none", refine="none")
        assert (model.mesh.n_holes, model.tangled) == (2, 0)
        assert max(model.distance.mesh_to_data.rms, model.distance.data_to_mesh.rms) < 0.05

    @pytest.mark.nightly
    def test_their_sides_are_not_reported(self):
        rng = np.random.default_rng(3)
        u, s = 2 * np.pi * rng.random(5000), rng.random(5000)
        radius = 0.5 + 0.1 * np.sin(3 * np.pi * s) + 0.08 * np.cos(u) * s
        points = np.stack([radius * np.cos(u), radius * np.sin(u), 2 * s + 0.4 * np.sin(u)], axis=1)
        model = sm.reconstruct(points, init="cylinder", vertices=2000, holes="none", handles="none", refine="none")
        assert max(model.distance.mesh_to_data.rms, model.distance.data_to_mesh.rms) < 0.05

    def test_it_ends_where_they_end(self):
        start = primitive_around(self.tube(np.radians(35.0), np.radians(-35.0)), "cylinder", 1000)
        rim = start.vertices[np.isin(np.arange(start.n_vertices), rims_of(start.connectivity).vertices)]
        ends = np.sign(rim[:, 2]) * (3 - np.tan(np.radians(35.0)) * rim[:, 0])
        assert np.abs(rim[:, 2] - ends).max() < 0.15


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore:a part of the motion ended early")
@pytest.mark.filterwarnings("ignore:.* of the data is inside of the model")  # that the film spans
def test_a_handle_refused_by_the_user_stays_a_film():
    out = sm.reconstruct(
        torus_points(), init="sphere", vertices=700, handles=lambda proposal: False, iterations=20, creases="none"
    )
    assert out.mesh.genus == 0
    assert {proposal.reason for proposal in out.topology.handles} == {"refused by accept"}
