"""Primitives: distances, gradients, charts, coordinates, samples, meshes, gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh._base.vectors import tangents
from simplexmesh.data.primitives.patch import span

P = sm.primitives
AXIS = [0.3, -0.5, 0.8]
KINDS = {
    "plane": P.Plane([0.1, 0.2, 0.3], AXIS),
    "sphere": P.Sphere([0.1, 0.2, 0.3], 0.7),
    "cylinder": P.Cylinder([0.1, 0.2, 0.3], AXIS, 0.7),
    "cone": P.Cone([0.1, 0.2, 0.3], AXIS, 0.4),
    "torus": P.Torus([0.1, 0.2, 0.3], AXIS, 1.0, 0.3),
    "line": P.Line([0.1, 0.2, 0.3], AXIS),
    "circle": P.Circle([0.1, 0.2, 0.3], AXIS, 0.7),
    "beam": P.Beam([0.1, 0.2, 0.3], AXIS, 1.4, 1.0, 0.2, 0.15, across=[1, 0, 0]),
    "flange": P.Flange([0.1, 0.2, 0.3], AXIS, 0.9, 0.4, 0.4),
    "flange pair": P.FlangePair([0.1, 0.2, 0.3], AXIS, 0.9, 0.4, 0.4),
}
ENDS = {
    "plane": [[-3, 3], [-3, 3]],
    "sphere": [[-np.pi, np.pi], [-np.pi / 2, np.pi / 2]],
    "cylinder": [[-np.pi, np.pi], [-3, 3]],
    "cone": [[-np.pi, np.pi], [0, 4]],
    "torus": [[-np.pi, np.pi], [-np.pi, np.pi]],
    "line": [[-np.pi, np.pi], [-3, 3]],
    "circle": [[-np.pi, np.pi], [0, 1]],
    "beam": [[-3, 3], [0, 6.5]],
    "flange": [[-np.pi, np.pi], [-3, 1.8]],
    "flange pair": [[-np.pi, np.pi], [-3, 4.4]],
}
SURFACES = [kind for kind in KINDS if kind not in ("line", "circle")]
every = pytest.mark.parametrize("kind", KINDS)


def around(count=400, seed=0):
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (count, 3))


def bounded(primitive, extent=None):
    """The primitive with ends, as if it had been fitted."""
    ends = np.array(ENDS[primitive.kind] if extent is None else extent, float)
    return primitive.with_fit(P.Fit(0.0, 0.0, np.zeros((primitive.n_parameters,) * 2), ends, 100))


class TestDistance:
    @every
    def test_is_that_of_the_nearest_of_dense_samples(self, kind):
        primitive = KINDS[kind]
        u, v = (np.linspace(*ends, 700) for ends in ENDS[kind])
        v = np.append(v, primitive._knots.clip(*ENDS[kind][1]))
        grid = primitive.at(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
        near, exact = (
            cKDTree(grid, balanced_tree=False, compact_nodes=False).query(around())[0],
            np.abs(primitive.distance(around())),
        )
        assert (near >= exact - 1e-12).all()
        assert (near <= np.hypot(exact, 0.01)).all()

    @every
    def test_changes_sign_across_surfaces(self, kind):
        signs = np.sign(KINDS[kind].distance(around()))
        assert set(signs) == ({-1.0, 1.0} if kind in SURFACES else {1.0})

    @every
    def test_feet_are_on_it_and_as_far(self, kind):
        primitive, points = KINDS[kind], around()
        feet = primitive.projected(points)
        assert_allclose(primitive.distance(feet), 0, atol=1e-12)
        assert_allclose(np.linalg.norm(points - feet, axis=1), np.abs(primitive.distance(points)), atol=1e-12)

    @every
    def test_gradient_is_the_difference_quotient(self, kind):
        primitive, points = KINDS[kind], around()
        steps = [(primitive.distance(points + h) - primitive.distance(points - h)) / 2e-6 for h in 1e-6 * np.eye(3)]
        assert_allclose(primitive.gradient(points), np.stack(steps, axis=1), atol=1e-8)

    @every
    def test_is_finite_where_undefined(self, kind):
        primitive = KINDS[kind]
        origin, axis = primitive._pose
        on = np.stack([origin, origin + 0.5 * axis, origin - 0.5 * axis])
        assert np.isfinite(primitive.gradient(on)).all()
        assert np.isfinite(primitive.derivatives(on)).all()

    @every
    @given(seed=st.integers(0, 10**6), scale=st.floats(0.01, 100))
    def test_goes_with_motions_and_scales(self, kind, seed, scale):
        T = np.eye(4)
        T[:3, :3] = scale * Rotation.random(random_state=seed).as_matrix()
        T[:3, 3] = np.random.default_rng(seed).normal(size=3)
        points = around(50)
        moved = points @ T[:3, :3].T + T[:3, 3]
        assert_allclose(
            KINDS[kind].transformed(T).distance(moved), scale * KINDS[kind].distance(points), atol=1e-9 * scale
        )


class TestChart:
    @every
    def test_derivatives_are_difference_quotients(self, kind):
        primitive, points = KINDS[kind], around()
        found = primitive.derivatives(points)
        assert found.shape == (len(points), primitive.n_parameters)
        for k, step in enumerate(1e-6 * np.eye(primitive.n_parameters)):
            quotient = (primitive.stepped(step).distance(points) - primitive.stepped(-step).distance(points)) / 2e-6
            assert_allclose(found[:, k], quotient, atol=1e-8)

    @every
    @pytest.mark.parametrize("axis", np.concatenate([np.eye(3), -np.eye(3)]))
    def test_has_no_singular_pose(self, kind, axis):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.align_vectors([axis], [KINDS[kind]._pose[1]])[0].as_matrix()
        derivatives = KINDS[kind].transformed(turn).derivatives(around(2000))
        assert np.linalg.cond(derivatives) < 50

    @every
    def test_zero_step_and_other_points_of_the_axis_change_nothing(self, kind):
        primitive, points = KINDS[kind], around()
        same = primitive.stepped(np.zeros(primitive.n_parameters))
        assert_allclose(same.distance(points), primitive.distance(points), atol=1e-14)
        assert_allclose(primitive.centered(points + 5).distance(points), primitive.distance(points), atol=1e-12)


class TestPart:
    @pytest.mark.parametrize("kind", SURFACES)
    def test_samples_are_on_it_evenly_and_within(self, kind):
        primitive = bounded(KINDS[kind])
        points = primitive.sampled(20000, rng=1).points
        assert_allclose(primitive.distance(points), 0, atol=1e-12)
        mesh = primitive.triangulated(0.05)
        middle = mesh.vertices[mesh.faces].mean(axis=1)
        one, two = (mesh.vertices[mesh.faces[:, k]] - mesh.vertices[mesh.faces[:, 0]] for k in (1, 2))
        share = np.average(middle, axis=0, weights=np.linalg.norm(np.cross(one, two), axis=1))
        assert_allclose(points.mean(axis=0), share, atol=5 * points.std() / np.sqrt(len(points)) + 0.01)

    @pytest.mark.parametrize("part", [1.0, 0.25])
    def test_thin_tubes_are_round_by_default(self, part):
        """Their triangles were as long across as along, so that tubes had six sides, and points stood out of them."""
        thin = bounded(P.Torus([0, 0, 0], AXIS, 4.0, 0.5), [[-part * np.pi, part * np.pi], [-np.pi, np.pi]])
        mesh = thin.triangulated()
        assert np.abs(thin.distance(mesh.vertices[mesh.faces].mean(axis=1))).max() < 0.04
        assert len(mesh.vertices) == 32 * (32 if part == 1 else 9)

    def test_samples_have_normals_but_on_curves(self):
        for kind, primitive in KINDS.items():
            cloud = bounded(primitive).sampled(50)
            if kind in SURFACES:
                assert_allclose(cloud.normals, primitive.gradient(cloud.points), atol=1e-9)
            else:
                assert cloud.normals is None

    @pytest.mark.parametrize("low", [0.2, -0.9])
    @pytest.mark.parametrize("kind", SURFACES)
    def test_bounds_hold_samples_tightly(self, kind, low):
        ends = [[0.3, 2.1], [0.2 if kind == "cone" else low, 1.1]] if kind != "plane" else ENDS[kind]
        primitive = bounded(KINDS[kind], ends)
        u, v = (np.linspace(*row, 400) for row in ends)
        points = primitive.at(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
        assert_allclose(primitive.bounds, [points.min(axis=0), points.max(axis=0)], atol=1e-3)

    @pytest.mark.parametrize(
        ("kind", "genus", "holes"),
        [
            *(("sphere", 0, 0), ("cylinder", 0, 2), ("torus", 1, 0), ("cone", 0, 1)),
            *(("beam", 0, 2), ("flange", 0, 1), ("flange pair", 0, 2)),
        ],
    )
    def test_meshes_are_sound(self, kind, genus, holes):
        mesh = bounded(KINDS[kind]).mesh(0.1)
        assert mesh.check()
        assert (mesh.genus, mesh.n_holes) == (genus, holes)
        assert np.abs(KINDS[kind].distance(mesh.vertices)).max() < 0.01
        outside = np.einsum("ij,ij->i", KINDS[kind].gradient(mesh.vertices), mesh.normals)
        assert np.median(outside) > 0.9

    def test_without_ends_says_so(self):
        with pytest.raises(ValueError, match="has no ends"):
            KINDS["cylinder"].sampled(3)

    def test_span_of_angles(self):
        assert_allclose(span(np.array([3.0, -3.0, 2.5]), periodic=True), [2.5, 2 * np.pi - 3.0])
        assert_allclose(span(np.linspace(0, 7, 90), periodic=True), [-np.pi, np.pi])
        assert_allclose(span(np.array([3.0, -3.0, 2.5]), periodic=False), [-3, 3])


@pytest.mark.parametrize("kind", ["cylinder", "cone", "torus", "circle"])
@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_coverage_is_the_share_of_the_turn_that_has_points(kind, share):
    turn = 2 * np.pi * share * np.linspace(0, 1, 500)
    points = KINDS[kind].at(np.column_stack([turn, np.tile([0.2, 0.4], 250)]))
    assert KINDS[kind].coverage(points) == pytest.approx(share, abs=0.03)
    assert P.fit_of(KINDS[kind], points).covered == KINDS[kind].coverage(points)
    one, none = KINDS[kind].coverage(points[:1]), KINDS[kind].coverage(points[:0])
    assert (one, none) == (pytest.approx(10 / 360), 0)


class TestGap:
    @pytest.mark.parametrize("kind", SURFACES)
    def test_reaches_the_surface_along_the_normal(self, kind):
        primitive = bounded(KINDS[kind])
        on = primitive.sampled(300, rng=2).points
        normals = primitive.gradient(on)
        start = on + 0.02 * normals
        assert_allclose(primitive.gap(start, normals, 0.1), -0.02, atol=1e-6)
        assert np.isnan(primitive.gap(start, normals, 0.01)).all()
        assert np.isnan(primitive.gap(start, -normals, 0.1)).all()

    @pytest.mark.parametrize("unit", [1e-7, 1e5])
    def test_is_the_same_in_any_unit(self, unit):
        rng = np.random.default_rng(0)
        start, normals = rng.normal(size=(800, 3)), rng.normal(size=(800, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        one = P.Torus([0, 0, 0], AXIS, 1.0, 0.3).gap(start, normals, 1.0)
        other = P.Torus([0, 0, 0], AXIS, unit, 0.3 * unit).gap(unit * start, normals, unit)
        assert 30 < np.isfinite(one).sum() < 400
        assert_allclose(other, unit * one, rtol=1e-6)

    def test_ends_where_the_points_did(self):
        pipe = bounded(KINDS["cylinder"], [[-np.pi, np.pi], [-1, 1]])
        beyond = pipe.at([[0.0, 2.0], [0.0, 0.5]])
        assert np.isnan(pipe.gap(beyond, pipe.gradient(beyond), 1.0)).tolist() == [True, False]

    def test_draws_a_sphere(self):
        ball = P.Sphere([0, 0, 0], 1.0)
        model = sm.DeformableModel(sm.sphere(8, radius=1.3), ball)
        for _ in model.run(60):
            pass
        assert np.abs(ball.distance(model.mesh.vertices)).max() < 0.02


class TestBadInput:
    @pytest.mark.parametrize(
        ("make", "said"),
        [
            (lambda: P.Cylinder([0, 0, 0], [0, 0, 0], 1), "axis must be a direction"),
            (lambda: P.Cylinder([0, 0, 0], [0, 0, 1], 0), "radius"),
            (lambda: P.Cylinder([0, 0, np.nan], [0, 0, 1], 1), "point must be finite"),
            (lambda: P.Torus([0, 0, 0], [0, 0, 1], 1, 2), "tube_radius must be at most"),
            (lambda: P.Cone([0, 0, 0], [0, 0, 1], 30), "radians"),
            (lambda: P.Plane([0, 0], [0, 0, 1]), "point must have shape"),
            (lambda: KINDS["sphere"].transformed(np.diag([1, 2, 1, 1.0])), "one scale"),
        ],
    )
    def test_is_told(self, make, said):
        with pytest.raises(ValueError, match=said):
            make()


class TestCurves:
    @pytest.mark.parametrize("kind", ["line", "circle"])
    def test_have_samples_bounds_and_a_polyline(self, kind):
        curve = bounded(KINDS[kind], [[-np.pi, np.pi], [-3, 3] if kind == "line" else [0, 0]])
        some, drawn = curve.sampled(500, rng=0).points, curve.to_pyvista()
        assert_allclose(curve.distance(some), 0, atol=1e-12)
        assert_allclose(curve.distance(drawn.points), 0, atol=1e-6)
        assert drawn.length == pytest.approx(np.linalg.norm(np.ptp(curve.bounds, axis=0)), rel=0.01)
        with pytest.raises(ValueError, match="is a curve"):
            curve.mesh()


@pytest.mark.parametrize("kind", KINDS)
def test_a_target_is_not_met_where_the_normal_leads_nowhere(kind):
    """Along tangents and from axes and centers too, where no gradient is known: NaN, not an error."""
    shape, rng = KINDS[kind], np.random.default_rng(0)
    points = shape.at(rng.uniform(-0.5, 0.5, (20, 2))) if kind not in ("line", "circle") else rng.normal(size=(20, 3))
    tangents = np.cross(shape.gradient(points), [0.6, 0.0, 0.8])
    places = np.concatenate([points, np.tile(getattr(shape, "center", getattr(shape, "point", np.zeros(3))), (20, 1))])
    gaps = shape.gap(places, np.tile(tangents, (2, 1)), 3.0)
    assert not np.isinf(gaps).any()


def test_a_closed_mesh_comes_to_a_plane():
    plane = sm.fit_primitive(np.random.default_rng(0).uniform(-1, 1, (500, 3)) * [1, 1, 0], "plane")
    model = sm.DeformableModel(sm.sphere(8), plane, reach=0.5)
    list(model.run(3, warnings=False))
    assert np.isfinite(model.mesh.vertices).all()


def test_a_whole_circle_has_all_its_points():
    circle = P.Circle([0, 0, 0], [0, 0, 1], 1.0)
    assert np.allclose(np.linalg.norm(circle.sampled(50, rng=0).points, axis=1), 1)
    assert np.allclose(circle.bounds, [[-1, -1, 0], [1, 1, 0]], atol=1e-6)


@given(seed=st.integers(0, 1000))
def test_a_fitted_plane_ends_with_the_smallest_rectangle_around_its_points(seed):
    rng = np.random.default_rng(seed)
    turn, sides = Rotation.random(rng=rng).as_matrix(), np.array([3.0, 1.0])
    hull = [[-1.5, -0.5, 0], [1.5, -0.5, 0], [1.5, 0, 0], [1, 0.5, 0], [-1.5, 0.5, 0]]  # a corner is cut off
    flat = np.concatenate([hull, (rng.random((200, 3)) - 0.5) * [1.5, 0.5, 0]])
    plane = sm.fit_primitive(flat @ turn.T + [5, 6, 7], "plane")
    assert_allclose(np.sort(np.ptp(plane.extent, axis=1)), np.sort(sides), rtol=1e-9)
    assert_allclose(plane.triangulated().area, 3, rtol=1e-9)
    assert_allclose(plane.at(plane.coordinates(flat)), plane.projected(flat), atol=1e-12)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = 2 * Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    moved = plane.transformed(T)
    at = plane.coordinates(flat)
    assert_allclose(moved.at(2 * at), plane.at(at) @ T[:3, :3].T + T[:3, 3], atol=1e-9)


def test_a_direction_of_coordinates_is_in_the_plane():
    plane = P.Plane([0, 0, 1], [0, 0, 2], across=[1, 1, 5])
    assert_allclose(plane.at([[np.sqrt(2), 0]]), [[1, 1, 1]], atol=1e-12)
    with pytest.raises(ValueError, match="across must not be along"):
        P.Plane([0, 0, 1], [0, 0, 2], across=[0, 0, 3])


def test_points_on_a_line_leave_the_coordinates_of_a_plane():
    plane = P.Plane([0, 0, 0], [0, 0, 1])
    assert plane.aligned(np.arange(5)[:, None] * [1.0, 2, 0]) is plane


@pytest.mark.parametrize("axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1), (1, 2, 3), (9, -4.3, 0.1)])
def test_frames_are_the_tangents_of_their_axis(axis):
    pipe = P.Cylinder([0, 0, 0], axis, 1.0)
    assert_allclose(pipe.frame, [*tangents(pipe.axis), pipe.axis], rtol=0, atol=1e-15)
