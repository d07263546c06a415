"""Adaptation of metric parameters to curvature, and the motion of rims of open meshes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh._base.vectors import norm
from simplexmesh.motion.model.averages import HIGHEST, LOWEST, adapted_metric
from tests.motion import reference as reference
from tests.motion.meshes import (
    Everywhere,
    evolved,
    hole_places,
    open_square,
    open_tube,
    procrustes,
    rim_of,
    rotation,
)

SEEDS = st.integers(0, 10**6)


# ---- metric adaptation


@given(seed=SEEDS, strength=st.floats(0, 1))
def test_adapted_metric_parameters_sum_to_one_within_their_range(seed, strength):
    rng = np.random.default_rng(seed)
    ball = sm.sphere(3)
    curvature = rng.normal(size=180) ** 5 * (rng.random(180) < 0.8)
    metric = np.full((180, 3), 1 / 3)
    for _ in range(30):
        metric = adapted_metric(metric, curvature, ball.neighbors, strength=strength)
    assert_allclose(metric.sum(axis=1), 1, atol=1e-9)
    assert metric.min() >= LOWEST - 1e-12
    assert metric.max() <= HIGHEST + 1e-12


def test_adaptation_is_the_formula_of_the_thesis_but_where_the_surface_is_flatter_than_in_the_mean():
    """There the thesis's ratio, which has no bound, is taken over the mean."""
    ball = sm.sphere(2)
    curvature = -1 - 0.1 * np.random.default_rng(0).random(80)
    size = np.abs(curvature)
    around = size[ball.neighbors]
    turn = around - around.mean(axis=1, keepdims=True)
    metric = np.tile([0.2, 0.3, 0.5], (80, 1))
    found = adapted_metric(metric, curvature, ball.neighbors, strength=0.2)
    flat = size < size.mean()
    assert 10 < flat.sum() < 70
    thesis = (metric + 1 / 3 + 0.2 * turn / size[:, None]) / 2
    assert_allclose(found[~flat], thesis[~flat], atol=1e-14)
    floored = (metric + 1 / 3 + 0.2 * turn / size.mean()) / 2
    assert_allclose(found[flat], floored[flat], atol=1e-14)
    assert np.abs(found - thesis)[flat].max() > 1e-4


class Ellipsoid:
    """The ellipsoid x^2/a^2 + y^2/b^2 + z^2/c^2 = 1, to first order along the normal."""

    axes = np.array([3.0, 1.0, 1.0])

    def gap(self, vertices, normals, reach):
        value = ((vertices / self.axes) ** 2).sum(axis=1) - 1
        slope = (2 * vertices / self.axes**2 * normals).sum(axis=1)
        return np.where(slope > 0.05, -value / np.maximum(slope, 0.05), np.nan)


def test_vertices_migrate_to_high_curvature():
    start = sm.sphere(8).moved(sm.sphere(8).vertices * Ellipsoid.axes)

    def correlation(strength):
        mesh = evolved(start, 400, Ellipsoid(), adaptation=strength)
        density = -np.log(reference.size_of_stars(mesh.vertices, mesh.neighbors))
        return np.corrcoef(density, np.log(np.abs(mesh.sphere_curvature)))[0, 1], mesh

    even, adapted = correlation(0.0), correlation(0.2)
    assert adapted[0] > 0.6

    def tip(mesh):
        return (np.abs(mesh.vertices[:, 0]) > 2.5).mean()

    assert tip(adapted[1]) > 1.3 * tip(even[1])
    assert np.abs(((adapted[1].vertices / Ellipsoid.axes) ** 2).sum(axis=1) - 1).max() < 0.05


# ---- rims of holes


def test_a_circle_rim_rests_exactly():
    tube = open_tube()
    assert tube.n_holes == 2
    rim = rim_of(tube)
    still = evolved(tube, 1000)
    assert norm(still.vertices - tube.vertices)[rim].max() < 1e-9


@pytest.mark.parametrize("rigidity", [1, 4])
@pytest.mark.parametrize("mesh", [open_tube(), open_square(), open_square(bump=3.0)], ids=["tube", "square", "bump"])
def test_open_meshes_neither_contract_nor_fold(mesh, rigidity):
    after = evolved(mesh, 1000, rigidity=rigidity)
    assert np.isfinite(after.vertices).all()
    assert_allclose(np.ptp(after.vertices[:, :2], axis=0), np.ptp(mesh.vertices[:, :2], axis=0), rtol=0.15)
    assert after.area > 0.75 * mesh.area
    inner = np.setdiff1d(np.arange(mesh.n_vertices), rim_of(mesh))
    n = after.normals
    assert ((n[:, None] * n[after.neighbors]).sum(axis=2).sum(axis=1)[inner] > 0).all()


def test_noise_on_a_rim_is_smoothed_and_the_rim_follows_forces_and_data():
    tube = open_tube()
    rim = rim_of(tube)
    rng = np.random.default_rng(0)
    rough = tube.moved(tube.vertices + 0.02 * rng.normal(size=tube.vertices.shape))

    def radial(mesh):
        return norm(mesh.vertices[rim, :2]).std()

    assert radial(evolved(rough, 200)) < 0.3 * radial(rough)
    lifted = evolved(tube, 1, forces=[lambda frame: np.full(frame.vertices.shape, 0.01)])
    assert_allclose((lifted.vertices - tube.vertices)[rim], 0.01, atol=1e-9)
    drawn = evolved(tube, 1, Everywhere(0.05), beta=0.2)
    assert_allclose(norm(drawn.vertices - tube.vertices)[rim], 0.01, atol=1e-9)


def rough_open(mesh, seed=0, size=0.03):
    edge = norm(mesh.vertices[mesh.neighbors[:, 0]] - mesh.vertices).mean()
    return mesh.moved(mesh.vertices + size * edge * np.random.default_rng(seed).normal(size=mesh.vertices.shape))


@pytest.mark.parametrize("mesh", [open_tube(), open_square(), open_square(bump=3.0)], ids=["tube", "square", "bump"])
def test_an_open_mesh_with_its_own_shape_as_reference_is_at_rest(mesh):
    kept = rough_open(mesh)
    still = evolved(kept, 500, constraint="shape", reference=kept)
    assert norm(still.vertices - kept.vertices).max() < 1e-9


def test_a_distorted_tube_returns_to_its_shape_up_to_a_similarity():
    kept = rough_open(open_tube(around=12, along=6, length=1.5))
    bent = kept.vertices + 0.16 * np.sin(np.pi * kept.vertices[:, [1, 2, 0]])
    turned = kept.moved(3.0 * bent @ rotation(1).T + [4, 5, 6])
    assert procrustes(turned, kept) > 0.1
    back = evolved(turned, 600, constraint="shape", reference=kept)
    assert procrustes(back, kept) < 1e-3
    rim = rim_of(kept)
    half = np.where(np.isin(np.arange(kept.n_vertices), rim), "mean_curvature", "shape")
    assert procrustes(evolved(turned, 600, constraint=half, reference=kept), kept) > 3e-3


def test_free_rims_keep_their_corners_and_only_even_out():
    def sharpest(mesh):
        c = mesh.connectivity
        loop = mesh.vertices[c.face_vertices[hole_places(mesh)]]
        u, v = loop - np.roll(loop, 1, axis=0), np.roll(loop, -1, axis=0) - loop
        return np.arccos((u * v).sum(axis=1) / norm(u) / norm(v)).max()

    square = open_square()
    assert sharpest(evolved(square, 200, constraint="free")) > 0.9 * sharpest(square)
    assert sharpest(evolved(square, 200)) < 0.6 * sharpest(square)
    tube = open_tube()
    rim = rim_of(tube)
    still = evolved(tube, 1, constraint="free", metric=tube.metric)
    assert norm(still.vertices - tube.vertices)[rim].max() < 1e-12
    tight = evolved(tube, 1, constraint="orientation", metric=tube.metric, alpha=0.5)
    assert (norm(tight.vertices[rim, :2]) < 0.999 * norm(tube.vertices[rim, :2])).all()


def test_folded_rim_vertices_are_not_pushed_and_rims_count_their_own_energy():
    tube = open_tube()
    rim = rim_of(tube)
    i = int(rim[0])
    v = np.array(tube.vertices)
    a, b = (k for k in tube.neighbors[i] if k in rim)
    v[[a, b]] = v[[b, a]]
    folded = tube.moved(v)
    upright = (folded.normals * folded.normals[folded.neighbors].sum(axis=1)).sum(axis=1) > 0
    assert not upright[i]
    moved = norm(evolved(folded, 1, Everywhere(0.01), alpha=0.0, beta=1.0).vertices - v)
    assert_allclose(moved[rim], np.where(upright, 0.01, 0.0)[rim], atol=1e-15)
    model = sm.DeformableModel(tube, alpha=np.isin(np.arange(tube.n_vertices), rim) * 0.5)
    assert next(model.run(1)).energy < 1e-25  # the rim is at rest, though not under the force of a surface


def test_rounding_on_a_plane_draws_no_vertex():
    sheet = sm.plane(12, 12)
    noise = np.random.default_rng(0).normal(size=sheet.n_vertices)
    model = sm.DeformableModel(sheet.moved(sheet.vertices + 1e-9 * noise[:, None] * [0, 0, 1]), adaptation=0.25)
    for _ in model.run(30):
        pass
    assert np.abs(model.metric - 1 / 3).max() < 1e-4
