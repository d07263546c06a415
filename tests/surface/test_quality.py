"""Shapes of triangles and spreads of neighbors, against the thesis's tables and by their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.bench.truth import discretized
from simplexmesh.bench.truth import rings as truth
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.quality import aspect_ratios
from tests.bench import article_bodies, article_rings

# A Tab 4: least, greatest, mean, deviation of the height ratio, and how close it is met
TABLE_4 = {
    "sphere": (lambda: discretized.uv_sphere(50, 50).mesh, (0.121444, 0.528411, 0.419728, 0.0857635), 2e-5),
    "icosphere": (lambda: article_bodies.icosphere(16).mesh, (0.688617, 0.866024, 0.816532, 0.0394559), 2e-5),
    "cylindre": (article_bodies.capped_cylinder, (0.157675, 0.587785, 0.196776, 0.123648), 2e-6),
    "cone": (article_bodies.cone, (0.211018, 0.617172, 0.368828, 0.124579), 2e-6),
}


def statistics(values):
    """Least, greatest, mean and population standard deviation, as in the thesis's tables."""
    return values.min(), values.max(), values.mean(), values.std()


def fan(ring):
    """The triangles of a ring around its center."""
    m = len(ring.neighbors)
    i = np.arange(m)
    return ring.points, np.stack([0 * i, 1 + i, 1 + (i + 1) % m], axis=1)


class TestAspectRatios:
    @pytest.mark.parametrize("name", TABLE_4)
    def test_are_those_of_the_article(self, name):
        make, expected, close = TABLE_4[name]
        assert_allclose(statistics(aspect_ratios(make(), "height")), expected, rtol=0, atol=close)

    @pytest.mark.parametrize(
        ("kind", "expected"),
        [
            ("regular", (0.847215, 0.847215, 0.847215, 0.0)),
            ("vertex", (0.608575, 0.847215, 0.78225, 0.0952829)),
            ("angles", (0.610953, 0.74162, 0.698064, 0.0615968)),
        ],
    )
    def test_of_rings_are_those_of_the_article(self, kind, expected):
        ring = article_rings.article_ring(1.0, kind)
        assert_allclose(statistics(aspect_ratios(fan(ring), "height")), expected, rtol=0, atol=6e-7)

    def test_of_the_thesis_grids(self):
        flat = graph("plane").__class__("flat", "0", lambda x, y: (0 * x,) * 6)
        assert_allclose(aspect_ratios(discretized.split_square(flat, 8).mesh), 2**-0.5)
        assert_allclose(aspect_ratios(discretized.sawtooth(flat, 8).mesh), 2 / 5**0.5)

    @given(seed=st.integers(0, 2**31 - 1))
    def test_are_their_definition(self, seed):
        points = np.random.default_rng(seed).normal(size=(4, 3))
        faces = [[0, 1, 2], [1, 2, 3], [0, 2, 3]]
        for face, edge, height in zip(
            faces, *(aspect_ratios((points, faces), kind) for kind in ("edge", "height")), strict=True
        ):
            a, b, c = points[face]
            sides = np.array([np.linalg.norm(b - c), np.linalg.norm(c - a), np.linalg.norm(a - b)])
            area = np.linalg.norm(np.cross(b - a, c - a)) / 2
            assert np.isclose(edge, sides.min() / sides.max())
            assert np.isclose(height, (2 * area / sides).min() / sides.max())

    def test_of_an_equilateral_triangle(self):
        points = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 5, 5]]
        assert_allclose(aspect_ratios((points, [[0, 1, 2]])), 1)
        assert_allclose(aspect_ratios((points, [[0, 1, 2]]), "height"), 3**0.5 / 2)

    def test_without_extent_are_zero(self):
        points = [[1, 1, 1]] * 3 + [[0, 0, 0]]
        for kind in ("edge", "height"):
            assert aspect_ratios((points, [[0, 1, 2], [0, 1, 3]]), kind).tolist() == [0, 0]

    @pytest.mark.parametrize("size", [1e-300, 1e-160, 1e160, 1e300])
    @pytest.mark.parametrize("kind", ["edge", "height"])
    def test_heed_no_size(self, kind, size):
        points, faces = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]), [[0, 1, 2], [1, 2, 3]]
        assert_allclose(aspect_ratios((size * points, faces), kind), aspect_ratios((points, faces), kind), rtol=1e-12)

    def test_other_kinds_are_told(self):
        with pytest.raises(ValueError, match=r"^kind must be one of 'edge', 'height', not 'area'$"):
            sm.aspect_ratios(sm.sphere(2), "area")
        with pytest.raises(TypeError, match=r"^surface must be a surface of triangles, not "):
            sm.aspect_ratios(np.eye(4)[:, :3])


def around(ring, normal=None):
    """The spread of a ring's neighbors."""
    normals = np.tile(ring.exact.normals[0] if normal is None else normal, (len(ring.points), 1))
    found = sm.spread(ring.points, neighborhood=ring.around, normals=normals)
    return found.distances[0], found.angles[0], found.imbalances[0]


class TestSpread:
    @pytest.mark.parametrize("count", [6, 12])
    def test_tells_the_schemes_of_the_thesis_apart(self, count):
        found = {scheme: around(truth.scheme_ring(graph("sphere"), scheme, count, 1e-3)) for scheme in truth.SCHEMES}
        step = 2 * np.pi / count
        assert max(found["R"]) < 1e-6
        distances, angles, imbalance = found["Rda"]
        assert distances < 1e-10
        assert np.isclose(angles, 2 * (0.2 * step) ** 2 / count, rtol=1e-3)
        assert np.isclose(imbalance, 2 * np.sin(0.1 * step), rtol=1e-3)
        distances, angles, imbalance = found["Rdd"]
        lengths = np.array([1.2] + [1.0] * (count - 1))
        assert np.isclose(distances, lengths.var() / lengths.mean() ** 2, rtol=1e-3)
        assert angles < 1e-6
        assert np.isclose(imbalance, 0.2 / lengths.mean(), rtol=1e-3)
        lengths = np.array([1.0] * (count // 2 + 1) + [0.5] * (count // 2 - 1))
        assert np.isclose(found["Rdds"][0], lengths.var() / lengths.mean() ** 2, rtol=1e-3)
        assert found["Rdds"][2] > 0.5
        assert found["U"][0] < 1e-10
        assert min(found["U"][1:]) > 0.1

    @given(seed=st.integers(0, 2**31 - 1), m=st.integers(2, 12))
    def test_is_its_definition(self, seed, m):
        rng = np.random.default_rng(seed)
        to = rng.normal(size=(m, 3))
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        points = np.concatenate([np.zeros((1, 3)), to]) + rng.normal(size=3)
        ring = Neighborhoods(np.array([0]), np.array([0, m]), np.arange(1, m + 1), np.array([False]))
        found = sm.spread(
            points if m > 2 else np.concatenate([points, points[:1]]),
            neighborhood=ring,
            normals=np.tile(n, (max(m + 1, 4), 1)),
        )
        length = np.linalg.norm(to, axis=1)
        assert np.isclose(found.distances[0], length.var() / length.mean() ** 2)
        flat = to - np.outer(to @ n, n)
        first = flat[0] / np.linalg.norm(flat[0])
        turn = np.sort(np.arctan2(flat @ np.cross(n, first), flat @ first))
        steps = np.diff(np.append(turn, turn[0] + 2 * np.pi))
        assert np.isclose(found.angles[0], steps.var())
        worst = max(min(np.linalg.norm(a + b) for b in flat) for a in flat)
        assert np.isclose(found.imbalances[0], worst / np.linalg.norm(flat, axis=1).mean())

    def test_heeds_neither_place_nor_size_nor_order(self):
        ring = truth.scheme_ring(graph("cubic"), "U", 12, 0.3)
        R = Rotation.random(random_state=0).as_matrix()
        points = ring.points[[0, *np.random.default_rng(0).permutation(np.arange(1, 13))]]
        found = sm.spread(
            5 * points @ R.T + 3, neighborhood=ring.around, normals=np.tile(ring.exact.normals[0] @ R.T, (13, 1))
        )
        assert_allclose((found.distances[0], found.angles[0], found.imbalances[0]), around(ring), atol=1e-12)

    def test_at_a_border_is_out_of_balance(self):
        found = discretized.split_square(graph("hyperboloid"), 8)
        spread = sm.spread(found.mesh)
        assert spread.imbalances[found.inner].max() < 0.2
        assert spread.imbalances[~found.inner].min() > 0.3
        assert spread.angles[~found.inner].min() > spread.angles[found.inner].max()

    def test_of_a_lonely_vertex_is_nothing(self):
        points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [9, 9, 9]]
        faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        with pytest.warns(
            sm.SimplexMeshWarning, match=r"^the spread of neighbors could not be estimated at 1 of 5 ver"
        ):
            found = sm.spread((points, faces))
        assert found.failed.tolist() == [False] * 4 + [True]
        for values in (found.distances, found.angles, found.imbalances):
            assert np.isnan(values).tolist() == found.failed.tolist()
