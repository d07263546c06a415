"""Saliency, salient points and HK classes: closed-form shapes, invariance, noise, and one sentence on bad input."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.bench.truth.discretized import split_square, torus, uv_cylinder
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.bench.truth.noise import noisy
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.saliency import hk_classes as hk
from simplexmesh.surface.saliency._kernels_watersheds import watersheds
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.fields import field_of
from simplexmesh.surface.saliency.noise import field_noise, local_noise, smallest_window
from simplexmesh.surface.saliency.saliency import map_weight
from simplexmesh.surface.saliency.smoothed_curvature import mean_deviators, shrunk, smoothed_curvature
from simplexmesh.surface.sampled_surface import SampledSurface, as_sampled_surface
from tests.nightly.marks import nightly
from tests.surface.saliency.reference import gaussian_mean, persistence, turning_mean

BUMPS = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -0.6, -0.8]])
HEIGHTS = np.array([0.16, 0.13, 0.10, 0.07, 0.04])


@cache
def noisy_balls(noise):
    """Two balls with noise, and their curvatures."""
    balls = [noisy(ball(24), noise, rng=seed) for seed in range(2)]
    return [(each, sm.curvature(each)) for each in balls]


def ball(frequency=24, radius=1.0):
    mesh = sm.sphere(frequency).triangulated("dual")
    return sm.TriangleMesh(radius * mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True), mesh.faces)


def bumpy(frequency=24, heights=HEIGHTS, width=0.15):
    """A ball with bumps of known places and heights."""
    mesh = ball(frequency)
    away = ((mesh.vertices[:, None] - BUMPS) ** 2).sum(axis=2)
    return sm.TriangleMesh(mesh.vertices * (1 + np.exp(-away / (2 * width**2)) @ heights)[:, None], mesh.faces)


def curved(mesh, rings=2):
    return sm.curvature(mesh, "sine", neighborhood=sm.rings(rings))


def bump_of(points):
    """Which bump each point is at, -1 for none."""
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    near = np.linalg.norm(points[:, None] - BUMPS, axis=2)
    return np.where(near.min(axis=1) < 0.08, near.argmin(axis=1), -1).tolist()


def turned(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


@pytest.fixture(scope="module")
def body():
    mesh = bumpy()
    return mesh, curved(mesh)


class TestDiffusion:
    @pytest.mark.parametrize("kind", ["triangles", "simplex mesh", "cloud"])
    def test_of_a_harmonic_decays_as_heat_does(self, kind):
        mesh = ball(24)
        of = {"triangles": mesh, "simplex mesh": sm.sphere(24), "cloud": sm.PointCloud(mesh.vertices)}[kind]
        samples = as_sampled_surface(of)
        z = samples.points[:, 2] / np.linalg.norm(samples.points, axis=1)
        for sigma in (0.2, 0.5):
            found = Diffusion(samples).smoothed(z, sigma, steps=16)
            assert found == pytest.approx(z * np.exp(-(sigma**2)), abs=0.03)  # eigenvalue 2 times sigma^2 / 2

    def test_is_a_gaussian_window_on_a_plane(self):
        sheet = sm.plane(30, 30, size=(2.0, 2.0)).triangulated("dual")
        diffusion = Diffusion(as_sampled_surface(sheet))
        values = np.random.default_rng(0).normal(size=sheet.n_vertices)
        middle = np.abs(sheet.vertices[:, :2]).max(axis=1) < 0.5
        expected = gaussian_mean(sheet.vertices, diffusion.areas, values, 0.15)[middle]
        found = diffusion.smoothed(values, 0.15, steps=8)[middle]
        assert np.corrcoef(found, expected)[0, 1] > 0.98
        assert found.std() == pytest.approx(expected.std(), rel=0.1)

    def test_keeps_the_total_and_stays_between_the_values(self, body):
        diffusion = Diffusion(as_sampled_surface(body[0]))
        values = np.random.default_rng(1).random(body[0].n_vertices)
        found = diffusion.smoothed(values, 0.1)
        assert diffusion.areas @ found == pytest.approx(diffusion.areas @ values, rel=1e-4)
        assert values.min() - 1e-6 < found.min() < found.max() < values.max() + 1e-6

    def test_borders_reflect(self):
        sheet = sm.plane(40, 40).triangulated("dual")
        assert Diffusion(as_sampled_surface(sheet)).smoothed(np.full(sheet.n_vertices, 3.0), 0.2) == pytest.approx(
            3.0, abs=1e-5
        )

    def test_unknown_values_are_filled_in_and_have_no_weight(self):
        mesh = ball(16)
        values = np.where(np.arange(mesh.n_vertices) % 7 == 0, np.nan, 2.0)
        assert Diffusion(as_sampled_surface(mesh)).smoothed(values, 0.1) == pytest.approx(2.0, abs=1e-4)

    def test_unknown_values_are_like_their_neighbors(self):
        mesh = ball(16)
        z = mesh.vertices[:, 2]
        values = np.where(z > 0.8, np.nan, np.where(z > 0, 1.0, 3.0))
        found = Diffusion(as_sampled_surface(mesh)).smoothed(values, 0.1)
        assert found[z > 0.5] == pytest.approx(1.0, abs=0.02)

    def test_wide_windows_from_narrow_ones_agree(self, body):
        diffusion = Diffusion(as_sampled_surface(body[0]))
        values = body[1].mean
        several = diffusion.at_scales(values, [0.05, 0.1, 0.2])
        assert several[2] == pytest.approx(diffusion.smoothed(values, 0.2, steps=3), abs=0.1 * np.ptp(several[2]))

    def test_areas_are_those_of_the_surface(self):
        mesh = sm.torus(40, 20)
        of_triangles = mesh.triangulated("dual")
        assert Diffusion(as_sampled_surface(of_triangles)).areas.sum() == pytest.approx(of_triangles.area)
        assert Diffusion(as_sampled_surface(mesh)).areas.sum() == pytest.approx(mesh.area, rel=0.1)
        cloud = ball(20).sampled(4000, rng=0)
        assert Diffusion(as_sampled_surface(cloud)).areas.sum() == pytest.approx(4 * np.pi, rel=0.2)

    def test_without_convergence_the_system_is_solved_directly(self, monkeypatch):
        samples = as_sampled_surface(ball(20))
        values = np.random.default_rng(0).normal(size=len(samples.points))
        exact = Diffusion(samples).smoothed(values, 0.3)
        monkeypatch.setattr("simplexmesh.surface.saliency.diffusion.MAX_ITERATIONS", 2)
        np.testing.assert_allclose(Diffusion(samples).smoothed(values, 0.3), exact, atol=1e-4)


class TestWatersheds:
    @given(st.integers(0, 10**6), st.integers(3, 14), st.booleans())
    def test_equal_the_definition(self, seed, n, ties):
        rng = np.random.default_rng(seed)
        links = rng.random((n, n)) < 0.3
        links = (links | links.T) & ~np.eye(n, dtype=bool)
        neighbors = [np.flatnonzero(row) for row in links]
        values = rng.integers(0, 5, n).astype(float) if ties else rng.random(n)
        offsets = np.concatenate([[0], np.cumsum([len(row) for row in neighbors])])
        members = np.concatenate([*neighbors, np.zeros(0, int)]).astype(np.int64)
        order = np.lexsort((np.arange(n), -values))
        basin, saddle, _ = watersheds(offsets, members, values, order)
        top = basin == np.arange(n)
        assert np.where(top, values - np.where(top, saddle, 0), 0) == pytest.approx(persistence(neighbors, values))
        assert (values[basin] >= values).all()
        for i in range(n):  # the highest neighbor, earliest in the order, leads up
            uphill = [j for j in neighbors[i] if (values[j], -j) > (values[i], -i)]
            above = max(uphill, key=lambda j: (values[j], -j), default=i)
            assert basin[i] == basin[above]


class TestSaliency:
    def test_is_highest_on_the_bumps_in_order(self, body):
        mesh, curvature = body
        found = sm.saliency(mesh, curvature=curvature)
        near = [found[np.linalg.norm(mesh.vertices - tip, axis=1) < 0.3].max() for tip in BUMPS]
        assert sorted(near, reverse=True) == near
        far = np.linalg.norm(mesh.vertices[:, None] - BUMPS, axis=2).min(axis=1) > 0.7
        assert found[far].max() < 0.1 * near[0]
        assert bump_of(mesh.vertices[[found.argmax()]]) == [0]

    def test_of_a_sphere_is_zero(self):
        mesh = ball(20)
        assert sm.saliency(mesh, curvature=curved(mesh)).max() < 1e-3

    @given(st.integers(0, 10**6), st.floats(0.01, 100))
    def test_is_the_same_for_moved_and_scaled_copies(self, seed, size):
        mesh = bumpy(10)
        copy = sm.TriangleMesh(size * mesh.vertices @ turned(seed).T + [1, -2, 3], mesh.faces)
        one, other = (sm.saliency(each, curvature=curved(each)) for each in (mesh, copy))
        assert other == pytest.approx(one, abs=1e-4 * one.max())

    def test_does_not_depend_on_how_vertices_are_numbered(self, body):
        mesh, curvature = body
        order = np.random.default_rng(0).permutation(mesh.n_vertices)
        place = np.argsort(order)
        copy = sm.TriangleMesh(mesh.vertices[order], place[mesh.faces])
        one, other = sm.saliency(mesh, curvature=curvature), sm.saliency(copy, curvature=curved(copy))
        assert other == pytest.approx(one[order], abs=1e-3 * one.max())

    def test_hardly_depends_on_the_density(self):
        scales = [0.08, 0.12]
        coarse, fine = bumpy(20), bumpy(40)
        one = sm.saliency(coarse, curvature=curved(coarse), scales=scales)
        other = sm.saliency(fine, curvature=curved(fine), scales=scales)
        nearest = as_sampled_surface(fine).tree.query(coarse.vertices)[1]
        assert np.abs(other[nearest] - one).max() < 0.12 * one.max()

    def test_takes_clouds_and_simplex_meshes(self):
        bump = 0.15 * np.exp(-((ball(24).vertices - [0, 0, 1]) ** 2).sum(axis=1) / (2 * 0.2**2))
        cloud = sm.PointCloud(ball(24).vertices * (1 + bump)[:, None], ball(24).vertices)
        mesh = sm.sphere(20)
        high = 0.15 * np.exp(-((mesh.vertices - [0, 0, 1]) ** 2).sum(axis=1) / (2 * 0.2**2))
        mesh = mesh.moved(mesh.vertices * (1 + high)[:, None])
        of_cloud = sm.curvature(cloud, "sine", normals=cloud.normals, neighborhood=sm.nearest(18))
        for surface, points, curvature in ((cloud, cloud.points, of_cloud), (mesh, mesh.vertices, curved(mesh))):
            found = sm.saliency(surface, curvature=curvature)
            assert np.linalg.norm(points[found.argmax()] / 1.15 - [0, 0, 1]) < 0.15

    def test_of_a_given_field(self, body):
        mesh, _ = body
        spot = np.exp(-((mesh.vertices - [0, 0, 1.16]) ** 2).sum(axis=1) / 0.02)
        assert bump_of(mesh.vertices[[sm.saliency(mesh, of=spot).argmax()]]) == [0]

    def test_has_no_ridge_along_a_rim(self):
        whole = bumpy(24)
        kept = (whole.vertices[whole.faces][:, :, 0] > -0.3).all(axis=1)
        used, faces = np.unique(whole.faces[kept], return_inverse=True)
        part = sm.TriangleMesh(whole.vertices[used], faces.reshape(-1, 3))
        full = sm.saliency(whole, curvature=curved(whole))[used]
        found = sm.saliency(part, curvature=curved(part))
        rim = ~as_sampled_surface(part).one_ring.closed
        plain = rim & (full < 0.1 * full.max())
        assert plain.sum() > 20
        assert found[plain].max() < 0.35 * found.max()

    def test_a_map_of_one_peak_counts_more_than_one_of_many(self):
        samples = as_sampled_surface(ball(12))
        z = samples.points[:, 2]
        many = np.abs(np.sin(9 * samples.points).prod(axis=1))
        assert map_weight(samples, np.exp(4 * (z - 1))) > 3 * map_weight(samples, many)

    def test_is_the_weighted_mean_over_scales(self, body):
        mesh, curvature = body
        samples = as_sampled_surface(mesh)
        diffusion = Diffusion(samples)
        means = diffusion.at_scales(field_of("mean", samples, curvature), [0.05, 0.08, 0.1, 0.16])
        fine, coarse = 0.05 * np.abs(means[0] - means[2]), 0.08 * np.abs(means[1] - means[3])
        weights = map_weight(samples, fine), map_weight(samples, coarse)
        expected = (weights[0] * fine + weights[1] * coarse) / sum(weights)
        found = sm.saliency(mesh, curvature=curvature, scales=[0.05, 0.08])
        assert found == pytest.approx(expected)
        assert weights[0] != pytest.approx(weights[1], rel=1e-3)

    def test_a_spike_is_bounded_by_the_edge_length(self, body):
        mesh, curvature = body
        mean = curvature.mean.copy()
        mean[7] = 1e6
        names = ("k1", "k2", "gauss", "normals", "failed", "d1", "error")
        spiked = sm.Curvature(**{name: getattr(curvature, name) for name in names}, mean=mean, method="spiked")
        plain, found = sm.saliency(mesh, curvature=curvature), sm.saliency(mesh, curvature=spiked)
        far = np.linalg.norm(mesh.vertices - mesh.vertices[7], axis=1) > 0.5
        assert found.max() < 2 * plain.max()
        assert found[far] == pytest.approx(plain[far], abs=0.3 * plain.max())

    @pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")
    def test_is_unknown_on_a_component_without_curvature(self):
        mesh = ball(8)
        extra = [[5.0, 0, 0], [6, 0, 0], [5, 1, 0]]
        n = mesh.n_vertices
        both = sm.TriangleMesh(np.vstack([mesh.vertices, extra]), np.vstack([mesh.faces, [[n, n + 1, n + 2]]]))
        found = sm.saliency(both, curvature=sm.curvature(both, "sine"))
        assert np.isnan(found[n:]).all()
        assert np.isfinite(found[:n]).all()


class TestSalientPoints:
    def test_of_saliency_begin_at_the_given_scale(self, body):
        mesh, curvature = body
        found = sm.salient_points(mesh, of="saliency", curvature=curvature, scale=0.15)
        expected = sm.saliency(mesh, curvature=curvature, scales=0.15 * np.array([1, 1.5, 2, 2.5, 3]))
        assert found.field.tolist() == expected.tolist()
        with pytest.raises(ValueError, match=r"^scale must be above 0 for saliency, which compares windows, not 0$"):
            sm.salient_points(mesh, of="saliency", curvature=curvature, scale=0)

    def test_are_the_bumps_in_order(self, body):
        mesh, curvature = body
        for of in ("mean", "saliency"):
            found = sm.salient_points(mesh, of=of, curvature=curvature)
            tips = [k for k in bump_of(found.points) if k >= 0]
            assert tips == [0, 1, 2, 3, 4]
            assert (np.diff(found.persistence) <= 0).all()

    def test_are_the_tips_of_an_ellipsoid(self):
        egg = sm.ellipsoid((3, 1, 1), 24).triangulated("dual")
        found = sm.salient_points(egg, curvature=curved(egg))
        assert sorted(found.points.round(1).tolist()) == [[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]]

    def test_are_the_same_at_twice_the_density(self):
        for frequency in (24, 48):
            mesh = bumpy(frequency)
            found = sm.salient_points(mesh, of="mean", curvature=curved(mesh), scale=0.06)
            assert bump_of(found.points)[:5] == [0, 1, 2, 3, 4]
            assert len(found) <= 6  # the ball itself bends more than the hollows around bumps

    @pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
    def test_noise_adds_none_and_hides_only_the_faint(self, seed):
        mesh = bumpy(40)
        rng = np.random.default_rng(seed)
        edge = Diffusion(as_sampled_surface(mesh)).spacing
        noisy = sm.TriangleMesh(mesh.vertices + 0.1 * edge * rng.normal(size=mesh.vertices.shape), mesh.faces)
        found = sm.salient_points(noisy, of="mean", curvature=curved(noisy, 3))
        assert {0, 1, 2} <= set(bump_of(found.points)) <= {0, 1, 2, 3, 4}

    @pytest.mark.parametrize("of", ["magnitude", "curvedness", "saliency"])
    @pytest.mark.parametrize("noise", [0.01, *nightly(0.1), 0.3])
    def test_of_a_noisy_ball_are_few_with_wide_neighborhoods(self, of, noise):
        """Neighbors that see far err alike: their means err hardly less. The highest may be there, no other."""
        found = [sm.salient_points(mesh, of=of, curvature=curvature) for mesh, curvature in noisy_balls(noise)]
        assert sum(map(len, found)) <= 3

    @given(st.integers(0, 10**6), st.floats(0.01, 100))
    def test_move_with_the_surface(self, seed, size):
        mesh = bumpy(12, width=0.25)
        copy = sm.TriangleMesh(size * mesh.vertices @ turned(seed).T + [1, -2, 3], mesh.faces)
        one, other = (sm.salient_points(each, of="mean", curvature=curved(each)) for each in (mesh, copy))
        assert other.vertices.tolist() == one.vertices.tolist()
        assert other.persistence * size == pytest.approx(one.persistence, rel=1e-3)

    def test_the_most_persistent_comes_first_not_the_highest(self):
        mesh = ball(20)
        x, _, z = mesh.vertices.T
        near = [np.linalg.norm(mesh.vertices - place, axis=1) for place in ([0, 0, 1.0], [0.6, 0, 0.8], [0, 0, -1])]
        field = np.maximum.reduce([10 - 9 * near[0], 9 - 9 * near[1], 5 - 9 * near[2], 0 * x])
        found = sm.salient_points(mesh, of=field)
        assert found.values.round().tolist() == [10, 5, 9]
        assert found.persistence == pytest.approx([10, 5, 2.4], abs=0.5)  # they meet half way, 0.32 from either
        assert z[found.vertices[1]] < -0.99

    def test_keep_their_distance_and_number(self, body):
        mesh, curvature = body
        found = sm.salient_points(mesh, curvature=curvature, threshold=0, radius=0.3)
        away = np.linalg.norm(found.points[:, None] - found.points, axis=2) + 9 * np.eye(len(found))
        assert len(found) > 5
        assert away.min() > 0.3
        assert len(sm.salient_points(mesh, curvature=curvature, threshold=0, radius=0)) > len(found)
        few = sm.salient_points(mesh, curvature=curvature, threshold=0, radius=0.3, count=3)
        assert few.vertices.tolist() == found.vertices[:3].tolist() == list(few)

    def test_basins_hold_their_points_and_everything(self, body):
        mesh, curvature = body
        found = sm.salient_points(mesh, of="mean", curvature=curvature)
        assert found.basin[found.vertices].tolist() == list(range(len(found)))
        assert found.basin.min() >= 0
        near = np.linalg.norm(mesh.vertices - 1.1 * BUMPS[2], axis=1) < 0.12
        assert set(found.basin[near]) == {bump_of(found.points).index(2)}

    def test_of_a_border_are_left_out_by_default(self):
        mesh = ball(16)
        kept = (mesh.vertices[mesh.faces][:, :, 2] > 0).all(axis=1)
        part = sm.TriangleMesh(mesh.vertices, mesh.faces[kept])
        field = -part.vertices[:, 2]
        assert len(sm.salient_points(part, of=field, border=True)) > 0
        assert len(sm.salient_points(part, of=field)) == 0

    def test_a_uniform_body_has_none(self):
        """The dual of an icosahedron's subdivision is a ball but for a third of a percent at its twelve pentagons."""
        mesh = sm.sphere(10).triangulated("dual")
        assert len(sm.salient_points(mesh)) == 0

    def test_use_the_error_of_the_curvature_they_measure(self, body):
        mesh, _ = body
        own, given_ = sm.salient_points(mesh), sm.salient_points(mesh, curvature=sm.curvature(mesh))
        assert own.threshold == given_.threshold
        assert own.vertices.tolist() == given_.vertices.tolist()

    def test_a_constant_field_has_none(self):
        mesh = ball(8)
        assert len(sm.salient_points(mesh, of=np.ones(mesh.n_vertices))) == 0


class TestClasses:
    def test_of_a_torus(self):
        ring = sm.torus(90, 36, radius=1.0, tube_radius=0.35).triangulated("dual")
        found = sm.hk_classes(ring, curvature=curved(ring, 1), scale=0)
        out = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
        assert set(found.labels[out > 1.08]) == {hk.PEAK}
        assert set(found.labels[out < 0.92]) == {hk.SADDLE_RIDGE}  # R < 2r nowhere: H stays positive

    def test_of_the_inside_of_a_thick_torus(self):
        ring = sm.torus(90, 60, radius=1.0, tube_radius=0.7).triangulated("dual")
        found = sm.hk_classes(ring, curvature=curved(ring, 1), scale=0)
        out = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
        inner = out < 0.45  # H < 0 within R / 2 of the axis
        assert set(found.labels[inner]) == {hk.SADDLE_VALLEY}

    @pytest.mark.filterwarnings("ignore:the faces are oriented inward")
    def test_of_a_ball_from_both_sides(self):
        mesh = ball(16)
        inside = sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
        assert sm.hk_classes(mesh, curvature=curved(mesh)).counts == {"peak": mesh.n_vertices}
        assert sm.hk_classes(inside, curvature=curved(inside)).counts == {"pit": mesh.n_vertices}

    def test_of_a_plane_and_a_tube(self):
        sheet = sm.plane(20, 20).triangulated("dual")
        middle = as_sampled_surface(sheet).one_ring.closed
        flat = sm.hk_classes(sheet, curvature=curved(sheet), tolerance_mean=1e-9, tolerance_gauss=1e-9)
        assert set(flat.labels[middle]) == {hk.FLAT}
        tube = sm.cylinder(48, 40, height=4).triangulated("dual")
        middle = np.abs(tube.vertices[:, 2]) < 1.2
        found = sm.hk_classes(tube, curvature=curved(tube), tolerance_gauss=0.02)
        assert set(found.labels[middle]) == {hk.RIDGE}

    @pytest.mark.parametrize(
        ("mean", "gauss", "expected"),
        [
            (1, 1, hk.PEAK), (1, 0, hk.RIDGE), (1, -1, hk.SADDLE_RIDGE), (0, 0, hk.FLAT), (0, -1, hk.MINIMAL),
            (-1, -1, hk.SADDLE_VALLEY), (-1, 0, hk.VALLEY), (-1, 1, hk.PIT), (0.01, 1, hk.PEAK), (-0.01, 1, hk.PIT),
        ],
    )  # fmt: skip
    def test_table(self, mean, gauss, expected):
        near = np.full(1, 0.1)
        assert hk.signs(np.array([float(mean)]), np.array([float(gauss)]), near, near).tolist() == [expected]

    def test_noise_leaves_most_where_they_were(self):
        ring = sm.torus(120, 48, radius=1.0, tube_radius=0.35).triangulated("dual")
        edge = Diffusion(as_sampled_surface(ring)).spacing
        noise = 0.03 * edge * np.random.default_rng(0).normal(size=ring.vertices.shape)
        noisy = sm.TriangleMesh(ring.vertices + noise, ring.faces)
        found = sm.hk_classes(noisy, curvature=curved(noisy, 3))
        out = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
        wrong = (found.labels == hk.PEAK) & (out < 0.95) | (found.labels == hk.SADDLE_RIDGE) & (out > 1.05)
        assert wrong.mean() < 0.01
        assert (found.labels[out > 1.25] == hk.PEAK).mean() > 0.8

    def test_noise_does_not_make_saddles_into_peaks(self):
        """The mean of noisy K has the variance of H on top; that of tensors has not."""
        ring = sm.torus(160, 80, radius=1.0, tube_radius=0.35).triangulated("dual")
        edge = Diffusion(as_sampled_surface(ring)).spacing
        noise = 0.06 * edge * np.random.default_rng(0).normal(size=ring.vertices.shape)
        curvature = curved(sm.TriangleMesh(ring.vertices + noise, ring.faces))
        diffusion = Diffusion(as_sampled_surface(ring))
        out = np.hypot(ring.vertices[:, 0], ring.vertices[:, 1])
        truth = (1 - 1 / out) / 0.35**2
        gauss = smoothed_curvature(diffusion, curvature, 0.1).gauss
        off = np.abs(gauss - truth).mean(), np.abs(diffusion.smoothed(curvature.gauss, 0.1) - truth).mean()
        assert off[0] < 0.35 < 2 < off[1]
        inner = sm.hk_classes(ring, curvature=curvature, scale=0.1).labels[out < 0.72]
        assert set(inner) <= {hk.SADDLE_RIDGE, hk.SADDLE_VALLEY, hk.MINIMAL}

    def test_tolerances_come_from_the_visible_error(self):
        mesh = ball(20)
        plain = curved(mesh)
        rough = plain.mean + np.random.default_rng(0).normal(size=mesh.n_vertices)
        names = ("k1", "k2", "gauss", "normals", "failed", "d1")
        kept = {name: getattr(plain, name) for name in names}

        def tolerance(mean, error):
            known = sm.Curvature(**kept, mean=mean, error=np.full(mesh.n_vertices, error), method="given")
            return sm.hk_classes(mesh, curvature=known, scale=0).tolerance_mean

        floor = 0.3 / Diffusion(as_sampled_surface(mesh)).diagonal
        assert tolerance(rough, 0.5) == pytest.approx(hk.SIGNIFICANCE * 0.5)
        shown = 3.0  # three times what neighbors differ
        assert np.median(tolerance(rough, 50.0)) == pytest.approx(hk.SIGNIFICANCE * shown, rel=0.25)
        assert tolerance(np.ones(mesh.n_vertices), 50.0) == pytest.approx(floor, rel=1e-3)
        assert sm.hk_classes(mesh, curvature=plain, scale=0).counts == {"peak": mesh.n_vertices}

    def test_a_coarse_clean_mesh_shows_its_saddles(self):
        """The window of 1.5 edges is three quarters of the tube's radius: averaged, a quarter of K is left."""
        made = torus(40, 14, irregular=True, rng=0)
        found = sm.hk_classes(made.mesh)
        expected = np.where(made.exact.gauss > 0, hk.PEAK, hk.SADDLE_RIDGE)
        clear = np.abs(made.exact.gauss) > 0.4
        assert (found.labels == expected)[clear].mean() > 0.95
        assert (found.labels == expected)[np.abs(made.exact.gauss) > 1].all()

    @pytest.mark.parametrize("noise", [0.0, 0.1, 0.2])
    def test_a_thin_tube_is_a_ridge_with_noise_and_without(self, noise):
        tube = noisy(uv_cylinder(48, 168, 0.5, 10.0).mesh, noise, rng=1)
        middle = np.abs(tube.vertices[:, 2] - tube.vertices[:, 2].mean()) < 4.5
        found = sm.hk_classes(tube)
        assert (found.labels == hk.RIDGE)[middle].mean() > 0.95

    def test_bent_surfaces_of_uncertain_signs_are_not_flat(self):
        k1, k2 = np.array([[3.0, -3.0], [3, 0.1], [-0.1, -3], [1, -1], [3, -2], [3, -0.8]]).T
        found = hk.bent_class((k1 + k2) / 2, k1 * k2, np.full(6, 1.0))
        assert [hk.NAMES[k] for k in found] == ["minimal", "ridge", "valley", "flat", "minimal", "ridge"]

    def test_within_given_tolerances_all_is_flat(self):
        sheet = sm.plane(30, 30, size=(0.4, 0.4)).triangulated("dual")
        x, y, _ = sheet.vertices.T
        saddle = sm.TriangleMesh(np.stack([x, y, x * y], axis=1), sheet.faces)  # H 0, K -1
        assert set(hk.hk_classes(saddle, tolerance_mean=0.2, tolerance_gauss=2.0).labels) == {hk.FLAT}
        assert set(hk.hk_classes(saddle).labels) == {hk.MINIMAL}

    @pytest.mark.parametrize("noise", [0.0, 0.1])
    def test_a_monkey_saddle_is_flat_only_at_its_center(self, noise):
        made = split_square(graph("monkey_saddle"), 22)
        found = sm.hk_classes(noisy(made.mesh, noise, rng=0)).labels[made.inner]
        curvedness = np.sqrt(2 * made.exact.mean**2 - made.exact.gauss)[made.inner]
        assert 0 < curvedness[found == hk.FLAT].max() < 0.2 < 0.7 < curvedness.mean()
        assert set(found) <= {hk.FLAT, hk.MINIMAL, hk.SADDLE_RIDGE, hk.SADDLE_VALLEY}

    def test_averages_decide_where_a_vertex_is_zero_within_its_tolerance(self):
        one = tuple(np.array(each) for each in ([3.0, 0.1, 0.1], [5.0, 5.0, 0.1], [1.0, 1, 1], [2.0, 2, 2]))
        other = tuple(np.array(each) for each in ([-0.5, 0.9, 1.1], [-0.5, -9, 1.9], [0.4, 0.4, 0.4], [0.6, 0.6, 0.6]))
        assert [each.tolist() for each in hk._combined([one, other])] == [
            [3.0, 0.9, 0.1], [5.0, 5.0, 1.9], [1.0, 0.4, 1], [2.0, 2, 0.6],
        ]  # fmt: skip

    def test_a_face_is_flat_up_to_its_edges(self):
        """Windows near an edge have some of its bend."""
        corners = np.array([[i, j, k] for i in (-1.0, 1) for j in (-1.0, 1) for k in (-1.0, 1)])
        sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        faces = [[a, b, c] for a, b, c, _ in sides] + [[a, c, d] for a, _, c, d in sides]
        fine = sm.divided(sm.TriangleMesh(corners, faces), 0.06)
        beside = np.sort(np.abs(fine.vertices), axis=1)[:, 1]
        assert (sm.hk_classes(fine).labels == hk.FLAT)[beside < 0.9].mean() > 0.99

    @pytest.mark.filterwarnings("ignore::simplexmesh.SimplexMeshWarning")
    def test_failed_vertices_are_unknown(self):
        mesh = sm.TriangleMesh(np.vstack([ball(8).vertices, [[9.0, 9, 9]]]), ball(8).faces)
        found = sm.hk_classes(mesh, curvature=sm.curvature(mesh, "sine"))
        assert found.labels[-1] == hk.UNKNOWN
        assert found.counts["unknown"] == 1
        assert repr(found).startswith("HKClasses(unknown 1, peak")


class TestSmoothedCurvature:
    def test_averages_with_directions_equal_the_definition(self):
        mesh = sm.ellipsoid((3, 2, 1), 4).triangulated("dual")
        found = curved(mesh)
        diffusion = Diffusion(as_sampled_surface(mesh))
        expected = turning_mean(diffusion, found.normals, found.d1, (found.k1 - found.k2) / 2, 0.6)
        assert mean_deviators(diffusion, found, found.d1, 0.6) == pytest.approx(expected, abs=1e-4)

    @given(st.integers(0, 10**6))
    def test_does_not_depend_on_signs_of_directions_or_place(self, seed):
        mesh = ball(6)
        mesh = sm.TriangleMesh(mesh.vertices * [1.0, 0.8, 0.5], mesh.faces)
        found, turn = curved(mesh), turned(seed)
        sign = np.random.default_rng(seed).choice([-1.0, 1.0], (mesh.n_vertices, 1))
        other = replace(found, normals=found.normals @ turn.T, d1=sign * found.d1 @ turn.T)
        diffusion = Diffusion(as_sampled_surface(mesh))
        moved = Diffusion(as_sampled_surface(sm.TriangleMesh(mesh.vertices @ turn.T, mesh.faces)))
        assert mean_deviators(moved, other, other.d1, 0.3) == pytest.approx(
            mean_deviators(diffusion, found, found.d1, 0.3), abs=1e-4
        )

    def test_tensors_that_rotate_with_the_surface_are_kept(self):
        """Around a tube k1 is the same everywhere, and d1 goes round with it."""
        ring = torus(200, 40, radius=5.0, tube_radius=1.0)
        c = sm.curvature(ring.mesh)
        diffusion = Diffusion(as_sampled_surface(ring.mesh))
        half = diffusion.smoothed((c.k1 - c.k2) / 2, 0.5)
        assert np.abs(mean_deviators(diffusion, c, c.d1, 0.5)) == pytest.approx(half, rel=0.03)
        _, gauss, _ = smoothed_curvature(diffusion, c, 0.5)
        assert gauss == pytest.approx(diffusion.smoothed(c.gauss, 0.5), abs=0.03)

    def test_of_methods_without_directions_k_is_the_mean_of_k(self):
        ring = torus(60, 24).mesh
        c, diffusion = sm.curvature(ring, "discrete"), Diffusion(as_sampled_surface(ring))
        assert c.d1 is None
        assert smoothed_curvature(diffusion, c, 0.3).gauss == pytest.approx(diffusion.smoothed(c.gauss, 0.3))
        for found in shrunk(diffusion, c):
            assert found.gauss == pytest.approx(diffusion.smoothed(c.gauss, smallest_window(diffusion)))

    def test_clean_values_stay_and_noisy_ones_become_means(self):
        made = torus(40, 14, irregular=True, rng=0)
        diffusion = Diffusion(as_sampled_surface(made.mesh))
        (mean, gauss, _), (whole, whole_gauss, _) = shrunk(diffusion, sm.curvature(made.mesh))
        assert rms(mean - made.exact.mean) < 0.4 * rms(whole - made.exact.mean)
        assert rms(gauss - made.exact.gauss) < 0.4 * rms(whole_gauss - made.exact.gauss)
        rough = noisy(ball(16), 0.1, rng=0)
        diffusion, c = Diffusion(as_sampled_surface(rough)), sm.curvature(rough)
        (mean, gauss, error), (whole, _, left) = shrunk(diffusion, c)
        assert rms(mean - whole) < 0.1 * rms(c.mean - whole)
        assert rms(gauss - 1) < 0.7 * rms(c.gauss - 1)
        assert left.mean() < 1.001 * error.mean() < 0.8 * local_noise(diffusion, c).mean()

    def test_methods_without_directions_or_errors_are_averaged(self):
        mesh = ball(8)
        for found in (sm.curvature(mesh, "discrete"), curved(mesh)):
            diffusion = Diffusion(as_sampled_surface(mesh))
            one, other = shrunk(diffusion, found)
            assert one is other
            assert one.mean == pytest.approx(diffusion.smoothed(found.mean, smallest_window(diffusion)))

    def test_neighbors_without_an_estimate_have_no_weight(self):
        ring = torus(100, 20, radius=5.0, tube_radius=1.0)
        found = sm.curvature(ring.mesh)
        hidden = np.arange(len(found.k1)) % 7 == 0
        kept = {name: np.where(hidden, np.nan, getattr(found, name)) for name in ("k1", "k2", "mean", "gauss")}
        kept |= {name: np.where(hidden[:, None], np.nan, getattr(found, name)) for name in ("normals", "d1")}
        diffusion = Diffusion(as_sampled_surface(ring.mesh))
        mean, gauss, _ = smoothed_curvature(diffusion, replace(found, failed=hidden, **kept), 0.5)
        whole, whole_gauss, _ = smoothed_curvature(diffusion, found, 0.5)
        assert np.isnan(mean).tolist() == np.isnan(gauss).tolist() == hidden.tolist()
        assert mean[~hidden] == pytest.approx(whole[~hidden], abs=0.02)
        assert gauss[~hidden] == pytest.approx(whole_gauss[~hidden], abs=0.02)


def rms(values):
    return float(np.sqrt((values**2).mean()))


def test_the_noise_of_a_field():
    mesh = ball(40)
    noise = 0.3 * np.random.default_rng(0).normal(size=mesh.n_vertices)
    found = field_noise(Diffusion(as_sampled_surface(mesh)), 5 * mesh.vertices[:, 2] + noise)
    assert found == pytest.approx(0.3, rel=0.15)


class TestBadInput:
    @pytest.mark.parametrize("function", [sm.saliency, sm.salient_points, sm.hk_classes])
    @pytest.mark.parametrize(
        ("options", "error", "words"),
        [
            ({"curvature": 3}, TypeError, "curvature must be a Curvature, made by simplexmesh.curvature, not int"),
            ({"curvature": "other"}, ValueError, "curvature must have 642 rows, one per vertex, not 162"),
        ],
    )
    def test_curvature_of_something_else(self, function, options, error, words):
        if options["curvature"] == "other":
            options = {"curvature": curved(ball(4))}
        with pytest.raises(error) as caught:
            function(ball(8), **options)
        assert str(caught.value) == words

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda m: sm.saliency(m, scales=[]), "scales must be at least one length above 0, not []"),
            (lambda m: sm.saliency(m, scales=[0.1, -1]), "scales must be at least one length above 0, not [0.1, -1.0]"),
            (
                lambda m: sm.saliency(m, scales=[0.1, 1e6]),
                "scales must be from 0.015, below which nothing is averaged, to 3.46, not [0.1, 1000000.0]",
            ),
            (
                lambda m: sm.saliency(m, scales=[1e-6]),
                "scales must be from 0.015, below which nothing is averaged, to 3.46, not [1e-06]",
            ),
            (lambda m: sm.saliency(m, scales=[np.nan]), "scales must be finite; scales[0] is nan"),
            (lambda m: sm.saliency(m, of="gauss"), "of must be one of 'mean', 'magnitude', 'curvedness', not 'gauss'"),
            (lambda m: sm.saliency(m, of=[1.0, 2]), "of must have shape (642,), not (2,)"),
            (
                lambda m: sm.salient_points(m, of="k"),
                "of must be one of 'magnitude', 'mean', 'curvedness', 'saliency', not 'k'",
            ),
            (lambda m: sm.salient_points(m, radius=-1), "radius must be at least 0, not -1"),
            (lambda m: sm.salient_points(m, scale=-1), "scale must be at least 0, not -1"),
            (lambda m: sm.salient_points(m, threshold=np.nan), "threshold must be finite, not nan"),
            (lambda m: sm.salient_points(m, count=-1), "count must be at least 0, not -1"),
            (lambda m: sm.hk_classes(m, tolerance_mean=-1), "tolerance_mean must be at least 0, not -1"),
            (lambda m: sm.hk_classes(m, tolerance_gauss=[-1.0] * 642), "tolerance_gauss must be at least 0, not -1"),
        ],
    )  # fmt: skip
    def test_is_one_sentence(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call(ball(8))
        assert str(caught.value) == words

    @pytest.mark.parametrize("function", [sm.saliency, sm.salient_points, sm.hk_classes, sm.inversion_lines])
    @pytest.mark.parametrize(
        "surface", [3, np.full((9, 3), np.nan), "nowhere.off", (np.eye(4)[:, :3], np.zeros((0, 3)))]
    )
    def test_other_objects_are_refused(self, function, surface):
        with pytest.raises((ValueError, TypeError, OSError)):
            function(surface)

    def test_a_surface_without_any_curvature_has_no_saliency(self):
        samples = SampledSurface(np.eye(4)[:, :3], links=Neighborhoods.of(np.full((4, 1), -1, np.int32)))
        with pytest.warns(sm.SimplexMeshWarning, match="at 4 of 4 vertices"):
            unknown = sm.curvature(samples, "sine")
        assert np.isnan(sm.saliency(samples, curvature=unknown)).all()
        assert len(sm.salient_points(samples, curvature=unknown)) == 0
        assert sm.hk_classes(samples, curvature=unknown).counts == {"unknown": 4}
