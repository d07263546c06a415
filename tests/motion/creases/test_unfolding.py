"""Faces unfolded, vertices along a path put in order, and the even surface that lines are found on."""

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.motion.creases.lines import resolution, surface_through
from simplexmesh.motion.creases.paths import respaced, traced
from simplexmesh.motion.creases.unfolding import unfolded
from tests.motion.creases.test_paths import ring


def test_what_is_thrown_over_a_held_neighbor_comes_back():
    ball, rng = sm.sphere(8), np.random.default_rng(0)
    for vertex in rng.choice(ball.n_vertices, 20, replace=False):
        edges = ball.vertices[ball.neighbors[vertex]] - ball.vertices[vertex]
        places = ball.vertices.copy()
        places[vertex] += 1.6 * edges[0]
        folded = ball.moved(places)
        free = np.arange(ball.n_vertices) == vertex
        assert tangled_vertices(folded).any()
        out = unfolded(folded, free)
        assert not tangled_vertices(out).any()
        np.testing.assert_array_equal(out.vertices[~free], places[~free])


def test_the_unit_does_not_matter_and_what_is_not_folded_stays():
    ball = sm.sphere(8)
    free = np.arange(ball.n_vertices) < 5
    np.testing.assert_array_equal(unfolded(ball, free).vertices, ball.vertices)
    places = ball.vertices.copy()
    places[0] += 1.6 * (places[ball.neighbors[0, 0]] - places[0])
    one, large = (unfolded(ball.moved(scale * places), free).vertices / scale for scale in (1.0, 1000.0))
    np.testing.assert_allclose(one, large, atol=1e-6)


@pytest.mark.parametrize("closed", [False, True])
def test_vertices_that_passed_each_other_are_put_in_order(closed):
    ball = sm.sphere(10)
    (path,) = traced(ball, [ring(1.0, 0.0)], 0.0)
    if not closed:
        (path,) = path.pieces(np.arange(ball.n_vertices) != path.vertices[3])
    places = ball.vertices.copy()
    places[path.vertices] = path.places
    swapped = places.copy()
    a, b = path.vertices[5:7]
    swapped[a] = 1.3 * places[b] - 0.3 * places[a]
    angles = []
    for vertices in (swapped, respaced(ball.moved(swapped), [path])):
        x, y, _ = vertices[path.vertices].T
        angles.append(np.diff(np.unwrap(np.arctan2(y, x))))
        np.testing.assert_array_equal(np.delete(vertices, path.vertices, axis=0), np.delete(places, path.vertices, 0))
    assert np.ptp(np.sign(angles[0])) == 2
    assert np.ptp(np.sign(angles[1])) == 0


def test_the_surface_of_an_uneven_model_is_even():
    ball = sm.sphere(16)
    uneven = ball.vertices + np.array([0, 0, 0.8])
    uneven = ball.moved(uneven / np.linalg.norm(uneven, axis=1)[:, None])
    points = np.random.default_rng(0).normal(size=(8000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    vertices, faces = surface_through(uneven, points, 0.0)
    sides = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
    wanted = resolution(4 * np.pi / len(points), 0.0)
    assert sides.mean() == pytest.approx(wanted, rel=0.1)
    assert np.quantile(sides, [0.02, 0.98]) == pytest.approx(wanted, rel=0.5)


def test_fewer_points_or_more_noise_show_less():
    assert resolution(4.0, 0.0) == pytest.approx(2 * resolution(1.0, 0.0))
    assert resolution(1.0, 1e-3) == resolution(1.0, 0.0) < resolution(1.0, 1.0)
    assert resolution(1.0, 4.0) == pytest.approx(2 * resolution(1.0, 1.0))
