"""What scanners see: density with range and slant, shadows, offsets, noise along rays, points between at edges."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import kstest

from simplexmesh._base.vectors import norm, normalized
from tests.cloud.scenes.plant import scanned_plant
from tests.cloud.scenes.scanner import JUMP, scanned
from tests.cloud.scenes.shapes import ball, pipe, plane
from tests.cloud.scenes.test_shapes import exact_distance

X, Y, Z = np.eye(3)
FLOOR = plane((-4, -4, 0), 8 * X, 8 * Y)
ABOVE = np.array([[0.3, -0.2, 1.5]])

GLOBE = ball((0.8, 0.2, 0.9), 0.2)
TOWARD = normalized(GLOBE.center - ABOVE[0])
RIM = np.arcsin(0.2 / norm(GLOBE.center - ABOVE[0]))


def scan(shapes, places=ABOVE, count=40_000, **options):
    return scanned(shapes, np.asarray(places, float), count, np.random.default_rng(0), **options)


class TestDensity:
    def test_falls_with_the_square_of_the_range_and_with_slant(self):
        """Of a wall, before it at a height h and from it at a distance d, h / d³ points an area: in rings."""
        place, height = np.array([1.5, 0.3, -0.2]), 1.5
        seen = scan([plane((0, -4, -4), 8 * Y, 8 * Z)], [place], count=60_000)
        rho = norm((seen.points - place)[:, 1:])
        edges = np.linspace(0, 3.6, 13)
        counts, _ = np.histogram(rho, edges)
        law = -np.diff(height / np.hypot(height, edges))  # of h / d³ 2 pi rho
        assert_allclose(counts / counts.sum(), law / law.sum(), rtol=0.05)
        per_area = counts / np.diff(edges**2)
        assert per_area[0] > 10 * per_area[-1]

    def test_is_the_same_all_around(self):
        seen = scan([plane((0, -4, -4), 8 * Y, 8 * Z)], [[1.5, 0, 0]])
        _, y, z = seen.points.T
        near = np.hypot(y, z) < 3.5
        assert kstest(np.arctan2(z, y)[near] / (2 * np.pi) + 0.5, "uniform").statistic < 0.02

    def test_of_stations_is_that_of_their_angles(self):
        seen = scan([FLOOR], [[0, 0, 1], [0, 0, 2]], count=20_000)
        shares = [np.mean(np.abs(seen.points[seen.station == k, :2]).max(axis=1) < 1) for k in range(2)]
        assert shares[0] > 1.3 * shares[1]
        assert len(seen.points) == 20_000


class TestShadows:
    def test_of_a_sphere_is_a_cone(self):
        seen = scan([FLOOR, GLOBE])
        off = np.arccos(normalized(seen.points - ABOVE[0]) @ TOWARD)
        assert off[seen.labels == 0].min() > RIM
        assert off[seen.labels == 0].min() < RIM + 0.01
        assert off[seen.labels == 1].max() < RIM + 1e-12
        assert off[seen.labels == 1].max() > RIM - 0.01
        facing = normalized(seen.points[seen.labels == 1] - GLOBE.center) @ -TOWARD
        assert facing.min() > np.sin(RIM)  # before the circle where rays touch

    def test_of_a_pipe_and_through_it(self):
        """From over an upright pipe the floor is seen around it and through it, and nothing of the pipe itself."""
        tube = pipe([0.3, -0.2, 0.4], [0.3, -0.2, 0.9], 0.1)
        seen = scan([FLOOR, tube], straddle=0.0)
        rho = norm((seen.points[seen.labels == 0] - ABOVE[0])[:, :2])
        through, around = 0.1 * 1.5 / 1.1, 0.1 * 1.5 / 0.6
        assert not ((rho > through) & (rho < around)).any()
        assert_allclose([rho[rho < through].max(), rho[rho > around].min()], [through, around], rtol=0.1)
        assert (seen.labels == 0).all()

    @pytest.mark.parametrize("seed", [0, 1, 2])
    def test_of_plants_nothing_is_behind_anything(self, seed):
        scene = scanned_plant(seed, 0.0, 0.0, 6000, offset=0.0)
        rng = np.random.default_rng(1)
        rows = rng.choice(np.flatnonzero(scene.labels >= 0), 200, replace=False)
        start = scene.stations[scene.station[rows]]
        walk = start + np.linspace(0, 1, 1001)[:-1, None, None] * (scene.points[rows] - start)
        for shape in scene.shapes:
            sign = (shape.distance(walk.reshape(-1, 3)) > 0).reshape(walk.shape[:2])
            step, ray = np.nonzero(sign[1:] != sign[:-1])
            before, after = (shape.holds(shape.coordinates(walk[at, ray])) for at in (step, step + 1))
            assert not (before & after).any()

    def test_a_plant_has_hidden_parts(self):
        scene = scanned_plant(0, 0.0, 0.0, 20_000, stations=1)
        turns = scene.shapes[5].coordinates(scene.points[scene.labels == 5])[:, 0]
        assert 0 < len(np.unique(np.round(turns * 18 / np.pi))) <= 19  # of 36: one side of a pipe


class TestFaults:
    def test_clean_points_are_on_their_shapes(self):
        scene = scanned_plant(3, 0.0, 0.0, 20_000, offset=0.0)
        for k, shape in enumerate(scene.shapes):
            assert_allclose(exact_distance(shape, scene.points[scene.labels == k]), 0, atol=1e-12)

    def test_stations_are_off_by_their_offsets(self):
        scene = scanned_plant(3, 0.0, 0.1, 20_000, offset=0.004)
        assert_allclose(norm(scene.offsets), [0, 0.004, 0.004, 0.004], atol=1e-15)
        assert (scene.station[scene.labels >= 0] >= 0).all()
        back = scene.points - scene.offsets[scene.station]
        for k, shape in enumerate(scene.shapes):
            assert_allclose(exact_distance(shape, back[scene.labels == k]), 0, atol=1e-12)

    def test_noise_is_along_the_rays(self):
        globe = ball((0, 0, 0), 1.0)
        seen = scan([globe], [[0, 0, 3.0]], 10_000, noise=0.002)
        along = normalized(seen.points - [0, 0, 3.0])
        b = along @ Z * 3
        exact = -b - np.sqrt(b**2 - 8)
        steep = b < -np.sqrt(8.02)  # but where noise could carry them over the edge
        assert kstest(((norm(seen.points - [0, 0, 3.0]) - exact) / 0.002)[steep], "norm").pvalue > 0.01

    def test_points_between_at_edges_of_depth(self):
        seen = scan([FLOOR, GLOBE])
        mixed = seen.points[seen.labels < 0] - ABOVE[0]
        assert len(mixed) > 20
        along = normalized(mixed)
        assert_allclose(np.arccos(along @ TOWARD), RIM, atol=0.02)
        touch = 0.2 / np.tan(RIM)
        assert (norm(mixed) > touch - 2 * JUMP).all()
        assert (norm(mixed) < 1.02 * 1.5 / -along[:, 2]).all()
        share = (norm(mixed) - touch) / (1.5 / -along[:, 2] - touch)
        assert share.min() < 0.2
        assert share.max() > 0.8
        assert not (scan([FLOOR, GLOBE], straddle=0.0).labels < 0).any()

    def test_a_plane_has_no_edges(self):
        assert (scan([FLOOR], count=5000).labels == 0).all()

    def test_where_nothing_is_seen(self):
        with pytest.raises(ValueError, match=r"^no station sees a shape$"):
            scan([pipe([5, 0, 0], [6, 0, 0], 0.1)], [[0, 0, 0]])
