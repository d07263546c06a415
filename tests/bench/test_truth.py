"""Surfaces that are known exactly: printed values, finite differences, every curvature derived twice."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplexmesh._base.vectors import tangents
from simplexmesh.bench.truth import closed
from simplexmesh.bench.truth.exact import Exact
from simplexmesh.bench.truth.graphs import ARTICLE, PRINTINGS, THESIS, Graph, graph
from tests.bench import implicit
from tests.bench.random_graph import random_graph

ALL = [(printing, name) for printing, named in PRINTINGS.items() for name in named]
RANDOM = np.random.default_rng(7).uniform(-1, 1, (2, 200))

# Charton 2014 / 2012, at the origin: H, K, k1, k2
PRINTED = {
    ("article", "plane"): (0, 0, 0, 0),
    ("article", "cylinder"): (0.353553391, 0, 0.707106781, 0),
    ("article", "sphere"): (0.5, 0.25, 0.5, 0.5),
    ("article", "paraboloid"): (-0.8, 0.64, -0.8, -0.8),
    ("thesis", "elliptic_paraboloid"): (-3, 8, -2, -4),
    ("article", "hyperboloid"): (0, -0.64, 0.8, -0.8),
    ("thesis", "ellipsoid"): (0.104166667, 0.0104166667, 0.125, 0.083333333),
    ("article", "monkey_saddle"): (0, 0, 0, 0),
    ("article", "cubic"): (-0.3, -0.0225, 0.0354101966, -0.635410197),
    ("thesis", "cubic"): (0, -0.0189377998, 0.137614679, -0.137614679),
    ("article", "exponential"): (1, 1, 1, 1),
    ("thesis", "exponential"): (-0.510310363, 2 / 9, -0.314876373, -0.705744353),
    ("article", "trigonometric"): (0.98696044, 0.97409091, 0.98696044, 0.98696044),
    ("thesis", "trigonometric"): (0.470794054, 0, 0.941588108, 0),
}


@pytest.mark.parametrize(
    ("which", "values"), PRINTED.items(), ids=lambda v: "-".join(v) if isinstance(v[0], str) else ""
)
def test_values_at_the_origin(which, values):
    at = graph(which[1], which[0]).exact()
    found = (at.mean[0], at.gauss[0], at.k1[0], at.k2[0])
    np.testing.assert_allclose(found, values, rtol=5e-9, atol=1e-12)


def test_slopes_at_the_origin():
    slopes = {"plane": (0.2, 0.2), "cubic": (0, 0), "exponential": (0, 0)}
    for name, slope in slopes.items():
        assert [float(v[0]) for v in graph(name).jet(np.zeros(1), np.zeros(1))[1:3]] == pytest.approx(slope)
    assert [float(v[0]) for v in graph("exponential", "thesis").jet(np.zeros(1), np.zeros(1))[1:3]] == [2, -1]


class TestRandomGraph:
    def test_heights_are_correlated_as_told(self):
        """The root mean squares over many surfaces, of slopes and second derivatives, and one correlation."""
        length, bending = 0.3, 1.5
        jets = [random_graph(length, bending, seed).jet(np.array([0.0, 0.3]), np.zeros(2)) for seed in range(800)]
        f, fx, fy, fxx, fxy, fyy = np.array(jets).transpose(1, 0, 2)
        for second in (fxx, fyy, np.sqrt(3) * fxy):
            assert abs(np.sqrt((second**2).mean()) / bending - 1) < 0.06
        for slope in (fx, fy):
            assert abs(np.sqrt((slope**2).mean()) / (bending * length / np.sqrt(3)) - 1) < 0.06
        assert abs((f[:, 0] * f[:, 1]).mean() / (f**2).mean() - np.exp(-0.5)) < 0.06

    def test_seeds(self):
        one, same, other = (random_graph(0.3, 1.0, seed).points(0.1, 0.2) for seed in (0, 0, 1))
        assert (one == same).all()
        assert (one != other).any()


@pytest.mark.parametrize("surface", [*(graph(name, printing) for printing, name in ALL), random_graph(0.4, 2.0, 1)])
def test_derivatives_are_those_of_differences(surface):
    jet, (x, y), h = surface.jet, 0.9 * RANDOM, 1e-4
    f, fx, fy, fxx, fxy, fyy = jet(x, y)
    east, west, north, south = (jet(x + a, y + b) for a, b in ((h, 0), (-h, 0), (0, h), (0, -h)))
    for exact, forward, backward in ((fx, east[0], west[0]), (fy, north[0], south[0])):
        np.testing.assert_allclose(exact, (forward - backward) / (2 * h), atol=3e-6 * (1 + np.abs(f).max()))
    for exact, k, forward, backward in ((fxx, 1, east, west), (fxy, 1, north, south), (fyy, 2, north, south)):
        np.testing.assert_allclose(exact, (forward[k] - backward[k]) / (2 * h), atol=3e-5 * (1 + np.abs(f).max()))


@pytest.mark.parametrize(("printing", "name"), ALL)
class TestGraph:
    def test_curvatures_are_those_of_the_formulas_for_graphs(self, printing, name):
        surface, (x, y) = graph(name, printing), RANDOM
        _, p, q, r, s, t = surface.jet(x, y)
        w = 1 + p**2 + q**2
        at = surface.exact(x, y)
        mean = -((1 + q**2) * r - 2 * p * q * s + (1 + p**2) * t) / (2 * w**1.5)
        np.testing.assert_allclose(at.mean, mean, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(at.gauss, (r * t - s**2) / w**2, rtol=1e-9, atol=1e-12)

    def test_goldman_agrees(self, printing, name):
        surface = graph(name, printing)
        points = surface.points(*RANDOM)
        level = implicit.of_graph(surface)
        at = surface.exact(*RANDOM)
        np.testing.assert_allclose(level.value(points), 0, atol=1e-14)
        mean, gauss = level.curvatures(points)
        np.testing.assert_allclose(mean, at.mean, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(gauss, at.gauss, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(level.exact(points).k1, at.k1, rtol=1e-10, atol=1e-12)

    def test_directions_are_a_frame_along_which_it_bends(self, printing, name):
        surface = graph(name, printing)
        at, level = surface.exact(*RANDOM), implicit.of_graph(surface)
        frames = np.stack([at.d1, at.d2, at.normals], axis=1)
        np.testing.assert_allclose(
            frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (200, 3, 3)), atol=1e-12
        )
        np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-12)
        assert (at.k1 >= at.k2).all()
        assert (at.normals[:, 2] > 0).all()
        points = surface.points(*RANDOM)
        steep = np.linalg.norm(level.gradient(points), axis=1)
        for along, bend in ((at.d1, at.k1), (at.d2, at.k2)):
            found = np.einsum("ni,nij,nj->n", along, level.hessian(points), along) / steep
            np.testing.assert_allclose(found, bend, rtol=1e-9, atol=1e-11)


def test_both_printings_have_what_they_print():
    assert set(THESIS) - set(ARTICLE) == set()
    assert set(ARTICLE) - set(THESIS) == {"plane", "paraboloid"}
    differing = {name for name in THESIS if THESIS[name].formula != ARTICLE[name].formula}
    assert differing == {"cubic", "exponential", "trigonometric"}


@pytest.mark.parametrize(("printing", "name"), ALL)
def test_formulas_say_what_is_computed(printing, name):
    surface = graph(name, printing)
    text = surface.formula.replace("^", "**").replace("pi x", "(pi*x)").replace("pi y", "(pi*y)")
    for squeezed in ("cos ", "sin "):
        text = text.replace(squeezed, squeezed[:-1])
    text = text.replace("3 x y", "3*x*y").replace("2 x**2 y", "2*x**2*y").replace("- x y", "- x*y")
    text = text.replace("2 x", "2*x").replace("2 y", "2*y").replace("0.2 (", "0.2*(").replace("0.4 (", "0.4*(")
    text = text.replace("0.15 (", "0.15*(").replace("0.1 (", "0.1*(")
    x, y = RANDOM
    names = {"x": x, "y": y, "pi": np.pi, "sqrt": np.sqrt, "exp": np.exp, "cos": np.cos, "sin": np.sin}
    np.testing.assert_allclose(surface.points(x, y)[:, 2], eval(text, names), atol=1e-14)


CLOSED = {
    "sphere": (partial(closed.sphere, radius=2.0), implicit.sphere(2.0), (-1.4, 1.4)),
    "cylinder": (partial(closed.cylinder, radius=2.0), implicit.cylinder(2.0), (-3, 3)),
    "torus": (partial(closed.torus, radius=4.0, tube=2.0), implicit.torus(4.0, 2.0), (-3, 3)),
    "ellipsoid": (partial(closed.ellipsoid, axes=(3.0, 2.0, 1.0)), implicit.ellipsoid((3.0, 2.0, 1.0)), (-1.4, 1.4)),
}


@pytest.mark.parametrize(("shape", "level", "range_v"), CLOSED.values(), ids=CLOSED)
class TestClosedForms:
    def places(self, range_v):
        rng = np.random.default_rng(3)
        return rng.uniform(0, 2 * np.pi, 100), rng.uniform(*range_v, 100)

    def test_points_lie_on_the_level_set_which_agrees_on_everything(self, shape, level, range_v):
        points, at = shape(*self.places(range_v))
        np.testing.assert_allclose(level.value(points), 0, atol=1e-11)
        other = level.exact(points)
        np.testing.assert_allclose(other.normals, at.normals, atol=1e-12)
        np.testing.assert_allclose(other.k1, at.k1, atol=1e-10)
        np.testing.assert_allclose(other.k2, at.k2, atol=1e-10)
        apart = at.k1 - at.k2 > 1e-3
        np.testing.assert_allclose(np.abs((other.d1 * at.d1).sum(1))[apart], 1, atol=1e-9)
        mean, gauss = level.curvatures(points)
        np.testing.assert_allclose(mean, at.mean, atol=1e-10)
        np.testing.assert_allclose(gauss, at.gauss, atol=1e-10)

    def test_derivatives_are_those_of_differences(self, shape, level, range_v):
        points, _ = shape(*self.places(range_v))
        h = 1e-5
        for axis in np.eye(3):
            slope = (level.value(points + h * axis) - level.value(points - h * axis)) / (2 * h)
            np.testing.assert_allclose(level.gradient(points) @ axis, slope, rtol=1e-6, atol=1e-5)
            bend = (level.gradient(points + h * axis) - level.gradient(points - h * axis)) / (2 * h)
            np.testing.assert_allclose(level.hessian(points) @ axis, bend, rtol=1e-6, atol=1e-5)

    def test_normals_are_those_of_differences(self, shape, level, range_v):
        u, v = self.places(range_v)
        h = 1e-6
        east = shape(u + h, v)[0] - shape(u - h, v)[0]
        north = shape(u, v + h)[0] - shape(u, v - h)[0]
        outward = np.cross(east, north)
        np.testing.assert_allclose(
            outward / np.linalg.norm(outward, axis=1)[:, None], shape(u, v)[1].normals, atol=1e-7
        )


def test_torus_has_the_extremes_of_the_article():
    _, at = closed.torus(0.0, np.linspace(0, 2 * np.pi, 721), 4.0, 2.0)
    assert (at.mean.min(), at.mean.max()) == pytest.approx((0, 1 / 3))
    assert (at.gauss.min(), at.gauss.max()) == pytest.approx((-1 / 4, 1 / 12))


def test_ellipsoid_has_its_textbook_gaussian_curvature():
    a, b, c = axes = (3.0, 2.0, 1.0)
    points, at = closed.ellipsoid(*np.random.default_rng(0).uniform(-1.5, 1.5, (2, 50)), axes)
    fourth = (points**2 / np.array(axes) ** 4).sum(axis=1)
    np.testing.assert_allclose(at.gauss, 1 / (a * b * c * fourth) ** 2, rtol=1e-12)
    mean = np.abs((points**2).sum(1) - a * a - b * b - c * c) / (2 * (a * b * c) ** 2 * fourth**1.5)
    np.testing.assert_allclose(at.mean, mean, rtol=1e-12)


def test_goldman_changes_sign_with_f():
    points = implicit.sphere(2.0)
    at = np.array([[0.0, 2.0, 0.0]])
    mean, gauss = implicit.goldman(-points.gradient(at), -points.hessian(at))
    assert (mean[0], gauss[0]) == (-0.5, 0.25)


@given(st.integers(0, 10**6))
def test_goldman_agrees_with_the_eigenvalues_for_any_quadratic(seed):
    rng = np.random.default_rng(seed)
    gradient, hessian = rng.normal(size=(1, 3)), rng.normal(size=(1, 3, 3))
    hessian = hessian + hessian.transpose(0, 2, 1)
    at = implicit.Implicit(lambda p: p[:, 0], lambda p: gradient, lambda p: hessian).exact(np.zeros((1, 3)))
    mean, gauss = implicit.goldman(gradient, hessian)
    np.testing.assert_allclose(mean, at.mean, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(gauss, at.gauss, rtol=1e-8, atol=1e-6 * (1 + at.k1[0] ** 2 + at.k2[0] ** 2))


@given(st.integers(0, 10**6), st.sampled_from(sorted(ARTICLE)), st.floats(0.1, 10))
def test_scaling_scales_curvatures(seed, name, size):
    """Over s f(x / s) everything is s times as large: curvatures 1 / s."""
    surface = graph(name)
    x, y = np.random.default_rng(seed).uniform(-1, 1, 2)

    def jet(u, v):
        f, fx, fy, fxx, fxy, fyy = surface.jet(u / size, v / size)
        return size * f, fx, fy, fxx / size, fxy / size, fyy / size

    large = Graph("large", "", jet).exact(size * x, size * y)
    small = surface.exact(x, y)
    np.testing.assert_allclose(size * large.k1, small.k1, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(size**2 * large.gauss, small.gauss, rtol=1e-9, atol=1e-12)


@given(st.integers(0, 10**6))
def test_tangents_are_a_right_handed_frame(seed):
    normal = np.random.default_rng(seed).normal(size=(5, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    u, v = tangents(normal)
    frames = np.stack([u, v, normal], axis=1)
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-12)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (5, 3, 3)), atol=1e-12)


def test_rows_can_be_taken():
    _, at = closed.torus(0.0, np.linspace(0, 3, 7))
    some = at[np.array([2, 5])]
    assert isinstance(some, Exact)
    assert len(some) == 2
    assert some.k2.tolist() == at.k2[[2, 5]].tolist()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: graph("potato"), "name must be one of"),
        (lambda: graph("plane", "thesis"), "name must be one of"),
        (lambda: graph("plane", "poster"), "printing must be one of 'article', 'thesis', not 'poster'"),
        (lambda: closed.torus(0.0, 0.0, 1.0, 2.0), "radius must be above 2, not 1"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_one_row_of_what_is_true_is_one_row():
    exact = graph("cubic").exact([0.0, 0.1, 0.2], 0.0)
    assert exact[1].normals.tolist() == exact[[1]].normals.tolist() == exact[1:2].normals.tolist()
    assert (len(exact[1]), exact[1].d2.shape) == (1, (1, 3))
