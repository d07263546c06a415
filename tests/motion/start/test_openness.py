"""Two sides that have only the points of one sheet are told from those of a solid."""

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.start.from_points import share_bare, share_doubled
from simplexmesh.motion.start.report import FAR

HALF = 0.05
"""Half the thickness, in the middle, of a lens of radius 1."""


def lens():
    ball = sm.sphere(16)
    return ball.moved(ball.vertices * [1, 1, HALF])


def points_of(rng, offset, noise):
    """Return points at an offset to both sides of the middle of a lens, with noise, both in half thicknesses."""
    disc = rng.uniform(-1, 1, (8000, 2))
    disc = disc[(disc**2).sum(axis=1) < 0.95]
    half = HALF * np.sqrt(1 - (disc**2).sum(axis=1))
    across = offset * rng.choice([-1, 1], len(disc)) + noise * rng.normal(size=len(disc))
    return np.column_stack([disc, half * across])


@pytest.mark.parametrize(
    ("offset", "noise", "least", "most"),
    [
        pytest.param(0, 0.9, 0.9, 1.0, id="a noisy sheet"),
        pytest.param(0.7, 0.7, 0.6, 1.0, id="sides two noises apart"),
        pytest.param(0.9, 0.6, 0.0, 0.4, id="sides three noises apart"),
        pytest.param(1, 0.2, 0.0, 0.0, id="a solid"),
        pytest.param(0.5, 0.0, 0.0, 0.0, id="a solid that was made twice too thick"),
    ],
)
def test_sides_that_share_points(offset, noise, least, most):
    points = points_of(np.random.default_rng(3), offset, noise)
    assert least <= share_doubled(lens(), points) <= most


def test_noise_without_tails_is_a_sheet_at_most_places_too():
    rng = np.random.default_rng(4)
    points = points_of(rng, 0, 0)
    points[:, 2] = rng.triangular(-1, 0, 1, len(points)) * HALF
    assert share_doubled(lens(), points) > 0.5


def test_it_has_no_unit_and_no_place():
    points, mesh = points_of(np.random.default_rng(5), 0.7, 0.6), lens()
    turn = np.linalg.qr(np.random.default_rng(6).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = mesh.moved(1e3 * mesh.vertices @ turn.T + 7)
    for share in (share_doubled, share_bare):
        assert share(moved, 1e3 * points @ turn.T + 7) == pytest.approx(share(mesh, points), abs=0.01)


def test_halves_of_a_ball_without_points():
    """Of the cap farther below than 4 % of the diagonal, the area counts twice, less once its projection."""
    ball = sm.sphere(30)
    points = sm.sphere(60).vertices
    assert share_bare(ball, points) == 0.0
    below = FAR * 3
    assert share_bare(ball, points[points[:, 2] > 0]) == pytest.approx(1 - below - (1 - below**2) / 4, abs=0.02)
