"""The indicator of points without normals: sheets hardly thicker than its cells have two sides."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.mesh.shapes import sphere
from simplexmesh.numerics.plane_fits import planes
from simplexmesh.orientation.poisson import Poisson, oriented_indicator

CELL = 0.0157


def planet(half, noise, seed):
    """Return noisy points of a ball of radius 0.4 in a flat ring of a thickness up to a radius of 1, and normals."""
    rng = np.random.default_rng(seed)
    turn, radius = 2 * np.pi * rng.random(24_000), np.sqrt(0.16 + 0.84 * rng.random(24_000))
    side = rng.choice([-1.0, 1.0], 24_000)
    flat = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), half * side])
    round_ = rng.normal(size=(9_000, 3))
    round_ /= np.linalg.norm(round_, axis=1)[:, None]
    seen = round_[np.abs(0.4 * round_[:, 2]) > half]
    points = np.concatenate([flat, 0.4 * seen])
    normals = np.concatenate([side[:, None] * [0, 0, 1], seen])
    return points + rng.normal(0, noise, points.shape), normals


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(("half", "noise"), [(0.01, 0.0), (0.014, 0.002), (0.02, 0.004)])
def test_thin_sheets_have_two_sides(half, noise, seed):
    points, normals = planet(half, noise, seed)
    inward = oriented_indicator(points, planes(points), CELL).at(points)[1]
    assert ((inward * normals).sum(axis=1) > 0).mean() < 0.02


def test_ambiguity_is_least_for_the_true_normals():
    ball, rng = sphere(20), np.random.default_rng(0)
    problem = Poisson.of(ball.vertices, 0.1)

    def ambiguity(normals):
        return problem.indicator(normals).ambiguity

    values = [ambiguity(ball.normals * rng.choice([1, -1], (ball.n_vertices, 1), p=[p, 1 - p])) for p in (1, 0.9, 0.8)]
    cap = np.where(ball.vertices[:, 2:] > 0.5, -1, 1)
    assert values == sorted(values)
    assert ambiguity(ball.normals * cap) > 1.5 * values[0]
