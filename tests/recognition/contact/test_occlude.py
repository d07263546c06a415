"""Occlusion: surfaces that fit are brought together, none goes into the other, and pairs are kept to."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.recognition.contact.constrained_least_squares import constrained_least_squares
from simplexmesh.recognition.contact.part_distances import Part
from simplexmesh.surface.normals.estimate import vertex_normals
from tests.nightly.marks import nightly

GROUND = sm.plane(24, 24, size=(6.0, 6.0)).triangulated()


def hills(count, *, facing=1):
    """A field of hills without symmetry, seen from above, or from below: what fits on it."""
    flat = sm.plane(count, count, size=(2.0, 2.0)).triangulated("dual")
    x, y, _ = flat.vertices.T
    z = 0.1 * np.sin(5 * x + y) * np.cos(4 * y) + 0.05 * x * y + 0.04 * np.sin(11 * x) * np.sin(9 * y)
    return sm.TriangleMesh(np.stack([x, y, z], axis=1), flat.faces[:, ::facing])


LOWER, UPPER = hills(40), hills(40, facing=-1)


def lifted(mesh, height):
    """A mesh so much higher."""
    return sm.TriangleMesh(mesh.vertices + np.array([0, 0, height]), mesh.faces)


def motion(seed, *, degrees, shift, lift, about=(0.0, 0.0, 0.0)):
    """A small turn about a point, a shift aside and a lift."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    way = rng.normal(size=2)
    T[:3, 3] = np.asarray(about) - T[:3, :3] @ about + [*(shift * way / np.linalg.norm(way)), lift]
    return T


def off(found, T, mesh):
    """How far the vertices end up from where they began."""
    back = found.T_target_source @ T
    return np.linalg.norm(mesh.vertices @ back[:3, :3].T + back[:3, 3] - mesh.vertices, axis=1).max()


def feet(*ends, radius=0.2):
    """Balls at some places, one part."""
    ball = sm.sphere(6, radius=radius).triangulated("dual")
    n = ball.n_vertices
    vertices = np.concatenate([ball.vertices + end for end in ends])
    return sm.TriangleMesh(vertices, np.concatenate([ball.faces + n * k for k in range(len(ends))])), n


class TestOcclude:
    @pytest.mark.parametrize("seed", [*nightly(*range(5)), 5])
    def test_what_fits_returns_to_its_place(self, seed):
        T = motion(seed, degrees=2 + 2 * seed, shift=0.1, lift=0.2)
        found = sm.occlude(UPPER.transformed(T), LOWER)
        assert off(found, T, UPPER) < 1e-4
        assert found.angle == pytest.approx(np.radians(2 + 2 * seed), abs=1e-4)
        assert found.contact_area > 0.95 * UPPER.area  # all but the border
        assert found.area_before < 0.2 * found.contact_area
        assert found.penetration < 1e-5

    def test_of_other_triangles_too(self):
        T = motion(1, degrees=5, shift=0.1, lift=0.2)
        found = sm.occlude(hills(33, facing=-1).transformed(T), LOWER, tolerance=0.01)
        assert off(found, T, UPPER) < 0.02
        assert found.contact_area > 0.8 * UPPER.area
        assert found.penetration < 1e-4

    @pytest.mark.parametrize("name", ["source", "target"])
    def test_that_a_part_is_inside_out_is_told(self, name):
        ball = sm.sphere(6).triangulated("dual")
        parts = {"source": ball, "target": ball.scaled(0.95 if name == "source" else 1 / 0.95)}
        parts[name] = sm.TriangleMesh(parts[name].vertices, parts[name].faces[:, ::-1])
        with pytest.warns(sm.SimplexMeshWarning, match=f"^{name} has inward normals, .* taken for those of a cavity"):
            assert sm.occlude(**parts, tolerance=0.06).contact_area > 0  # a ball in a hole

    @pytest.mark.filterwarnings("ignore:source penetrates target")
    @pytest.mark.parametrize("name", ["source", *nightly("target")])
    def test_that_one_body_of_a_part_is_inside_out_is_told(self, name):
        """A part of which one of two bodies was, turned by 94 degrees without a word."""
        ball = sm.sphere(4).triangulated("dual")
        n, inner = ball.n_vertices, ball.scaled(0.8)
        vertices = np.concatenate([ball.vertices, np.add(ball.vertices, [3, 0, 0]), inner.vertices])
        faces, cavity = [ball.faces, ball.faces + n], ball.faces[:, ::-1] + 2 * n
        below = sm.TriangleMesh(vertices, np.concatenate([*faces, cavity]))
        parts = {"source": lifted(below, 2.02), "target": below}
        assert sm.occlude(**parts, penetration=0.1).contact_area > 0  # a hollow ball is not inside out
        faces[1] = faces[1][:, ::-1]
        parts[name] = sm.TriangleMesh(parts[name].vertices, np.concatenate([*faces, cavity]))
        with pytest.warns(sm.SimplexMeshWarning, match=rf"^{name} has inward normals, {len(cavity)} of its"):
            sm.occlude(**parts)

    def test_that_faces_of_an_open_part_disagree_is_told(self):
        faces = UPPER.faces.copy()
        faces[:5] = faces[:5, ::-1]
        with pytest.warns(sm.SimplexMeshWarning, match="^source has inward normals, 5 of its"):
            sm.occlude(lifted(sm.TriangleMesh(UPPER.vertices, faces), 0.1), LOWER)

    def test_three_feet_stand_on_the_ground(self):
        stool, n = feet([1, 0, 0.3], [-0.5, 0.9, 0.35], [-0.5, -0.8, 0.27])
        for lift in (0.0, -0.2):  # from above, and from within
            start = lifted(stool, lift)
            found = sm.occlude(start, GROUND, tolerance=0.005)
            T = found.T_target_source
            height = start.vertices @ T[2, :3] + T[2, 3]
            assert [height[k * n : (k + 1) * n].min() for k in range(3)] == pytest.approx([0, 0, 0], abs=1e-5)
            assert found.penetration == pytest.approx(-min(height.min(), 0), abs=1e-12)
            assert {int(k) for k in np.flatnonzero(found.contact) // n} == {0, 1, 2}

    def test_comes_out_however_deep_it_is(self):
        stool, _ = feet([1, 0, 0.3], [-0.5, 0.9, 0.35], [-0.5, -0.8, 0.27])
        sunk = lifted(stool, -np.sort(stool.vertices[:, 2])[stool.n_vertices // 3])  # one vertex is in contact
        slab = sm.TriangleMesh(*thick(GROUND.vertices, GROUND.faces, 2.0))
        found = sm.occlude(sunk, slab, tolerance=1e-4, reach=1e-4)
        assert found.penetration < 1e-6
        assert found.T_target_source[2, 3] > 0.05

    @pytest.mark.nightly
    def test_what_is_deep_in_the_moving_part_comes_out_as_well(self):
        stool, _ = feet([1, 0, 0.3], [-0.5, 0.9, 0.35], [-0.5, -0.8, 0.27])
        sunk = lifted(stool, -np.sort(stool.vertices[:, 2])[stool.n_vertices // 3])
        slab = sm.TriangleMesh(*thick(GROUND.vertices, GROUND.faces, 2.0))
        found = sm.occlude(sm.divided(slab, 0.1), sunk, tolerance=1e-3, reach=0.02)
        assert found.penetration < 1e-6
        assert found.T_target_source[2, 3] < -0.05

    def test_what_is_far_behind_an_open_surface_is_not_inside(self):
        balls, n = feet([0, 0, 0.25], [0, 0, -2.0])
        T = sm.occlude(balls, GROUND, tolerance=0.005, reach=0.5).T_target_source
        assert (balls.vertices[:n] @ T[2, :3] + T[2, 3]).min() == pytest.approx(0, abs=1e-6)

    def test_what_is_deeper_than_it_may_be_does_not_touch(self):
        ball, _ = feet([0, 0, 0.0])
        found = sm.occlude(ball, GROUND, tolerance=0.005)
        assert found.area_before < 0.1 * ball.area
        assert found.contact_area > 0

    def test_corners_stored_apart_make_no_border(self):
        ball, _ = feet([0, 0, 0.0])
        soup = Part(
            sm.TriangleMesh(ball.vertices[ball.faces].reshape(-1, 3), np.arange(ball.faces.size).reshape(-1, 3))
        )
        assert soup.closed
        assert soup.signed_distance(2 * ball.vertices)[0] == pytest.approx(0.2, abs=0.01)
        assert (soup.points.shape, soup.areas.sum()) == ((ball.faces.size, 3), pytest.approx(ball.area))

    def test_goes_as_deep_as_it_may(self):
        stool, _ = feet([1, 0, 0.3], [-0.5, 0.9, 0.35], [-0.5, -0.8, 0.27])
        deep = sm.occlude(stool, GROUND, tolerance=0.005, penetration=0.02)
        assert deep.penetration == pytest.approx(0.02, abs=1e-4)
        assert deep.distances.min() == pytest.approx(-0.02, abs=1e-4)
        assert deep.contact_area > 2 * sm.occlude(stool, GROUND, tolerance=0.005).contact_area

    def test_vertices_of_the_fixed_part_stay_out_as_well(self):
        """A cone under a coarse plate: no vertex of the plate is near its tip."""
        spike, _ = feet([0, 0, 0.0])
        tip = np.array([0.13, 0.21, 0.6])
        spike = sm.TriangleMesh(np.where(spike.vertices[:, 2:] > 0.18, tip, spike.vertices), spike.faces).welded(
            report=False
        )
        plate = sm.plane(6, 6, size=(4.0, 4.0)).triangulated()
        plate = lifted(sm.TriangleMesh(plate.vertices, plate.faces[:, ::-1]), 0.8)
        found = sm.occlude(plate, spike, tolerance=0.02)
        moved = plate.vertices @ found.T_target_source[:3, :3].T + found.T_target_source[:3, 3]
        assert Triangles(sm.TriangleMesh(moved, plate.faces)).signed(tip[None])[0][0] > -1e-4
        assert moved[:, 2].min() < 0.79  # it has come down

    def test_of_a_simplex_mesh_rows_are_its_vertices(self):
        ball = sm.sphere(8, radius=0.5, center=(0, 0, 0.55))
        found = sm.occlude(ball, GROUND, tolerance=0.005)
        height = ball.vertices @ found.T_target_source[2, :3] + found.T_target_source[2, 3]
        assert found.distances == pytest.approx(height)
        assert found.contact.shape == (ball.n_vertices,)
        assert found.contact_area > 0

    def test_of_fragments_of_a_bone(self):
        egg = sm.ellipsoid((3, 2, 1), 14).triangulated("dual")
        rough = sm.TriangleMesh(egg.vertices * (1 + 0.05 * np.sin(4 * egg.vertices[:, :1])), egg.faces)
        x, y, z = (0.5 * LOWER.vertices).T
        top = np.stack([5.0 * x, 5.0 * y, 2.0 * z], axis=1)
        block = sm.TriangleMesh(*thick(top, LOWER.faces, 3.0))
        below, above = (sm.boolean(rough, block, name) for name in ("intersection", "difference"))
        assert below.is_closed
        assert above.is_closed
        T = motion(2, degrees=5, shift=0.15, lift=0.3, about=above.vertices.mean(axis=0))
        found = sm.occlude(above.transformed(T), below)
        assert off(found, T, above) < 1e-4
        assert found.penetration < 1e-5  # of a size of 6

    @settings(max_examples=6)
    @given(st.integers(0, 10**6), st.sampled_from([1e-3, 1.0, 1e4]))
    def test_turns_moves_and_scales_with_the_parts(self, seed, size):
        upper, lower = hills(20, facing=-1), hills(20)
        off = upper.transformed(motion(1, degrees=5, shift=0.1, lift=0.2))
        A = motion(seed, degrees=170, shift=3.0, lift=2.0)
        A[:3] *= size
        plain, both = (sm.occlude(*parts) for parts in ((off, lower), (off.transformed(A), lower.transformed(A))))
        back = np.linalg.inv(A) @ both.T_target_source @ A
        assert back == pytest.approx(plain.T_target_source, abs=3e-4)
        assert both.contact_area == pytest.approx(plain.contact_area * size**2, rel=0.03)

    def test_distances_are_those_of_the_deviation(self):
        ball = sm.sphere(10).triangulated("dual")
        upper = lifted(ball, 2.1)
        found = sm.occlude(upper, ball)
        moved = upper.transformed(found.T_target_source)
        assert found.distances == pytest.approx(sm.deviation(moved, ball).distances, abs=1e-12)
        assert (found.distances[found.contact] < 0.002 * upper.diagonal * 1.01).all()
        facing = np.einsum("ij,ij->i", vertex_normals(moved, "area"), moved.vertices)
        assert (facing[found.contact] < 0).all()


class TestPairs:
    def test_give_the_start(self):
        T = motion(3, degrees=150, shift=5.0, lift=4.0)
        picks = UPPER.vertices[[0, 900, 1500]]
        goals = picks + 0.02 * np.random.default_rng(0).normal(size=(3, 3))
        found = sm.occlude(UPPER.transformed(T), LOWER, pairs=(picks @ T[:3, :3].T + T[:3, 3], goals))
        assert off(found, T, UPPER) < 1e-4
        assert 0.005 < found.slack < 0.1  # how badly they were picked

    def test_hold_what_would_slide(self):
        stool, _ = feet([1, 0, 0.3], [-0.5, 0.9, 0.35], [-0.5, -0.8, 0.27])
        here = np.array([[1.0, 0, 0.1]])
        there = np.array([[0.8, 0.1, 0.0]])
        found = sm.occlude(stool, GROUND, tolerance=0.005, pairs=(here, there), slack=0.03)
        at = here @ found.T_target_source[:3, :3].T + found.T_target_source[:3, 3]
        assert found.slack == pytest.approx(np.linalg.norm(at - there), abs=1e-12)
        assert found.slack < 0.0301
        assert found.penetration < 1e-4
        free = sm.occlude(stool, GROUND, tolerance=0.005)
        assert np.linalg.norm(here @ free.T_target_source[:3, :3].T + free.T_target_source[:3, 3] - there) > 0.1

    def test_that_nothing_can_meet_are_told(self):
        ball = sm.sphere(8, center=(0, 0, 1.2)).triangulated("dual")
        pairs = ([[0, 0, 0.2], [0, 0, 2.2]], [[0, 0, 0.0], [0, 0, 3.0]])  # two apart, to be three apart
        with pytest.raises(
            ValueError, match=r"^slack must let the pairs be met .*, not be 0\.1: they are left [0-9.]+ apart$"
        ):
            sm.occlude(ball, GROUND, pairs=pairs, slack=0.1)


class TestInput:
    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"tolerance": 0}, "tolerance must be above 0, not 0"),
            ({"penetration": -1}, "penetration must be at least 0, not -1"),
            ({"reach": np.nan}, "reach must be finite, not nan"),
            ({"slack": 1.0}, "slack must be left out without pairs"),
            ({"pairs": np.eye(3)}, "pairs must be two arrays of points, of the source and of the target"),
            ({"pairs": (np.eye(3), np.eye(3)[:2])}, "pairs[1] must have shape (3, 3), not (2, 3)"),
            ({"pairs": (np.eye(3)[:2], np.eye(3)[:2])}, "pairs must be at least 3 without a slack, not 2"),
            ({"pairs": (np.eye(3), np.eye(3)), "slack": 0.0}, "slack must be above 0, not 0"),
        ],
    )
    def test_wrong_numbers_are_told(self, options, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            sm.occlude(UPPER, LOWER, **options)
        assert str(caught.value) == words

    def test_parts_out_of_reach_are_told(self):
        away = lifted(UPPER, 50)
        with pytest.raises(
            ValueError, match=r"^source must be within the reach 0\.2\d+ of target and not beyond its border"
        ):
            sm.occlude(away, LOWER)

    @pytest.mark.parametrize("name", ["source", "target"])
    def test_sizes_that_a_tree_of_boxes_cannot_hold_are_told(self, name):
        parts = {"source": UPPER, "target": LOWER, name: sm.sphere(3, radius=1e160)}
        with pytest.raises(ValueError, match=f"^{name} must be within 1e-60 and"):
            sm.occlude(**parts)

    def test_parts_that_do_not_face_each_other_are_told(self):
        ball = sm.sphere(8).triangulated("dual")
        with pytest.warns(sm.SimplexMeshWarning, match=r"^no vertex of source touches target"):
            found = sm.occlude(ball, ball)
        assert found.contact_area == 0
        assert found.angle == 0

    def test_parts_that_cannot_be_brought_out_of_each_other_are_told(self):
        ball = sm.sphere(6).triangulated("dual")
        wall = sm.TriangleMesh(
            np.concatenate([1.4 * ball.vertices, 0.8 * ball.vertices]),
            np.concatenate([ball.faces, ball.faces[:, ::-1] + ball.n_vertices]),
        )
        with pytest.warns(sm.SimplexMeshWarning, match=r"^source penetrates target by 0\.\d+") as caught:
            found = sm.occlude(ball, wall)  # too large for the room it is in
        assert {each.filename for each in caught} == {__file__}
        assert found.penetration > 0.1

    @pytest.mark.parametrize("name", ["source", "target"])
    def test_points_are_no_surface(self, name):
        parts = {"source": UPPER, "target": LOWER, name: sm.PointCloud(UPPER.vertices)}
        with pytest.raises(TypeError, match=f"^{name} must be"):
            sm.occlude(**parts)


class TestConstrainedLeastSquares:
    @given(st.integers(0, 10**6))
    def test_is_that_of_a_general_solver(self, seed):
        rng = np.random.default_rng(seed)
        rows, weight, gap = rng.normal(size=(30, 6)), rng.uniform(0, 1, 30), rng.normal(size=30)
        bounds = rng.normal(size=(12, 6))
        floor = bounds @ rng.normal(size=6) - rng.uniform(0, 1, 12)  # some x meets them
        found = constrained_least_squares(rows, weight, gap, bounds, floor)
        assert (bounds @ found - floor).min() > -1e-4 * (1 + np.abs(found).max())
        known = minimize(
            lambda x: (weight * (gap + rows @ x) ** 2).sum(),
            np.zeros(6),
            jac=lambda x: 2 * rows.T @ (weight * (gap + rows @ x)),
            constraints={"type": "ineq", "fun": lambda x: bounds @ x - floor, "jac": lambda x: bounds},
            method="SLSQP",
            options={"maxiter": 500, "ftol": 1e-14},
        )
        value = (weight * (gap + rows @ found) ** 2).sum()
        assert value == pytest.approx(known.fun, rel=2e-3, abs=2e-3)

    def test_without_weights_is_the_shortest(self):
        found = constrained_least_squares(
            np.ones((2, 3)), np.zeros(2), np.ones(2), np.array([[0, 2.0, 0]]), np.array([1.0])
        )
        assert found == pytest.approx([0, 0.5, 0], abs=1e-5)

    def test_bounds_against_each_other_share_what_is_missing(self):
        both = np.array([[1.0, 0], [-1.0, 0]])
        found = constrained_least_squares(np.eye(2), np.zeros(2), np.zeros(2), both, np.array([1.0, 1.0]))
        assert found == pytest.approx([0, 0], abs=1e-3)

    @pytest.mark.parametrize("size", [1e-9, 1e9])
    def test_heeds_no_unit(self, size):
        rng = np.random.default_rng(0)
        rows, gap, bounds = rng.normal(size=(9, 6)), rng.normal(size=9), rng.normal(size=(5, 6))
        plain = constrained_least_squares(rows, np.ones(9), gap, bounds, np.ones(5))
        assert constrained_least_squares(
            rows, np.ones(9), size * gap, bounds, np.full(5, size)
        ) / size == pytest.approx(plain)


class TestSigned:
    @pytest.mark.parametrize(
        "surface", [sm.torus(20, 12).triangulated("dual"), LOWER, sm.clipped(sm.sphere(6), (0, 0, 0.3), (0, 0, 1))]
    )
    def test_is_what_libigl_says_of_clean_surfaces(self, surface):
        points = np.random.default_rng(0).normal(size=(2000, 3))
        distance, _, beyond = Triangles(surface).signed(points)
        kind = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
        signed_distance, *_ = igl.signed_distance(
            points, np.array(surface.vertices), np.array(surface.faces), sign_type=kind
        )
        assert distance[~beyond] == pytest.approx(signed_distance[~beyond], abs=1e-12)
        assert np.abs(distance) == pytest.approx(np.abs(signed_distance), abs=1e-12)

    @given(st.integers(0, 10**6))
    def test_direction_is_the_gradient(self, seed):
        target = Triangles(sm.ellipsoid((3, 2, 1), 8))
        points = np.random.default_rng(seed).normal(size=(20, 3)) * [3, 2, 1]
        distance, direction, _ = target.signed(points)
        ahead, _, _ = target.signed(points + 1e-6 * direction)
        assert np.linalg.norm(direction, axis=1) == pytest.approx(1)
        assert ahead - distance == pytest.approx(1e-6, rel=1e-2)

    def test_on_the_surface_is_its_normal(self):
        ball = sm.sphere(8).triangulated("dual")
        distance, direction, _ = Triangles(ball).signed(ball.vertices)
        assert distance == pytest.approx(0, abs=1e-9)
        assert np.einsum("ij,ij->i", direction, ball.vertices) == pytest.approx(1, abs=1e-2)

    def test_tells_what_is_beyond_a_border(self):
        distance, _, beyond = Triangles(GROUND).signed(np.array([[0, 0, 1.0], [9, 0, 1.0], [0, 0, -2.0]]))
        assert distance[[0, 2]] == pytest.approx([1, -2])
        assert beyond.tolist() == [False, True, False]

    def test_inside_is_what_a_surface_winds_around_where_it_passes_through_itself(self):
        both, _ = feet([0, 0, 0.0], [0.25, 0, 0.0])  # two balls that overlap
        points = np.random.default_rng(0).uniform(-0.3, 0.6, (800, 3))
        distance, _, _ = Triangles(both).signed(points)
        away = np.linalg.norm(points[:, None] - [[0, 0, 0], [0.25, 0, 0]], axis=2).min(axis=1)
        clear = np.abs(away - 0.2) > 0.01
        assert ((distance < 0) == (away < 0.2))[clear].all()
        assert ((sm.deviation(points, both).distances < 0) == (away < 0.2))[clear].all()

    def test_slivers_turn_nothing_inside_out(self):
        """A tetrahedron with a face of no area along an edge: its normal says nothing."""
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0]])
        faces = [[0, 2, 1], [0, 1, 4], [0, 4, 3], [4, 1, 3], [1, 2, 3], [2, 0, 3]]  # 0 1 4 are on a line
        points = np.random.default_rng(0).uniform(-0.5, 1.5, (500, 3))
        distance, _, _ = Triangles(sm.TriangleMesh(corners, faces)).signed(points)
        inside = (points > 0).all(axis=1) & (points.sum(axis=1) < 1)
        assert ((distance < 0) == inside).all()
        assert ((sm.deviation(points, sm.TriangleMesh(corners, faces)).distances < 0) == inside).all()


def thick(top, faces, depth):
    """Vertices and faces of what is below a sheet, as a closed block."""
    n = len(top)
    below = np.concatenate([top[:, :2], np.full((n, 1), -depth)], axis=1)
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    both = {tuple(pair) for pair in ends.tolist()}
    rim = [(a, b) for a, b in ends.tolist() if (b, a) not in both]
    sides = [[b, a, a + n] for a, b in rim] + [[b, a + n, b + n] for a, b in rim]
    return np.concatenate([top, below]), np.concatenate([faces, faces[:, ::-1] + n, sides])
