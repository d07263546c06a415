"""Kernels of the motion equal naive twins of the thesis's formulas, fast and general."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.motion.model import _kernels_averages, _kernels_contours, _kernels_step
from simplexmesh.motion.model._kernels_contours import Courses, Shapes
from simplexmesh.motion.model._kernels_step import Forces, Frames, Moving, Step, Wanted
from simplexmesh.motion.model.contours import ContourShape
from tests.motion import reference as reference
from tests.motion.meshes import hole_places, open_tube

SEEDS = st.integers(0, 10**6)


def rough(seed, *, noise=0.2, degenerate=False, frequency=3):
    """Return positions and neighbors of a crumpled sphere, some neighbors collinear or coincident on request."""
    rng = np.random.default_rng(seed)
    ball = sm.sphere(frequency)
    vertices = ball.vertices + noise * rng.normal(size=ball.vertices.shape)
    if degenerate:
        neighbors = ball.neighbors
        on_line, in_point, double = rng.choice(len(vertices), 3, replace=False)
        a, b, c = neighbors[in_point]
        vertices[a] = vertices[b] = vertices[c]  # three neighbors coincide
        a, b, c = neighbors[on_line]
        vertices[c] = 0.25 * vertices[a] + 0.75 * vertices[b]
        vertices[double] = vertices[neighbors[double, 0]]
    return vertices, ball.neighbors


def apart(vertices, neighbors):
    """Return which vertices differ from their neighbors; where two coincide, the angle is undefined."""
    return np.linalg.norm(vertices[neighbors] - vertices[:, None], axis=2).min(axis=1) > 1e-9


def frames(vertices, neighbors):
    n = len(vertices)
    out = Frames(np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, 9, np.int8))
    _kernels_step.frames(n, vertices, neighbors, *out)
    normals, inverse_radius, curvature, area, obtuse = out
    beyond = reference.beyond_a_right_angle(vertices, neighbors)
    assert_array_equal(obtuse[apart(vertices, neighbors)], beyond[apart(vertices, neighbors)])
    a, b, c = (vertices[neighbors[:, k]] for k in range(3))
    wide = inverse_radius > 0
    assert_allclose(area[wide], 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)[wide], rtol=1e-9, atol=1e-300)
    return normals, inverse_radius, curvature


def stepped(kernel, seed, constraint, vertices, neighbors, *, fast=False, extra=0.0):
    """Take one step with random parameters by a kernel and by its twin; return both results."""
    rng = np.random.default_rng(seed + 1)
    n = len(vertices)
    previous = vertices + 0.05 * rng.normal(size=(n, 3))
    metric = rng.dirichlet([4.0, 4.0, 4.0], n)
    gaps = np.where(rng.random(n) < 0.3, np.nan, 0.3 * rng.normal(size=n))
    alpha, beta, damping = rng.uniform(0, 0.5, n), rng.uniform(0, 1, n), rng.uniform(0.01, 1, n)
    wanted, angle = rng.normal(size=n), rng.uniform(-3, 3, n)
    normals, inverse_radius, _ = frames(vertices, neighbors)
    codes = np.array([reference.NAMES.index(name) for name in constraint], dtype=np.int8)
    out = Step(np.zeros((n, 3)), np.zeros(n), np.zeros(n))
    obtuse = reference.beyond_a_right_angle(vertices, neighbors)
    frame = Frames(normals, inverse_radius, np.zeros(n), np.zeros(n), obtuse)
    moving, forces = Moving(vertices, previous, neighbors, metric), Forces(alpha, beta, damping, gaps)
    if fast:
        kernel(n, wanted, moving, frame, forces, out)
    else:
        kernel(n, codes, moving, frame, Wanted(wanted, angle, np.zeros((n, 3)) + extra), forces, out)
    phi = reference.wanted_angle(constraint, vertices, neighbors, curvature=wanted, angle=angle)
    twin = reference.step(
        vertices, previous, neighbors, metric, phi, gaps, alpha=alpha, beta=beta, damping=damping, extra=extra
    )
    return out, twin


@given(seed=SEEDS, degenerate=st.booleans())
def test_frames_are_normal_circumradius_and_mean_curvature(seed, degenerate):
    vertices, neighbors = rough(seed, degenerate=degenerate)
    normals, inverse_radius, curvature = frames(vertices, neighbors)
    n, _, r, _ = reference.frame(vertices, neighbors)
    assert_allclose(normals, n, atol=1e-9)
    assert_allclose(inverse_radius, np.where(np.isnan(r), 0, 1 / r), rtol=1e-7, atol=1e-9)
    clear = apart(vertices, neighbors)
    assert_allclose(curvature[clear], reference.mean_curvature(vertices, neighbors)[clear], rtol=1e-6, atol=1e-6)
    assert (np.abs(curvature) <= inverse_radius * (1 + 1e-9)).all()  # also for coincident points, and none is NaN
    assert not degenerate or (inverse_radius == 0).any()


def test_curvature_is_one_over_the_radius_on_a_sphere():
    ball = sm.sphere(4, radius=7.0)
    assert_allclose(frames(ball.vertices, ball.neighbors)[2], 1 / 7, rtol=1e-12)


@given(seed=SEEDS, degenerate=st.booleans())
def test_angles_are_simplex_angles_over_the_whole_range(seed, degenerate):
    vertices, neighbors = rough(seed, noise=0.5, degenerate=degenerate)
    normals, inverse_radius, _ = frames(vertices, neighbors)
    out = np.zeros(len(vertices))
    _kernels_step.angles(len(vertices), vertices, neighbors, normals, inverse_radius, out)
    turn = (out - reference.simplex_angle(vertices, neighbors) + np.pi) % (2 * np.pi) - np.pi
    assert_allclose(turn[apart(vertices, neighbors)], 0, atol=1e-6)
    assert np.abs(out).max() > np.pi / 2


@given(seed=SEEDS)
def test_averages_are_the_means_over_the_one_ring(seed):
    vertices, neighbors = rough(seed, degenerate=True)
    rng = np.random.default_rng(seed)
    out, values = np.zeros(len(vertices)), rng.normal(size=len(vertices))
    _kernels_averages.averages(len(vertices), values, neighbors, out)
    assert_allclose(out, reference.one_ring_mean(values, neighbors), atol=1e-14)
    inverse_radius = frames(vertices, neighbors)[1]
    angles = rng.uniform(-np.pi, np.pi, len(vertices))
    _kernels_averages.angle_averages(len(vertices), angles, neighbors, inverse_radius, out)
    radii = 1 / np.where(inverse_radius > 0, inverse_radius, np.nan)
    assert_allclose(out, reference.one_ring_mean_angle(angles, neighbors, radii), atol=1e-9)


@pytest.mark.parametrize("name", reference.NAMES)
@pytest.mark.parametrize("degenerate", [False, True])
@given(seed=SEEDS)
@settings(max_examples=10)
def test_a_step_is_the_law_of_motion_under_every_constraint(seed, degenerate, name):
    vertices, neighbors = rough(seed, noise=0.1, degenerate=degenerate)
    extra = np.random.default_rng(seed).normal(scale=0.02, size=vertices.shape)
    kernel = _kernels_step.constrained_step
    out, twin = stepped(kernel, seed, [name] * len(vertices), vertices, neighbors, extra=extra)
    clear = apart(vertices, neighbors)
    for ours, naive in zip(out, twin, strict=True):
        assert np.isfinite(ours).all()
        assert_allclose(ours[clear], naive[clear], atol=1e-7)


@given(seed=SEEDS, degenerate=st.booleans())
def test_the_fast_step_is_the_general_one_where_all_want_mean_curvature(seed, degenerate):
    vertices, neighbors = rough(seed, noise=0.1, degenerate=degenerate)
    names = ["mean_curvature"] * len(vertices)
    fast, twin = stepped(_kernels_step.curvature_step, seed, names, vertices, neighbors, fast=True)
    general, _ = stepped(_kernels_step.constrained_step, seed, names, vertices, neighbors)
    for a, b, c in zip(fast, general, twin, strict=True):
        assert_allclose(a, b, atol=1e-10)
        assert_allclose(a, c, atol=1e-7)


def test_vertices_each_follow_their_own_constraint():
    vertices, neighbors = rough(5, noise=0.1)
    names = [reference.NAMES[i % len(reference.NAMES)] for i in range(len(vertices))]
    (mixed, _, _), _ = stepped(_kernels_step.constrained_step, 5, names, vertices, neighbors)
    for k, name in enumerate(reference.NAMES):
        (pure, _, _), _ = stepped(_kernels_step.constrained_step, 5, [name] * len(vertices), vertices, neighbors)
        assert_array_equal(mixed[k :: len(reference.NAMES)], pure[k :: len(reference.NAMES)])


@given(seed=SEEDS, strength=st.floats(0, 1))
@settings(max_examples=8)
def test_adaptation_kernels_are_the_floored_formula(seed, strength):
    vertices, neighbors = rough(seed, degenerate=True)
    rng = np.random.default_rng(seed)
    normals, size = frames(vertices, neighbors)[0], np.zeros(len(vertices))
    vertices[3] = vertices[neighbors[3, 1]]
    lengths = np.linalg.norm(vertices[neighbors] - vertices[:, None], axis=2)
    for shortest in (0.0, float(np.median(lengths))):
        _kernels_averages.curvedness(len(size), vertices, normals, neighbors, shortest, size)
        assert_allclose(size, reference.curvedness(vertices, normals, neighbors, shortest), rtol=1e-9, atol=1e-12)
    size = rng.normal(size=len(size)) ** 3 * (rng.random(len(size)) < 0.8)
    metric, out = rng.dirichlet([9.0, 9.0, 9.0], len(size)), np.zeros((len(size), 3))
    floor = np.abs(size).mean()
    _kernels_averages.adapted(len(size), metric, size, floor, neighbors, strength, 0.05, 0.833, out)
    assert_allclose(out, reference.adapted_metric(metric, size, neighbors, strength, 0.05, 0.833), atol=1e-12)


def wavy_boundary(seed, count):
    """Return a random closed line in space, the rows before and after, and an interior neighbor of each vertex."""
    rng = np.random.default_rng(seed)
    around = 2 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count)) / count
    line = np.stack([np.cos(around), np.sin(around), np.sin(2 * around)], axis=1)
    line += 0.1 / count * rng.normal(size=line.shape)
    places = np.arange(count, dtype=np.int32)
    inner = 1.3 * line + 0.1 * rng.normal(size=line.shape)
    neighbors = np.stack([np.roll(places, 1), places + count, np.roll(places, -1)], axis=1)
    return np.concatenate([line, inner]), neighbors, Courses(places, np.roll(places, 1), np.roll(places, -1))


def unshaped(count):
    """Return that nothing is prescribed of the shape of contours."""
    return Shapes(np.full(count, np.nan), np.full(count, np.nan), np.zeros((count, 3)))


def boundary_goals(vertices, rows, name, restored=None):
    out = np.zeros((len(rows.vertices), 3))
    codes = np.full(len(vertices), reference.NAMES.index(name), np.int8)
    restored = out if restored is None else restored
    _kernels_contours.contour_goals(vertices, rows, unshaped(len(rows.vertices)), codes, restored, out)
    return out


@given(seed=SEEDS, count=st.integers(5, 30))
def test_goals_of_boundaries_follow_the_contour_formula(seed, count):
    vertices, _, rows = wavy_boundary(seed, count)
    smooth, straight, own = (boundary_goals(vertices, rows, name) for name in ("angle", "orientation", "free"))
    assert_array_equal(boundary_goals(vertices, rows, "mean_curvature"), smooth)
    assert_array_equal(boundary_goals(vertices, rows, "curvature"), smooth)
    assert_array_equal(boundary_goals(vertices, rows, "shape", own), own)
    line = vertices[:count]
    for k in range(count):
        before2, before, after, after2 = (line[(k + j) % count] for j in (-2, -1, 1, 2))
        assert_allclose(smooth[k], reference.rim_place(before, line[k], after, before2, after2), atol=1e-9)
        middle, half = (before + after) / 2, np.linalg.norm(after - before) / 2
        assert_allclose(straight[k], middle, atol=1e-14)
        # free: on the circle through the three, equidistant from both neighbors, on the vertex's side
        assert_allclose(np.linalg.norm(own[k] - before), np.linalg.norm(own[k] - after), rtol=1e-9)
        n = np.cross(before - line[k], after - line[k])
        assert abs((own[k] - middle) @ n) < 1e-9 * max(np.linalg.norm(n), 1e-9)
        assert_allclose(inscribed(before, own[k], after), inscribed(before, line[k], after), atol=1e-6)
        assert np.linalg.norm(own[k] - middle) <= 2 * max(half, np.linalg.norm(line[k] - middle))


def inscribed(a, p, b):
    """Return the inscribed angle at p over the chord from a to b, constant along a circle."""
    u, v = a - p, b - p
    return np.arctan2(np.linalg.norm(np.cross(u, v)), u @ v)


@given(seed=SEEDS)
@settings(max_examples=10)
def test_restored_positions_are_those_of_the_best_similarity(seed):
    rng = np.random.default_rng(seed)
    kept = open_tube(8, 5)
    row = np.unique(kept.connectivity.face_vertices[hole_places(kept)])
    shape = ContourShape(row, kept.vertices, kept.neighbors)
    Q = Rotation.random(random_state=seed).as_matrix()
    moved = 2.5 * kept.vertices @ Q.T + [1, 2, 3]
    assert_allclose(shape.positions(moved), moved[row], atol=1e-9)
    moved = moved + rng.choice([0.3, 3.0]) * rng.normal(size=moved.shape)
    for place, i in zip(shape.positions(moved), row, strict=True):
        star = sorted({int(i), *kept.neighbors[i].tolist(), *kept.neighbors[kept.neighbors[i]].ravel().tolist()})
        times = np.array([1 + (kept.neighbors[kept.neighbors[i]] == k).sum() for k in star], dtype=float)
        times[[k not in kept.neighbors[i] and k != i for k in star]] -= 1  # at two edges' distance only
        times[star.index(i)] = 1
        a, b = kept.vertices[star], moved[star]
        a0, b0 = np.average(a, axis=0, weights=times), np.average(b, axis=0, weights=times)
        turn = Rotation.align_vectors(b - b0, a - a0, weights=times)[0].apply(a - a0)
        scale = (times[:, None] * turn * (b - b0)).sum() / (times[:, None] * turn**2).sum()
        assert_allclose(place, b0 + scale * turn[star.index(i)], atol=1e-9)


@given(seed=SEEDS)
def test_a_step_of_a_boundary_is_the_law_of_motion(seed):
    vertices, neighbors, rows = wavy_boundary(seed, 8)
    rng = np.random.default_rng(seed)
    n = len(vertices)
    neighbors = np.concatenate([neighbors, rng.integers(0, n, (8, 3))])
    normals, previous = rng.normal(size=(n, 3)), vertices + 0.05 * rng.normal(size=(n, 3))
    goals, extra = rng.normal(size=(8, 3)), 0.1 * rng.normal(size=(n, 3))
    gaps = np.where(rng.random(n) < 0.3, np.nan, rng.normal(size=n))
    alpha, beta, damping = rng.uniform(0, 0.5, n), rng.uniform(0, 1, n), rng.uniform(0.01, 1, n)
    out, moves, energy = step = Step(np.zeros((n, 3)), np.zeros(n), np.zeros(n))
    moving, forces = Moving(vertices, previous, neighbors, previous), Forces(alpha, beta, damping, gaps)
    _kernels_contours.contour_step(rows, moving, normals, goals, extra, forces, step)
    for i in range(8):
        upright = normals[i] @ normals[neighbors[i]].sum(axis=0) > 0
        gap = gaps[i] if upright and not np.isnan(gaps[i]) else 0.0
        force = goals[i] - vertices[i]
        step = (1 - damping[i]) * (vertices[i] - previous[i]) + alpha[i] * force + beta[i] * gap * normals[i] + extra[i]
        limit = 0.5 * np.sqrt(((vertices[neighbors[i]] - vertices[i]) ** 2).sum(axis=1).mean())
        step *= min(1.0, limit / np.linalg.norm(step))
        assert_allclose(out[i], vertices[i] + step, atol=1e-12)
        assert_allclose(moves[i], step @ step, rtol=1e-9)
        assert_allclose(energy[i], 0.5 * (alpha[i] * force @ force + beta[i] * gap**2), rtol=1e-9)
