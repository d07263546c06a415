"""Curvature on borders: about as accurate as inside, with an error to match; the twins of its kernels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.surface.curvature import _kernels_high_degree, high_degree, rims
from simplexmesh.surface.curvature import _kernels_rims as kernels
from simplexmesh.surface.curvature.jets import fitted
from simplexmesh.surface.curvature.scales import scales_of
from simplexmesh.surface.curvature.stacked import stacked
from simplexmesh.surface.samples import as_samples
from simplexmesh.surface.truth import discretized
from simplexmesh.surface.truth.graphs import graph
from simplexmesh.surface.truth.noise import noisy
from tests import reference_rims as reference


def half_torus(rng=0):
    ring = discretized.torus(168, 60, irregular=True, rng=rng)
    return discretized.cut(ring, ring.vertices[:, 0] > 0)


def half_ellipsoid(rng=0):
    whole = discretized.ellipsoid(100, 100, irregular=True, rng=rng)
    return discretized.cut(whole, whole.vertices @ [0.6, 0.5, 0.62] > -0.05)


def square(name):
    def made(rng=0):
        return discretized.split_square(graph(name), 80)

    return made


def rms(values):
    return np.sqrt((values**2).mean())


def errors(made, noise, rng=1):
    """Of H, on the rim and inside."""
    found = sm.curvature(noisy(made.mesh, noise, rng=rng))
    off = found.mean - made.exact.mean
    return off[~made.inner], off[made.inner]


class TestAccuracy:
    @pytest.mark.parametrize(
        ("surface", "noise", "most"),
        [
            (half_torus, 0.01, 2.0),  # 3.0 where nothing is learned
            (half_torus, 0.1, 2.0),  # 2.6
            (half_ellipsoid, 0.01, 2.0),  # 1.7
            (half_ellipsoid, 0.1, 2.0),  # 0.8
            (square("exponential"), 0.01, 2.2),  # 3.0
            (square("exponential"), 0.1, 2.0),  # 2.1
            (square("trigonometric"), 0.01, 2.5),  # 2.9
            (square("trigonometric"), 0.1, 2.0),  # 1.7
            (square("monkey_saddle"), 0.1, 2.0),  # 1.9
        ],
    )
    def test_within_twice_the_inside(self, surface, noise, most):
        made = surface()
        both = (errors(made, noise, rng) for rng in (1, 2))
        assert np.mean([rms(on_rim) / rms(inside) for on_rim, inside in both]) < most

    @pytest.mark.parametrize("noise", [0.003, 0.01, 0.1])
    @pytest.mark.parametrize("surface", [half_torus, square("exponential"), square("trigonometric")])
    def test_better_than_the_fit_alone(self, surface, noise):
        made = surface()
        samples = as_samples(noisy(made.mesh, noise, rng=1))
        rows = np.flatnonzero(~made.inner)
        alone = fitted(samples, rows, scales_of(samples), samples.one_ring).shape.mean(axis=1)
        on_rim, _ = errors(made, noise)
        assert rms(on_rim) < 0.95 * rms(alone - made.exact.mean[rows])

    @pytest.mark.parametrize("name", ["exponential", "trigonometric", "monkey_saddle"])
    def test_graphs_without_noise(self, name):
        """Their grids are not scattered: fits that nearly interpolate fail there, others do not."""
        on_rim, inside = errors(square(name)(), 0.0)
        assert rms(on_rim) < 2.0 * rms(inside)  # up to 26 with fits of degree 6

    @pytest.mark.parametrize(("around", "most"), [(120, 1e-4), (60, 3e-3)])
    @pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.6, 0.5, 0.62), (0.0, 0.0, 1.0)])
    def test_regular_tori_without_noise(self, normal, around, most):
        """Near-singular fits to few rows of a grid err by 0.1 on the rim, and by 0.08 in parts without a probe."""
        made = discretized.torus(14 * around // 5, around)
        on_rim, inside = errors(discretized.cut(made, made.vertices @ normal > 0.1), 0.0)
        assert rms(on_rim) < most
        assert rms(inside) < most

    @pytest.mark.parametrize("rng", [0, 1, 2])
    @pytest.mark.parametrize(
        "normal", [(1.0, 0.0, 0.0), (0.6, 0.5, 0.62), (0.0, 0.0, 1.0)], ids=["meridian", "aslant", "parallel"]
    )
    def test_tori_without_noise(self, rng, normal):
        made = discretized.torus(168, 60, irregular=True, rng=rng)
        on_rim, inside = errors(discretized.cut(made, made.vertices @ normal > 0.02), 0.0)
        assert rms(on_rim) < 2.0 * rms(inside)  # 5 to 11 with fits of degree 6

    def test_a_fit_of_high_degree_replaces_only_worse_ones(self):
        made = half_torus()
        samples = as_samples(made.mesh)
        scales, rows = scales_of(samples), np.flatnonzero(~made.inner)
        found = fitted(samples, rows, scales, samples.one_ring)
        each = np.arange(len(rows))
        after = high_degree.refitted(samples, rows, each, scales, found)
        changed = (after.shape != found.shape).any(axis=1)
        assert changed.mean() > 0.9
        assert (after.error[changed] < found.error[changed]).all()
        sure = after._replace(error=np.where(each % 2, 1.0, 1e-12))
        again = high_degree.refitted(samples, rows, each, scales, sure)
        np.testing.assert_array_equal(again.shape[::2], after.shape[::2])
        np.testing.assert_array_equal(again.normals[::2], after.normals[::2])
        assert (again.shape[1::2] != after.shape[1::2]).any(axis=1).mean() > 0.9

    def test_a_fit_of_high_degree_replaces_what_contradicts_it(self):
        """However sure that was."""
        made = half_torus()
        samples = as_samples(made.mesh)
        scales, rows = scales_of(samples), np.flatnonzero(~made.inner)
        found = fitted(samples, rows, scales, samples.one_ring)
        wrong = found._replace(shape=found.shape * 1.01, error=np.full(len(rows), 1e-9))
        after = high_degree.refitted(samples, rows, np.arange(len(rows)), scales, wrong)
        assert rms(after.shape.mean(axis=1) - made.exact.mean[rows]) < 1e-3

    def test_a_fit_of_high_degree_does_not_depend_on_the_normal_it_starts_from(self):
        """Chords over a plane that is not tangent are stretched unevenly: H was off by H times the squared angle."""
        made = half_torus()
        samples = as_samples(made.mesh)
        scales, rim = scales_of(samples), np.flatnonzero(~made.inner)
        found = fitted(samples, rim, scales, samples.one_ring)
        tilted = found.normals + 0.02 * found.d1
        tilted /= np.linalg.norm(tilted, axis=1)[:, None]
        along = found.d1 - (found.d1 * tilted).sum(axis=1)[:, None] * tilted
        along /= np.linalg.norm(along, axis=1)[:, None]
        fits = np.array([[8, 100]])
        one, other = (
            high_degree._tried(samples, rim, scales, known, fits).jets[:, 0, :2].mean(axis=1)
            for known in (found, found._replace(normals=tilted, d1=along))
        )
        assert abs((other - one).mean()) < 3e-5

    def test_gauss_and_directions_too(self):
        made = half_torus()
        samples = as_samples(noisy(made.mesh, 0.01, rng=1))
        rim = np.flatnonzero(~made.inner)
        found = sm.curvature(noisy(made.mesh, 0.01, rng=1))
        alone = fitted(samples, rim, scales_of(samples), samples.one_ring).shape.prod(axis=1)
        exact = made.exact.gauss[rim]
        assert rms(found.gauss[rim] - exact) < 0.75 * rms(alone - exact)
        assert np.abs((found.d1 * found.normals).sum(axis=1)).max() < 1e-9
        assert np.abs(np.linalg.norm(found.d1, axis=1) - 1).max() < 1e-9
        assert np.median(np.abs((found.d1 * made.exact.d1).sum(axis=1))[rim]) > 0.999
        assert (found.k1 >= found.k2).all()

    def test_of_simplex_meshes(self):
        made = half_torus()
        mesh = sm.dual(noisy(made.mesh, 0.01, rng=1))
        around, height = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) - 1, mesh.vertices[:, 2]
        cosine = np.cos(np.arctan2(height, around))
        off = sm.curvature(mesh).mean - (1 / 0.35 + cosine / (1 + 0.35 * cosine)) / 2
        rim = ~as_samples(mesh).one_ring.closed
        assert rim.sum() > 100
        assert rms(off[rim]) < 2.0 * rms(off[~rim])  # 2.4 where nothing is learned

    @pytest.mark.parametrize("name", ["lion_head.off", "elephant.off"])
    def test_a_cut_through_a_scan_agrees_with_the_whole(self, data_folder, name):
        mesh = sm.read(data_folder / name)
        whole = sm.curvature(mesh)
        kept = ((mesh.vertices - np.median(mesh.vertices, axis=0))[:, 0] > 0)[mesh.faces].all(axis=1)
        used, faces = np.unique(mesh.faces[kept], return_inverse=True)
        samples = as_samples(sm.TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3)))
        found = sm.curvature(samples)
        rows = np.flatnonzero(~samples.one_ring.closed & as_samples(mesh).one_ring.closed[used] & ~found.failed)
        alone = fitted(samples, rows, scales_of(samples), samples.one_ring).shape.mean(axis=1)
        exact = whole.mean[used[rows]]
        assert np.abs(found.mean[rows] - exact).mean() < 1.05 * np.abs(alone - exact).mean()


class TestError:
    @pytest.mark.parametrize("noise", [0.003, 0.01, 0.1])
    @pytest.mark.parametrize("surface", [half_torus, square("trigonometric"), square("exponential"), half_ellipsoid])
    def test_matches_the_actual_one(self, surface, noise):
        """A graph's rim at 0.3 % noise errs 3 to 5 times as much as the fit alone expects, 1.5 to 2.2 as this."""
        made = surface()
        found = sm.curvature(noisy(made.mesh, noise, rng=1))
        apart = (np.abs(found.mean - made.exact.mean) / found.error)[~made.inner]
        assert 0.2 < np.median(apart) / 0.6745 < 2.4


class TestUnchanged:
    def test_all_but_borders(self):
        made = half_torus()
        mesh = noisy(made.mesh, 0.01, rng=1)
        samples = as_samples(mesh)
        found = sm.curvature(mesh)
        alone = fitted(samples, np.arange(len(made.vertices)), scales_of(samples), samples.one_ring)
        np.testing.assert_array_equal(found.mean[made.inner], alone.shape.mean(axis=1)[made.inner])
        np.testing.assert_array_equal(found.error[made.inner], alone.error[made.inner])
        assert (found.mean[~made.inner] != alone.shape.mean(axis=1)[~made.inner]).mean() > 0.95

    def test_some_vertices_are_rows_of_all(self):
        mesh = noisy(half_torus().mesh, 0.01, rng=1)
        rim = np.flatnonzero(~as_samples(mesh).one_ring.closed)
        some = np.array([rim[7], 2000, rim[50], rim[3]])
        found, part = sm.curvature(mesh), sm.curvature(mesh, vertices=some)
        np.testing.assert_allclose(part.mean, found.mean[some], rtol=1e-12)
        np.testing.assert_allclose(part.error, found.error[some], rtol=1e-12)

    def test_rotated_scaled_and_renumbered(self):
        mesh = noisy(half_torus().mesh, 0.01, rng=1)
        order = np.random.default_rng(0).permutation(len(mesh.vertices))
        turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
        other = sm.TriangleMesh(8.0 * (mesh.vertices @ turn.T)[order] + 3.0, order.argsort()[mesh.faces])
        found, moved = sm.curvature(mesh), sm.curvature(other)
        assert np.abs(8.0 * moved.mean - found.mean[order]).max() < 1e-5
        assert np.abs(8.0 * moved.error - found.error[order]).max() < 1e-5
        assert np.abs(np.abs((moved.d1 * (found.d1 @ turn.T)[order]).sum(axis=1)) - 1).max() < 1e-6

    def test_inside_out(self):
        mesh = noisy(half_torus().mesh, 0.01, rng=1)
        found, other = sm.curvature(mesh), sm.curvature(sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1]))
        assert np.abs(found.mean + other.mean).max() < 1e-8

    @pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
    def test_coarse_mesh_inside_out_and_reflected(self, noise):
        """Whether few points determine a cubic depended on the handedness of the axes: H changed by 0.12."""
        made = discretized.torus(40, 16, irregular=True)
        mesh = noisy(discretized.cut(made, made.vertices[:, 1] > -0.2).mesh, noise, rng=1)
        found, flipped = sm.curvature(mesh), mesh.faces[:, ::-1]
        assert np.abs(found.mean + sm.curvature(sm.TriangleMesh(mesh.vertices, flipped)).mean).max() < 1e-8
        assert np.abs(found.mean - sm.curvature(sm.TriangleMesh(mesh.vertices * [1, -1, 1], flipped)).mean).max() < 1e-8

    def test_too_little_to_learn_from(self):
        """A disc of three rings has no row four farther in, and a strip nothing inside."""
        made = discretized.split_square(graph("paraboloid"), 5)
        strip = discretized.cut(discretized.torus(60, 24), discretized.torus(60, 24).vertices[:, 2] > 0.25)
        for one in (noisy(made.mesh, 0.01, rng=0), noisy(strip.mesh, 0.01, rng=0)):
            samples = as_samples(one)
            rows = np.arange(len(one.vertices))
            alone = fitted(samples, rows, scales_of(samples), samples.one_ring)
            np.testing.assert_allclose(sm.curvature(one).mean, alone.shape.mean(axis=1), rtol=1e-12, atol=1e-12)

    @pytest.mark.parametrize("noise", [0.0, 1e-4, 0.01])
    def test_isolated_points_and_stray_triangles_change_nothing(self, noise):
        mesh = noisy(half_torus().mesh, noise, rng=1)
        n, rng = len(mesh.vertices), np.random.default_rng(0)
        corners = np.repeat(rng.uniform(5.0, 9.0, (2 * n, 3)), 3, axis=0) + 0.01 * rng.normal(size=(6 * n, 3))
        points = rng.uniform(-9.0, -5.0, (2 * n, 3))
        faces = np.vstack([mesh.faces, n + np.arange(6 * n).reshape(-1, 3)])
        found = sm.curvature(mesh)
        for others, left in ((points, mesh.faces), (corners, faces)):
            with pytest.warns(sm.SimplexMeshWarning):
                more = sm.curvature(sm.TriangleMesh(np.vstack([mesh.vertices, others]), left))
            rim = ~as_samples(mesh).one_ring.closed
            assert rms(more.mean[:n][rim] - found.mean[rim]) < 0.5 * rms(found.error[rim])
            assert np.median(more.error[:n][rim] / found.error[rim]) == pytest.approx(1.0, abs=0.2)

    def test_planes_are_flat_to_the_rim(self):
        made = discretized.split_square(graph("plane"), 40)
        assert np.abs(sm.curvature(made.mesh).mean).max() < 1e-9

    def test_detail_is_a_lower_bound_there_too(self):
        mesh = noisy(half_torus().mesh, 0.01, rng=1)
        samples = as_samples(mesh)
        rim = np.flatnonzero(~samples.one_ring.closed)
        alone = fitted(samples, rim, scales_of(samples, detail=0.3), samples.one_ring)
        np.testing.assert_array_equal(sm.curvature(mesh, detail=0.3).mean[rim], alone.shape.mean(axis=1))


class TestBent:
    @settings(max_examples=30)
    @given(seed=st.integers(0, 999))
    def test_adds_to_the_shape_operator(self, seed):
        chance = np.random.default_rng(seed)
        axes = np.linalg.qr(chance.normal(size=(5, 3, 3)))[0]
        axes[:, :, 2] = np.cross(axes[:, :, 0], axes[:, :, 1])
        d1, normals = axes[:, :, 0], axes[:, :, 2]
        shape = np.sort(chance.normal(size=(5, 2)), axis=1)[:, ::-1]
        along, more = chance.normal(size=(5, 3)), chance.normal(size=5)
        bends, first = rims.bent(shape, d1, normals, along, more)
        for i in range(5):
            before = axes[i][:, :2] @ np.diag(shape[i]) @ axes[i][:, :2].T
            way = along[i] - (along[i] @ normals[i]) * normals[i]
            way /= np.linalg.norm(way)
            after = before + more[i] * np.outer(way, way)
            assert np.trace(after) == pytest.approx(bends[i].sum())
            np.testing.assert_allclose(after @ first[i], bends[i, 0] * first[i], atol=1e-9)
            assert bends[i, 0] >= bends[i, 1]


class TestStacked:
    def test_recovers_true_weights(self):
        chance = np.random.default_rng(0)
        true = np.array([0.8, -0.3, 0.0, 0.5])
        predictors = chance.normal(size=(3, 80, 4))
        weights, rest = stacked([(one, one @ true + 0.01 * chance.normal(size=80)) for one in predictors], 9.0)
        np.testing.assert_allclose(weights, true, atol=0.02)
        assert 0.005 < rest.std() < 0.02

    def test_contradicting_sets_give_zero_weights(self):
        chance = np.random.default_rng(0)
        predictors, true = chance.normal(size=(3, 80, 4)), np.array([[1.0, 1, 0, -1], [-1, -1, 1, 0], [0, 0, -1, 1]])
        weights, _ = stacked([(one, one @ of) for one, of in zip(predictors, true, strict=True)], 9.0)
        assert np.abs(weights).max() < 0.01

    def test_one_set_gives_zero_weights(self):
        predictors = np.random.default_rng(0).normal(size=(80, 4))
        assert (stacked([(predictors, predictors[:, 0])], 9.0)[0] == 0).all()


class TestTwins:
    @staticmethod
    def drawn(seed, noise):
        made = discretized.torus(48, 18, irregular=True, rng=seed)
        made = discretized.cut(made, made.vertices[:, 1] > 0)
        samples = as_samples(noisy(made.mesh, noise, rng=seed))
        ring = samples.one_ring
        return samples, [ring[i].tolist() for i in range(len(made.vertices))]

    @settings(max_examples=5)
    @given(seed=st.integers(0, 999), most=st.integers(0, 6))
    def test_depths_and_peeled(self, seed, most):
        samples, rings = self.drawn(seed, 0.0)
        ring = samples.one_ring
        found = kernels.depths(ring.offsets, ring.members, ring.closed, most)
        np.testing.assert_array_equal(found, reference.depths(rings, ring.closed, most))
        offsets, members = kernels.peeled(ring.offsets, ring.members, found, 2)
        for i, one in enumerate(rings):
            left = [j for j in one if found[j] >= 2] if found[i] >= 2 else []
            assert members[offsets[i] : offsets[i + 1]].tolist() == left

    @settings(max_examples=10)
    @given(seed=st.integers(0, 999), noise=st.sampled_from([0.0, 0.01, 0.1]))
    def test_plain_fits(self, seed, noise):
        samples, rings = self.drawn(seed, noise)
        ring, scales = samples.one_ring, scales_of(samples)
        rows = np.sort(np.random.default_rng(seed).choice(len(rings), 6, replace=False))
        radii = scales.spacing[rows, None] * np.array([3.0, 5.0])
        means, lean, inward = np.zeros((6, 2, 3)), np.zeros(6), np.zeros((6, 3))
        links = ring.offsets.view(np.uint64), ring.members.view(np.uint64)
        seen = (samples.points, scales.directions, True, radii, np.array([30, 50]))
        kernels.plain_fits(rows, *links, *seen, 1, means, lean, inward)
        for r, i in enumerate(rows):
            for k in range(2):
                expected = reference.plain(rings, samples.points, scales.directions, i, radii[r, k], (30, 50)[k])
                np.testing.assert_allclose(means[r, k], expected[0], rtol=1e-5, atol=1e-5)
            assert lean[r] == pytest.approx(expected[1], abs=1e-9)
            np.testing.assert_allclose(inward[r], expected[2], atol=1e-12)

    def test_one_thread_and_all_agree(self):
        samples, rings = self.drawn(0, 0.01)
        ring, scales, n = samples.one_ring, scales_of(samples), len(rings)
        links = ring.offsets.view(np.uint64), ring.members.view(np.uint64)
        seen = (samples.points, scales.directions, True, scales.spacing[:, None] * rims.RADII, rims.FULL)
        outs = []
        for run in (kernels.plain_fits.serial, kernels.plain_fits.parallel):
            out = np.zeros((n, len(rims.RADII), 3)), np.zeros(n), np.zeros((n, 3))
            run(np.arange(n), *links, *seen, 3, *out)
            outs.append(out)
        for one, other in zip(*outs, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)

    @settings(max_examples=8)
    @given(seed=st.integers(0, 999), noise=st.sampled_from([0.0, 0.01]))
    def test_high_degree_fits(self, seed, noise):
        samples, rings = self.drawn(seed, noise)
        scales = scales_of(samples)
        rows = np.sort(np.random.default_rng(seed).choice(len(rings), 6, replace=False))
        known = fitted(samples, rows, scales, samples.one_ring)
        fits = np.array([[5, 24], [6, 40], [8, 70]])
        numbers, jets = self.tried(samples, rows, scales, known, fits, _kernels_high_degree.high_degree_fits.serial)
        for r, i in enumerate(rows):
            for f, (degree, nearest) in enumerate(fits):
                around = known.shape[r], known.d1[r], known.normals[r]
                radius = high_degree.RADIUS * scales.spacing[i]
                expected, bends = reference.high_degree(
                    rings, samples.points, scales.directions, i, radius, around, degree, nearest
                )
                np.testing.assert_allclose(numbers[r, f, 1:2], expected[1:2], rtol=1e-4, atol=1e-3)
                np.testing.assert_allclose(numbers[r, f, :1], expected[:1], rtol=1e-4, atol=1e-3)
                np.testing.assert_allclose(numbers[r, f, 2:], expected[2:], rtol=1e-3, atol=1e-14)
                np.testing.assert_allclose(jets[r, f, :2], bends, rtol=1e-4, atol=1e-3)
                np.testing.assert_allclose(np.linalg.norm(jets[r, f, 2:].reshape(2, 3), axis=1), 1.0, rtol=1e-12)

    def test_high_degree_fits_do_not_depend_on_what_memory_held(self):
        """Work arrays are not cleared, and loops run beyond the points to the end of a block."""
        places = np.random.default_rng(0).uniform(-0.6, 0.6, (3, 320))
        places[2] = 0.4 * places[0] ** 2 - 0.3 * places[1] ** 3
        places[:, 45:] = np.nan
        found = []
        for held in (0.0, np.nan, 1e300):
            work, numbers, jet = _kernels_high_degree.workspace(), np.zeros(4), np.zeros(8)
            for array in work:
                array[:] = held
            x, _, z = np.eye(3)
            _kernels_high_degree.fitted(places, 45, 4, x, z, -0.8, 0.0, 1.0, work, numbers, jet)
            found.append(np.concatenate([numbers, jet]))
        assert np.isfinite(found).all()
        assert abs(found[0][1] + 0.4) < 1e-3
        np.testing.assert_array_equal(found[1:], found[:1] * 2)

    def test_high_degree_fits_in_one_thread_and_in_all(self):
        samples, rings = self.drawn(0, 0.0)
        scales, rows = scales_of(samples), np.arange(len(rings))
        known = fitted(samples, rows, scales, samples.one_ring)
        both = _kernels_high_degree.high_degree_fits
        one, other = (
            self.tried(samples, rows, scales, known, high_degree.FITS, run) for run in (both.serial, both.parallel)
        )
        for a, b in zip(one, other, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-6)

    @staticmethod
    def tried(samples, rows, scales, known, fits, run):
        ring = samples.one_ring
        links = ring.offsets.view(np.uint64), ring.members.view(np.uint64)
        seen = (samples.points, scales.directions, scales.oriented, high_degree.RADIUS * scales.spacing[rows])
        numbers, jets = np.full((len(rows), len(fits), 4), np.nan), np.zeros((len(rows), len(fits), 8))
        run(rows, *links, *seen, known.shape, known.d1, known.normals, fits, 3, numbers, jets)
        return numbers, jets
