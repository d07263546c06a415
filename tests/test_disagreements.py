"""What the page of disagreements says of printed formulas, where no other test shows it, and where it points to."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.bench.truth import discretized
from simplexmesh.cloud.constrained import TorusAfterCylinder, TorusBetweenCylinders
from simplexmesh.mesh import geometry
from tests.bench import article_bodies

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "disagreements.md"
TETRAHEDRON = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def test_every_pointer_of_the_page_is_a_test():
    pointers = re.findall(r"`([\w/]+\.py)::(\w+)`", PAGE.read_text(encoding="utf-8"))
    assert len(pointers) > 20
    for path, name in pointers:
        assert f"def {name}(" in (TESTS / path).read_text(encoding="utf-8"), (path, name)


def test_cutting_a_handle_takes_one_from_the_genus():
    ring = sm.torus(30, 12)
    x, y, _ = ring.vertices.T
    along = sm.Contour.through(ring, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
    opened = sm.cut(ring, along).mesh
    assert (ring.genus, opened.genus) == (1, 0)
    assert len(opened.faces) - len(ring.faces) == 2
    assert opened.n_vertices == ring.n_vertices


def measured(x, y, z):
    """The curvature of the sphere through the origin, where the outward normal is z, and three neighbors."""
    points = np.stack([np.append(0.0, part) for part in (x, y, z)], axis=1)
    return geometry.sphere_curvature(points, TETRAHEDRON)[0]


def test_the_limit_of_the_sphere_curvature_has_a_half():
    """Equation 3.38, for three neighbors at angles and speeds on a surface of curvatures k1 and k2."""
    k1, k2, t = 1.3, 0.4, 1e-4
    angle, speed = np.array([0.3, 2.1, 4.4]), np.array([1.0, 0.7, 1.2])
    turned = np.stack([np.cos(angle), np.sin(angle), speed * np.cos(2 * angle)])
    ratio = np.linalg.det(turned) / np.linalg.det(np.stack([np.cos(angle), np.sin(angle), speed]))
    x, y = t * speed * np.cos(angle), t * speed * np.sin(angle)
    found = measured(x, y, -(k1 * x**2 + k2 * y**2) / 2)
    assert found == pytest.approx((k1 + k2) / 2 + (k1 - k2) / 2 * ratio, rel=1e-5)
    assert abs(found - ((k1 + k2) / 2 + (k1 - k2) * ratio)) > 0.1


def test_the_error_of_regular_meshes_depends_on_the_direction():
    """Equation 3.44 has one coefficient; on a cylinder it is two thirds to twice that, by where the neighbors are."""

    def share(first, t):
        angle = first + 2 * np.pi / 3 * np.arange(3)
        around, along = t * np.cos(angle), t * np.sin(angle)
        return (measured(np.sin(around), along, np.cos(around) - 1) - 0.5) / (-(0.5**3) / 8 * t**2)

    shares = [share(first, 0.02) for first in (0.0, np.pi / 12, np.pi / 6)]
    assert_allclose(shares, [2 / 3, 4 / 3, 2], rtol=1e-3)


def test_the_height_over_a_chord_has_its_radius():
    """After equation 3.8 a vertex midway between its neighbors is r tan(phi / 2) above them, not tan(phi / 2)."""
    radius, half = 3.0, 0.2
    r, turn = radius * np.sin(half), 2 * np.arctan2(radius * (1 - np.cos(half)), radius * np.sin(half))
    assert turn == pytest.approx(half)  # a regular polygon turns by the angle of its edges, phi
    assert radius * (1 - np.cos(half)) == pytest.approx(r * np.tan(turn / 2))
    assert radius * (1 - np.cos(half)) != pytest.approx(np.tan(turn / 2), rel=0.1)


def test_the_laplacian_of_the_article_lacks_a_half():
    """Its equation 20, without the half, gives twice the curvature of a sphere."""
    ball = article_bodies.icosphere()
    force, cells = np.zeros_like(ball.vertices), np.zeros(len(ball.vertices))
    for first in range(3):
        i, j, k = (ball.faces[:, (first + corner) % 3] for corner in range(3))
        edge, u, v = (ball.vertices[one] - ball.vertices[other] for one, other in ((i, j), (i, k), (j, k)))
        cotangent = (u * v).sum(axis=1) / np.linalg.norm(np.cross(u, v), axis=1)
        for end, sign in ((i, 1), (j, -1)):
            np.add.at(force, end, sign * cotangent[:, None] * edge)
            np.add.at(cells, end, cotangent * (edge**2).sum(axis=1) / 8)
    printed = np.linalg.norm(force, axis=1) / cells / 2
    assert_allclose(printed, 2 / np.linalg.norm(ball.vertices, axis=1), rtol=0.01)
    assert_allclose(sm.curvature(ball.mesh, "discrete", area="voronoi").mean, printed / 2, rtol=1e-9)


def test_the_article_has_voronoi_cells_where_its_text_has_mixed_ones():
    """It prints a mean K of 0.250375 for its sphere."""
    ball = discretized.uv_sphere(50, 50).mesh
    means = {area: sm.curvature(ball, "discrete", area=area).gauss.mean() for area in ("voronoi", "mixed")}
    assert abs(means["voronoi"] - 0.250375) < 1e-6
    assert abs(means["mixed"] - 0.250375) > 1e-4


def test_the_form_of_chen_and_schmitt_has_half_its_middle_coefficient():
    """For A x^2 + B xy + C y^2 the curvatures are A + C +- sqrt((A - C)^2 + B^2) over 2, where 4 B^2 is printed."""
    k1, k2, turn = 1.0, 0.25, 0.4
    angle = np.linspace(0, np.pi, 7)[:-1]
    k = k1 * np.cos(angle - turn) ** 2 + k2 * np.sin(angle - turn) ** 2
    x, y = np.cos(angle) / np.sqrt(k), np.sin(angle) / np.sqrt(k)
    (A, B, C), *_ = np.linalg.lstsq(np.stack([x * x, x * y, y * y], axis=1), np.ones(6), rcond=None)
    assert (A + C + np.hypot(A - C, B)) / 2 == pytest.approx(k1)
    assert abs((A + C + np.hypot(A - C, 2 * B)) / 2 - k1) > 0.1


def test_the_printed_error_of_a_normal_is_not_zero_where_the_normal_is_right():
    """Algorithm 4 takes c and d, the mean curvature and the cosine; the sine e belongs to it, and c does not."""
    angle = np.array([0.0, 1.1, 2.0, 3.5, 4.1, 5.2])
    rows = np.stack([np.cos(2 * angle), np.sin(2 * angle), np.ones(6), np.cos(angle), np.sin(angle)], axis=1)
    (_, _, c, d, e), *_ = np.linalg.lstsq(rows, 0.7 + 0.2 * np.cos(2 * angle - 0.6), rcond=None)
    assert np.hypot(d, e) < 1e-12
    assert np.hypot(c, d) > 0.5


@pytest.mark.parametrize(("variant", "same"), [("pca", True), ("svd4", False)])
def test_the_plane_of_the_thesis_depends_on_the_origin(variant, same):
    mesh = discretized.torus(24, 12, irregular=True).mesh
    here = sm.vertex_normals(mesh, "plane", variant=variant)
    there = sm.vertex_normals(sm.TriangleMesh(mesh.vertices + 5.0, mesh.faces), "plane", variant=variant)
    assert np.allclose(here, there, atol=1e-6) == same


BEFORE = sm.primitives.Cylinder([0.1, 0.2, 0.3], [0.3, -0.5, 0.8], 0.7)
AROUND = np.random.default_rng(1).uniform(-3, 3, (200, 3))


def test_the_derivative_of_a_torus_between_cylinders_has_a_factor_of_two():
    """A.2.6: of the square of the distance from the center."""
    after, R = sm.primitives.Cylinder(BEFORE.point + 0.8 * BEFORE.axis, [0.9, 0.2, 0.1], 0.7), 2.0
    bend = TorusBetweenCylinders(BEFORE, after, R)
    u, v = BEFORE.axis, after.axis
    n, e, half = np.cross(u, v) / np.linalg.norm(np.cross(u, v)), (v - u) / np.linalg.norm(v - u), np.arccos(u @ v) / 2
    y = AROUND - (after.point + R / np.cos(half) * e)
    turned = np.cross(y, n)
    N = np.linalg.norm(turned, axis=1)
    dN = -turned @ np.cross(e, n) / np.cos(half) / N
    apart = np.sqrt((y**2).sum(axis=1) + R**2 - 2 * R * N)
    true, printed = (
        (-factor * y @ e / np.cos(half) + 2 * R - 2 * N - 2 * R * dN) / (2 * apart) for factor in (2.0, 1.0)
    )
    found = (bend.primitive.derivatives(AROUND) @ bend.chart)[:, 0]
    assert_allclose(found, true, atol=1e-12)
    assert np.abs(found - printed).max() > 0.1


def test_the_gradient_of_a_torus_after_a_cylinder_has_braces():
    """A.2.5: the factor of two of the third part is that of all of it."""
    u, c = BEFORE.axis, np.array([2.0, 1.0, 0.5])
    bend = TorusAfterCylinder(BEFORE, c)
    y, z = AROUND - c, BEFORE.point - c
    s, t, k, both = y @ u, z @ u, y @ z, AROUND + BEFORE.point - 2 * c
    T3 = -2 * np.sqrt(s**2 * (z @ z) + k**2 - 2 * s * k * t)
    first, last = -2 * np.outer(s, (z @ z) * u) - 2 * np.outer(s**2, z), np.outer(k * (t + s), u)
    apart = np.sqrt((y**2).sum(axis=1) + z @ z - t**2 + T3)
    sides = -2 * y - 2 * (z - t * u)

    def gradient(third):
        return (sides + 2 / T3[:, None] * (first - 2 * k[:, None] * both + third)) / (2 * apart[:, None])

    found = bend.primitive.derivatives(AROUND) @ bend.chart
    assert_allclose(found, gradient(2 * (last + (s * t)[:, None] * both)), atol=1e-10)
    assert np.abs(found - gradient(2 * last + (s * t)[:, None] * both)).max() > 0.04
