"""The exact shapes: areas and spread in closed form, normals, and rays against walks along them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from simplexmesh._base.vectors import cross, dot, norm, normalized
from tests.cloud.scenes.shapes import ball, bend, cone, perpendicular, pipe, plane, sampled

X, Y, Z = np.eye(3)


def pieces():
    """One shape of each kind in a pose that favors no axis."""
    turn, shift = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix(), np.array([0.3, -0.2, 0.5])
    shapes = [
        plane((-0.5, -0.4, 0), X, 0.8 * Y),
        pipe(-0.6 * Z, 0.5 * Z, 0.2),
        ball((0.1, 0, 0), 0.4),
        cone((0, 0, -0.6), Z, 0.5, (0.3, 1.1)),
        bend(np.array([0.5, 0, 0]), Y, Z, 0.5, 0.15, 2.0)[0],
    ]
    return {shape.kind: shape.moved(turn, shift) for shape in shapes}


PIECES = pieces()
KINDS = list(PIECES)


def exact_distance(shape, points):
    """Distances from the parameters alone."""
    if shape.kind == "plane":
        return (points - shape.point) @ shape.normal
    if shape.kind == "sphere":
        return norm(points - shape.center) - shape.radius
    to = points - shape.origin
    height = to @ shape.axis
    rho = norm(to - np.outer(height, shape.axis))
    if shape.kind == "cylinder":
        return rho - shape.radius
    if shape.kind == "torus":
        return np.hypot(rho - shape.radius, height) - shape.tube_radius
    return norm(to) * np.sin(np.arctan2(rho, height) - shape.half_angle)


@pytest.mark.parametrize("kind", KINDS)
class TestEvery:
    def test_points_are_on_it_and_within_its_ends(self, kind):
        shape, rng = PIECES[kind], np.random.default_rng(0)
        uv = shape.sample(2000, rng)
        points, _ = shape.at(uv)
        assert_allclose(exact_distance(shape, points), 0, atol=1e-15)
        assert_allclose(shape.coordinates(points) % (2 * np.pi), uv % (2 * np.pi), atol=1e-13)
        assert shape.holds(uv).all()

    def test_distance(self, kind):
        points = np.random.default_rng(1).uniform(-1, 1, (500, 3))
        assert_allclose(PIECES[kind].distance(points), exact_distance(PIECES[kind], points), atol=1e-14)

    def test_normals_are_where_the_distance_grows(self, kind):
        shape = PIECES[kind]
        points, normals = shape.at(shape.sample(200, np.random.default_rng(2)))
        slope = [
            (shape.distance(points + 1e-6 * way) - shape.distance(points - 1e-6 * way)) / 2e-6 for way in np.eye(3)
        ]
        assert_allclose(np.stack(slope, axis=1), normals, atol=1e-8)

    def test_the_ball_holds_it(self, kind):
        shape = PIECES[kind]
        middle, radius = shape.ball
        points, _ = shape.at(shape.sample(5000, np.random.default_rng(3)))
        assert norm(points - middle).max() < radius < 1.3 * norm(points - middle).max()

    def test_rays_meet_it_where_a_walk_does(self, kind):
        shape, rng = PIECES[kind], np.random.default_rng(4)
        start = np.array([1.7, 1.4, -1.2])
        aims, _ = shape.at(shape.sample(150, rng))
        along = normalized(aims + rng.normal(0, 0.15, aims.shape) - start)
        far = shape.hits(start, along)
        steps = np.linspace(1.0, 4.5, 2001)
        walk = start + steps[:, None, None] * along
        sign = shape.distance(walk.reshape(-1, 3)).reshape(walk.shape[:2]) > 0
        there = shape.holds(shape.coordinates(walk.reshape(-1, 3))).reshape(sign.shape)
        crossed = (sign[1:] != sign[:-1]) & there[1:] & there[:-1]
        first = np.where(crossed.any(axis=0), steps[crossed.argmax(axis=0)], np.inf)
        agree = np.isclose(far, first, atol=3e-3) | (np.isinf(far) & np.isinf(first))
        assert np.isfinite(far).sum() > 50
        assert np.isinf(far).sum() > 5
        assert agree.mean() > 0.96  # a walk misses what is thinner than its steps, and ends
        met = np.isfinite(far)
        assert_allclose(shape.distance(start + far[met, None] * along[met]), 0, atol=1e-12)


class TestClosedForms:
    def test_areas(self):
        expected = {
            "plane": 0.8,
            "cylinder": 2 * np.pi * 0.2 * 1.1,
            "sphere": 4 * np.pi * 0.4**2,
            "cone": np.pi * np.tan(0.5) / np.cos(0.5) * (1.1**2 - 0.3**2),
            "torus": 2 * np.pi * 0.15 * 0.5 * 2.0,
        }
        for kind, shape in PIECES.items():
            assert_allclose(shape.area, expected[kind], rtol=1e-12)

    @pytest.mark.parametrize(
        ("kind", "share"),
        [
            ("sphere", lambda v: (np.sin(v) + 1) / 2),
            ("cone", lambda v: (v**2 - 0.3**2) / (1.1**2 - 0.3**2)),
            ("torus", lambda v: (0.5 * (v + np.pi) + 0.15 * np.sin(v)) / np.pi),
            ("cylinder", lambda v: v / 1.1),
        ],
    )
    def test_even_spread(self, kind, share):
        uv = PIECES[kind].sample(20_000, np.random.default_rng(5))
        (u0, u1), _ = PIECES[kind].extent
        assert kstest(share(uv[:, 1]), "uniform").pvalue > 0.01
        assert kstest((uv[:, 0] - u0) / (u1 - u0), "uniform").pvalue > 0.01

    def test_shares_by_area(self):
        shapes = list(PIECES.values())
        _, _, labels = sampled(shapes, 50_000, np.random.default_rng(6))
        share = np.array([shape.area for shape in shapes]) / sum(shape.area for shape in shapes)
        assert_allclose(np.bincount(labels) / 50_000, share, atol=4 * 0.5 / np.sqrt(50_000))


class TestBend:
    @pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.0])
    def test_continues_its_pipe_and_leads_on(self, angle):
        rng = np.random.default_rng(7)
        along = normalized(rng.normal(size=3))
        axis = perpendicular(along, rng)
        start = rng.normal(size=3)
        shape, end, after = bend(start, along, axis, 0.25, 0.05, angle)
        assert_allclose(dot(along, after), np.cos(angle), atol=1e-14)
        assert_allclose(dot(cross(along, after), axis), np.sin(angle), atol=1e-14)
        for u, at, way in ((0, start, along), (angle, end, after)):
            ring, normals = shape.at(np.stack([np.full(9, u), np.linspace(-3, 3, 9)], axis=1))
            assert_allclose(norm(ring - at), 0.05, atol=1e-15)
            assert_allclose((ring - at) @ way, 0, atol=1e-15)
            assert_allclose(normals @ way, 0, atol=1e-14)
