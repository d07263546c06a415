"""Closed forms at the vertices: facts about spheres, heights and angles, rates, and invariances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh.mesh import geometry, shapes
from tests.mesh import reference as reference
from tests.mesh.families import ALL, CLOSED, flipped, renumbered, shaken

ONE = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
seeds = st.integers(0, 2**32 - 1)
meshes = st.builds(
    lambda name, seed: shaken(ALL[name], np.random.default_rng(seed)), st.sampled_from(sorted(ALL)), seeds
)
# Quantity -> its power of the scale, and its sign when the surface is seen from inside.
SCALARS = {"simplex_angle": (0, -1), "sphere_curvature": (-1, -1)}


def rotation(rng):
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.sign(np.linalg.det(Q))


def random_tetrahedra(rng, n):
    """n meshes of four vertices in one array; geometry is of interest at every fourth."""
    neighbors = (ONE[None] + 4 * np.arange(n)[:, None, None]).reshape(-1, 3)
    return rng.normal(size=(4 * n, 3)), neighbors


class TestSphere:
    @given(seed=seeds, log_radius=st.floats(-6, 6), offset=st.floats(-3, 3))
    def test_sphere_curvature_is_one_over_the_radius_anywhere_on_a_sphere(self, seed, log_radius, offset):
        rng = np.random.default_rng(seed)
        points, neighbors = random_tetrahedra(rng, 100)
        points /= np.linalg.norm(points, axis=1)[:, None]
        R = 10**log_radius
        H = geometry.sphere_curvature(R * (points + offset), neighbors)
        a, b, c = points[neighbors].transpose(1, 0, 2)
        spread = np.abs(np.einsum("ij,ij->i", points - a, np.cross(b - a, c - a)))  # six times the volume
        good = spread > 1e-3
        assert_allclose(np.abs(H[good]) * R, 1, rtol=1e-9)

    @pytest.mark.parametrize("base", shapes.lattices.BASES)
    @pytest.mark.parametrize("f", [1, 3, 8, 20])
    def test_curvature_is_positive_with_outward_normals(self, base, f):
        ball = shapes.sphere(f, base, radius=2.5, center=(1, 2, 3))
        assert_allclose(ball.sphere_curvature, 1 / 2.5, rtol=1e-9)
        assert (ball.simplex_angle > 0).all()
        assert (np.einsum("ij,ij->i", ball.normals, ball.vertices - [1, 2, 3]) > 0).all()

    @given(seed=seeds)
    def test_radius_is_that_of_the_sphere_through_the_four_points(self, seed):
        points, neighbors = random_tetrahedra(np.random.default_rng(seed), 10)
        H = geometry.sphere_curvature(points, neighbors)
        for i in range(0, 40, 4):
            R = reference.sphere_radius(*points[[i, *neighbors[i]]])
            assert_allclose(abs(H[i]), 1 / R, rtol=1e-7)

    @given(seed=seeds)
    def test_cosphericity(self, seed):
        """For fixed neighbors, points on one side of a sphere have one angle, on the other side pi less."""
        rng = np.random.default_rng(seed)
        points = rng.normal(size=(4, 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        many = rng.normal(size=(50, 3))
        many /= np.linalg.norm(many, axis=1)[:, None]
        phi = np.array([geometry.simplex_angle(np.vstack([p, points[1:]]), ONE)[0] for p in many])
        n = geometry.normals(points, ONE)[0]
        above = (many - points[1]) @ n > 0
        assume(above.any() and not above.all())
        assert_allclose(phi[above], phi[above][0], atol=1e-6)
        assert_allclose(phi[~above], phi[above][0] - np.pi, atol=1e-6)


class TestHeight:
    @given(seed=seeds)
    def test_metric_parameters_and_angle_reproduce_the_vertex(self, seed):
        """P = e1 A + e2 B + e3 C + L n, for all signs and beyond a right angle."""
        points, neighbors = random_tetrahedra(np.random.default_rng(seed), 200)
        e = geometry.metric_parameters(points, neighbors)
        n = geometry.normals(points, neighbors)
        center, r = geometry.circumcircle(points, neighbors)
        phi = geometry.simplex_angle(points, neighbors)
        foot = np.einsum("ij,ijk->ik", e, points[neighbors])
        d = np.linalg.norm(foot - center, axis=1)
        h = reference.height(points, neighbors)
        near = h**2 < d**2 - r**2  # the smaller of two heights, for feet outside the circle
        good = (r < 30) & (np.abs(h) > 1e-3) & (np.abs(h**2 - (d**2 - r**2)) > 1e-2)
        L = geometry.height_of_angle(r, d, phi)
        L_near = geometry.height_of_angle(r, d, phi, far=False)
        again = foot + np.where(near, L_near, L)[:, None] * n
        assert_allclose(e.sum(axis=1), 1, rtol=1e-12)
        assert_allclose(again[good], points[good], atol=1e-9 * 30)
        assert (near[good].any(), (phi[good] < -np.pi / 2).any(), (phi[good] > np.pi / 2).any()) == (True,) * 3

    @given(
        r=st.floats(0.1, 10),
        t=st.floats(0, 0.99),
        turn=st.floats(0, 2 * np.pi),
        phi=st.floats(-3, 3),
    )
    def test_the_vertex_at_the_height_of_an_angle_has_that_angle(self, r, t, turn, phi):
        """For a foot inside the circle, any angle; reproduces P to 1e-9 of the circle."""
        assume(abs(phi) > 1e-3)
        corners = r * np.array([[np.cos(a), np.sin(a), 0] for a in (0.3, 2.0, 4.4)])
        foot = t * r * np.array([np.cos(turn), np.sin(turn), 0])
        L = float(geometry.height_of_angle(r, t * r, phi))
        points = np.vstack([foot + L * np.eye(3)[2], corners])
        assert np.sign(L) == np.sign(phi)
        assert_allclose(geometry.simplex_angle(points, ONE)[0], phi, rtol=1e-9)
        assert_allclose(geometry.metric_parameters(points, ONE)[0] @ corners, foot, atol=1e-9 * r)
        assert_allclose(reference.height(points, ONE)[0], L, rtol=1e-9)

    @given(r=st.floats(0.1, 10), t=st.floats(1.01, 5), u=st.floats(0.02, 0.98), above=st.booleans())
    def test_two_heights_share_an_angle_for_a_foot_outside(self, r, t, u, above):
        d = t * r
        phi = (1 if above else -1) * (np.pi - u * np.arcsin(r / d))
        far, near = geometry.height_of_angle(r, d, phi), geometry.height_of_angle(r, d, phi, far=False)
        assert_allclose(far * near, d**2 - r**2, rtol=1e-9)
        assert abs(far) >= abs(near)
        for h in (far, near):
            assert_allclose(np.arctan2(2 * h * r, r**2 - d**2 - h**2), phi, rtol=1e-9)

    def test_limits(self):
        L = geometry.height_of_angle
        assert_array_equal(L(2.0, [0.0, 1.0, 2.0, 3.0], 0.0), 0)
        assert L(1.0, 1.0, np.pi / 2) == 0
        assert_allclose(L(1.0, 0.0, np.pi / 2), 1)
        assert_allclose(L(1.0, 0.6, np.pi / 2), 0.8)
        assert np.isnan(L(1.0, 2.0, 2.0))
        assert_allclose(L(3.0, 0.0, np.linspace(-3, 3, 7)), 3 * np.tan(np.linspace(-3, 3, 7) / 2))  # half-angle

    def test_continuous_across_a_right_angle(self):
        phi = np.pi / 2 + np.array([-1e-9, 0, 1e-9])
        assert_allclose(np.diff(geometry.height_of_angle(1.0, 0.7, phi)), 0, atol=1e-8)


class TestPlane:
    @given(seed=seeds, inside=st.booleans())
    def test_angle_is_zero_in_the_plane_inside_the_circle_and_pi_outside(self, seed, inside):
        rng = np.random.default_rng(seed)
        a = rng.uniform(0, 1.5, 3) + np.array([0, 2.1, 4.2])
        circle = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
        foot = np.append(rng.normal(size=2), 0)
        foot *= rng.uniform(0.1, 0.9) ** (1 if inside else -1) / np.linalg.norm(foot)
        points = np.vstack([foot, circle])
        assert_allclose(abs(geometry.simplex_angle(points, ONE)[0]), 0 if inside else np.pi, atol=1e-12)
        assert geometry.sphere_curvature(points, ONE)[0] == 0

    def test_neighbors_on_one_line_are_an_ordinary_case(self):
        points = np.array([[0.3, 2.0, 0.1], [0, 0, 0], [1, 1, 1], [3, 3, 3.0]])
        assert_array_equal(geometry.normals(points, ONE)[0], 0)
        for quantity in (geometry.simplex_angle, geometry.sphere_curvature):
            assert quantity(points, ONE)[0] == 0
        assert_allclose(geometry.metric_parameters(points, ONE)[0], 1 / 3, rtol=1e-15)
        center, radius = geometry.circumcircle(points, ONE)
        assert np.isnan(center[0]).all()
        assert radius[0] == np.inf

    @given(seed=seeds, log_scale=st.floats(-6, 6))
    def test_neighbors_on_one_line_up_to_rounding(self, seed, log_scale):
        rng = np.random.default_rng(seed)
        line = rng.normal(size=3) * rng.uniform(-1, 1, (3, 1))
        points = 10**log_scale * np.vstack([rng.normal(size=3), line])
        assume(np.linalg.norm(line[1] - line[0]) > 0.05)
        assume(np.linalg.norm(line[2] - line[0]) > 0.05)
        assert_array_equal(geometry.normals(points, ONE)[0], 0)
        assert geometry.sphere_curvature(points, ONE)[0] == 0

    @pytest.mark.parametrize("scale", [1e-8, 1.0, 1e8])
    def test_coinciding_points_give_finite_numbers(self, scale):
        for points in (np.zeros((4, 3)), scale * np.eye(4)[[0, 0, 1, 2], :3], scale * np.eye(4)[[3, 0, 0, 1], :3]):
            for quantity in (geometry.normals, geometry.simplex_angle, geometry.sphere_curvature):
                assert np.isfinite(quantity(points, ONE)).all()
            assert np.isfinite(geometry.metric_parameters(points, ONE)).all()


class TestCircle:
    @given(seed=seeds)
    def test_center_is_as_far_from_all_neighbors_and_in_their_plane(self, seed):
        points, neighbors = random_tetrahedra(np.random.default_rng(seed), 20)
        center, r = geometry.circumcircle(points, neighbors)
        good = r < 30
        for j in range(3):
            assert_allclose(np.linalg.norm(points[neighbors[:, j]] - center, axis=1)[good], r[good], rtol=1e-8)
        off = np.einsum("ij,ij->i", center - points[neighbors[:, 0]], geometry.normals(points, neighbors))
        assert_allclose(off[good], 0, atol=1e-8)


class TestInvariance:
    @pytest.mark.parametrize("name", SCALARS)
    @given(mesh=meshes, seed=seeds, log_scale=st.floats(-3, 3))
    def test_scalars(self, name, mesh, seed, log_scale):
        rng = np.random.default_rng(seed)
        power, sign = SCALARS[name]
        value = getattr(mesh, name)
        tolerance = {"rtol": 1e-6, "atol": 1e-6 * np.abs(value).max()}
        Q, t, s = rotation(rng), rng.normal(size=3), 10**log_scale
        away = np.abs(np.abs(mesh.simplex_angle) - np.pi) > 1e-5  # where the angle jumps from pi to -pi
        assert_allclose(getattr(mesh.moved(mesh.vertices @ Q.T + t), name)[away], value[away], **tolerance)
        assert_allclose(getattr(mesh.moved(s * mesh.vertices), name) / s**power, value, **tolerance)
        assert_allclose(getattr(flipped(mesh), name)[away], sign * value[away], **tolerance)
        order = rng.permutation(mesh.n_vertices)
        assert_allclose(getattr(renumbered(mesh, order), name), value[order], **tolerance)

    @given(mesh=meshes, seed=seeds)
    def test_normals_turn_with_the_mesh_and_metric_parameters_do_not_change(self, mesh, seed):
        rng = np.random.default_rng(seed)
        Q = rotation(rng)
        other = mesh.moved(7 * mesh.vertices @ Q.T + rng.normal(size=3))
        assert_allclose(other.normals, mesh.normals @ Q.T, atol=1e-8)
        assert_allclose(other.metric, mesh.metric, rtol=1e-6, atol=1e-6)
        assert_allclose(flipped(mesh).normals, -mesh.normals, atol=1e-12)
        assert_allclose(flipped(mesh).metric, mesh.metric[:, [0, 2, 1]], rtol=1e-9, atol=1e-9)

    @given(seed=seeds)
    def test_inversion_centered_at_the_vertex_keeps_the_angle(self, seed):
        """Inversion maps the circumsphere to a plane and the plane to a sphere: their angle is kept, up to sign."""
        points, neighbors = random_tetrahedra(np.random.default_rng(seed), 30)
        for i in range(0, 120, 4):
            A = points[neighbors[i]] - points[i]
            inverse = A / (A**2).sum(axis=1)[:, None]
            before = geometry.simplex_angle(np.vstack([np.zeros(3), A]), ONE)[0]
            after = geometry.simplex_angle(np.vstack([np.zeros(3), inverse]), ONE)[0]
            assert_allclose(np.abs(np.sin(before)), np.abs(np.sin(after)), atol=1e-6)


class TestConvergence:
    """On regular meshes, refined at a point, the error of the mean curvature falls with the square of the edge."""

    @staticmethod
    def slope(surface, H, angles, speeds=(1.0, 1.0, 1.0)):
        t = 0.2 / 2.0 ** np.arange(5)
        errors = []
        for step in t:
            uv = [(0, 0)] + [(step * v * np.cos(a), step * v * np.sin(a)) for a, v in zip(angles, speeds, strict=True)]
            points = np.array([surface(*p) for p in uv])
            errors.append(abs(geometry.sphere_curvature(points, ONE)[0] - H))
        return np.polyfit(np.log(t), np.log(errors), 1)[0]

    @pytest.mark.parametrize("turn", [0.0, 0.4, 1.1])
    def test_order_two_on_a_cylinder(self, turn):
        """Neighbors at equal distances along geodesics, 120 degrees apart."""
        angles = turn + 2 * np.pi / 3 * np.arange(3)
        assert abs(self.slope(lambda u, v: (np.sin(u), v, np.cos(u)), 0.5, angles) - 2) < 0.1

    @pytest.mark.parametrize("turn", [0.0, 0.7])
    def test_order_two_at_an_umbilic_for_uneven_neighbors(self, turn):
        """At an umbilic the limit is H whatever the neighbors, when the surface is symmetric there."""
        angles = turn + np.array([0.0, 2.2, 4.0])
        speeds = (1.0, 0.7, 1.2)
        assert abs(self.slope(lambda u, v: (u, v, -(u**2 + v**2) + (u**4 + v**4)), 2.0, angles, speeds) - 2) < 0.1

    def test_uneven_neighbors_elsewhere_have_another_limit(self):
        """H* = H + (k1 - k2) a / b of the specification; verifies the check above."""
        angles, v = np.array([0.2, 2.0, 4.4]), np.array([1.0, 0.6, 1.3])
        a = np.linalg.det(np.stack([np.cos(angles), np.sin(angles), v * np.cos(2 * angles)], axis=1))
        b = np.linalg.det(np.stack([np.cos(angles), np.sin(angles), v], axis=1))
        k1, k2 = 1.5, 0.2
        t = 1e-3
        uv = [(0, 0), *(t * v[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1))]
        points = np.array([(x, y, -(k1 * x * x + k2 * y * y) / 2) for x, y in uv])
        limit = (k1 + k2) / 2 + (k1 - k2) / 2 * a / b
        assert_allclose(geometry.sphere_curvature(points, ONE)[0], limit, rtol=1e-3)

    def test_order_two_on_a_regular_mesh(self):
        """Regular hexagons rolled into a cylinder: every inner vertex, refined three times."""
        errors = []
        for n in (24, 48, 96):
            along = n // 3
            mesh = shapes.cylinder(n, along, radius=2.0, height=along * np.sqrt(3) / 2 * 2 * np.pi * 2.0 / n)
            c = mesh.connectivity
            inner = ~c.face_is_hole[c.face[c.neighbors]].any(axis=(1, 2))
            errors.append(np.abs(mesh.sphere_curvature - 1 / (2 * 2.0))[inner].max())
        assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2, atol=0.1)


@pytest.mark.parametrize("name", CLOSED)
def test_sphere_curvature_agrees_with_the_angle(name):
    mesh = CLOSED[name]
    _, r = geometry.circumcircle(mesh.vertices, mesh.neighbors)
    assert_allclose(mesh.sphere_curvature, np.sin(mesh.simplex_angle) / r, rtol=1e-9, atol=1e-12)
