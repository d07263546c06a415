"""Walls of which a model is only one sheet are told, noise and what is modeled on both sides are not."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.reconstruct.walls import in_two_layers, walls_message
from tests.nightly.marks import nightly

BALL = sm.sphere(20).triangulated()


def around(radius, count, seed, noise=0.0):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None] * (radius + noise * rng.normal(size=(count, 1)))


@pytest.mark.parametrize(
    ("heights", "least", "most"),
    [
        (lambda side, noise: side + 0.1 * noise, 0.85, 1.0),  # a sheet between two layers
        (lambda side, noise: side + 1 + 0.1 * noise, 0.85, 1.0),  # one of the layers
        (lambda side, noise: noise, 0.0, 0.01),
        (lambda side, noise: 0.1 * side, 0.0, 0.0),  # the chords of a model of both
    ],
)
def test_layers_are_told_from_noise(heights, least, most):
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((4000, 2)), np.zeros(4000)])
    found = in_two_layers(points, heights(rng.choice([-1.0, 1.0], 4000), rng.normal(size=4000)), 0.5)
    assert least <= found.mean() <= most


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([around(1.03, 5000, 0), around(0.97, 5000, 1)], "[89].% of the data lies in two layers of which"),
        ([around(1, 5000, 0), around(0.8, 5000, 1)], "50% of the data is inside of the model"),
        ([around(1, 10_000, 0, noise=0.04)], ""),
        ([around(1, 10_000, 0)], ""),
    ],
)
def test_what_is_said_of_a_ball(points, message):
    points = np.concatenate(points)
    mesh = sm.sphere(20)
    told = walls_message(points, np.abs(np.linalg.norm(points, axis=1) - 1), mesh)
    assert re.match(message, told) if message else not told


def test_points_farther_apart_than_faces_are_wide_are_not_inside():
    """Boundary voxels of a ball, whose centers are up to a voxel inside of it."""
    grid = np.indices((24, 24, 24)).reshape(3, -1).T - 11.5
    away = np.linalg.norm(grid, axis=1)
    points = grid[(away < 8) & (away > 7)]
    assert not walls_message(points, 8 - np.linalg.norm(points, axis=1), sm.sphere(30, radius=8))


@pytest.mark.parametrize("wall", [0.05, *nightly(0.08)])
def test_a_thin_wall_of_points_is_not_averaged_in_silence(wall):
    with pytest.warns(sm.SimplexMeshWarning, match="of the data lies in two layers"):
        sm.reconstruct(np.concatenate([around(1, 10_000, 0), around(1 - wall, 10_000, 1)]), vertices=1500)


@pytest.mark.nightly
def test_the_inner_wall_of_triangles_is_told():
    inner = sm.TriangleMesh(0.9 * BALL.vertices, BALL.faces[:, ::-1])
    both = sm.TriangleMesh(
        np.concatenate([BALL.vertices, inner.vertices]), np.concatenate([BALL.faces, inner.faces + BALL.n_vertices])
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sm.reconstruct(both, vertices=1500)
    assert any(re.match(r"4\d% of the data is inside of the model", str(each.message)) for each in caught)
