"""Plants: points on shapes that are apart, elbows tangent, noise and outliers as told, no two alike."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree
from scipy.stats import kstest

from simplexmesh._base.vectors import dot, norm
from tests.cloud.scenes.plant import CLEARANCE, plant_scene, scanned_plant
from tests.cloud.scenes.scoring import untangent
from tests.cloud.scenes.test_shapes import exact_distance
from tests.nightly.marks import nightly

SEEDS = range(12)
ORDER = ["plane"] * 2 + ["cylinder"] * 4 + ["torus"] * 2 + ["sphere", "cone"]


@functools.cache
def clean(seed):
    return plant_scene(seed, noise=0.0, outliers=0.0, count=20_000)


@pytest.fixture(params=[0, 1, *nightly(*SEEDS[2:])])
def scene(request):
    return clean(request.param)


def residuals(scene):
    return np.concatenate([exact_distance(s, scene.points[scene.labels == k]) for k, s in enumerate(scene.shapes)])


class TestEvery:
    def test_has_the_ten_shapes(self, scene):
        assert [shape.kind for shape in scene.shapes] == ORDER
        assert scene.points.shape == (20_000, 3)
        assert set(scene.labels) == set(range(10))

    def test_points_are_on_their_shapes(self, scene):
        assert_allclose(residuals(scene), 0, atol=1e-12)
        for k, shape in enumerate(scene.shapes):
            low, high = shape.extent[1] + [-1e-9, 1e-9]
            v = shape.coordinates(scene.points[scene.labels == k])[:, 1]
            assert ((v > low) & (v < high)).all()

    def test_elbows_continue_their_pipes(self, scene):
        assert [shape.joins for shape in scene.shapes[6:8]] == [(2, 3), (3, 4)]
        for elbow in scene.shapes[6:8]:
            assert max(untangent(elbow, scene.shapes[k]) for k in elbow.joins) < 1e-12
            rings = [elbow.at(np.stack([np.full(8, u), np.arange(8)], axis=1))[0] for u in elbow.extent[0]]
            for ring, number, end in zip(rings, elbow.joins, (1, 0), strict=True):
                joint = scene.shapes[number]
                at = joint.point + joint.extent[1, end] * joint.axis
                assert_allclose(norm(ring - at), joint.radius, atol=1e-12)

    def test_shapes_that_do_not_join_are_apart(self, scene):
        joined = {(2, 6), (3, 6), (3, 7), (4, 7), (2, 3), (3, 4), (0, 1)}
        trees = [cKDTree(scene.points[scene.labels == k]) for k in range(10)]
        for a in range(10):
            for b in range(a + 1, 10):
                if (a, b) not in joined:
                    assert trees[a].query(trees[b].data)[0].min() > CLEARANCE

    def test_measures(self, scene):
        for shape in scene.shapes[2:6]:
            assert 0.03 <= shape.radius <= 0.15
        for elbow in scene.shapes[6:8]:
            assert 2 <= elbow.radius / elbow.tube_radius <= 5
            assert np.radians(30) <= elbow.extent[0, 1] <= np.radians(120)


class TestRandom:
    @pytest.mark.nightly
    def test_scenes_differ_in_every_measure(self):
        measures = [
            [scene.shapes[2].radius, scene.shapes[5].radius, *(shape.radius for shape in scene.shapes[6:9])]
            + [scene.shapes[9].half_angle, *(elbow.extent[0, 1] for elbow in scene.shapes[6:8])]
            + [shape.extent[1, 1] for shape in scene.shapes[:6]]
            + [shape.axis[0] for shape in scene.shapes if shape.kind != "sphere"]
            for scene in map(clean, SEEDS)
        ]
        spread = np.ptp(measures, axis=0) / np.mean(np.abs(measures), axis=0)
        assert spread.min() > 0.2
        assert all(len(np.unique(each)) == len(SEEDS) for each in np.transpose(measures))

    @pytest.mark.nightly
    def test_radii_are_not_squeezed_by_what_fits(self):
        radii = np.array([scene.shapes[2].radius for scene in map(clean, SEEDS)])
        assert (radii > 0.08).sum() >= 2
        assert (radii < 0.08).sum() >= 2

    @pytest.mark.parametrize("make", [plant_scene, scanned_plant])
    def test_of_a_seed_is_one(self, make):
        one, other, third = (make(seed, count=3000) for seed in (3, 3, 4))
        assert_array_equal(one.points, other.points)
        assert_array_equal(one.labels, other.labels)
        assert not np.isclose(one.points, third.points).any(axis=1).all()


class TestFaults:
    @pytest.mark.parametrize("noise", [0.001, 0.002, 0.005])
    def test_noise_is_normal_along_the_normals(self, noise):
        scene, clean = plant_scene(0, noise, 0.0, 30_000), plant_scene(0, 0.0, 0.0, 30_000)
        away = residuals(scene)
        assert kstest(away / noise, "norm").pvalue > 0.01
        moved = scene.points - clean.points
        for k, shape in enumerate(scene.shapes):
            rows = clean.labels == k
            _, normals = shape.at(shape.coordinates(clean.points[rows]))
            assert_allclose(norm(moved[rows]), np.abs(dot(moved[rows], normals)), atol=1e-12)

    @pytest.mark.parametrize("share", [0.0, 0.1, 0.3])
    def test_outliers_are_a_share_even_in_the_box(self, share):
        scene = plant_scene(1, 0.002, share, 30_000)
        strays, rest = scene.points[scene.labels < 0], scene.points[scene.labels >= 0]
        assert len(strays) == round(share * 30_000)
        assert len(scene.points) == 30_000
        if share:
            low, high = rest.min(axis=0), rest.max(axis=0)
            for k in range(3):
                assert kstest((strays[:, k] - low[k]) / (high[k] - low[k]), "uniform").pvalue > 0.01

    def test_points_are_in_no_order(self):
        scene = plant_scene(2)
        assert abs(np.corrcoef(np.arange(len(scene.labels)), scene.labels)[0, 1]) < 0.02
