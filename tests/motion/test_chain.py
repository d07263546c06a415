"""From scan to guide: alignment by picks, plane cuts, deviation, landmark-driven deformation, booleans."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.recognition.register import icp
from simplexmesh.recognition.register.icp import find_correspondences
from simplexmesh.surface.landmarks import morphed as morph
from tests.nightly.marks import nightly

EGG = sm.ellipsoid((3, 2, 1), 16)
BALL = sm.sphere(24).triangulated("dual")


def turned(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def rigid(seed):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turned(seed), 10 * np.random.default_rng(seed).normal(size=3)
    return T


def potato(frequency=20):
    """A body without symmetry."""
    mesh = sm.sphere(frequency)
    x = mesh.vertices
    return mesh.moved(x * [1.6, 1.3, 1.0] * (1 + 0.15 * np.sin(3 * x[:, :1] + x[:, 1:2]) + 0.1 * x[:, 2:] ** 2))


class TestAlign:
    @pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
    def test_recovers_the_motion_from_rough_picks(self, seed):
        body, T = potato(12), rigid(seed)
        rng = np.random.default_rng(seed)
        picks = body.vertices[rng.choice(body.n_vertices, 5, replace=False)]
        goals = picks @ T[:3, :3].T + T[:3, 3]
        moved = body.vertices @ T[:3, :3].T + T[:3, 3]
        found = sm.align(body, moved, (picks + 0.03 * rng.normal(size=picks.shape), goals))
        off = body.vertices @ (found.T_target_source[:3, :3] - T[:3, :3]).T + found.T_target_source[:3, 3] - T[:3, 3]
        assert np.linalg.norm(off, axis=1).max() < 0.01
        assert found.overlap > 0.95
        assert found.error < 0.01
        assert 0.005 < found.pairs_error < 0.1

    def test_pairs_that_lead_nowhere_are_reported(self):
        body = potato(12)
        picks = body.vertices[[0, 300, 700]]
        with pytest.warns(
            sm.SimplexMeshWarning, match="^source has no points near target after the motion of the pairs"
        ):
            found = sm.align(body, body, (picks, picks + 100.0))
        assert found.overlap == 0

    def test_pairs_in_the_wrong_order_are_reported(self):
        body = potato()
        pairs = body.vertices[[0, 300, 700, 1100]], body.vertices[[0, 700, 300, 1100]]
        with pytest.warns(sm.SimplexMeshWarning, match=r"^no rigid motion brings the pairs nearer than 0\.48:"):
            sm.align(body, body, pairs, refine=False)

    def test_wrong_pairs_take_little_longer_than_right_ones(self, monkeypatch):
        searched = []

        def counted(source, target, tree, T, reach, chosen=slice(None)):
            searched.append((reach, len(source.points[chosen])))
            return find_correspondences(source, target, tree, T, reach, chosen)

        monkeypatch.setattr(icp, "find_correspondences", counted)
        body = potato().triangulated().sampled(9_000, rng=0)
        sm.align(body, body, (body.points[[0, 300, 700, 1100]], body.points[[0, 700, 300, 1100]]))
        last = min(reach for reach, _ in searched)
        assert {count for reach, count in searched if reach > last} == {2_000}
        assert {count for reach, count in searched if reach == last} == {9_000}

    def test_refines_what_the_pairs_say(self):
        body, T = potato(), rigid(3)
        moved = body.vertices @ T[:3, :3].T + T[:3, 3]
        picks = body.vertices[[0, 300, 700, 1100]]
        goals = moved[[0, 300, 700, 1100]] + 0.1 * np.random.default_rng(0).normal(size=(4, 3))
        plain, better = (sm.align(body, moved, (picks, goals), refine=wanted) for wanted in (False, True))
        assert plain.T_target_source.tolist() == plain.T_pairs.tolist() == better.T_pairs.tolist()
        for each, worst in ((plain, 1.0), (better, 0.01)):
            at = body.vertices @ each.T_target_source[:3, :3].T + each.T_target_source[:3, 3]
            assert np.linalg.norm(at - moved, axis=1).max() < worst
        assert better.error < plain.error

    def test_of_parts(self):
        body = potato(28)
        T = rigid(5)
        one = body.vertices[body.vertices[:, 0] > -0.4]
        other = (body.vertices @ T[:3, :3].T + T[:3, 3])[body.vertices[:, 0] < 0.4]
        common = np.flatnonzero(np.abs(body.vertices[:, 0]) < 0.3)[[0, 40, 200, 350]]
        goals = body.vertices[common] @ T[:3, :3].T + T[:3, 3] + 0.03
        found = sm.align(one, other, (body.vertices[common], goals))
        at = one @ found.T_target_source[:3, :3].T + found.T_target_source[:3, 3]
        assert np.linalg.norm(at - (one @ T[:3, :3].T + T[:3, 3]), axis=1).max() < 0.02
        assert 0.2 < found.overlap < 0.7

    @pytest.mark.parametrize(
        ("pairs", "words"),
        [
            ((np.zeros((2, 3)), np.zeros((2, 3))), "pairs must be at least 3, not 2"),
            ((np.eye(3), np.eye(3)[:2]), "pairs[1] must have shape (3, 3), not (2, 3)"),
            (([[0, 0, 0], [1, 0, 0], [2, 0, 0]], np.eye(3)), "pairs must not lie on one line, those of the source do"),
            ((np.eye(3), [[0, 0, 0], [1, 0, 0], [2, 0, 0]]), "pairs must not lie on one line, those of the target do"),
            (np.eye(3), "pairs must be two arrays of points, of the source and of the target"),
            ((np.eye(3), np.full((3, 3), np.nan)), "pairs[1] must be finite; pairs[1][0, 0] is nan"),
        ],
    )
    def test_bad_pairs_are_refused(self, pairs, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            sm.align(EGG, EGG, pairs)
        assert str(caught.value) == words

    def test_too_few_points_are_refused(self):
        with pytest.raises(ValueError, match=r"^target must hold at least 50 points"):
            sm.align(EGG, EGG.vertices[:20], (np.eye(3), np.eye(3)))


class TestClipped:
    @given(st.integers(0, 10**6), st.floats(-0.9, 0.9))
    def test_two_capped_parts_are_the_whole(self, seed, height):
        normal = turned(seed)[0]
        mesh = sm.torus(24, 14, radius=1.0, tube_radius=0.4).triangulated("dual")
        parts = []
        for sign in (1, -1):
            try:
                parts.append(sm.clipped(mesh, height * normal, 3 * sign * normal, cap=True))
            except ValueError:
                continue  # the plane misses it
        assert all(part.is_closed for part in parts)
        assert sum(part.volume for part in parts) == pytest.approx(mesh.volume, rel=1e-9)
        for part, sign in zip(parts, (1, -1), strict=False):
            if len(parts) == 2:
                assert (sign * (part.vertices @ normal - height)).min() > -1e-9

    def test_an_open_cut_has_the_border_in_the_plane(self):
        part = sm.clipped(BALL, (0, 0, 0.3), (0, 0, 1))
        assert not part.is_closed
        assert part.n_borders == 1
        assert part.vertices[:, 2].min() == pytest.approx(0.3)
        assert part.area == pytest.approx(2 * np.pi * 0.7, rel=0.01)

    def test_through_vertices_leaves_no_slivers(self):
        mesh = sm.sphere(16).triangulated("dual")
        part = sm.clipped(mesh, (0, 0, 0), (0, 0, 1), cap=True)
        assert part.is_closed
        assert part.volume == pytest.approx(mesh.volume / 2, rel=1e-6)

    def test_takes_a_simplex_mesh_and_an_open_surface(self):
        assert sm.clipped(EGG, (0, 0, 0), (1, 0, 0), cap=True).volume == pytest.approx(EGG.volume / 2, rel=1e-6)
        half = sm.clipped(BALL, (0, 0, 0), (0, 0, 1))
        for length in (1e-200, 1e200):  # whose squares are 0 and infinite
            np.testing.assert_array_equal(sm.clipped(BALL, (0, 0, 0), (0, 0, length)).vertices, half.vertices)
        quarter = sm.clipped(half, (0, 0, 0), (1, 0, 0))
        assert quarter.area == pytest.approx(BALL.area / 4, rel=1e-3)

    @pytest.mark.parametrize("unit", [1e-50, 1e-9, 1e-6, 1e-3, 1e3, 1e50])
    @pytest.mark.parametrize("cap", [True, False])
    def test_in_any_unit(self, unit, cap):
        whole = sm.clipped(BALL, (0, 0, 0.3), (0.1, 0.2, 1), cap=cap)
        small = sm.clipped(BALL.transformed(np.diag([unit] * 3 + [1])), (0, 0, 0.3 * unit), (0.1, 0.2, 1), cap=cap)
        assert small.is_closed == cap
        assert small.area == pytest.approx(whole.area * unit**2, rel=1e-6)
        assert not cap or small.volume == pytest.approx(whole.volume * unit**3, rel=1e-6)

    def test_an_inward_surface_keeps_its_orientation(self):
        inward = sm.TriangleMesh(BALL.vertices, BALL.faces[:, ::-1])
        part = sm.clipped(inward, (0, 0, 0.3), (0.1, 0.2, 1), cap=True)
        assert part.is_closed
        assert part.volume == pytest.approx(-sm.clipped(BALL, (0, 0, 0.3), (0.1, 0.2, 1), cap=True).volume, rel=1e-9)

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.clipped(BALL, (0, 0, 0), (0, 0, 0)), "normal must not be the zero vector"),
            (
                lambda: sm.clipped(sm.plane(8, 8, size=(2e160, 1.0)), (0, 0, 0), (0, 0, 1)),
                "surface must be within 1e-60 and 1e+60 in its unit of length, not reach to 1e+160: "
                "choose another unit",
            ),
            (lambda: sm.clipped(BALL, (0, 0, 0), (0, 0, 1), cap="no"), "cap must be true or false, not str 'no'"),
            (lambda: sm.clipped(BALL, (0, 0), (0, 0, 1)), "origin must have shape (3,), not (2,)"),
            (lambda: sm.clipped(BALL, (0, 0, 0), (0, 0, np.nan)), "normal must be finite; normal[2] is nan"),
            (
                lambda: sm.clipped(BALL, (0, 0, 5), (0, 0, 1)),
                "surface must have a part in front of the plane, it has none",
            ),
            (
                lambda: sm.clipped(sm.plane(8, 8), (0, 0, 0), (1, 0, 0), cap=True),
                "surface must be closed to be capped, it has a border",
            ),
        ],
    )
    def test_bad_input_is_refused(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value) == words


class TestDeviation:
    @pytest.mark.parametrize("offset", [0.1, -0.2])
    def test_of_an_offset_sphere_is_the_offset(self, offset):
        done = sm.TriangleMesh((1 + offset) * BALL.vertices, BALL.faces)
        found = sm.deviation(done, BALL)
        assert found.distances == pytest.approx(offset, abs=0.003)
        assert found.bias == pytest.approx(offset, abs=0.003)
        numbers = (found.mean, found.rms, found.p95, found.max)
        assert numbers == pytest.approx([abs(offset)] * 4, abs=0.003)
        assert repr(found).startswith("Deviation(mean=")

    def test_rows_are_those_of_what_was_given(self):
        points = np.array([[2.0, 0, 0], [0, 0, 0.5], [2, 0, 0], [0, 1, 0]])
        found = sm.deviation(points, BALL).distances
        assert found == pytest.approx([1, -0.5, 1, 0], abs=0.003)

    def test_beyond_a_border_nothing_is_known(self):
        planned = sm.plane(20, 20, size=(1.0, 1.0)).triangulated("dual")
        points = np.array([[0, 0, 0.2], [0, 0, -0.1], [5, 0, 0.2]])
        assert np.isnan(sm.deviation(points, planned).distances).tolist() == [False, False, True]
        assert sm.deviation(points, planned).distances[:2] == pytest.approx([0.2, -0.1])
        assert sm.deviation(points, planned, beyond_border=True).distances[2] == pytest.approx(4.5, abs=0.1)
        assert sm.deviation(points, planned).summary.count == 2

    def test_a_corner_on_the_border_is_beyond_it_by_any_of_its_triangles(self):
        """Beyond a half ball distances of up to 0.44 counted, where the triangle found had no side on the border."""
        half = sm.clipped(BALL, (0, 0, 0), (0, 0, 1))
        points = 1.1 * BALL.vertices
        known = np.isfinite(sm.deviation(points, half).distances)
        assert not known[points[:, 2] < -0.05].any()
        assert known[points[:, 2] > 0.05].all()

    def test_corners_stored_apart_make_no_border(self):
        corners = BALL.vertices[BALL.faces].reshape(-1, 3)
        soup = sm.TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))
        points = np.random.default_rng(0).normal(size=(50, 3))
        assert sm.deviation(points, soup).distances == pytest.approx(sm.deviation(points, BALL).distances, abs=1e-12)

    @pytest.mark.parametrize("size", [1e-40, 1e-25, 1e25])
    def test_signs_are_the_same_in_any_unit(self, size):
        """Winding numbers are in single precision: the inside was outside, or the process crashed."""
        points = np.random.default_rng(0).normal(size=(200, 3))
        found = sm.deviation(size * points, (size * BALL.vertices, BALL.faces)).distances
        assert found / size == pytest.approx(sm.deviation(points, BALL).distances, abs=1e-12)

    def test_a_surface_of_pyvista_is_measured_at_all_its_points(self):
        """It has a method `connectivity`, and was taken for a simplex mesh; a soup has a row for each corner."""
        ball = pv.Sphere(radius=0.5)
        corners = ball.points[ball.regular_faces].reshape(-1, 3)
        soup = pv.PolyData.from_regular_faces(corners, np.arange(len(corners)).reshape(-1, 3))
        for each in (ball, soup):
            found = sm.deviation(each, pv.Sphere(radius=0.6))
            assert found.distances == pytest.approx(np.full(each.n_points, -0.1), abs=0.002)

    def test_a_reference_with_inward_normals_is_reported(self):
        inward = sm.TriangleMesh(BALL.vertices, BALL.faces[:, ::-1])
        points = np.random.default_rng(0).normal(size=(50, 3))
        with pytest.warns(sm.SimplexMeshWarning, match="target has inward normals") as caught:
            found = sm.deviation(points, inward)
        assert {each.filename for each in caught} == {__file__}
        assert found.distances == pytest.approx(-sm.deviation(points, BALL).distances, abs=1e-12)
        with pytest.warns(sm.SimplexMeshWarning, match="flipped"):
            outward = inward.oriented()
        assert sm.deviation(points, outward).distances == pytest.approx(-found.distances, abs=1e-12)

    def test_that_one_of_two_bodies_is_inward_is_reported(self):
        """Also where they touch along an edge, and together are."""
        n, faces = BALL.n_vertices, BALL.faces
        both = np.concatenate([BALL.vertices, BALL.vertices + np.array([3.0, 0, 0])])
        half = f"{len(faces):,} of its {2 * len(faces):,} faces"
        with pytest.warns(sm.SimplexMeshWarning, match=f"target has inward normals, {half}"):
            sm.deviation(both, sm.TriangleMesh(both, np.concatenate([faces, faces[:, ::-1] + n])))
        tips = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]]
        outward = np.array([[0, 3, 2], [0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 5, 4], [0, 4, 1], [0, 1, 5], [1, 4, 5]])
        sm.deviation(both, sm.TriangleMesh(tips, outward))
        with pytest.warns(sm.SimplexMeshWarning, match="inward normals, 8 of its 8 faces"):
            sm.deviation(both, sm.TriangleMesh(tips, outward[:, ::-1]))

    def test_signs_are_right_at_sharp_corners(self):
        wedge = sm.TriangleMesh(
            [[0, 0, 0], [4, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        )
        rng = np.random.default_rng(0)
        points = rng.uniform(-1, 5, (4000, 3)) * [1, 0.5, 0.5]
        x, y, z = points.T
        inside = (x > 0) & (y > 0) & (z > 0) & (x / 4 + y + z < 1)
        assert ((sm.deviation(points, wedge).distances < 0) == inside).all()

    def test_reach_goes_as_far_inward(self):
        found = sm.deviation(np.array([[0, 0, 0.7], [0, 0, 0.95], [0, 0, 1.05], [0, 0, 1.3]]), BALL, reach=0.1)
        assert np.isnan(found.distances).tolist() == [True, False, False, True]
        assert found.distances[1:3] == pytest.approx([-0.05, 0.05], abs=0.005)

    def test_reach(self):
        found = sm.deviation(np.array([[2.0, 0, 0], [1.1, 0, 0]]), BALL, reach=0.5)
        assert np.isnan(found.distances).tolist() == [True, False]
        assert np.isnan(sm.deviation(np.array([[9.0, 0, 0]]), BALL, reach=0.5).bias)

    @settings(max_examples=4)
    @given(st.integers(0, 10**6))
    def test_moves_with_both(self, seed):
        T = rigid(seed)
        done = potato(8).triangulated("dual")
        both = [sm.TriangleMesh(each.vertices @ T[:3, :3].T + T[:3, 3], each.faces) for each in (done, BALL)]
        assert sm.deviation(*both).distances == pytest.approx(sm.deviation(done, BALL).distances, abs=1e-9)

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.deviation(BALL, BALL, reach=0), "reach must be above 0, not 0"),
            (lambda: sm.deviation(np.full((4, 3), np.nan), BALL), "source must be finite; source[0, 0] is nan"),
            (lambda: sm.deviation(np.zeros((4, 2)), BALL), "source must have shape (*, 3), not (4, 2)"),
            (
                lambda: sm.deviation(sm.Volume(np.ones((4, 4, 4))), BALL),
                "source must be a mesh or points, not Volume, of which reconstruct makes a surface",
            ),
        ],
    )
    def test_bad_input_is_refused(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value) == words

    def test_sizes_that_a_box_tree_cannot_hold_are_refused(self):
        with pytest.raises(ValueError, match=r"^target must be within 1e-60 and 1e\+60 in its unit of length, not"):
            sm.deviation(BALL, sm.sphere(3, radius=1e160))
        with pytest.raises(ValueError, match=r"^source must be within 1e-60 and 1e\+60 in its unit of length, not"):
            sm.deviation(sm.sphere(3, radius=1e-160), BALL)


class TestMorphed:
    @pytest.mark.filterwarnings("ignore:the surface folds")  # landmarks go anywhere
    @given(st.integers(0, 10**6), st.integers(1, 20), st.sampled_from(["compact", "thin_plate"]))
    def test_landmarks_reach_their_targets(self, seed, count, kernel):
        rng = np.random.default_rng(seed)
        count = max(count, 5) if kernel == "thin_plate" else count
        landmarks = rng.choice(BALL.n_vertices, count, replace=False)
        targets = BALL.vertices[landmarks] + 0.1 * rng.normal(size=(count, 3))
        out = sm.morphed(BALL, landmarks, targets, kernel=kernel)
        assert np.abs(out.vertices[landmarks] - targets).max() < 1e-5
        assert (out.faces == BALL.faces).all()

    def test_far_points_stay_and_near_ones_move_less_and_less(self):
        tip = int(BALL.vertices[:, 2].argmax())
        out = sm.morphed(BALL, [tip], [BALL.vertices[tip] + [0, 0, 0.2]], radius=1.0)
        moved = np.linalg.norm(out.vertices - BALL.vertices, axis=1)
        away = np.linalg.norm(BALL.vertices - BALL.vertices[tip], axis=1)
        assert (moved[away >= 1] == 0).all()
        assert (np.diff(moved[np.argsort(away)]) <= 1e-12).all()
        assert moved.max() == pytest.approx(0.2)

    def test_does_not_fold(self):
        tip = int(BALL.vertices[:, 2].argmax())
        out = sm.morphed(BALL, [tip], [BALL.vertices[tip] - [0, 0, 0.4]])
        a, b, c = (out.vertices[out.faces[:, j]] for j in range(3))
        assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0).all()
        assert out.volume > 0
        lines = np.linspace(0, 1, 2000)
        slope = np.abs(np.gradient(morph._wendland(lines, 1.0), lines)).max()
        assert 0.999 * morph.MAX_SLOPE < slope <= morph.MAX_SLOPE

    def test_reports_where_space_folds_nevertheless(self):
        tip = int(BALL.vertices[:, 0].argmax())
        beside = int(np.argsort(np.linalg.norm(BALL.vertices - BALL.vertices[tip], axis=1))[1])
        way = BALL.vertices[beside] - BALL.vertices[tip]
        with pytest.warns(sm.SimplexMeshWarning, match=r"^the surface folds at \d+ of [0-9,]+ points"):
            sm.morphed(BALL, [tip, beside], BALL.vertices[[tip, beside]] + [1.5 * way, -1.5 * way])

    @given(st.integers(0, 10**6))
    def test_gradients_are_those_of_the_displacement(self, seed):
        rng = np.random.default_rng(seed)
        at, weights, points = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), rng.normal(size=(20, 3))
        steps = 1e-6 * np.eye(3)
        moved = [
            [morph._wendland(morph.cdist(points + s * step, at), 2.0) @ weights for s in (1, -1)] for step in steps
        ]
        expected = np.stack([(one - other) / 2e-6 for one, other in moved], axis=2)
        assert morph._gradients(points, at, weights, 2.0) == pytest.approx(expected, abs=1e-7)

    def test_a_thin_plate_takes_a_rigid_motion_along(self):
        T = rigid(1)
        landmarks = [0, 500, 1000, 2000, 3000]
        out = sm.morphed(BALL, landmarks, BALL.vertices[landmarks] @ T[:3, :3].T + T[:3, 3], kernel="thin_plate")
        assert out.vertices == pytest.approx(BALL.vertices @ T[:3, :3].T + T[:3, 3], abs=1e-6)

    def test_keeps_the_kind(self):
        out = sm.morphed(EGG, [0], [EGG.vertices[0] * 1.1])
        assert isinstance(out, sm.SimplexMesh)
        assert out.connectivity is EGG.connectivity
        cloud = sm.morphed(sm.PointCloud(EGG.vertices), EGG.vertices[:1], EGG.vertices[:1] * 1.1)
        assert cloud.points == pytest.approx(out.vertices)

    @pytest.mark.parametrize(
        ("landmarks", "targets", "options", "words"),
        [
            ([0], [[0, 0, 9.0]], {"radius": 1.0}, "radius must be at least"),
            ([0, 0], [[0, 0, 1.0], [1, 0, 0]], {}, "landmarks must be different, landmarks[1] is where another is"),
            ([9999999], [[0, 0, 1.0]], {}, "landmarks[0] is 9999999, outside"),
            ([0, 1], [[0, 0, 1.0]], {}, "targets must have shape (2, 3), not (1, 3)"),
            ([], np.zeros((0, 3)), {}, "landmarks must be at least one, not none"),
            ([0, 1, 2], BALL.vertices[:3], {"kernel": "thin_plate"}, "landmarks must be at least 4, not in one plane"),
            ([0], [[0, 0, 1.0]], {"kernel": "gauss"}, "kernel must be one of 'compact', 'thin_plate', not 'gauss'"),
            ([[0, 0, np.nan]], [[0, 0, 1.0]], {}, "landmarks must be finite"),
            ([0], [[0, 0, 1.0]], {"kernel": "thin_plate", "radius": 1.0}, "radius must be left out with a thin plate"),
        ],
    )
    def test_bad_input_is_refused(self, landmarks, targets, options, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            sm.morphed(BALL, landmarks, targets, **options)
        assert str(caught.value).startswith(words)


class TestBoolean:
    def test_volumes_add_up(self):
        one, other = BALL, sm.TriangleMesh(BALL.vertices + np.array([0.7, 0.1, 0]), BALL.faces)
        union, both = (sm.boolean(one, other, name) for name in ("union", "intersection"))
        left, right = sm.boolean(one, other), sm.boolean(other, one)
        assert all(each.is_closed for each in (union, both, left, right))
        assert union.volume == pytest.approx(left.volume + both.volume + right.volume, rel=1e-9)
        assert left.volume + both.volume == pytest.approx(one.volume, rel=1e-9)

    def test_a_guide_fits_what_it_was_made_of(self):
        bone = potato().triangulated("dual")
        block = sm.TriangleMesh(*_box([-2.5, -2, 0.2], [2.5, 2, 2]))
        guide = sm.boolean(block, bone)
        assert guide.is_closed
        assert guide.topology.n_components == 1
        inner = guide.vertices[(np.abs(guide.vertices - [0, 0, 1.1]) < [2.4, 1.9, 0.85]).all(axis=1)]
        assert len(inner) > 200
        assert sm.deviation(inner, bone).max < 1e-6

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.boolean(BALL, sm.sphere(3, radius=1e-160)), "second must be within 1e-60 and 1e+60"),
            (lambda: sm.boolean(sm.plane(8, 8), BALL), "first must be closed, it has a border"),
            (
                lambda: sm.boolean(BALL, sm.TriangleMesh(BALL.vertices, BALL.faces[:, ::-1])),
                "second must be oriented outward, it encloses a volume of -4.1",
            ),
            (lambda: sm.boolean(BALL, BALL, "xor"), "operation must be one of 'difference', 'union', 'intersection'"),
            (
                lambda: sm.boolean(BALL, sm.TriangleMesh(BALL.vertices + 5, BALL.faces), "intersection"),
                "first and second must have a non-empty intersection, but nothing is left",
            ),
        ],
    )
    def test_bad_input_is_refused(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value).startswith(words)


def _box(low, high):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6]]
    faces += [[0, 6, 4], [1, 5, 7], [1, 7, 3]]
    return np.array(low) + corners * (np.array(high) - low), faces
