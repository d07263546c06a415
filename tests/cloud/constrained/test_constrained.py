"""Constrained primitives: derivatives, bonds, fits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.cloud.constrained import (
    BallJointCylinder,
    CoaxialCone,
    CylinderAfterTorus,
    SecantCone,
    SecantCylinder,
    TorusAfterCylinder,
    TorusBetweenCylinders,
    fitted,
)

P = sm.primitives
BEFORE = P.Cylinder([0.1, 0.2, 0.3], [0.3, -0.5, 0.8], 0.7)
FREE = P.Cylinder([0.5, 0.1, 0.9], [0.9, 0.2, 0.1], 0.4)
TORUS = P.Torus([0.1, 0.2, 0.3], [0.3, -0.5, 0.8], 2.0, 0.7)
PLACE = BEFORE.point + 0.8 * BEFORE.axis
MEETING = P.Cylinder(PLACE, [0.9, 0.2, 0.1], 0.7)
CONE = P.Cone(PLACE - 2 * FREE.axis, FREE.axis, 0.3)
ALL = {
    "secant": SecantCylinder.near(FREE, BEFORE),
    "secant of fixed radius": SecantCylinder.near(FREE, BEFORE, fixed_radius=True),
    "ball joint": BallJointCylinder(BEFORE),
    "after torus": CylinderAfterTorus(TORUS, 0.7),
    "torus after": TorusAfterCylinder(BEFORE, np.array([2.0, 1.0, 0.5])),
    "torus between": TorusBetweenCylinders(BEFORE, MEETING, 2.0),
    "coaxial cone": CoaxialCone(P.Cone(PLACE, -BEFORE.axis, 0.3), BEFORE),
    "secant cone": SecantCone(CONE, BEFORE, PLACE),
}
COUNTS = {
    "secant": 4,
    "secant of fixed radius": 3,
    "ball joint": 2,
    "after torus": 1,
    "torus after": 3,
    "torus between": 1,
    "coaxial cone": 2,
    "secant cone": 5,
}
every = pytest.mark.parametrize("name", ALL)


def from_axis(place, cylinder):
    away = place - cylinder.point
    return np.linalg.norm(away - (away @ cylinder.axis) * cylinder.axis)


def between_axes(one, other):
    across = np.cross(one.axis, other.axis)
    return abs((other.point - one.point) @ across) / np.linalg.norm(across)


def moved(constrained, rng, size=0.1):
    return constrained.stepped(size * rng.normal(size=constrained.chart.shape[1]))


@every
def test_derivatives_are_difference_quotients(name):
    constrained, points = ALL[name], np.random.default_rng(1).uniform(-3, 3, (300, 3))
    q = constrained.chart.shape[1]
    h = 1e-6
    steps = [
        (constrained.stepped(h * e).primitive.distance(points) - constrained.stepped(-h * e).primitive.distance(points))
        for e in np.eye(q)
    ]
    assert q == COUNTS[name]
    assert_allclose(
        constrained.primitive.derivatives(points) @ constrained.chart, np.stack(steps, axis=1) / (2 * h), atol=1e-7
    )


class TestBonds:
    """Hold to rounding after any step."""

    @pytest.fixture(params=range(5))
    def rng(self, request):
        return np.random.default_rng(request.param)

    @pytest.mark.parametrize("name", ["secant", "secant of fixed radius"])
    def test_secant_axes_meet(self, rng, name):
        assert between_axes(moved(ALL[name], rng).primitive, BEFORE) < 1e-12

    def test_a_fixed_radius_stays(self, rng):
        assert moved(ALL["secant of fixed radius"], rng).primitive.radius == BEFORE.radius

    def test_a_ball_joint_stays(self, rng):
        found = moved(ALL["ball joint"], rng).primitive
        assert_allclose(found.point, BEFORE.point, atol=1e-15)
        assert found.radius == BEFORE.radius

    def test_a_cylinder_leaves_a_torus_along_its_tangent(self, rng):
        found = moved(ALL["after torus"], rng).primitive
        assert abs((found.point - TORUS.center) @ TORUS.axis) < 1e-12
        assert abs(np.linalg.norm(found.point - TORUS.center) - TORUS.radius) < 1e-12
        assert_allclose(np.cross(TORUS.axis, found.point - TORUS.center) / TORUS.radius, found.axis, atol=1e-12)

    def test_a_torus_touches_the_axis_before(self, rng):
        found = moved(ALL["torus after"], rng).primitive
        assert abs(from_axis(found.center, BEFORE) - found.radius) < 1e-12
        assert abs(found.axis @ BEFORE.axis) < 1e-12
        assert abs((found.center - BEFORE.point) @ found.axis) < 1e-12

    def test_a_torus_touches_both_axes(self, rng):
        found = moved(ALL["torus between"], rng).primitive
        for cylinder in (BEFORE, MEETING):
            assert abs(from_axis(found.center, cylinder) - found.radius) < 1e-12
            assert abs((found.center - cylinder.point) @ found.axis) < 1e-12

    def test_a_coaxial_cone_stays_on_the_axis(self, rng):
        found = moved(ALL["coaxial cone"], rng, 0.02).primitive
        assert from_axis(found.point, BEFORE) < 1e-12
        assert_allclose(np.abs(found.axis @ BEFORE.axis), 1, atol=1e-12)

    def test_the_axis_of_a_secant_cone_meets_the_one_before(self, rng):
        assert between_axes(moved(ALL["secant cone"], rng, 0.05).primitive, BEFORE) < 1e-12


@every
def test_fits_recover_what_was_sampled(name):
    true, rng = ALL[name], np.random.default_rng(3)
    kind = true.primitive.kind
    ends = {"cylinder": [[-2, 2], [0.2, 4]], "cone": [[-2, 2], [1, 4]], "torus": [[0, 1.5], [-2, 2]]}[kind]
    fit = P.Fit(0.0, 0.0, np.zeros((true.primitive.n_parameters,) * 2), np.array(ends, float), 1)
    points = true.primitive.with_fit(fit).sampled(400, rng=rng).points
    found = fitted(moved(true, rng, 0.05), points)
    assert found.rms < 1e-8
    assert found.fit.count == 400
    assert found.covariance.shape == (true.primitive.n_parameters,) * 2


def test_the_start_of_a_secant_cylinder_is_the_nearest_place():
    heights = np.linspace(-10, 10, 200_001)
    places = BEFORE.point + heights[:, None] * BEFORE.axis
    away = places - FREE.point
    apart = np.linalg.norm(away - (away @ FREE.axis)[:, None] * FREE.axis, axis=1)
    assert_allclose(SecantCylinder.near(FREE, BEFORE).primitive.point, places[apart.argmin()], atol=1e-4)


def test_bad_input_is_named():
    with pytest.raises(ValueError, match=r"^points must be at least 3, the number of parameters, not 2$"):
        fitted(ALL["torus after"], np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"parallel$"):
        TorusBetweenCylinders(BEFORE, BEFORE, 2.0).chart  # noqa: B018
    with pytest.raises(ValueError, match=r"on the axis of the previous cylinder$"):
        CoaxialCone(P.Cone([5, 5, 5], BEFORE.axis, 0.3), BEFORE)
