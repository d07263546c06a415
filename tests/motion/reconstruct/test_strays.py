"""Places of a model that are farther from the data than its start was are put back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import simplexmesh as sm
from simplexmesh.motion.model.stages import Stage, mean_edge
from simplexmesh.motion.model.untangle import Tangles, filmed
from simplexmesh.motion.reconstruct import pipeline
from simplexmesh.motion.reconstruct.strays import Strays, restored

START = sm.sphere(16)
EDGE = mean_edge(START)
POINTS = sm.sphere(40).vertices
STAGE = Stage(2, 3 * EDGE, 40)


def distorted(height, width=0.25):
    """Return the sphere with a smooth pocket (of negative height) or bump around its pole."""
    v = START.vertices
    bump = np.exp(-0.5 * ((v[:, :2] ** 2).sum(axis=1)) / width**2) * (v[:, 2] > 0)
    return START.moved(v * (1 + height * bump)[:, None])


@pytest.mark.parametrize("height", [-0.4, 0.4])
def test_a_part_off_the_data_is_put_back_and_the_rest_stays(height):
    mesh, strays = distorted(height), Strays(START, POINTS, EDGE)
    strayed = strays.among(mesh)
    away = abs(np.linalg.norm(mesh.vertices, axis=1) - 1)
    assert strayed[away > 1.5 * EDGE].all()
    assert not strayed[away < EDGE].any()
    out = restored(Tangles(mesh), strays, strayed, sm.targets.Triangles(START.triangulated()), STAGE)
    assert not strays.among(out.mesh).any()
    assert out.count == 0
    far = START.vertices[:, 2] < 0
    assert_array_equal(out.mesh.vertices[far], mesh.vertices[far])
    assert abs(np.linalg.norm(out.mesh.vertices, axis=1) - 1).max() < 1.5 * EDGE


def test_what_was_off_the_data_at_the_start_has_not_strayed():
    far = distorted(-0.4)
    assert Strays(START, POINTS, EDGE).among(far).any()
    assert not Strays(far, POINTS, EDGE).among(far).any()


def test_a_film_is_flat_in_a_flat_rim_and_leaves_the_rest():
    sheet = sm.plane(vertices=400)
    lifted = sheet.moved(sheet.vertices + np.outer(np.arange(sheet.n_vertices) == 200, sheet.normals[0]))
    zone = np.linalg.norm(sheet.vertices - sheet.vertices[200], axis=1) < 0.2 * np.ptp(sheet.vertices, axis=0).max()
    out = filmed(lifted, zone)
    assert abs((out.vertices - sheet.vertices[0]) @ sheet.normals[0]).max() < 1e-9
    assert_array_equal(out.vertices[~zone], lifted.vertices[~zone])
    inner = zone & zone[sheet.neighbors].all(axis=1)
    means = out.vertices[sheet.neighbors].mean(axis=1)
    held = (sheet.connectivity.vertex_faces[:, :, None] == np.flatnonzero(sheet.connectivity.face_is_hole)).any((1, 2))
    assert abs(out.vertices - means)[inner & ~held].max() < 1e-9
    everything = np.ones(START.n_vertices, bool)
    assert filmed(START, everything) is START


def test_a_reconstruction_whose_last_motion_spoils_it_is_repaired_and_counts_it(monkeypatch):
    done = pipeline.finish

    def spoiled(run):
        done(run)
        v = run.mesh.vertices
        pocket = np.exp(-0.5 * (v[:, :2] ** 2).sum(axis=1) / 0.25**2) * (v[:, 2] > 0)
        run.mesh = run.mesh.moved(v * (1 - 0.4 * pocket)[:, None])

    monkeypatch.setattr(pipeline, "finish", spoiled)
    out = sm.reconstruct(POINTS, vertices=1500)
    assert out.restored > 20
    assert (out.strayed, out.tangled) == (0, 0)
    assert abs(np.linalg.norm(out.mesh.vertices, axis=1) - 1).max() < 0.06


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.6))
def test_tangles_after_moves_here_and_there_are_those_of_the_whole_mesh(seed, share):
    rng = np.random.default_rng(seed)
    tangles = Tangles(START)
    for _ in range(3):
        moved = START.moved(START.vertices + 0.2 * rng.normal(size=START.vertices.shape))
        tangles = tangles.with_positions(moved, rng.random(START.n_vertices) < share**3)
    assert_array_equal(tangles.pairs, Tangles(tangles.mesh).pairs)
    assert_array_equal(tangles.vertices, Tangles(tangles.mesh).vertices)
