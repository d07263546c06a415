"""Extraction of one shape, of none, and of exact points; the steps by themselves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.cloud.extraction._kernels_growth import around
from simplexmesh.cloud.extraction.elbows import elbow_of
from simplexmesh.cloud.extraction.growth import ASLANT, Grown, connected, distances, evidence, grown
from simplexmesh.cloud.extraction.patches import Limits, fit, patch
from simplexmesh.cloud.extraction.working import frequent, working
from simplexmesh.cloud.fitting.selection import SURFACES
from simplexmesh.data.primitives import Cone, Cylinder, Fit, Plane, Sphere, Torus
from tests.nightly.marks import nightly

TURN = (-np.pi, np.pi)
SHAPES = {
    "plane": (Plane([1, 2, 3], [1, 1, 1]), ((-1, 1), (-2, 2))),
    "sphere": (Sphere([1, 0, -2], 2.0), (TURN, (-np.pi / 2, np.pi / 2))),
    "cylinder": (Cylinder([0, 1, 0], [1, 2, 0], 0.7), (TURN, (-2, 2))),
    "cone": (Cone([0, 0, 1], [0, 1, 1], 0.4), (TURN, (0.5, 3))),
    "torus": (Torus([3, 0, 0], [0, 1, 2], 2.0, 0.6), (TURN, TURN)),
}


def made(kind, count=3000, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    shape, ends = SHAPES[kind]
    shape = shape.with_fit(Fit(0.0, 0.0, np.zeros((1, 1)), np.array(ends, float), 0))
    points = shape.sampled(count, rng=rng).points
    return shape, points + shape.gradient(points) * rng.normal(0, noise, (count, 1))


@pytest.mark.parametrize("noise", [*nightly(0.0), 0.01])
@pytest.mark.parametrize("kind", SHAPES)
def test_one_shape_is_found_as_what_it_is(kind, noise):
    shape, points = made(kind, noise=noise)
    out = sm.extract_primitives(points)
    assert [each.kind for each in out.primitives] == [kind]
    assert len(out.leftovers) < 0.02 * len(points)
    np.testing.assert_allclose(out.primitives[0]._shape, shape._shape, rtol=0.02 if noise else 1e-6)


@pytest.mark.parametrize("scale", [1e-9, 1e6])
def test_unit_does_not_matter(scale):
    _, points = made("cylinder", noise=0.01)
    (one,) = sm.extract_primitives(points * scale + 100 * scale).primitives
    assert one.radius == pytest.approx(0.7 * scale, rel=0.02)


@pytest.mark.parametrize("draw", ["uniform", *nightly("normal")])
def test_a_cloud_without_surfaces_has_next_to_no_primitives(draw):
    points = getattr(np.random.default_rng(3), draw)(size=(2000, 3))
    assert (sm.extract_primitives(points).labels >= 0).mean() < 0.05


@pytest.mark.parametrize(("ratio", "turn", "count"), [*nightly((2.1, 31, 20_000)), (9.7, 35, 4000)])
def test_elbows_alone_are_tori(ratio, turn, count):
    """Their normals are met by many lines nearly as well, and pieces look like cylinders, spheres and cones."""
    rng = np.random.default_rng(0)
    elbow = Torus([1, 2, 3], [1, 2, 0.3], ratio, 1.0)
    points = elbow.at(rng.uniform([0, -2], [np.radians(turn), 1.5], (count, 2)))
    (found,) = sm.extract_primitives(points + rng.normal(0, 0.02, (count, 1)) * elbow.gradient(points)).primitives
    assert found.kind == "torus"
    assert abs(found.radius - ratio) < 4 * np.sqrt(found.covariance[5, 5])
    assert abs(found.tube_radius - 1) < 4 * np.sqrt(found.covariance[6, 6])


@pytest.mark.parametrize(("ratio", "bent"), [(10, True), (30, False)])
def test_elbows_are_no_wider_than_bends_are(ratio, bent):
    """A cylinder with too much noise may be a bend; hardly bent it is a pipe with some of its bend."""
    rng = np.random.default_rng(2)
    pipe = Torus([0, 0, 0], [0, 0, 1], ratio, 1.0)
    points = pipe.at(rng.uniform([0, -np.pi], [8 / ratio, np.pi], (3000, 2)))
    points += rng.normal(0, 0.02, (3000, 1)) * pipe.gradient(points)
    work, limits = working(points, 0.02, rng), Limits(SURFACES, (0.0, np.inf), 50)
    across = np.array([np.cos(4 / ratio), np.sin(4 / ratio), 0])
    straight = Cylinder(ratio * across, np.cross([0, 0, 1], across), 1.0)
    near = np.flatnonzero(abs(straight.distance(work.points)) < 0.1)
    piece = Grown(straight, near, 0.05, evidence(work, straight, distances(work, straight, near), 0.05))
    found = elbow_of(work, piece, np.ones(3000, bool), limits, rng)
    assert bent == (found is not None and abs(found.primitive.radius - ratio) < 0.05 * ratio)


def test_two_layers_are_two_planes():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.uniform(0, 1, (10_000, 2)), np.repeat([0, 0.05], 5000) + rng.normal(0, 0.003, 10_000)])
    out = sm.extract_primitives(flat)
    assert [each.kind for each in out.primitives] == ["plane", "plane"]
    heights = sorted(float(each.point[2]) for each in out.primitives)
    np.testing.assert_allclose(heights, [0, 0.05], atol=0.001)


def test_a_plane_in_two_pieces_is_one():
    rng = np.random.default_rng(0)
    left = np.column_stack([rng.uniform(0, 1, (2000, 2)), rng.normal(0, 0.003, 2000)])
    out = sm.extract_primitives(np.concatenate([left, left[::-1] + np.array([1.5, 0, 0])]))
    assert [each.kind for each in out.primitives] == ["plane"]
    assert out.primitives[0].fit.count > 3900


@pytest.mark.parametrize("kind", SHAPES)
def test_noise_is_measured(kind):
    _, points = made(kind, 4000, noise=0.01)
    assert working(points, None, np.random.default_rng(0)).noise == pytest.approx(0.01, rel=0.25)
    assert working(points, 0.5, np.random.default_rng(0)).noise == 0.5


def test_the_most_frequent_value_is_that_of_the_larger_crowd():
    rng = np.random.default_rng(0)
    values = np.concatenate([rng.normal(1, 0.05, 600), rng.uniform(2, 40, 400)])
    assert frequent(values) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("kind", SHAPES)
def test_a_patch_grows_into_what_its_surroundings_are(kind):
    shape, points = made(kind, noise=0.003)
    work = working(points, None, np.random.default_rng(0))
    points, limits, tried = work.points, Limits(SURFACES, (0.0, np.inf), 50), []
    for seed in range(6):
        near = cKDTree(points).query(points[seed], k=400)[1]
        found = patch(work, near, limits)
        if found is not None:
            tried.append(np.quantile(np.abs(found.distance(points[near])), 0.9) / work.noise)
    assert min(tried) < 2
    assert np.abs(shape.distance(points)).max() < 6 * work.noise


@pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
def test_a_cylinder_grows_into_the_cone_it_was_fitted_to(seed):
    """Among strays, where the tangent planes of noisy normals meet nearer than at the apex."""
    rng, count = np.random.default_rng(seed), 700
    cone = Cone([0, 0, 0], [0, 0, 1], 0.22)
    points = cone.at(np.column_stack([rng.uniform(0, 2.2, count), np.sqrt(rng.uniform(1, 9, count))]))
    points = points + rng.normal(0, 0.015, (count, 1)) * cone.gradient(points)
    strays = rng.uniform(points.min(axis=0) - 0.2, points.max(axis=0) + 0.2, (count, 3))
    work = working(np.concatenate([points, strays]), 0.015, rng)
    pipe = fit("cylinder", work.points[:count], work.normals[:count])
    limits = Limits(SURFACES, (0.0, np.inf), 50)
    found = grown(work, pipe, np.ones(2 * count, bool), np.arange(count), limits, rng).primitive
    assert found.kind == "cone"
    assert found.half_angle == pytest.approx(0.22, abs=0.08)


@pytest.mark.parametrize("kind", SHAPES)
def test_kernels_tell_distances_and_angles_as_the_primitives_do(kind):
    shape, points = made(kind, 500, noise=0.1)
    rng = np.random.default_rng(0)
    work, free, members = working(points, 0.1, rng), rng.uniform(size=500) < 0.7, np.arange(100, 300)
    distance, gradient = shape.measured(work.points)
    np.testing.assert_allclose(distances(work, shape, members), distance[members], atol=1e-12)
    on = free & (np.abs(distance) <= 0.1) & (np.abs((gradient * work.normals).sum(axis=1)) >= ASLANT)
    about = work.near[members, 1:]
    assert around(shape._surface, work.graph, free, members, 0.1, ASLANT) == (free[about].sum(), on[about].sum())
    found, off = connected(work, shape, free, members, 0.1)
    assert on[found].all()
    np.testing.assert_allclose(off, distance[found], atol=1e-12)


def test_connected_points_stop_at_gaps():
    rng = np.random.default_rng(0)
    left = np.column_stack([rng.uniform(0, 1, (1000, 2)), np.zeros(1000)])
    work = working(np.concatenate([left, left + np.array([3, 0, 0])]), 0.01, rng)
    free = np.ones(len(work.points), bool)
    reached = connected(work, Plane([0, 0, 0], [0, 0, 1]), free, np.array([5]), 0.03)[0]
    np.testing.assert_array_equal(reached, np.flatnonzero(work.points[:, 0] < 2))
    assert not len(connected(work, Plane([0, 0, 1], [0, 0, 1]), free, np.array([5]), 0.03)[0])


def test_what_no_seed_is_on_grows_into_nothing():
    rng = np.random.default_rng(0)
    work = working(made("plane")[1], 0.01, rng)
    free, limits = np.ones(len(work.points), bool), Limits(SURFACES, (0.0, np.inf), 50)
    assert not len(grown(work, Sphere([1, 0, -2], 0.1), free, np.arange(9), limits, rng).members)


def test_evidence_is_greatest_for_the_noise_there_is():
    shape, points = made("sphere", 2000, noise=0.02)
    work = working(points, 0.01, np.random.default_rng(0))
    off = shape.distance(work.points)
    values = {noise: evidence(work, shape, off, noise) for noise in (0.01, 0.015, 0.02, 0.03, 0.04)}
    assert max(values, key=values.get) == 0.02


def test_pipes_whose_axes_meet_far_from_both_have_no_bend():
    rng = np.random.default_rng(0)
    turn, along = rng.uniform([0, 2], [2 * np.pi, 3], (2000, 2)).T
    one = np.column_stack([along, 0.05 * np.cos(turn), 0.05 * np.sin(turn)])
    out = sm.extract_primitives(np.concatenate([one, one[:, [1, 0, 2]]]))
    assert [each.kind for each in out.primitives] == ["cylinder", "cylinder"]


@pytest.mark.parametrize("most", [100_000, 1500])
def test_strays_beyond_an_end_are_not_of_a_pipe(monkeypatch, most):
    monkeypatch.setattr("simplexmesh.cloud.extraction.working.MOST", most)
    pipe, points = made("cylinder", noise=0.01)
    beyond = pipe.at([[0.5, 2.5], [2, -2.6], [-2, 3.5], [1, -4]])  # on its surface, but there is no pipe
    scene = sm.extract_primitives(np.concatenate([points, beyond]))
    (found,) = scene.primitives
    assert set(scene.labels[-4:]) == {-1}
    assert (scene.labels >= 0).mean() > 0.98
    assert (
        np.abs(np.abs((found.at(np.column_stack([[0, 0], found.extent[1]])) - pipe.point) @ pipe.axis) - 2).max() < 0.05
    )


@pytest.mark.parametrize("seed", [1, *nightly(2)])
def test_of_beams_and_floors_there_are_no_cylinders(seed):
    """Protocol P11: three pipes, a beam of three plates and a floor; the thesis finds two more (6.3)."""
    rng = np.random.default_rng(seed)
    pipes = [Cylinder([0, 0.5 * k, 0.6], [1, 0, 0], radius) for k, radius in enumerate((0.08, 0.12, 0.16))]
    parts = [pipe.at(rng.uniform([-np.pi, -1], [np.pi, 1], (2500, 2))) for pipe in pipes]
    for middle, size in (((0, 2, 0.5), (2, 0.3, 0)), ((0, 2, 0.9), (2, 0.3, 0)), ((0, 2, 0.7), (2, 0, 0.4))):
        parts.append(middle + np.array(size) * rng.uniform(-0.5, 0.5, (1500, 3)))  # flanges and web
    parts.append(rng.uniform([-1.5, -0.5, 0], [1.5, 2.5, 0], (4000, 3)))
    points = np.concatenate(parts)
    found = sm.extract_primitives(points + rng.normal(0, 0.003, points.shape), kinds=["cylinder"], rng=seed).primitives
    assert sorted(round(each.radius, 2) for each in found) == [0.08, 0.12, 0.16]
