"""Contours of a model: closed forms of what is prescribed of their place, their shape, and the surface at them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh import Contour, DeformableModel, crease, pinned, smooth
from simplexmesh.motion.model.state import mean_edge
from tests.nightly.marks import nightly

BALL = sm.sphere(8)
TURN = np.linspace(0, 2 * np.pi, 2000)
CIRCLE = np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)


def at_rest(mesh, iterations=2000, *, alpha=None, **options):
    """Return the mesh after a motion with much inertia."""
    options = {"damping": 0.1, **options, **({} if alpha is None else {"alpha": alpha})}
    model = DeformableModel(mesh, **options)
    for _ in model.run(iterations, every=iterations):
        pass
    return model.mesh


def flat_disk(size):
    """Return a disk in the plane z = 0 of about unit radius, and its rim, clockwise seen from above."""
    disk = sm.plane(size, size)
    (rim,) = Contour.of_holes(disk)
    places = disk.vertices - disk.vertices.mean(axis=0)
    return disk.moved(places / np.linalg.norm(places[rim.vertices], axis=1).max()), rim


@cache
def round_disk(size):
    """Return that disk at rest, its rim evenly on the unit circle."""
    disk, rim = flat_disk(size)
    return at_rest(disk, 600, damping=0.6, contours=pinned(rim, CIRCLE))


@cache
def cap(size, angle, line=None):
    """Return the surface over the unit circle that meets its plane at an angle."""
    rim = flat_disk(size)[1]
    line = rim.reversed() if line is None else line
    return at_rest(round_disk(size), rigidity=4, contours=[pinned(rim, CIRCLE), smooth(line, tangent=angle)])


FLAT, RIM = flat_disk(6)


@pytest.fixture
def disk():
    return round_disk(6)


def with_line(points):
    """Return a mesh with an open contour at given points, of which nothing else moves, and the weights of that."""
    x, y, _ = BALL.vertices.T
    path = Contour.through(BALL, [x.argmax(), y.argmax(), x.argmin()], closed=False).vertices[: len(points)]
    assert len(path) == len(points)
    vertices = BALL.vertices.copy()
    vertices[path] = points
    free = np.zeros(BALL.n_vertices)
    free[path[1:-1]] = 0.4
    mesh = BALL.moved(vertices)
    return mesh, Contour(mesh, path, closed=False), free


def bent(points):
    """Return the curvature at the inner points of a polyline, of the circle through three of them."""
    a, p, b = points[:-2], points[1:-1], points[2:]
    area = np.linalg.norm(np.cross(p - a, b - a), axis=1)
    sides = [np.linalg.norm(v, axis=1) for v in (p - a, b - p, b - a)]
    return 2 * area / (sides[0] * sides[1] * sides[2])


def twisted(points):
    """Return the angle between the planes of three points along a polyline and the next three."""
    normals = np.cross(points[1:-1] - points[:-2], points[2:] - points[1:-1])
    along = points[2:-1] - points[1:-2]
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = (np.cross(normals[:-1], normals[1:]) * along).sum(axis=1)
    return np.arctan2(side, (normals[:-1] * normals[1:]).sum(axis=1))


class TestShape:
    @pytest.mark.parametrize("curvature", [0.3, 1.2])
    @pytest.mark.parametrize("turned", [False, True])
    def test_between_fixed_ends_a_curvature_makes_an_arc(self, curvature, turned):
        Q = Rotation.random(random_state=3).as_matrix() if turned else np.eye(3)
        x = np.linspace(-0.5, 0.5, 14)
        mesh, line, free = with_line(np.stack([x, 0.1 * (0.25 - x**2), 0 * x], axis=1) @ Q.T)
        out = at_rest(mesh, alpha=free, contours=smooth(line, curvature=curvature)).vertices[line.vertices] @ Q
        assert_allclose(bent(out), curvature, rtol=1e-6)
        sagitta = (1 - np.sqrt(1 - 0.25 * curvature**2)) / curvature
        assert_allclose(np.interp(0, out[:, 0], out[:, 1]), sagitta, rtol=0.01)
        assert_allclose(out[:, 2], 0, atol=1e-9)

    @pytest.mark.parametrize("curvature", [-0.8, 0.0, 0.8])
    def test_in_a_plane_curvature_has_a_sign(self, curvature):
        x = np.linspace(0.5, -0.5, 14)
        wave = np.stack([x, 0.05 * np.sin(9 * x), 0.03 * np.cos(7 * x)], axis=1)
        wave[[0, -1], 1:] = 0.0
        mesh, line, free = with_line(wave)
        out = at_rest(mesh, alpha=free, contours=smooth(line, curvature=curvature, plane=[0, 0, 2])).vertices
        out = out[line.vertices]
        assert_allclose(out[:, 2], 0, atol=1e-9)
        assert_allclose(bent(out) * np.sign(out[1:-1, 1] + 1e-300), curvature, atol=1e-6)

    @pytest.mark.parametrize("torsion", [*nightly(0.5), -1.0])
    def test_a_helix_is_at_rest_and_restored(self, torsion):
        curvature, length = 1.5, 0.12
        both = curvature**2 + torsion**2
        radius, rise = curvature / both, torsion / both
        s = length * np.arange(20) * np.sqrt(both)
        helix = np.stack([radius * np.cos(s), radius * np.sin(s), rise * s], axis=1)
        wanted = bent(helix)
        noise = 0.01 * np.random.default_rng(0).normal(size=helix.shape)
        noise[[0, 1, -2, -1]] = 0.0
        for start in (helix, helix + noise):
            mesh, line, free = with_line(start)
            free[line.vertices[[1, -2]]] = 0.0
            out = at_rest(mesh, 4000, alpha=free, contours=smooth(line, curvature=wanted[0], torsion=0.0))
            points = out.vertices[line.vertices]
            assert_allclose(points, helix, atol=1e-6 if start is helix else 2e-3)
            assert_allclose(bent(points), wanted, rtol=1e-3)
            assert_allclose(twisted(points), twisted(helix), rtol=0.02)

    def test_curvature_evens_out_between_given_ends(self):
        s = np.linspace(0, 1, 20)
        arc = np.stack([np.sin(s), np.cos(s), 0 * s], axis=1)
        noise = 0.005 * np.random.default_rng(1).normal(size=arc.shape)
        noise[[0, 1, -2, -1]] = 0.0
        mesh, line, free = with_line(arc + noise)
        free[line.vertices[[1, -2]]] = 0.0
        out = at_rest(mesh, 6000, alpha=free, contours=smooth(line)).vertices[line.vertices]
        assert_allclose(out, arc, atol=1e-5)
        straight = at_rest(mesh, alpha=free, contours=smooth(line, continuity="normal")).vertices[line.vertices]
        assert_allclose(np.diff(straight[1:-1], n=2, axis=0), 0, atol=1e-9)

    @pytest.mark.parametrize("turn", [0.1, 1.2])  # of the second, edges two apart turn by more than a half
    @pytest.mark.parametrize("how", [{}, {"torsion": 0.0}, {"plane": [0, 0, 1]}])
    def test_an_arc_is_at_rest_up_to_its_ends(self, turn, how):
        s = turn * np.arange(5 if turn > 1 else 20)
        mesh, line, free = with_line(np.stack([np.cos(s), np.sin(s), 0 * s], axis=1))
        out = at_rest(mesh, 20, alpha=free, contours=smooth(line, **how)).vertices[line.vertices]
        assert_allclose(out, mesh.vertices[line.vertices], atol=1e-12)

    def test_free_keeps_the_bends(self):
        mesh, line, free = with_line(np.stack([np.arange(15.0), np.abs(np.arange(15) - 7.0), np.zeros(15)], axis=1))
        before = mesh.vertices[line.vertices]
        out = at_rest(mesh, 50, alpha=free, contours=smooth(line, continuity="free")).vertices[line.vertices]
        assert_allclose(out, before, atol=1e-9)

    def test_ends_of_an_open_contour_move_with_the_surface(self):
        mesh, line, _ = with_line(np.stack([np.arange(14.0) / 14, np.zeros(14), np.ones(14)], axis=1))
        with_contour, without = DeformableModel(mesh, contours=smooth(line)), DeformableModel(mesh)
        with_contour.step(), without.step()
        moved, alone = (model.mesh.vertices[line.vertices] for model in (with_contour, without))
        assert_array_equal(moved[[0, -1]], alone[[0, -1]])
        assert (moved[1:-1] != alone[1:-1]).any(axis=1).all()

    def test_several_conditions_act_in_any_order(self):
        x = np.linspace(0.5, -0.5, 14)
        mesh, line, free = with_line(np.stack([x, 0.25 - x**2, 0 * x], axis=1))
        bend = smooth(line, curvature=0.5, plane=[0, 0, 1])
        for other in (crease(line), pinned(line, [[1, 1, 1], [2, 2, 2]], at=line.vertices[:1])):
            one, two = (at_rest(mesh, 20, alpha=free, contours=both) for both in ([bend, other], [other, bend]))
            assert_array_equal(one.vertices, two.vertices)
            only = at_rest(mesh, 20, alpha=free, contours=other)
            assert (only.vertices[line.vertices[3:-3]] != one.vertices[line.vertices[3:-3]]).any()


class TestPlace:
    def test_a_contour_goes_to_a_line_and_spaces_itself_evenly(self):
        x = np.linspace(0, 1, 14) ** 2
        mesh, line, free = with_line(np.stack([x, 0.1 * np.sin(7 * x), 0.1 * np.cos(5 * x)], axis=1))
        ends = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]])
        out = at_rest(mesh, 1000, alpha=free, contours=pinned(line, ends)).vertices[line.vertices]
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        assert_allclose(np.cross(out, along), 0, atol=1e-12)
        assert_allclose(np.diff(out @ along), np.ptp(out @ along) / 13, rtol=1e-6)

    def test_a_closed_one_goes_around_a_closed_curve(self, disk):
        assert_allclose(np.linalg.norm(disk.vertices[RIM.vertices], axis=1), 1, atol=1e-5)
        sides = np.linalg.norm(np.diff(disk.vertices[RIM.vertices], axis=0), axis=1)
        assert np.ptp(sides) < 0.02 * sides.mean()
        assert_allclose(disk.vertices[:, 2], 0, atol=1e-12)

    def test_without_a_curve_it_stays(self, disk):
        some = RIM.vertices[::5]
        shrinking = {"constraint": "orientation", "contours": pinned(RIM, at=some)}
        out = at_rest(disk, 100, **shrinking)
        assert_array_equal(out.vertices[some], disk.vertices[some])
        assert (out.vertices[RIM.vertices[2::5]] != disk.vertices[RIM.vertices[2::5]]).any()
        assert {name: len(found) for name, found in out.contours.items()} == {"contour_1": len(RIM)}
        named = disk.with_contours(rim=RIM)
        assert list(DeformableModel(named, contours=[pinned(RIM), smooth("rim", curvature=1.0)]).mesh.contours) == [
            "rim"
        ]
        assert_array_equal(
            at_rest(named, 100, contours=[pinned("rim")]).vertices[RIM.vertices], disk.vertices[RIM.vertices]
        )

    @pytest.mark.parametrize("scale", [1e-40, 1e40])
    def test_in_any_unit_it_stays(self, disk, scale):
        disk = disk.scaled(scale)
        rim = Contour(disk, RIM.vertices)
        assert_allclose(at_rest(disk, 10, contours=pinned(rim)).vertices[rim.vertices], disk.vertices[rim.vertices])

    def test_far_away_it_is_approached_in_steps(self, disk):
        model = DeformableModel(disk, contours=pinned(RIM, CIRCLE + np.array([0, 0, 5.0])))
        before = model.mesh.vertices
        model.step()
        moved = np.linalg.norm(model.mesh.vertices - before, axis=1)[RIM.vertices]
        assert (moved <= 0.5 * 1.5 * mean_edge(disk)).all()
        assert (moved > 0.2 * mean_edge(disk)).all()


class TestSurface:
    @pytest.mark.parametrize("curvature", [-0.5, 0.8])
    def test_a_disk_with_a_curvature_at_its_rim_is_a_cap(self, disk, curvature):
        out = at_rest(disk, rigidity=4, contours=[pinned(RIM, CIRCLE), smooth(RIM, mean_curvature=curvature)])
        inner = np.setdiff1d(np.arange(disk.n_vertices), RIM.vertices)
        assert_allclose(out.sphere_curvature[inner], curvature, rtol=1e-6)
        height = (1 - np.sqrt(1 - curvature**2)) / curvature
        assert_allclose(out.vertices[np.abs(out.vertices[:, 2]).argmax(), 2], height, rtol=0.02)

    @pytest.mark.nightly
    def test_a_tangent_is_met_the_better_the_finer(self):
        wanted = np.tan(np.pi / 8)  # height of a cap that meets the plane of its rim at 45 degrees
        off = [wanted - cap(size, -np.pi / 4).vertices[:, 2].max() for size in (6, 12)]
        assert 0 < off[1] < 0.6 * off[0] < 0.4 * wanted  # first order: simplex angle and angle to go are equal at rest

    @pytest.mark.nightly
    def test_a_tangent_does_not_depend_on_the_direction(self):
        one, other = cap(6, -np.pi / 4), cap(6, np.pi / 4, RIM)
        assert_allclose(one.vertices, other.vertices, atol=1e-9)
        below = cap(6, -3 * np.pi / 4)
        assert_allclose(below.vertices[:, 2].min(), -one.vertices[:, 2].max(), rtol=1e-6)

    def test_a_flat_disk_keeps_its_own_angle(self):
        assert_allclose(cap(6, -np.pi / 2).vertices[:, 2], 0, atol=1e-9)

    def test_a_tangent_inside_a_tube_flares_it(self):
        tube = sm.cylinder(24, 16)
        z = tube.vertices[:, 2]
        rims = Contour.of_holes(tube)
        c = tube.connectivity
        middle = np.add.reduceat(z[c.face_vertices], c.face_offsets[:-1]) / c.face_sizes < np.median(z)
        middle[c.face_is_hole] = False
        rings = Contour.of_faces(tube, middle)
        ring = max(rings, key=lambda line: tube.vertices[line.vertices, 2].mean())
        for angle in (0.5, -0.5):
            conditions = [*(pinned(rim) for rim in rims), pinned(ring), smooth(ring, tangent=angle)]
            out = at_rest(tube, 1000, contours=conditions)
            radius = np.linalg.norm(out.vertices[:, :2], axis=1)
            at = out.vertices[ring.vertices, 2].mean()
            up, down = (
                radius[(side > 0.1) & (side < 0.5)].mean()
                for side in (out.vertices[:, 2] - at, at - out.vertices[:, 2])
            )
            ring_up = np.cross(*(tube.vertices[ring.vertices[:2]]))[2]  # positive: counter-clockwise seen from above
            assert (up - down) * angle * ring_up > 0

    def test_across_a_crease_nothing_is_averaged(self):
        x, y, _ = BALL.vertices.T
        line = Contour.through(BALL, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
        marked = BALL.with_data(crease=np.isin(np.arange(BALL.n_vertices), line.vertices).astype(np.uint8))
        rough = 1 + 0.05 * np.random.default_rng(0).normal(size=(BALL.n_vertices, 1))
        off = np.setdiff1d(np.arange(BALL.n_vertices), line.vertices)
        model = DeformableModel(BALL.moved(BALL.vertices * rough), contours=crease(line))
        other = DeformableModel(marked.moved(BALL.vertices * rough))
        model.step(), other.step()
        assert_array_equal(model.mesh.vertices[off], other.mesh.vertices[off])
        plain = DeformableModel(BALL.moved(BALL.vertices * rough))
        plain.step()
        assert (plain.mesh.vertices[off] != model.mesh.vertices[off]).any()

    def test_a_sphere_around_a_contour_is_at_rest(self):
        loop = BALL.faces[40]
        for condition in (crease, smooth):
            model = DeformableModel(BALL, metric=BALL.metric, contours=condition(Contour(BALL, loop)))
            model.step()
            off = np.setdiff1d(np.arange(BALL.n_vertices), loop)
            assert_allclose(model.mesh.vertices[off], BALL.vertices[off], atol=1e-12)


@given(st.integers(0, 2**31 - 1))
def test_a_tangent_along_an_open_contour_is_that_of_its_inner_vertices(seed):
    first, last = np.random.default_rng(seed).choice(BALL.n_vertices, 2, replace=False)
    line = sm.Contour.through(BALL, [first, last], closed=False)
    angles = np.full(len(line), 0.2)
    places = []
    for tangent in (0.2, angles):
        model = DeformableModel(BALL, contours=smooth(line, tangent=tangent))
        list(model.run(2))
        places.append(model.mesh.vertices)
    assert_allclose(places[0], places[1], atol=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: smooth(RIM, continuity="C2"), "continuity must be one of"),
        (
            lambda: smooth(RIM, continuity="free", curvature=1.0),
            "curvature, torsion and plane are for continuity='curvature'",
        ),
        (lambda: smooth(RIM, torsion=0.0, plane=[0, 0, 1]), "give it or plane, not both"),
        (lambda: smooth(RIM, tangent=0.0, mean_curvature=1.0), "give tangent or mean_curvature, not both"),
        (lambda: smooth(RIM, plane=[0, 0, 0]), "plane must be a normal of some length"),
        (lambda: pinned(RIM, [[0, 0, 0]]), "curve must have at least 2 different points"),
        (
            lambda: DeformableModel(FLAT, contours=smooth(RIM, curvature=[1.0, 2.0])),
            r"curvature must have shape \(24,\)",
        ),
        (lambda: DeformableModel(FLAT, contours=pinned("rim")), r"contours must be those of the mesh, \[\], not 'rim'"),
        (lambda: DeformableModel(BALL, contours=pinned(RIM)), "contour"),
        (
            lambda: DeformableModel(FLAT, contours=pinned(RIM, at=[RIM.mesh.n_vertices // 2])),
            "at must be vertices of the contour",
        ),
        (lambda: pinned([1, 2, 3]), "contour must be a Contour"),
        (lambda: DeformableModel(FLAT, contours=[RIM]), "contours must be a Condition"),
        (lambda: DeformableModel(FLAT, contours=RIM), "contours must be a Condition"),
        (lambda: smooth(RIM, curvature=-1.0), "curvature has a sign in a plane only"),
        (lambda: smooth(RIM, tangent=45), "tangent must be in radians, -pi to pi, not 45: numpy.radians"),
        (lambda: smooth(RIM, torsion=10), "torsion must be in radians"),
        (lambda: pinned(RIM, at=[]), "at must be at least one vertex"),
        (
            lambda: DeformableModel(FLAT, contours=[smooth(RIM, curvature=1.0), smooth(RIM, mean_curvature=1.0)]),
            "contours must not give two conditions of a kind",
        ),
    ],
)
def test_what_is_no_condition_is_refused(make, message):
    with pytest.raises((ValueError, TypeError), match=message):
        make()
