"""Least squares of exact distances: against scipy, statistics of the result, kernels against their twins."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from simplexmesh.cloud.fitting import solver
from simplexmesh.cloud.fitting.taper import Taper
from simplexmesh.data.primitives import Cone, Cylinder, Torus
from tests.cloud.fitting.clouds import PRIMITIVES, SURFACES, exact, noisy, same

every = pytest.mark.parametrize("kind", PRIMITIVES)
STEP = np.array([0.05, -0.04, 0.08, 0.06, -0.05, 0.1, -0.07])


def moved_start(kind):
    primitive, _ = PRIMITIVES[kind]
    return primitive.stepped(STEP[: primitive.n_parameters])


@every
def test_exact_points_are_met(kind):
    primitive, points = exact(kind)
    found = solver.solve(moved_start(kind), points)
    assert not same(moved_start(kind), primitive)
    assert same(found, primitive, 1e-7)


@every
def test_the_optimum_is_that_of_scipy(kind):
    primitive, points = noisy(kind)
    found = solver.solve(moved_start(kind), points)
    matrix = found.normal_equations(points)[0]

    def residuals(step):
        there = primitive.stepped(step)
        if kind in ("line", "circle"):  # the vectors to the foot points, whose squares are the distances'
            return (points - there.projected(points)).ravel()
        return there.distance(points)

    second = least_squares(residuals, np.zeros(primitive.n_parameters), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    cost = (found.distance(points) ** 2).sum()
    assert_allclose(cost, 2 * second.cost, rtol=1e-9)
    spread = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
    assert same(found, primitive.stepped(second.x), 1e-6 * spread)
    assert matrix.shape == (primitive.n_parameters,) * 2


@every
def test_the_cost_does_not_decrease_in_any_direction(kind):
    _, points = noisy(kind)
    found = solver.solve(moved_start(kind), points)
    matrix = found.normal_equations(points)[0]
    cost = (found.distance(points) ** 2).sum()
    steps = 1e-4 / np.sqrt(np.diagonal(matrix))
    for k, step in enumerate(np.diag(steps)):
        for sign in (-1, 1):
            rise = (found.stepped(sign * step).distance(points) ** 2).sum() - cost
            assert_allclose(rise, 1e-8, rtol=0.25), k  # half the second derivative is the matrix


@pytest.mark.parametrize("kind", ["plane", "sphere", "cylinder", "cone", "torus"])
def test_mean_distance_is_zero(kind):
    _, points = noisy(kind, noise=0.05)
    found = solver.solve(moved_start(kind), points)
    assert abs(found.distance(points).mean()) < 1e-3 * 0.05


def test_the_coarse_stopping_rule_needs_few_steps():
    """The rule of the thesis ends after 2 to 4 steps: the cost that is left, 1e-3 of N s^2, is sqrt(0.4) deviations."""
    primitive, points = noisy("cylinder")
    start = Cylinder(primitive.point, primitive.axis + np.array([0.02, 0, 0.02]), 2.05)
    full = solver.solve(start, points)
    matrix = full.normal_equations(points)[0]
    few = solver.solve(start, points, iterations=4, tolerance=1e-3)
    deviation = 0.02 * np.sqrt(np.linalg.inv(matrix)[4, 4])
    assert abs(few.radius - full.radius) < 0.64 * deviation
    assert abs(start.radius - full.radius) > 5 * deviation


@every
def test_held_parameters_stay(kind):
    _, points = noisy(kind)
    start = moved_start(kind)
    fixed = np.zeros(start.n_parameters, bool)
    fixed[-1] = True
    found = solver.solve(start, points, fixed=fixed)
    assert (found.distance(points) ** 2).sum() < (start.distance(points) ** 2).sum()
    if start._shape:
        assert found._shape[-1] == pytest.approx(start._shape[-1], rel=1e-12)
    else:  # a plane's shift along its normal, a line's one across it
        free = solver.solve(start, points)
        assert (found.distance(points) ** 2).sum() > 1.01 * (free.distance(points) ** 2).sum()


@every
def test_weights_count_points(kind):
    _, points = noisy(kind, 200)
    weights = np.random.default_rng(0).integers(0, 4, len(points)).astype(float)
    found = solver.solve(moved_start(kind), points, weights=weights)
    other = solver.solve(moved_start(kind), np.repeat(points, weights.astype(int), axis=0))
    assert same(found, other, 1e-6)


@every
def test_the_loss_sees_no_outliers(kind):
    primitive, points = exact(kind)
    points[:60] += [3.0, -2.0, 5.0]
    plain = solver.solve(primitive, points)
    found = solver.solve(primitive, points, loss_scale=0.05)
    assert not same(plain, primitive, 0.1)
    assert same(found, primitive, 0.02)


@every
def test_the_loss_is_least(kind):
    """No step goes down from the sum of d^2 / (1 + (d / s)^2), where half the noise is beyond s."""
    _, points = noisy(kind, noise=0.05)
    found = solver.solve(PRIMITIVES[kind][0], points, loss_scale=0.05, iterations=100)
    matrix = found.normal_equations(points, None, 0.05)[0]

    def cost(primitive):
        square = primitive.distance(points) ** 2
        return (square / (1 + square / 0.05**2)).sum()

    for step in np.diag(1e-3 / np.sqrt(np.diagonal(matrix))):
        up, down = cost(found.stepped(step)) - cost(found), cost(found.stepped(-step)) - cost(found)
        assert abs(up - down) < 0.05 * (up + down)


@pytest.mark.parametrize("kind", SURFACES)
@pytest.mark.parametrize("loss", [None, 0.05])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("iterations", [1, 3, 30])
def test_descents_of_kernels_are_those_of_all(kind, loss, held, iterations):
    """Also where the first steps go up, from starts that are far off."""
    primitive, points = noisy(kind)
    fixed = np.arange(primitive.n_parameters) == 1 if held else None
    for far in (1.0, 8.0):
        start = primitive.stepped(np.minimum(far * STEP[: primitive.n_parameters], 0.3))
        settings = (points, None, loss), fixed, iterations, (1e-10, 1e-20)
        found, twin = solver.surface_descended(start, *settings), solver.descended(start, *settings)
        assert_allclose(found.distance(points), twin.distance(points), atol=1e-7)
        assert iterations < 30 or not same(found, start, 1e-3)


@pytest.mark.parametrize(
    ("start", "radii"), [(Torus([0, 0, 0], [0, 0, 1], 1.2, 0.8), (0.7, 1.0)), (Cone([0, 0, 0], [0, 0, 1], 1.5), (9, 1))]
)
def test_steps_to_no_primitive_are_refused(start, radii):
    """As to a torus whose tube is wider than its ring, and to a cone that opens backward."""
    u, v = np.random.default_rng(0).uniform(0, 2 * np.pi, (2, 300))
    rho, z = radii[0] + radii[1] * np.cos(v), radii[1] * np.sin(v)
    points = np.column_stack([rho * np.cos(u), rho * np.sin(u), z if start.kind == "torus" else -0.3 * rho])
    settings = (points, None, None), None, 30, (1e-10, 1e-20)
    found, twin = solver.surface_descended(start, *settings), solver.descended(start, *settings)
    assert found.distance(points) @ found.distance(points) < start.distance(points) @ start.distance(points)
    assert_allclose(found.distance(points), twin.distance(points), atol=1e-6)


def test_steps_of_damping_solve_the_equations():
    rows = np.random.default_rng(0).normal(size=(20, 7))
    rows[:, 3] = 0.0
    matrix, downhill, free = rows.T @ rows, rows.T @ np.ones(20), np.arange(7) != 5
    step = np.ones(7)
    assert solver.kernels.fill_step(matrix, downhill, 0.1, free, step)
    kept = free & (np.arange(7) != 3)
    twin = np.linalg.solve((matrix + 0.1 * np.diag(np.diagonal(matrix)))[kept][:, kept], downhill[kept])
    assert_allclose(step[kept], twin, rtol=1e-12)
    assert (step[~kept] == 0).all()
    assert not solver.kernels.fill_step(np.full((7, 7), np.nan), downhill, 0.1, free, step)


@pytest.mark.parametrize("loss", [None, 0.5])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize(
    "surface",
    [
        *(PRIMITIVES[kind][0] for kind in SURFACES),
        Cone([0.1, 0.2, 0.3], [1, 2, 0.3], 1.2),
        Taper(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1.0]), 0.5, 0.4),
        Taper(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1.0]), 0.5, -0.4),
    ],
    ids=lambda surface: surface.kind,
)
def test_kernels_agree_with_derivatives(surface, weighted, loss):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(300, 3)) * 2
    weights = rng.uniform(0, 2, len(points)) if weighted else None
    distance, rows = surface.distance(points), surface.derivatives(points)
    less = 1.0 if loss is None else 1 / (1 + (distance / loss) ** 2)
    mass = less * (np.ones(300) if weights is None else weights)
    twin = rows.T @ ((mass * less)[:, None] * rows), -rows.T @ (mass * less * distance), mass @ distance**2
    for a, b in zip(surface.normal_equations(points, weights, loss), twin, strict=True):
        assert_allclose(a, b, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("slope", [0.4, -0.4, 1e-3, 0.0])
def test_derivatives_of_tapers(slope):
    taper = Taper(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.6, 0.8]), 0.5, slope)
    points = np.random.default_rng(0).normal(size=(100, 3)) * 2
    step = 1e-6
    ends = [[taper.stepped(sign * step * e).distance(points) for sign in (1, -1)] for e in np.eye(6)]
    numeric = np.array([(a - b) / (2 * step) for a, b in ends]).T
    assert_allclose(taper.derivatives(points), numeric, atol=1e-6)


@pytest.mark.parametrize("angle", [1e-4, 0.01, 0.3, 1.2])
def test_tapers_are_cones(angle):
    cone = Cone([0.1, 0.2, 0.3], [0.0, 0.6, 0.8], angle)
    points = np.random.default_rng(0).normal(size=(100, 3)) * 2 + 3 * cone.axis + cone.point
    taper = Taper.of(cone, points)
    assert_allclose(taper.distance(points), cone.distance(points), atol=1e-9)
    assert_allclose(taper.cone().distance(points), cone.distance(points), atol=1e-9)


def test_a_fit_of_a_cone_passes_the_cylinder():
    """From a cone that widens the wrong way the least squares lead through a slope of 0, where the apex is nowhere."""
    cone, points = exact("cone")
    middle = points.mean(axis=0)
    top = cone.point + (12 * cone.axis)
    wrong = Cone(top, -cone.axis, float(np.arctan2(np.tan(0.3) * 6, 6)))
    assert wrong.distance(middle[None])[0] < 3
    found = solver.solve(wrong, points, iterations=60)
    assert same(found, cone, 1e-6)
