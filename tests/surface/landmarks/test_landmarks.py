"""Regions, lines, landmarks and circles of a surface: known divisions, known lines, known rims."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.smoothed_curvature import smoothed_curvature
from simplexmesh.surface.sampled_surface import as_sampled_surface
from tests.nightly.marks import nightly

BALL = sm.sphere(16).triangulated("dual")


def curved(mesh, rings=2):
    return sm.curvature(mesh, "sine", neighborhood=sm.rings(rings))


def turned(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


class TestRegions:
    def test_are_the_connected_pieces_of_a_class(self):
        bands = np.floor(2 * BALL.vertices[:, 2] + 0.25).astype(int) % 2
        found = sm.regions(BALL, bands, minimum=0)
        assert len(found) == 5
        assert (bands == found.classes[found.labels]).all()
        assert found.areas.sum() == pytest.approx(BALL.area)
        assert found.sizes.sum() == BALL.n_vertices
        assert (np.diff(found.areas) <= 0).all()

    @given(st.integers(0, 10**6), st.integers(2, 5), st.floats(0, 0.2))
    def test_are_whole_large_enough_and_border_on_other_classes(self, seed, kinds, share):
        rng = np.random.default_rng(seed)
        mesh = sm.sphere(5).triangulated("dual")
        labels = rng.integers(0, kinds, mesh.n_vertices)
        found = sm.regions(mesh, labels, minimum=share * mesh.area)
        ring = as_sampled_surface(mesh).one_ring
        ends = np.repeat(ring.centers, ring.valence)
        kind = found.classes[found.labels]
        again = sm.regions(mesh, kind, minimum=0)
        assert again.labels.tolist() == found.labels.tolist()
        assert ((found.labels[ends] == found.labels[ring.members]) == (kind[ends] == kind[ring.members])).all()
        assert len(found) == 1 or found.areas.min() >= share * mesh.area
        assert found.areas.sum() == pytest.approx(mesh.area)

    def test_specks_go_to_what_they_border_on_most(self):
        labels = (BALL.vertices[:, 2] > 0).astype(int)
        top, bottom = BALL.vertices[:, 2].argmax(), BALL.vertices[:, 2].argmin()
        labels[[top, bottom]] = 2
        found = sm.regions(BALL, labels)
        assert len(found) == 2
        assert found.classes[found.labels[[top, bottom]]].tolist() == [1, 0]

    def test_a_speck_between_two_goes_where_it_has_more_edges(self):
        ring = as_sampled_surface(BALL).one_ring
        side = BALL.vertices[:, 2] > 0.013
        above = np.array([side[ring[i]].sum() for i in range(BALL.n_vertices)])
        for speck in (*np.flatnonzero(above == 4)[:3], *np.flatnonzero((above == 2) & (ring.valence == 6))[:3]):
            labels = side.astype(int)
            labels[speck] = 7
            found = sm.regions(BALL, labels)
            assert found.classes[found.labels[speck]] == (above[speck] == 4)

    def test_small_ones_that_are_large_enough_together_stay(self):
        height = BALL.vertices[:, 2]
        labels = np.where(height > 0.9, 2, np.where(height > 0.77, 1, 0))  # a cap, and a belt around it alone
        _, belt, cap = sm.regions(BALL, labels, minimum=0).areas
        assert cap < belt
        found = sm.regions(BALL, labels, minimum=1.2 * belt)
        assert found.classes.tolist() == [0, 1]
        assert found.areas[1] == pytest.approx(cap + belt)

    def test_a_small_piece_of_its_own_stays(self):
        n = BALL.n_vertices
        both = sm.TriangleMesh(
            np.vstack([BALL.vertices, 0.01 * BALL.vertices + 5]), np.vstack([BALL.faces, BALL.faces + n])
        )
        assert len(sm.regions(both, np.zeros(2 * n, int))) == 2

    def test_of_hk_classes(self):
        ring = sm.torus(90, 36, radius=1.0, tube_radius=0.35).triangulated("dual")
        found = sm.regions(ring, sm.hk_classes(ring, curvature=curved(ring, 1)), minimum=0.02 * ring.area)
        names = [sm.HKClasses.names[k] for k in found.classes]
        assert sorted(names)[:1] == ["peak"]
        assert "saddle ridge" in names
        assert len(found) <= 4

    @pytest.mark.parametrize(
        ("labels", "options", "words"),
        [
            ([1, 2], {}, "labels must have shape (2562,), not (2,)"),
            (np.full(2562, 0.5), {}, "labels must be whole numbers, not float64"),
            (np.zeros(2562, int), {"minimum": -1}, "minimum must be at least 0, not -1"),
        ],
    )
    def test_bad_input_is_told(self, labels, options, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            sm.regions(BALL, labels, **options)
        assert str(caught.value) == words


class TestLines:
    def test_are_where_the_field_has_the_value(self):
        for level in (-0.5, 0.0, 0.7):
            (line,) = sm.level_lines(BALL, BALL.vertices[:, 2], level=level)
            assert line.closed
            assert line.points[:, 2] == pytest.approx(level, abs=1e-12)
            assert line.length == pytest.approx(2 * np.pi * np.sqrt(1 - level**2), rel=0.02)

    def test_run_from_edge_to_edge_with_higher_values_on_their_left(self):
        (line,) = sm.level_lines(BALL, BALL.vertices[:, 2], level=0.3)
        step = np.roll(line.points, -1, axis=0) - line.points
        assert (np.cross(line.points, step)[:, 2] > 0).all()  # up is higher, out is the normal: left of the step
        ring = [set(as_sampled_surface(BALL).one_ring[i]) for i in range(BALL.n_vertices)]
        assert all(int(b) in ring[a] for a, b in line.edges)

    def test_end_at_borders_and_where_nothing_is_known(self):
        sheet = sm.plane(20, 20).triangulated("dual")
        (line,) = sm.level_lines(sheet, sheet.vertices[:, 0], level=0.013)
        assert not line.closed
        assert np.ptp(line.points[:, 1]) == pytest.approx(np.ptp(sheet.vertices[:, 1]), rel=0.05)
        values = np.where(BALL.vertices[:, 0] > 0.5, np.nan, BALL.vertices[:, 2])
        (part,) = sm.level_lines(BALL, values, level=0.1)
        assert not part.closed
        assert part.length < 2 * np.pi * 0.8

    def test_no_part_is_lost_where_triangles_share_an_edge_or_disagree(self):
        """Of two triangles entered through one edge the second was left out."""
        page = sm.TriangleMesh(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]], [[0, 1, 2], [0, 1, 3], [1, 0, 4]]
        )
        assert sum(line.length for line in sm.level_lines(page, [1.0, -1, -1, -1, -1])) == pytest.approx(1.5 * 2**0.5)
        (whole,) = sm.level_lines(BALL, BALL.vertices[:, 2], level=0.3)
        turned = np.where(np.arange(len(BALL.faces))[:, None] % 3 == 0, BALL.faces[:, ::-1], BALL.faces)
        lines = sm.level_lines((BALL.vertices, turned), BALL.vertices[:, 2], level=0.3)
        assert sum(line.length for line in lines) == pytest.approx(whole.length)

    @given(st.integers(0, 10**6))
    def test_of_any_field_cross_each_sign_change_once(self, seed):
        mesh = sm.torus(12, 8).triangulated("dual")
        values = np.random.default_rng(seed).normal(size=mesh.n_vertices).round(0)
        lines = sm.level_lines(mesh, values)
        ring = as_sampled_surface(mesh).one_ring
        ends = np.repeat(ring.centers, ring.valence)
        changing = (values[ends] >= 0) != (values[ring.members] >= 0)
        expected = {(min(a, b), max(a, b)) for a, b in zip(ends[changing], ring.members[changing], strict=True)}
        alone = [i for i in np.flatnonzero(values == 0) if (values[ring[i]] < 0).all()]
        expected -= {(min(i, j), max(i, j)) for i in alone for j in ring[i]}  # a point is no line
        crossed = [tuple(map(int, edge)) for line in lines for edge in line.edges]
        assert len(crossed) == len(set(crossed))
        assert set(crossed) == expected
        assert all(line.closed for line in lines)

    def test_of_inversion_divide_a_torus_at_its_top_and_bottom(self):
        ring = sm.torus(90, 36, radius=1.0, tube_radius=0.35).triangulated("dual")
        found = sm.inversion_lines(ring, of="gauss", curvature=curved(ring, 1))
        assert len(found) == 2
        for line in found:
            assert np.hypot(line.points[:, 0], line.points[:, 1]) == pytest.approx(1.0, abs=0.04)
            assert abs(line.points[:, 2]) == pytest.approx(0.35, abs=0.01)

    def test_of_mean_curvature_go_around_a_bump(self):
        sheet = sm.plane(90, 80, size=(2.0, 2.0)).triangulated("dual")
        away = np.hypot(sheet.vertices[:, 0], sheet.vertices[:, 1])
        bump = 0.02 * np.exp(-(away**2) / (2 * 0.25**2))
        mesh = sm.TriangleMesh(sheet.vertices + bump[:, None] * [0, 0, 1], sheet.faces)
        found = sm.inversion_lines(mesh, curvature=curved(mesh), scale=0)
        radii = [np.hypot(line.points[:, 0], line.points[:, 1]) for line in found if line.closed]
        (around,) = (each for each in radii if each.max() < 0.5)
        assert around == pytest.approx(0.25 * np.sqrt(2), abs=0.01)  # H ~ (2 - r^2 / w^2)

    def test_short_ones_are_left_out(self):
        values = (BALL.vertices**2).sum(axis=1)
        values = np.where(np.arange(len(values)) == 7, 2.0, values)
        assert len(sm.level_lines(BALL, values, level=1.5)) == 1
        assert sm.level_lines(BALL, values, level=1.5, minimum=1.0) == ()

    def test_a_vertex_that_just_reaches_the_level_is_none(self):
        assert sm.level_lines(BALL, np.where(np.arange(BALL.n_vertices) == 7, 0.0, -1.0)) == ()

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.level_lines(BALL, [1.0]), "values must have shape (2562,), not (1,)"),
            (lambda: sm.level_lines(BALL, BALL.vertices[:, 0], level=np.nan), "level must be finite, not nan"),
            (lambda: sm.level_lines(BALL, BALL.vertices[:, 0], minimum=-1), "minimum must be at least 0, not -1"),
            (lambda: sm.inversion_lines(BALL, of="k1"), "of must be one of 'mean', 'gauss', not 'k1'"),
            (
                lambda: sm.level_lines(sm.sphere(4), np.zeros(320)),
                "surface must have triangles to draw lines on; of a simplex mesh take mesh.triangulated()",
            ),
        ],
    )
    def test_bad_input_is_told(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value) == words


class TestSnapping:
    EGG = sm.ellipsoid((3, 1, 1), 24).triangulated("dual")

    @pytest.mark.parametrize("pick", [[2.7, 0.3, 0.2], [2.8, -0.3, 0.1], [2.9, 0.0, -0.3]])
    def test_picks_near_a_tip_lead_to_it(self, pick):
        curvature = curved(self.EGG)
        for criterion in ("peak", "ridge", "magnitude", "curvedness"):
            found = sm.snap_landmark(self.EGG, pick, criterion, radius=0.8, curvature=curvature)
            assert found.point == pytest.approx([3, 0, 0], abs=0.15)
            assert 0 < found.moved <= 0.8

    @pytest.mark.filterwarnings("ignore:the faces are oriented inward")
    def test_a_pit_is_found_and_no_tip(self):
        inside = sm.TriangleMesh(self.EGG.vertices, self.EGG.faces[:, ::-1])
        curvature = curved(inside)
        assert sm.snap_landmark(inside, [2.7, 0.3, 0.2], "pit", radius=0.8, curvature=curvature).point[0] > 2.95
        assert sm.snap_landmark(inside, [2.7, 0.3, 0.2], "peak", radius=0.8, curvature=curvature).point[0] < 2.7
        assert sm.snap_landmark(inside, [2.7, 0.3, 0.2], "valley", radius=0.8, curvature=curvature).point[0] > 2.95

    @pytest.mark.filterwarnings("ignore:the faces are oriented inward")
    def test_values_are_those_of_the_criterion(self):
        egg = sm.ellipsoid((3, 2, 1), 40).triangulated("dual")
        inside = sm.TriangleMesh(egg.vertices, egg.faces[:, ::-1])
        expected = {
            "peak": 0.75,
            "ridge": 3.0,
            "magnitude": 1.875,
            "curvedness": 2.187,
        }  # at the tip: 3 / 2^2 and 3 / 1
        for surface, names in ((egg, expected), (inside, {"pit": 0.75, "valley": 3.0})):
            curvature = curved(surface, 1)
            for name, value in names.items():
                found = sm.snap_landmark(surface, [2.95, 0.1, 0], name, radius=0.4, curvature=curvature, scale=0)
                assert found.value == pytest.approx(value, rel=0.06)

    def test_the_waist_is_the_saddle(self):
        waist = sm.torus(60, 30).triangulated("dual")
        found = sm.snap_landmark(waist, waist.vertices[0], "saddle", radius=2.0, curvature=curved(waist, 1))
        assert found.value > 0
        assert np.hypot(*found.point[:2]) < np.hypot(waist.vertices[:, 0], waist.vertices[:, 1]).min() + 0.1

    def test_goes_no_farther_than_the_radius_along_the_surface(self):
        field = BALL.vertices[:, 2]
        start = int(np.argmin(field))
        found = sm.snap_landmark(BALL, start, field, radius=0.5)
        assert found.moved <= 0.5
        assert found.value == pytest.approx(-np.cos(0.5), abs=0.05)
        near = sm.snap_landmark(BALL, start, field, radius=1e-6)
        assert (near.vertex, near.moved) == (start, 0.0)

    def test_does_not_jump_over_a_gap(self):
        n = BALL.n_vertices
        both = sm.TriangleMesh(
            np.vstack([BALL.vertices, BALL.vertices + np.array([2.1, 0, 0])]), np.vstack([BALL.faces, BALL.faces + n])
        )
        found = sm.snap_landmark(both, [1.0, 0, 0], both.vertices[:, 0], radius=0.4)
        assert found.vertex < n

    @given(st.integers(0, 10**6), st.floats(0.01, 100))
    def test_moves_with_the_surface(self, seed, size):
        egg = sm.ellipsoid((3, 2, 1), 10).triangulated("dual")
        copy = sm.TriangleMesh(size * egg.vertices @ turned(seed).T + 1, egg.faces)
        one = sm.snap_landmark(egg, 5, "peak", radius=1.0, curvature=curved(egg))
        other = sm.snap_landmark(copy, 5, "peak", radius=size, curvature=curved(copy))
        assert other.vertex == one.vertex
        assert other.moved == pytest.approx(size * one.moved)

    def test_the_window_is_no_more_than_a_third_of_the_radius(self):
        egg = sm.ellipsoid((3, 2, 1), 10).triangulated("dual")
        one, other = (sm.snap_landmark(egg, 5, "peak", radius=0.3, curvature=curved(egg), scale=w) for w in (None, 0.1))
        assert (one.vertex, one.value) == (other.vertex, pytest.approx(other.value))

    def test_averages_first_and_takes_the_size_then_as_salient_points_do(self):
        rng = np.random.default_rng(0)
        mesh = sm.TriangleMesh(BALL.vertices + 0.002 * rng.normal(size=BALL.vertices.shape), BALL.faces)
        curvature = curved(mesh, 1)
        field = sm.salient_points(mesh, curvature=curvature, scale=0.2).field
        found = sm.snap_landmark(mesh, 3, curvature=curvature, scale=0.2, radius=0.4)
        assert found.value == pytest.approx(field[found.vertex])
        gauss = smoothed_curvature(Diffusion(as_sampled_surface(mesh)), curvature, 0.2).gauss
        found = sm.snap_landmark(mesh, 3, "saddle", curvature=curvature, scale=0.2, radius=0.4)
        assert found.value == pytest.approx(-gauss[found.vertex])

    @pytest.mark.parametrize(
        ("pick", "options", "words"),
        [
            ([0, 0, 3.0], {"radius": 0.5}, "pick must be within the radius 0.5 of the surface, not 2.001 away"),
            (2562, {"radius": 0.5}, "pick[0] is 2562, outside 0..2561"),
            ([0, 0, np.nan], {"radius": 0.5}, "pick must be finite; pick[2] is nan"),
            ([0, 0], {"radius": 0.5}, "pick must have shape (3,), not (2,)"),
            (0, {"radius": 0}, "radius must be above 0, not 0"),
            (0, {"radius": 1, "criterion": np.zeros(3)}, "criterion must have shape (2562,), not (3,)"),
            (
                0,
                {"radius": 0.3, "criterion": np.full(2562, np.nan)},
                "criterion must be known somewhere within 0.3 of the pick, it is nowhere",
            ),
        ],
    )
    def test_bad_input_is_told(self, pick, options, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            sm.snap_landmark(BALL, pick, **options)
        assert str(caught.value) == words

    def test_an_unknown_criterion_lists_the_known(self):
        with pytest.raises(ValueError, match=r"^criterion must be one of 'peak', .*, not 'best'$"):
            sm.snap_landmark(BALL, 0, "best", radius=1)


def sheet_with_a_hole(radius=0.5, depth=0.6, step=0.04, tilt=0):
    """A slab z < 0 with a round bore of rounded rim along z, as an implicit surface, turned."""
    x, y, z = np.meshgrid(*(np.arange(-a, a + step / 2, step) for a in (1.3, 1.3, depth)), indexing="ij")
    away = np.hypot(x - 0.2, y + 0.1)
    slab, bore = z - 0.1 + 0 * x, radius - away
    rim = 0.08  # rounded: the union of the two outsides
    field = np.where((slab > -rim) & (bore > -rim), np.hypot(slab + rim, bore + rim) - rim, np.maximum(slab, bore))
    grid = pv.ImageData(dimensions=x.shape, spacing=(step,) * 3, origin=(-1.3, -1.3, -depth))
    grid["f"] = field.ravel(order="F")
    found = grid.contour([0.0], scalars="f", method="flying_edges").clean()
    faces = found.regular_faces
    mesh = sm.TriangleMesh(np.asarray(found.points, float), faces)
    up = mesh.vertex_normals[np.argmax(np.hypot(*mesh.vertices[:, :2].T) * (mesh.vertices[:, 2] > 0.05))]
    mesh = mesh if up[2] > 0 else sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    q = turned(tilt) if tilt else np.eye(3)
    return sm.TriangleMesh(mesh.vertices @ q.T, mesh.faces), q @ [0.2, -0.1, 0.1], q[:, 2]


class TestCircles:
    @given(st.integers(0, 10**6), st.floats(0.01, 100), st.floats(0.3, 1.0))
    def test_points_on_a_circle_give_it(self, seed, size, share):
        rng = np.random.default_rng(seed)
        turn = 2 * np.pi * share * rng.random(40)
        q = turned(seed)
        center = size * rng.normal(size=3)
        points = center + size * (np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) @ q.T)
        found = sm.fit_circle(points)
        assert found.center == pytest.approx(center, abs=1e-6 * size)
        assert found.radius == pytest.approx(size, rel=1e-6)
        assert abs(found.normal @ q[:, 2]) == pytest.approx(1, abs=1e-9)
        assert found.rms < 1e-6 * size
        assert found.covered <= share + 0.1

    @pytest.mark.parametrize("count", [3, 6, 12, 24, 200])
    def test_a_whole_circle_of_few_points_is_whole(self, count):
        turn = 2 * np.pi * np.arange(count) / count
        found = sm.fit_circle(np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1))
        assert found.covered == pytest.approx(1)

    @pytest.mark.parametrize("count", [6, 12, 40, 200])
    @pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
    def test_covered_is_the_share_of_an_arc(self, count, share):
        if share == 0.75 and count == 6:
            return  # gaps of 54 degrees, and one of 90
        turn = 2 * np.pi * share * np.linspace(0, 1, count)
        found = sm.fit_circle(np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1))
        assert found.covered == pytest.approx(share, abs=0.03)

    @pytest.mark.parametrize("seed", range(3))
    def test_strays_are_left_out(self, seed):
        rng = np.random.default_rng(seed)
        turn = 2 * np.pi * rng.random(100)
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) + 0.005 * rng.normal(size=(100, 3))
        found = sm.fit_circle(np.vstack([points, rng.uniform(-1.5, 1.5, (40, 3))]))
        assert found.center == pytest.approx([0, 0, 0], abs=0.01)
        assert found.radius == pytest.approx(1, abs=0.005)
        assert (found.vertices >= 100).sum() < 4

    @pytest.mark.parametrize("size", [1e-9, 1e-4, 1e5, 1e9])
    def test_is_the_same_in_any_unit(self, size):
        rng = np.random.default_rng(3)
        turn = 5 * rng.random(60)
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) @ turned(1).T + 0.02 * rng.normal(
            size=(60, 3)
        )
        one, other = sm.fit_circle(points), sm.fit_circle(size * points)
        assert other.center == pytest.approx(size * one.center, rel=1e-6, abs=1e-7 * size)
        assert (other.radius, other.rms) == pytest.approx((size * one.radius, size * one.rms), rel=1e-7)
        assert abs(other.normal @ one.normal) == pytest.approx(1, abs=1e-12)

    def test_of_very_many_points_looks_at_some_first_and_fits_all(self):
        rng = np.random.default_rng(2)
        turn = 2 * np.pi * rng.random(40_000)
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) + 0.05 * rng.normal(size=(40_000, 3))
        found = sm.fit_circle(points)
        assert len(found.vertices) > 38_000
        assert np.linalg.norm(found.center) < 0.002
        assert found.covariance[5, 5] == pytest.approx(0.05**2 / 40_000, rel=0.05)

    @pytest.mark.parametrize("tilt", [*nightly(0), 1, *nightly(2, 3, 4)])
    def test_the_rim_of_a_hole_is_found_within_a_percent(self, tilt):
        mesh, center, axis = sheet_with_a_hole(tilt=tilt)
        found = sm.rim_circle(mesh, center + 0.1 * turned(tilt + 5)[0], radius=0.8, curvature=curved(mesh))
        off = found.center - center
        off -= (off @ axis) * axis
        assert np.linalg.norm(off) < 0.01 * 0.5
        assert found.radius == pytest.approx(0.5 + 0.08 * (1 - np.sqrt(0.5)), rel=0.03)  # half way around the rounding
        assert found.normal @ axis > 0.999
        assert found.covered > 0.95

    def test_what_is_no_rim_is_told(self):
        sheet = sm.plane(60, 60, size=(2.0, 2.0)).triangulated("dual")
        x, y, _ = sheet.vertices.T
        crossing = np.stack([x, y, 0.1 * (np.exp(-((x / 0.06) ** 2)) + np.exp(-((y / 0.06) ** 2)))], axis=1)
        ridges = sm.TriangleMesh(crossing, sheet.faces)
        with pytest.warns(
            sm.SimplexMeshWarning, match=r"sharp points within 0\.8 of the pick are not on a circle there"
        ):
            sm.rim_circle(ridges, [0.0, 0, 0], radius=0.8, curvature=curved(ridges))

    def test_moves_with_the_surface(self):
        mesh, center, _ = sheet_with_a_hole()
        one = sm.rim_circle(mesh, center, radius=0.8, curvature=curved(mesh))
        copy = sm.TriangleMesh(10 * mesh.vertices + 3, mesh.faces)
        other = sm.rim_circle(copy, 10 * center + 3, radius=8, curvature=curved(copy))
        assert other.center == pytest.approx(10 * one.center + 3, abs=1e-3)
        assert other.radius == pytest.approx(10 * one.radius, rel=1e-4)

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            (lambda: sm.fit_circle([[0, 0, 0], [1, 0, 0]]), "points must be at least 3, not 2"),
            (lambda: sm.fit_circle([[0, 0, 0], [1, 0, 0], [2, 0, 0]]), "points must not lie on one line"),
            (lambda: sm.fit_circle(np.zeros((9, 3))), "points must not lie on one line"),
            (lambda: sm.fit_circle(np.eye(3), weights=[1, 1]), "weights must have shape (3,), not (2,)"),
            (lambda: sm.fit_circle(np.eye(3), weights=[1, -1, 1]), "weights must be at least 0, not -1"),
            (
                lambda: sm.fit_circle(np.eye(3), weights=[1, 0, 1]),
                "weights must be above 0 for at least 3 points, not 2",
            ),
            (lambda: sm.fit_circle(np.full((4, 3), np.inf)), "points must be finite; points[0, 0] is inf"),
            (
                lambda: sm.rim_circle(BALL, [9.0, 0, 0], radius=0.5),
                "pick must have at least 6 sharp points within 0.5, it has 0",
            ),
            (lambda: sm.rim_circle(BALL, 0, radius=-1), "radius must be above 0, not -1"),
            (lambda: sm.rim_circle(BALL, 0, radius=1, sharpness=2), "sharpness must be between 0 and 1, not 2"),
        ],
    )
    def test_bad_input_is_told(self, call, words):
        with pytest.raises((ValueError, TypeError)) as caught:
            call()
        assert str(caught.value) == words
