"""User-defined forces, and names of constraints."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh._base.vectors import dot, norm
from simplexmesh.motion.model.forces import CONSTRAINTS, pull, repulsion
from simplexmesh.motion.model.parameters import constraint_codes


def run(mesh, iterations, forces, **options):
    model = sm.DeformableModel(mesh, forces=forces, **options)
    for _ in model.run(iterations, every=iterations):
        pass
    return model.mesh


def test_constraints_have_names_and_codes():
    assert_array_equal(constraint_codes("angle", 3), [2, 2, 2])
    assert_array_equal(constraint_codes(list(CONSTRAINTS), 6), range(6))
    assert_array_equal(constraint_codes([5, 0], 2), [5, 0])
    assert_array_equal(constraint_codes(np.array(["free", "shape"], dtype=object), 2), [0, 4])


@pytest.mark.parametrize(
    ("constraint", "error", "message"),
    [
        ("soft", ValueError, "constraint must be one of 'free', .*, not 'soft'"),
        (["free", "soft"], ValueError, "constraint must be one of 'free', .*, not 'soft'"),
        (["free"], ValueError, r"constraint must have shape \(2,\), not \(1,\)"),
        ([[["free"] * 2]], ValueError, r"constraint must have shape \(2,\), not \(1, 1, 2\)"),
        ([0, 6], ValueError, r"constraint\[1\] is 6, outside 0..5"),
        ([0.5, 1.0], TypeError, "constraint must be whole numbers, not float64"),
        (np.array(["free", None]), TypeError, r"constraint must be numbers of shape \(2,\), not ndarray of object"),
        (3, ValueError, r"constraint must have shape \(2,\), not \(\)"),
    ],
)
def test_wrong_constraints_are_named(constraint, error, message):
    with pytest.raises(error, match=message):
        constraint_codes(constraint, 2)


def test_a_force_adds_its_displacements():
    ball = sm.sphere(4)
    drift = np.array([0.01, -0.02, 0.03])
    moved = run(ball, 1, [lambda frame: np.tile(drift, (320, 1)), lambda frame: 0.005 * frame.normals], alpha=0.0)
    assert_allclose(moved.vertices, ball.vertices + drift + 0.005 * ball.normals, atol=1e-15)


def test_one_force_need_not_be_in_a_list():
    ball = sm.sphere(4)
    force = repulsion([1, 0, 0], radius=0.4)
    assert_array_equal(run(ball, 3, force).vertices, run(ball, 3, [force]).vertices)


def test_a_force_gets_the_present_mesh_and_cannot_change_it():
    ball = sm.sphere(4)
    seen = []

    def watching(frame):
        seen.append((frame.iteration, frame.vertices.copy(), frame.normals.copy(), frame.mean_curvature.copy()))
        for array in (frame.vertices, frame.normals, frame.neighbors, frame.mean_curvature):
            assert not array.flags.writeable
        return 0.01 * frame.normals

    model = sm.DeformableModel(ball, forces=[watching])
    for k in range(3):
        here = model.mesh
        model.step()
        iteration, vertices, normals, curvature = seen[-1]
        assert iteration == k
        assert_array_equal(vertices, here.vertices)
        assert_allclose(normals, here.normals, atol=1e-12)
        assert_allclose(curvature, here.sphere_curvature, rtol=1e-9)


def test_pull_draws_a_vertex_to_the_point_and_its_surroundings_less():
    ball = sm.sphere(6)
    goal = 1.5 * ball.vertices[0]
    force = pull(goal, vertex=0, stiffness=0.2, extent=0.3)
    weak = pull(goal, vertex=0, stiffness=0.05, extent=0.3)
    once = norm(run(ball, 1, [weak], alpha=0.0).vertices - ball.vertices)
    away = norm(ball.vertices - ball.vertices[0])
    assert_allclose(once, 0.05 * 0.5 * np.exp(-0.5 * (away / 0.3) ** 2), atol=1e-12)
    there = run(ball, 200, [force])
    assert norm(there.vertices[0] - goal) < 0.15
    assert norm(there.vertices - ball.vertices)[away > 1.2].max() < 0.05


def test_repulsion_empties_the_ball_it_guards():
    ball = sm.sphere(8)
    center, radius = np.array([1.0, 0, 0]), 0.4
    force = repulsion(center, radius=radius, strength=0.5)
    once = run(ball, 1, [force], alpha=0.0)
    before, after = norm(ball.vertices - center), norm(once.vertices - center)
    cut = 0.5 * norm(ball.vertices[ball.neighbors[:, 0]] - ball.vertices).min()
    short = before > radius - 2 * 0.9 * cut  # where half the depth is below the limit of a step
    assert_allclose(after[short], (before + 0.5 * np.clip(radius - before, 0, None))[short], atol=1e-12)
    empty = run(ball, 300, [force])
    assert norm(empty.vertices - center).min() > 0.8 * radius > 2 * before.min()
    assert (dot(empty.normals, empty.normals[empty.neighbors[:, 0]]) > 0).all()


def test_repulsion_from_a_vertex_itself_is_no_direction():
    frame = type("At", (), {"vertices": np.array([[0.0, 0, 0], [0.1, 0, 0]])})
    assert_allclose(repulsion([0, 0, 0], radius=1.0, strength=1.0)(frame), [[0, 0, 0], [0.9, 0, 0]])


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: pull([0, 0], vertex=0, extent=1), ValueError, r"point must have shape \(3,\), not \(2,\)"),
        (lambda: pull([0, 0, 0], vertex=-1, extent=1), ValueError, "vertex must be at least 0, not -1"),
        (lambda: pull([0, 0, 0], vertex=0, extent=0), ValueError, "extent must be above 0, not 0"),
        (lambda: pull([0, 0, 0], vertex=0, extent=1, stiffness=2), ValueError, "stiffness must be between 0 and 1"),
        (lambda: repulsion([0, 0, np.nan], radius=1), ValueError, r"center must be finite; center\[2\] is nan"),
        (lambda: repulsion([0, 0, 0], radius=-1), ValueError, "radius must be above 0, not -1"),
        (lambda: repulsion([0, 0, 0], radius=1, strength=-1), ValueError, "strength must be between 0 and 1, not -1"),
    ],
)
def test_wrong_arguments_are_named(make, error, message):
    with pytest.raises(error, match=message):
        make()
