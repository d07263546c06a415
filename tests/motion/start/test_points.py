"""Automatic initialization from points: topology across shapes, noise and seeds; inside and outside; vertex budget."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from simplexmesh import PointCloud, read_points, read_triangles
from simplexmesh._base.vectors import normalized
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.shapes import sphere
from simplexmesh.motion.start import solid_mesh
from simplexmesh.motion.start.from_points import start_from_points
from simplexmesh.numerics.plane_fits import planes, spacing_of, subsampled
from simplexmesh.orientation.poisson import Poisson, fixpoint, flooded, oriented_indicator
from tests.nightly.marks import nightly

GENUS = {"torus.stl": 1, "knot1.off": 1, "eight.off": 2, "elephant.off": 3}


def torus(count, seed, noise=0.0):
    """Even samples of a torus of radii 1 and 0.35, noise as a part of the diagonal, and their outward normals."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(0, 2 * np.pi, (2, 3 * count))
    u, v = (w[rng.uniform(0, 1.35, len(u)) < 1 + 0.35 * np.cos(v)][:count] for w in (u, v))
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=1)
    points = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1) + 0.35 * normals
    return points + noise * np.linalg.norm([2.7, 2.7, 0.7]) * rng.normal(size=points.shape), normals


def off_torus(at):
    return np.hypot(np.hypot(at[:, 0], at[:, 1]) - 1, at[:, 2]) - 0.35


def sampled(folder, name, total, seed):
    """The vertices of a closed mesh and even samples of its triangles."""
    mesh = read_triangles(folder / name)
    rng = np.random.default_rng(seed)
    a, b, c = (mesh.vertices[mesh.faces[:, j]] for j in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = rng.choice(len(area), max(0, total - len(mesh.vertices)), p=area / area.sum())
    s, t = np.sqrt(rng.random((len(chosen), 1))), rng.random((len(chosen), 1))
    return np.concatenate([mesh.vertices, (1 - s) * a[chosen] + s * (1 - t) * b[chosen] + s * t * c[chosen]])


@pytest.mark.parametrize(("count", "noise"), [(3000, 0.0), (20_000, 0.002), *nightly((20_000, 0.0), (20_000, 0.01))])
def test_a_torus_from_bare_points(count, noise):
    points, _ = torus(count, 0, noise)
    start = start_from_points(PointCloud(points), 2000)
    mesh = start.mesh
    assert (mesh.n_vertices, mesh.genus, mesh.n_holes, mesh.n_components) == (2000, 1, 0, 1)
    assert np.isclose(mesh.volume, 2 * np.pi**2 * 0.35**2, rtol=0.05)
    assert mesh.check(self_intersections=True)
    off = off_torus(mesh.vertices)
    assert np.abs(off).mean() < 0.5 * start.report.cell + 0.2 * noise
    assert np.abs(off).max() < 2 * start.report.cell + 4 * noise


def test_inside_is_positive_outside_negative_and_the_gradient_points_in():
    points, normals = torus(8000, 0)
    indicator = start_from_points(PointCloud(points), 500).indicator
    values, gradients = indicator.at(np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 0], [1.4, 0, 0]]))
    assert (values[:2] > 0.3).all()
    assert (values[2:] < -0.2).all()
    values, gradients = indicator.at(points)
    assert np.abs(values).mean() < 0.1
    assert (np.einsum("ij,ij->i", gradients, normals) < 0).all()


@pytest.mark.parametrize("sign", [1, -1])
def test_given_normals_are_used_and_flipped_when_they_point_inwards(sign):
    points, normals = torus(8000, 0)
    mesh = start_from_points(PointCloud(points, sign * normals), 3000).mesh
    assert mesh.genus == 1
    assert np.isclose(mesh.volume, 2 * np.pi**2 * 0.35**2, rtol=0.05)


@pytest.mark.nightly
def test_a_hole_in_the_data_is_closed():
    ball = sphere(30).vertices
    start = start_from_points(PointCloud(ball[ball[:, 2] > -0.8]), 1000)
    mesh = start.mesh
    assert (mesh.genus, mesh.n_holes) == (0, 0)
    assert 0.02 < start.report.openness < 0.25
    assert start_from_points(PointCloud(ball), 1000).report.openness < 0.01
    assert np.isclose(mesh.volume, 4 / 3 * np.pi, rtol=0.1)


def test_all_components():
    points, _ = torus(3000, 0)
    both = PointCloud(np.concatenate([points, points + np.array([0, 0, 3])]))
    start = start_from_points(both, 2000, components="all")
    assert (start.mesh.n_components, start.mesh.genus) == (2, 2)
    assert start_from_points(both, 2000).mesh.n_components == 1


def test_scale_and_place_do_not_matter():
    points, _ = torus(5000, 0)
    mesh = start_from_points(PointCloud(points), 800).mesh
    other = start_from_points(PointCloud(1e-3 * points + 7), 800).mesh
    assert other.genus == 1
    assert np.isclose(other.volume, 1e-9 * mesh.volume, rtol=0.01)


@pytest.mark.parametrize("vertices", [50, 5000, *nightly(60_000)])
def test_the_budget_is_kept(vertices):
    mesh = start_from_points(PointCloud(torus(5000, 0)[0]), vertices).mesh
    assert abs(mesh.n_vertices - vertices) <= 0.02 * vertices
    assert mesh.genus == 1


@pytest.mark.data
def test_a_face_is_closed_and_reported_as_open(data_folder):
    start = start_from_points(read_points(data_folder / "fran_face.vtk"), 2000)
    assert (start.mesh.genus, start.mesh.n_holes) == (0, 0)
    assert "open" in str(start.report)


def bowl(seed, wall, count=12_000):
    """Samples of a bowl's wall, of the outer radius 1, and their normals."""
    rng = np.random.default_rng(seed)
    out = rng.normal(size=(4 * count, 3))
    out /= np.linalg.norm(out, axis=1)[:, None]
    out = out[out[:, 2] < 0.5][:count]
    inner = (rng.random(len(out)) < 0.5)[:, None]
    u = rng.uniform(0, 2 * np.pi, count // 20)
    edge = np.stack([np.sqrt(0.75) * np.cos(u), np.sqrt(0.75) * np.sin(u), 0 * u + 0.5], axis=1)
    up = np.stack([-0.5 * np.cos(u), -0.5 * np.sin(u), np.sqrt(0.75) + 0 * u], axis=1)
    points = np.concatenate([np.where(inner, (1 - wall) * out, out), rng.uniform(1 - wall, 1, (len(u), 1)) * edge])
    return points, np.concatenate([np.where(inner, -out, out), up])


@pytest.mark.parametrize(("vertices", "seeds"), [(200, [0]), *nightly((200, [0, 1, 2]), (400, [0, 1, 2]))])
def test_a_wall_thinner_than_faces_are_long_does_not_cross_itself(vertices, seeds, monkeypatch):
    clouds = [PointCloud(*bowl(seed, 0.05)) for seed in seeds]
    meshes = [start_from_points(cloud, vertices).mesh for cloud in clouds]
    assert not any(mesh.genus for mesh in meshes)
    assert not any(tangled_vertices(mesh).any() for mesh in meshes)
    monkeypatch.setattr(solid_mesh, "THICKENINGS", 0)
    assert any(tangled_vertices(start_from_points(cloud, vertices).mesh).any() for cloud in clouds)


@pytest.mark.data
@pytest.mark.nightly
@pytest.mark.parametrize("vertices", [1500, 3000])
def test_an_open_head_with_hollow_ears_starts_untangled(data_folder, vertices):
    head = read_triangles(data_folder / "lion_head.off")
    mesh = start_from_points(head.sampled(40_000, rng=0), vertices).mesh
    assert mesh.genus == 0
    assert not tangled_vertices(mesh).any()


def test_points_in_a_plane_are_an_open_surface():
    flat = np.random.default_rng(0).random((500, 3)) * [1, 1, 0]
    found = start_from_points(PointCloud(flat), 500).report
    assert found.is_open
    assert found.openness > 1  # no lid closes it


def test_noisy_points_are_subsampled_until_they_tell_a_plane():
    rng = np.random.default_rng(2)
    flat = np.column_stack([rng.uniform(-1, 1, (20000, 2)), np.zeros(20000)])
    assert subsampled(flat) is flat
    noisy = flat + rng.normal(0, 0.05, flat.shape)
    few = subsampled(noisy)
    assert 0.05 <= 1.5 * np.sqrt(4 / len(few)) <= 0.15  # noise about a plane through neighbors is less
    up = [(np.abs(planes(points).normals[:, 2]) > 0.9).mean() for points in (noisy, few)]
    assert up[0] < 0.7 < 0.95 < up[1]


def test_spacing_noise_and_areas_of_a_known_layer():
    rng = np.random.default_rng(0)
    points = np.concatenate([sphere(50).vertices, [[0, 0, 0]]])[:-1]
    area = 4 * np.pi / len(points)
    assert_allclose(spacing_of(cKDTree(points)), np.sqrt(area), rtol=0.05)
    rough = planes(points * (1 + 0.3 * np.sqrt(area) * rng.normal(size=(len(points), 1))))
    assert_allclose(rough.noise, 0.3 * np.sqrt(area), rtol=0.15)
    assert_allclose(Poisson.of(points, 1.5 * np.sqrt(area)).areas.sum(), 4 * np.pi, rtol=0.1)


def test_the_indicator_of_a_ball_jumps_by_one():
    ball = sphere(40)
    areas = np.full(ball.n_vertices, 4 * np.pi / ball.n_vertices)
    indicator = replace(Poisson.of(ball.vertices, 0.05), areas=areas).indicator(ball.vertices)
    values, _ = indicator.at(np.array([[0.0, 0, 0], [0.5, 0, 0], [0, 0, 1.2]]))
    assert_allclose(values[0] - values[2], 1, atol=0.02)
    assert_allclose(values[1], values[0], atol=0.02)
    unknown = oriented_indicator(ball.vertices, planes(ball.vertices), 0.05)
    assert_allclose(unknown.at(np.zeros((1, 3)))[0], values[0], atol=0.05)


def test_a_fixpoint_has_the_indicator_of_its_normals():
    ball, rng = sphere(12), np.random.default_rng(0)
    problem = Poisson.of(ball.vertices, 0.1)
    found = fixpoint(problem, ball.normals)
    assert found.settled
    assert_array_equal(found.field.values, problem.indicator(found.normals).values)
    mixed = fixpoint(problem, ball.normals * rng.choice([1, -1], (ball.n_vertices, 1), p=[0.9, 0.1]))
    assert mixed.settled
    assert_array_equal(mixed.normals, ball.normals)


def test_finer_floods_enclose_more_until_they_leak():
    ball = sphere(20).vertices
    enclosed = [flooded(ball, cell).enclosed for cell in (0.3, 0.2, 0.1, 0.02)]
    assert enclosed[0] < enclosed[1] < enclosed[2] < 4 / 3 * np.pi
    assert enclosed[3] < 0.01


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "total"),
    [("knot1.off", 20_000), ("elephant.off", 5000), *nightly(("eight.off", 20_000), ("torus.stl", 20_000))],
)
def test_genus_of_real_shapes(data_folder, name, total):
    mesh = start_from_points(PointCloud(sampled(data_folder, name, total, 0)), 3000).mesh
    assert (mesh.genus, mesh.n_components, mesh.n_vertices) == (GENUS[name], 1, 3000)
    assert mesh.volume > 0


@pytest.mark.data
@pytest.mark.parametrize("normals", [True, False])
def test_kitten(data_folder, normals):
    cloud = read_points(data_folder / "kitten.xyz")
    start = start_from_points(cloud if normals else PointCloud(cloud.points), 3000)
    assert (start.mesh.genus, start.mesh.n_components) == (1, 1)
    assert start.mesh.check(self_intersections=True)


def test_thin_limbs_are_kept():
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(28000, 3))
    turn, high = rng.uniform(0, 2 * np.pi, 900), rng.uniform(1, 2.4, 900)
    rod = np.stack([0.04 * np.cos(turn), 0.04 * np.sin(turn), high], axis=1)
    mesh = start_from_points(PointCloud(np.concatenate([normalized(ball), rod]))).mesh
    assert mesh.genus == 0
    assert mesh.vertices[:, 2].max() > 2.2  # without screening it ends at 1
