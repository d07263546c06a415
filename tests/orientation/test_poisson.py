"""The indicator of points without normals: sheets hardly thicker than its cells have two sides."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.shapes import sphere
from simplexmesh.motion.start.from_points import start_from_points
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


def cup(rng):
    turn, radius, angle = 2 * np.pi * rng.random(6000), np.sqrt(rng.random(1500)), 2 * np.pi * rng.random(1500)
    side = np.column_stack([np.cos(turn), np.sin(turn), 2 * rng.random(6000)])
    return np.concatenate([side, np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius])])


def tray(rng, size=(1.0, 1.0, 1.0)):
    sides = np.repeat(np.prod(size) / np.array(size), 2)[:5]
    side, points = rng.choice(5, 8000, p=sides / sides.sum()), rng.random((8000, 3))
    points[np.arange(8000), side // 2] = side % 2
    return points * size


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("shape", [cup, tray, lambda rng: tray(rng, (1.0, 1.0, 0.2))])
def test_open_containers_are_full(shape, seed):
    """The flood enters them: the side of their walls is that of bodies that they would be with a lid."""
    points = shape(np.random.default_rng(seed))
    start = start_from_points(PointCloud(points), 1500)
    assert (start.mesh.genus, start.mesh.n_components) == (0, 1)
    assert start.mesh.volume > 0.75 * np.prod(np.ptp(points, axis=0)) * (np.pi / 4 if shape is cup else 1)


def test_ambiguity_is_least_for_the_true_normals():
    ball, rng = sphere(20), np.random.default_rng(0)
    problem = Poisson.of(ball.vertices, 0.1)

    def ambiguity(normals):
        return problem.indicator(normals).ambiguity

    values = [ambiguity(ball.normals * rng.choice([1, -1], (ball.n_vertices, 1), p=[p, 1 - p])) for p in (1, 0.9, 0.8)]
    cap = np.where(ball.vertices[:, 2:] > 0.5, -1, 1)
    assert values == sorted(values)
    assert ambiguity(ball.normals * cap) > 1.5 * values[0]
