"""Rings, triangulations and noise: published properties, and points on the surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.bench.truth import closed, discretized, noise, rings
from simplexmesh.bench.truth.graphs import ARTICLE, graph
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.duality import dual
from tests.bench import article_bodies, article_rings

GS03_RADII = (0.5, 0.45, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05, 0.005, 0.0005)


def aspect(corners):
    """Height over longest side of triangles, (f, 3, 3): the smallest height, as the article computed it."""
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    twice = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return twice / sides.max(axis=1) ** 2


def statistics(values):
    return values.min(), values.max(), values.mean(), values.std()


def fan(ring):
    m = len(ring.neighbors)
    return np.stack([np.broadcast_to(ring.center, (m, 3)), ring.neighbors, np.roll(ring.neighbors, -1, axis=0)], axis=1)


def turns(ring):
    """How often the neighbors go around the normal, counter-clockwise seen from outside; None where a step is back."""
    normal = ring.exact.normals[0]
    away = ring.neighbors - ring.center
    away = away - np.outer(away @ normal, normal)
    following = np.roll(away, -1, axis=0)
    steps = np.arctan2(np.cross(away, following) @ normal, (away * following).sum(1))
    return None if (steps <= 0).any() else round(steps.sum() / (2 * np.pi), 9)


class TestRings:
    @pytest.mark.parametrize(
        ("kind", "printed"),
        [
            ("regular", (0.847215, 0.847215, 0.847215, 0.0)),
            ("vertex", (0.608575, 0.847215, 0.78225, 0.0952829)),
            ("angles", (0.610953, 0.74162, 0.698064, 0.0615968)),
        ],
    )
    def test_aspect_ratios_of_the_article(self, kind, printed):
        found = statistics(aspect(fan(article_rings.article_ring(1.0, kind))))
        np.testing.assert_allclose(found, printed, atol=6e-7)

    @pytest.mark.parametrize("kind", article_rings.KINDS)
    @pytest.mark.parametrize("distance", [0.5, 0.05, 0.0005])
    def test_the_article_has_its_rings_on_the_sphere(self, kind, distance):
        ring = article_rings.article_ring(distance, kind)
        np.testing.assert_allclose(np.linalg.norm(ring.neighbors, axis=1), 2.0, rtol=1e-12)
        away = np.linalg.norm(ring.neighbors - ring.center, axis=1)
        np.testing.assert_allclose(away[:5], distance, rtol=1e-9)
        assert (abs(away[5] - distance) < 1e-9 * distance) == (kind != "vertex")
        assert ring.exact.mean.tolist() == [0.5]
        assert turns(ring) == 1

    @pytest.mark.parametrize("perturbed", [False, True])
    @pytest.mark.parametrize("distance", GS03_RADII)
    def test_gs03_lies_on_the_cylinder_at_its_distance(self, distance, perturbed):
        ring = article_rings.gs03_ring(distance, perturbed=perturbed)
        np.testing.assert_allclose(np.hypot(*ring.neighbors[:, :2].T), 2.0, rtol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(ring.neighbors - ring.center, axis=1), distance, rtol=1e-10)
        low = -0.8 if perturbed else -0.5
        assert ring.neighbors[:, 2] / distance == pytest.approx([1, 0.5, -0.5, -1, low, 0.5])
        assert (ring.exact.mean[0], ring.exact.gauss[0]) == (0.25, 0)
        assert turns(ring) == 1

    @pytest.mark.parametrize("surface", ["cylinder", "sphere"])
    @pytest.mark.parametrize("count", [4, 6, 12])
    def test_symmetric_rings_divide_the_diameter_evenly(self, surface, count):
        ring = article_rings.symmetric_ring(0.3, count, surface=surface)
        assert len(ring.neighbors) == count
        np.testing.assert_allclose(np.linalg.norm(ring.neighbors - ring.center, axis=1), 0.3, rtol=1e-10)
        heights = np.unique(ring.neighbors[:, 2].round(12))
        assert len(heights) == count // 2 + 1
        np.testing.assert_allclose(np.diff(heights), np.diff(heights)[0], atol=1e-11)
        assert turns(ring) == 1
        mirrored = ring.neighbors * [1, -1, -1]
        assert np.sort(mirrored, axis=0) == pytest.approx(np.sort(ring.neighbors, axis=0), abs=1e-12)

    @pytest.mark.parametrize("scheme", rings.SCHEMES)
    @pytest.mark.parametrize("count", [6, 12])
    @pytest.mark.parametrize("name", ["cubic", "plane", "sphere"])
    def test_schemes_lie_on_the_graph_in_order(self, scheme, count, name):
        surface = graph(name)
        ring = rings.scheme_ring(surface, scheme, count, 0.1, at=(0.2, -0.3))
        assert len(ring.neighbors) == count
        np.testing.assert_allclose(ring.neighbors, surface.points(*ring.neighbors[:, :2].T), atol=1e-15)
        assert turns(ring) == 1

    def test_schemes_have_their_angles_and_distances(self):
        azimuth, away = rings.pattern("R", 6)
        assert away.tolist() == [1] * 6
        np.testing.assert_allclose(np.diff(azimuth), np.pi / 3)
        turned, _ = rings.pattern("Rda", 6)
        assert (turned - azimuth).round(12).tolist() == [0, 0, 0, 0, round(-0.2 * np.pi / 3, 12), 0]
        assert rings.pattern("Rdd", 12)[1].tolist() == [1] * 7 + [1.2] + [1] * 4
        assert rings.pattern("Rdds", 12)[1].tolist() == [1] * 7 + [0.5] * 5
        one_side = (np.sin(rings.pattern("U", 12)[0]) > 1e-9).sum()
        assert (one_side, 11 - one_side) == (9, 2)

    def test_stacked_rings_keep_their_rows(self):
        some = [
            article_rings.article_ring(0.5),
            rings.scheme_ring(graph("cubic"), "U", 12, 0.1),
            article_rings.gs03_ring(0.1),
        ]
        samples, around = rings.stacked(some)
        for row, ring in enumerate(some):
            assert (samples.points[around.centers[row]] == ring.center).all()
            assert (samples.points[around[row]] == ring.neighbors).all()
        assert around.closed.all()

    @pytest.mark.parametrize(
        ("call", "message"),
        [
            (lambda: article_rings.article_ring(-1.0), "distance must be"),
            (lambda: article_rings.article_ring(1.0, "round"), "kind must be one of"),
            (lambda: article_rings.symmetric_ring(0.5, 5), "count must be even, not 5"),
            (lambda: article_rings.symmetric_ring(0.5, 6, surface="cone"), "surface must be one of"),
            (lambda: rings.scheme_ring(graph("plane"), "X", 6, 0.1), "scheme must be one of"),
            (lambda: rings.pattern("R", 3), "count must be at least 4, not 3"),
        ],
    )
    def test_bad_input_is_named(self, call, message):
        with pytest.raises(ValueError, match=message):
            call()


MADE = {
    "split_square": lambda: discretized.split_square(graph("cubic"), 8),
    "sawtooth": lambda: discretized.sawtooth(graph("cubic"), 8),
    "sawtooth, odd": lambda: discretized.sawtooth(graph("cubic"), 7),
    "uv_sphere": lambda: discretized.uv_sphere(8, 6),
    "uv_cylinder": lambda: discretized.uv_cylinder(8, 6),
    "icosphere": lambda: article_bodies.icosphere(3),
    "torus": lambda: discretized.torus(24, 12),
    "ellipsoid": lambda: discretized.ellipsoid(24, 12),
}
COUNTS = {  # vertices, faces, vertices on borders
    "split_square": (81, 128, 32),
    "sawtooth": (9 * 5 + 8 * 4, 8 * 15, 5 * 2 + 4 * 2 + 7 * 2),
    "sawtooth, odd": (8 * 4 + 7 * 4, 7 * 13, 8 * 2 - 2 + 6 + 7),
    "uv_sphere": (8 * 5 + 2, 8 * 2 * 5, 0),
    "uv_cylinder": (8 * 7, 8 * 2 * 6, 16),
    "icosphere": (92, 180, 0),
    "torus": (288, 576, 0),
    "ellipsoid": (24 * 11 + 2, 24 * 2 * 11, 0),
}


@pytest.mark.parametrize("name", MADE)
class TestDiscretized:
    def test_counts(self, name):
        made = MADE[name]()
        vertices, faces, border = COUNTS[name]
        assert (len(made.vertices), len(made.faces)) == (vertices, faces)
        if name.startswith("sawtooth"):
            assert made.inner.sum() > 0.5 * vertices
        else:
            assert (~made.inner).sum() == border

    def test_is_an_oriented_manifold_with_its_topology(self, name):
        made = MADE[name]()
        mesh = dual(made.mesh)
        open_ends = {"uv_cylinder": 2, "split_square": 1, "sawtooth": 1, "sawtooth, odd": 1}
        assert (mesh.genus, mesh.n_holes) == (int(name == "torus"), open_ends.get(name, 0))

    def test_faces_are_oriented_as_the_normals(self, name):
        made = MADE[name]()
        corners = made.vertices[made.faces]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("fi,fi->f", faces, made.exact.normals[made.faces[:, 0]]) > 0).all()

    def test_every_vertex_belongs_to_a_face(self, name):
        made = MADE[name]()
        assert np.unique(made.faces).tolist() == list(range(len(made.vertices)))


def test_edges_of_the_grids_before_projection():
    flat = discretized.split_square(graph("plane"), 16)
    corners = flat.vertices[flat.faces][:, :, :2]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    np.testing.assert_allclose(sides.min(1) / sides.max(1), 1 / np.sqrt(2), rtol=1e-12)
    flat = discretized.sawtooth(graph("plane"), 16)
    corners = flat.vertices[flat.faces][:, :, :2]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    np.testing.assert_allclose(sides.min(1) / sides.max(1), 2 / np.sqrt(5), rtol=1e-12)


def test_icosphere_has_twelve_of_five_and_others_of_six():
    ball = article_bodies.icosphere(16)
    assert (len(ball.vertices), len(ball.faces)) == (2562, 5120)
    assert np.bincount(np.bincount(ball.faces.ravel()))[5:].tolist() == [12, 2550]


class TestIrregular:
    def test_vertices_stay_on_the_surface(self):
        made = discretized.torus(60, 24, irregular=True, rng=3)
        rho = np.hypot(*made.vertices[:, :2].T) - 1.0
        np.testing.assert_allclose(np.hypot(rho, made.vertices[:, 2]), 0.35, rtol=1e-12)
        made = discretized.ellipsoid(40, 20, irregular=True, rng=3)
        np.testing.assert_allclose(((made.vertices / [1.0, 0.7, 0.5]) ** 2).sum(1), 1, rtol=1e-12)

    def test_topology_is_the_regular_ones(self):
        assert dual(discretized.torus(60, 24, irregular=True).mesh).genus == 1
        assert dual(discretized.ellipsoid(40, 20, irregular=True).mesh).genus == 0

    def test_is_repeated_by_its_seed_and_differs_from_others(self):
        first, again, other = (discretized.torus(12, 8, irregular=True, rng=seed) for seed in (1, 1, 2))
        assert (first.vertices == again.vertices).all()
        assert (first.faces == again.faces).all()
        assert (first.vertices != other.vertices).any()
        assert (first.faces != other.faces).any()

    def test_valences_vary(self):
        valence = np.bincount(discretized.torus(60, 24, irregular=True).faces.ravel())
        assert (valence.min(), valence.max()) == (4, 8)


class TestCut:
    def test_keeps_the_truth_of_what_is_left(self):
        ring = discretized.torus(24, 12)
        half = discretized.cut(ring, ring.vertices[:, 0] > 0)
        mesh = dual(half.mesh)
        assert (mesh.genus, mesh.n_holes) == (0, 2)
        assert (half.vertices[:, 0] > 0).all()
        around, tube = np.arctan2(half.vertices[:, 1], half.vertices[:, 0]), np.hypot(*half.vertices[:, :2].T) - 1
        _, exact = closed.torus(around, np.arctan2(half.vertices[:, 2], tube))
        np.testing.assert_allclose(half.exact.normals, exact.normals, atol=1e-12)
        np.testing.assert_allclose(half.exact.k2, exact.k2, atol=1e-12)
        assert (half.vertices[~half.inner][:, 0] < half.vertices[half.inner][:, 0].max()).all()

    def test_nothing_cannot_be_kept(self):
        ring = discretized.torus(24, 12)
        with pytest.raises(ValueError, match="kept must leave at least one face"):
            discretized.cut(ring, np.zeros(288, bool))


class TestNoise:
    ball = discretized.uv_sphere(40, 40)

    @pytest.mark.parametrize("unit", noise.UNITS)
    def test_has_the_given_size_in_every_coordinate(self, unit):
        moved = noise.noisy(self.ball.mesh, 0.01, unit=unit, rng=0)
        size = 0.01 * noise.unit_of(self.ball.mesh, unit)
        np.testing.assert_allclose((moved.vertices - self.ball.vertices).std(axis=0), size, rtol=0.05)
        assert (moved.faces == self.ball.faces).all()

    def test_units(self):
        assert noise.unit_of(self.ball.mesh, "diagonal") == pytest.approx(4 * np.sqrt(3), rel=1e-3)
        one = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 9]], [[0, 1, 2]])
        assert noise.unit_of(one, "edge") == 4

    def test_no_noise_is_none_and_a_seed_repeats(self):
        assert (noise.noisy(self.ball.mesh, 0.0, rng=0).vertices == self.ball.vertices).all()
        one, other = (noise.noisy(self.ball.mesh, 0.1, rng=7).vertices for _ in range(2))
        assert (one == other).all()

    @pytest.mark.parametrize(
        ("options", "message"),
        [({"amount": -1}, "amount must be at least 0, not -1"), ({"amount": 1, "unit": "inch"}, "unit must be one of")],
    )
    def test_bad_input_is_named(self, options, message):
        with pytest.raises(ValueError, match=message):
            noise.noisy(self.ball.mesh, **options)


def test_every_graph_can_be_discretized():
    for surface in ARTICLE.values():
        made = discretized.sawtooth(surface, 4)
        assert np.isfinite(made.exact.k1).all()
