"""Models move to points that all lie on one side of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct import correct as module
from simplexmesh.motion.reconstruct.correct import correct, significant_offsets

BALL = sm.sphere(16)


def run(mesh, points):
    away = sm.targets.Triangles(mesh.triangulated()).closest(points)[0]
    known = {"points": points, "target": sm.targets.Points(points), "away": lambda _: away}
    return SimpleNamespace(mesh=mesh, stages=[SimpleNamespace(iterations=1, reach=0.5)], tangled=0, **known)


def points_of(surface, noise, n=15000):
    rng = np.random.default_rng(1)
    return surface.sampled(n, rng=rng).points + rng.normal(0, noise, (n, 3))


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize("drawn", [-0.2, 0.2])
def test_an_end_that_was_cut_off_or_drawn_out_comes_to_the_points(noise, drawn):
    body = sm.ellipsoid((1, 1, 3), 30).triangulated()
    limb = BALL.moved(BALL.vertices * [1, 1, 3])
    rise = np.clip(limb.vertices[:, 2:] - 2, 0, 1) ** 2
    tip, other = rise[:, 0] > 0.25, limb.moved(limb.vertices + [0, 0, drawn] * rise)
    out = run(other, points_of(body, noise))
    correct(out)
    before, after = (sm.targets.Triangles(body).closest(mesh.vertices[tip])[0].mean() for mesh in (other, out.mesh))
    assert after < 0.7 * before
    assert out.tangled == 0


def test_noise_alone_hardly_moves_a_model():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(20000, 3))
    points *= ((1 + rng.normal(0, 0.02, 20000)) / np.linalg.norm(points, axis=1))[:, None]
    ball = BALL.moved(BALL.vertices / np.linalg.norm(BALL.vertices, axis=1)[:, None])
    assert (significant_offsets(ball, points) != 0).mean() < 0.02


def test_where_it_would_tangle_the_model_stays(monkeypatch):
    offsets = np.full(BALL.n_vertices, 0.01)
    offsets[0] = 1.5
    monkeypatch.setattr(module, "significant_offsets", lambda mesh, points: offsets)
    out = run(BALL, points_of(BALL.triangulated(), 0.0, 6000))
    correct(out)
    moved = np.linalg.norm(out.mesh.vertices - BALL.vertices, axis=1)
    assert out.tangled == moved[0] == 0
    assert np.median(moved) > 0.015


@pytest.mark.parametrize("noise", [0.02, 0.3])
def test_noise_beyond_an_edge_tells_nothing(noise):
    out = run(BALL.moved(1.05 * BALL.vertices), points_of(BALL.triangulated(), noise))
    before = out.mesh
    correct(out)
    assert (out.mesh is before) == (noise > mean_edge(before))
