"""Refinement and redistribution: scores, edits, budgets, zones, and smaller distances to the data."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.motion.density import _kernels_refine
from simplexmesh.motion.density.face_edits import (
    MOST_MERGED,
    divide_faces,
    face_distance,
    face_score,
    removable_edges,
    with_even_metric,
)
from simplexmesh.motion.density.redistribute import _merge_count, _vertex_schedule, redistribute_round
from simplexmesh.motion.density.refine import THRESHOLDS, refine_round, refinement_scores
from simplexmesh.motion.density.refinement import Refined
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.start.primitives import primitive_around
from simplexmesh.motion.targets.triangles import inside_surface, surface_distance
from tests.mesh.families import ALL, shaken
from tests.motion.density import reference as reference
from tests.nightly.marks import nightly

EGG = sm.ellipsoid((1.0, 1.2, 2.0), 24).triangulated()
BALL = sm.sphere(3)


@functools.cache
def egg_of(vertices):
    return sm.reconstruct(EGG, vertices=vertices, adaptation=0.0, creases="none").mesh


class Sphere:
    """The unit sphere as a target, seen from anywhere within reach."""

    def gap(self, vertices, normals, reach):
        gaps = 1 - np.linalg.norm(vertices, axis=1)
        return np.where(np.abs(gaps) <= reach, gaps, np.nan)


class Blurred(Sphere):
    """The same, of which nothing smaller than a size shows north of the equator."""

    def __init__(self, size):
        self.size = size

    def resolution(self, places):
        return np.where(places[:, 2] > 0, self.size, 0.0)


def data_to_mesh(mesh, points):
    surface = mesh.triangulated(method="fan")
    return np.sqrt((surface_distance(points, surface.vertices, surface.faces) ** 2).mean())


def around_faces(mesh, faces):
    """The vertices of each face in order, from the smallest on."""
    loops = reference.loops(mesh.connectivity)
    return [tuple(np.roll(loops[f], -int(np.argmin(loops[f])))) for f in faces]


@pytest.fixture(scope="module")
def fine():
    return sm.refine(egg_of(160), EGG, threshold="fine", rounds=60)


class TestScore:
    @pytest.mark.parametrize("name", sorted(ALL))
    def test_is_that_of_the_naive_twin(self, name):
        rng = np.random.default_rng(1)
        mesh = shaken(ALL[name], rng)
        away = rng.uniform(0, 0.7, mesh.connectivity.face_sizes.size)
        away[::5] = np.nan
        expected = reference.score(mesh, away, 0.5)
        np.testing.assert_allclose(face_score(mesh, away, 0.5).total, expected, rtol=1e-9, atol=1e-15)

    def test_on_a_sphere_bending_is_the_gaussian_measure(self):
        ball = sm.sphere(12)
        nowhere = np.zeros(ball.connectivity.face_sizes.size)
        bent, gauss = face_score(ball, nowhere, 1.0).curvature, ball.face_gauss
        sizes = ball.connectivity.face_sizes
        np.testing.assert_allclose(bent[sizes == 6], gauss[sizes == 6], rtol=0.05)
        np.testing.assert_allclose(bent[sizes == 5], gauss[sizes == 5], rtol=0.3)

    def test_sees_creases_that_have_no_gaussian_curvature(self):
        tube = sm.cylinder(24, 24)
        away = np.full(tube.connectivity.face_sizes.size, 1e-4)
        inside = np.abs([tube.vertices[loop][:, 2].mean() for loop in reference.loops(tube.connectivity)]) < 0.5
        inside &= ~tube.connectivity.face_is_hole
        assert np.abs(tube.face_gauss[inside]).max() < 1e-9
        assert (face_score(tube, away, 1.0).curvature[inside] > 1e-3).all()

    def test_of_flat_faces_far_away_is_not_zero(self):
        sheet = sm.plane(8, 8)
        far = face_score(sheet, np.full(sheet.connectivity.face_sizes.size, 0.1), 1.0)
        assert (far.total[~sheet.connectivity.face_is_hole] > 0).all()

    def test_of_holes_and_of_faces_without_data_is_zero(self):
        sheet = sm.plane(8, 8)
        c = sheet.connectivity
        assert (face_score(sheet, np.ones(c.face_sizes.size), 1.0).total[c.face_is_hole] == 0).all()
        assert (face_score(sheet, np.full(c.face_sizes.size, np.nan), 1.0).total == 0).all()

    @given(seed=st.integers(0, 10**6), size=st.floats(1e-3, 1e3))
    def test_does_not_depend_on_place_and_size(self, seed, size):
        rng = np.random.default_rng(seed)
        mesh = shaken(sm.ellipsoid((1, 2, 3), 3), rng)
        away = rng.uniform(0, 1, mesh.connectivity.face_sizes.size)
        moved = mesh.moved(size * Rotation.random(rng=rng).apply(np.array(mesh.vertices)) + rng.normal(size=3))
        before, after = face_score(mesh, away, 0.5).total, face_score(moved, size * away, size * 0.5).total
        np.testing.assert_allclose(after, before, rtol=1e-6, atol=1e-12)

    def test_falls_with_the_cube_of_the_number_of_faces(self):
        scores = [
            np.median(face_score(ball, face_distance(ball, Sphere(), 0.5)[0], 0.5).total)
            for ball in (sm.sphere(6), sm.sphere(12))
        ]
        assert scores[0] / scores[1] == pytest.approx(4**3, rel=0.2)

    def test_the_distance_of_a_face_is_that_of_its_middle_when_its_vertices_are_there(self):
        ball = sm.sphere(3)
        away = face_distance(ball, Sphere(), 0.5)[0]
        middles = [1 - np.linalg.norm(ball.vertices[loop].mean(axis=0)) for loop in ball.faces]
        np.testing.assert_allclose(away, middles, rtol=1e-9)

    def test_the_distance_of_a_face_without_data_is_unknown(self):
        assert np.isnan(face_distance(sm.sphere(3, radius=3.0), Sphere(), 0.5)[0]).all()


class TestCuts:
    @pytest.mark.parametrize("name", ["icosahedron-5", "torus", "cylinder", "plane"])
    def test_the_pair_is_the_best_of_all(self, name):
        rng = np.random.default_rng(2)
        mesh = shaken(ALL[name], rng)
        c = mesh.connectivity
        faces = np.flatnonzero(~c.face_is_hole)
        may_grow = rng.uniform(size=c.face_sizes.size) < 0.8
        out = np.zeros((len(faces), 2), np.int32)
        loops = c.twin.reshape(-1), c.face.reshape(-1), c.face_darts, c.face_offsets
        _kernels_refine.best_cuts(np.asarray(mesh.vertices), *loops, may_grow, faces, out)
        for face, pair in zip(faces.tolist(), out.tolist(), strict=True):
            costs = reference.cut_costs(mesh, face, may_grow, 0.1)
            if not costs:
                assert pair == [-1, -1]
            else:
                assert costs[frozenset(pair)] == pytest.approx(min(costs.values()), rel=1e-12)

    @given(seed=st.integers(0, 10**6), limit=st.integers(0, 30))
    def test_groups_apart_are_those_of_the_naive_twin(self, seed, limit):
        rng = np.random.default_rng(seed)
        groups = rng.integers(0, 40, (30, 4)).astype(np.int32)
        free = rng.uniform(size=40) < 0.9
        out = np.zeros(30, np.int64)
        count = _kernels_refine.disjoint_rows(groups, free.copy(), limit, out)
        assert out[:count].tolist() == reference.apart(groups, free, limit)


class TestRound:
    def test_only_faces_above_the_threshold_are_divided(self):
        out = refine_round(egg_of(160), sm.targets.Triangles(EGG), reach=0.4, threshold=1e9)
        assert (out.inserted, out.converged) == (0, True)

    @pytest.mark.parametrize("budget", [0, 1, 2, 9, 10, 47, 200])
    def test_keeps_to_its_budget(self, budget):
        out = refine_round(egg_of(160), sm.targets.Triangles(EGG), reach=0.4, threshold=1e-12, budget=budget)
        assert budget - 10 < out.inserted or out.inserted >= egg_of(160).n_faces
        assert out.inserted <= budget
        assert out.mesh.check().ok

    @pytest.mark.parametrize("budget", range(8))
    def test_each_division_is_paid_for(self, budget):
        mesh = sm.sphere(4)
        sizes = mesh.connectivity.face_sizes
        apart = [int(np.argmin(sizes)), int(np.flatnonzero(sizes == 5)[-1])]
        edit, grow = EditableMesh(mesh), np.ones(sizes.size, bool)
        cuts = divide_faces(edit, mesh, np.array(apart), budget, grow)
        assert cuts == min(2, budget // 2)
        assert edit.result().mesh.n_vertices == mesh.n_vertices + 2 * cuts

    def test_a_division_needs_neighbors_that_may_grow(self):
        mesh = sm.sphere(4)
        c, face = mesh.connectivity, int(np.argmin(mesh.connectivity.face_sizes))
        around = np.setdiff1d(c.vertex_faces[(c.vertex_faces == face).any(axis=1)], [face])
        grow = ~np.isin(np.arange(c.face_sizes.size), around)
        assert divide_faces(EditableMesh(mesh), mesh, np.array([face]), 100, grow) == 0
        grow[around[0]] = True
        assert divide_faces(EditableMesh(mesh), mesh, np.array([face]), 100, grow) == 0

    def test_tangled_faces_are_left_alone(self):
        vertices = np.array(egg_of(160).vertices)
        vertices[0] = 3 * vertices[egg_of(160).neighbors[0, 0]] - 2 * vertices[0]
        tangled = egg_of(160).moved(vertices)
        target = sm.targets.Triangles(EGG)
        faces = tangled.connectivity.vertex_faces[tangled_vertices(tangled)]
        assert len(faces) > 0
        assert (face_score(tangled, face_distance(tangled, target, 0.4)[0], 0.4).total[faces] > 0).any()
        assert (refinement_scores(tangled, target, 0.4)[faces] == 0).all()
        assert (refinement_scores(tangled, target, 0.4) > 0).sum() > 20


class TestRefine:
    def test_ends_with_no_face_above_the_threshold(self, fine):
        assert isinstance(fine, Refined)
        assert fine.converged
        assert fine.inserted == fine.mesh.n_vertices - egg_of(160).n_vertices > 0
        assert [r.n_vertices for r in fine.rounds] == sorted(r.n_vertices for r in fine.rounds)
        assert fine.mesh.check(self_intersections=True).ok

    def test_finer_thresholds_are_nearer(self, fine):
        coarse, medium = (sm.refine(egg_of(160), EGG, threshold=name) for name in ("coarse", "medium"))
        meshes = [egg_of(160), coarse.mesh, medium.mesh, fine.mesh]
        away = [data_to_mesh(mesh, EGG.vertices) for mesh in meshes]
        assert [m.n_vertices for m in meshes] == sorted(m.n_vertices for m in meshes)
        assert away[3] < 0.55 * away[2] < 0.5 * away[0]
        again = sm.refine(egg_of(160), EGG, threshold=THRESHOLDS["coarse"])
        assert again.mesh.n_vertices == coarse.mesh.n_vertices

    def test_a_sphere_on_a_sphere_gets_nearer(self):
        points = sm.sphere(30).vertices
        ball = sm.sphere(4)
        out = sm.refine(ball, Sphere(), threshold="fine", reach=0.5)
        assert data_to_mesh(out.mesh, points) < 0.5 * data_to_mesh(ball, points)

    def test_where_the_data_bends_vertices_are_nearer_to_each_other(self, fine):
        spacing = np.linalg.norm(
            fine.mesh.vertices[fine.mesh.neighbors] - fine.mesh.vertices[:, None], axis=2
        ).mean(axis=1)  # fmt: skip
        tip = np.abs(fine.mesh.vertices[:, 2]) > 1.7
        assert spacing[tip].mean() < 0.8 * spacing[~tip].mean()

    def test_the_maps_follow_vertices_and_faces(self):
        out = sm.refine(egg_of(160), EGG, threshold="medium", iterations=0, adaptation=0.0, rounds=1)
        assert (out.vertex_map >= 0).all()
        assert len(np.unique(out.vertex_map)) == egg_of(160).n_vertices
        assert (out.face_map >= 0).all()
        moved = np.linalg.norm(out.mesh.vertices[out.vertex_map] - egg_of(160).vertices, axis=1)
        assert np.median(moved) < 0.1

    @pytest.mark.parametrize("budget", [160, 161, 200, 300])
    def test_never_exceeds_the_number_of_vertices_requested(self, budget):
        out = sm.refine(egg_of(160), EGG, threshold=1e-12, vertices=budget)
        assert budget - 10 < out.mesh.n_vertices <= budget

    def test_keeps_genus_holes_and_metric_of_a_tube(self):
        tube = sm.cylinder(16, 12)
        flared = tube.moved(tube.vertices * (1 + 0.5 * tube.vertices[:, 2:] ** 2) ** [1, 1, 0])
        out = sm.refine(tube, flared.triangulated(), threshold="fine", reach=1.0, rounds=5)
        assert out.inserted > 0
        assert (out.mesh.genus, out.mesh.n_holes) == (tube.genus, tube.n_holes)
        np.testing.assert_allclose(out.mesh.data["metric"].sum(axis=1), 1.0)
        assert out.mesh.check().ok

    def test_an_interrupt_keeps_the_last_whole_state(self):
        seen = []

        def stop(done, mesh):
            seen.append(mesh)
            if len(seen) == 2:
                raise KeyboardInterrupt

        with pytest.warns(sm.SimplexMeshWarning, match="interrupted after 2 rounds; the mesh is the last complete"):
            out = sm.refine(egg_of(160), EGG, threshold="fine", watch=stop)
        assert out.interrupted
        assert not out.converged
        assert out.mesh is seen[1]
        assert len(out.rounds) == 2
        assert out.inserted == seen[1].n_vertices - egg_of(160).n_vertices

    def test_takes_data_of_all_kinds(self):
        x, y, z = np.mgrid[-12:13, -12:13, -12:13].astype(float)
        ball = sm.Volume(8 - np.sqrt(x * x + y * y + z * z), origin=(-12, -12, -12))
        start = sm.sphere(3, radius=8.0)
        for target, more in ((ball, {"level": 0.0}), (sm.targets.Isosurface(ball, 0.0), {})):
            out = sm.refine(start, target, threshold="fine", **more)
            assert out.inserted > 0
            np.testing.assert_allclose(np.linalg.norm(out.mesh.vertices, axis=1), 8, atol=0.05)
        assert sm.refine(sm.sphere(3), sm.sphere(30).vertices, threshold="medium").mesh.genus == 0


@pytest.fixture(scope="module")
def zone():
    return np.flatnonzero(np.array([egg_of(160).vertices[loop][:, 2].mean() for loop in egg_of(160).faces]) > 0.8)


@pytest.fixture(scope="module")
def outside(zone):
    return np.setdiff1d(np.arange(egg_of(160).connectivity.face_sizes.size), zone)


@pytest.fixture(scope="module")
def zoned(zone):
    return sm.refine(egg_of(160), EGG, threshold="fine", zones=zone)


@pytest.mark.parametrize("step", [refine_round, redistribute_round])
def test_faces_smaller_than_what_the_data_shows_are_not_divided(step):
    mesh = sm.sphere(6, radius=0.9)
    options = {"threshold": 1e-12, "budget": 200} if step is refine_round else {"vertices": mesh.n_vertices + 200}
    for share, north in ((0.9, True), (1.2, False)):  # the largest face is of one and the same share
        size = share * np.sqrt(mesh.face_areas.max())
        out = step(mesh, Blurred(size), reach=1.0, **options)
        new = out.mesh.vertices[np.setdiff1d(np.arange(out.mesh.n_vertices), out.vertex_map)]
        assert len(new) >= 150
        assert (new[:, 2] > 0.2).any() == north


class Torn(Blurred):
    """The sphere, but north of the equator each vertex sees data somewhere else."""

    def gap(self, vertices, normals, reach):
        elsewhere = np.random.default_rng(0).normal(0, 0.1, len(vertices))
        return super().gap(vertices, normals, np.inf) + np.where(vertices[:, 2] > 0, elsewhere, 0.0)


def test_faces_where_data_tells_no_surface_are_not_divided():
    ball = sm.sphere(8)
    ball = ball.moved(ball.vertices * 1.01)
    step = redistribute_round(ball, Torn(0.0), reach=0.5, vertices=ball.n_vertices + 40)
    new = step.mesh.vertices[np.setdiff1d(np.arange(step.mesh.n_vertices), step.vertex_map)]
    assert len(new) > 20
    assert new[:, 2].max() < 0.2  # an edge


class TestZones:
    def test_faces_outside_are_untouched(self, zoned, outside):
        out = zoned
        assert out.inserted > 20
        before, after = around_faces(egg_of(160), outside), around_faces(out.mesh, out.face_map[outside])
        renumbered = [tuple(out.vertex_map[list(loop)]) for loop in before]
        assert {frozenset(loop) for loop in renumbered} == {frozenset(loop) for loop in after}
        assert out.mesh.check(self_intersections=True).ok

    def test_vertices_outside_do_not_move(self, zone, zoned):
        inside = np.isin(egg_of(160).connectivity.vertex_faces, zone).any(axis=1)
        np.testing.assert_array_equal(zoned.mesh.vertices[zoned.vertex_map[~inside]], egg_of(160).vertices[~inside])

    def test_inside_the_mesh_gets_nearer(self, zoned):
        top = EGG.vertices[EGG.vertices[:, 2] > 1.2]
        assert data_to_mesh(zoned.mesh, top) < 0.5 * data_to_mesh(egg_of(160), top)

    def test_may_be_given_as_masks(self, zone, outside):
        faces = np.isin(np.arange(egg_of(160).connectivity.face_sizes.size), zone)
        vertices = ~np.isin(egg_of(160).connectivity.vertex_faces, outside).any(axis=1)
        whole, masked, inner = (
            sm.refine(egg_of(160), EGG, threshold="fine", zones=each, rounds=1).inserted
            for each in (zone, faces, vertices)
        )
        assert 0 < inner < whole == masked

    def test_no_faces_at_all_changes_nothing(self):
        assert sm.refine(egg_of(160), EGG, threshold="fine", zones=[]).mesh is egg_of(160)

    def test_sizes_are_made_even_within(self):
        uneven = sm.refine_face(sm.refine_face(sm.sphere(8), 40).mesh, 40).mesh
        c, edit = uneven.connectivity, EditableMesh(uneven)
        zone = np.ones(c.face_sizes.size, bool)
        assert not edit.even_out(within=~zone)
        zone[c.vertex_faces[c.face_darts[c.face_offsets[40]] // 3]] = False
        some = edit.even_out(within=zone)
        done = edit.result()
        sizes = done.mesh.connectivity.face_sizes[done.face_map[~zone]]
        np.testing.assert_array_equal(sizes, c.face_sizes[~zone])
        assert 0 < some < EditableMesh(uneven).even_out(within=np.ones_like(zone)) == EditableMesh(uneven).even_out()


class TestRedistribute:
    @pytest.mark.parametrize(
        ("start", "wanted", "steps"), [(100, 125, 1), (100, 126, 2), (100, 88, 1), (100, 87, 2), (100, 1000, 11)]
    )
    def test_numbers_grow_by_a_quarter_and_shrink_by_an_eighth_at_most(self, start, wanted, steps):
        schedule = _vertex_schedule(start, wanted, 3)
        assert len(schedule) == steps + 3
        assert schedule[steps - 1 :] == 4 * [wanted]
        ratios = np.array(schedule[:steps]) / [start, *schedule[: steps - 1]]
        np.testing.assert_allclose(ratios, (wanted / start) ** (1 / steps), rtol=0.01)

    def test_no_more_is_merged_than_pays(self):
        merged, highest = np.array([1.0, 2, 3, 4, 5]), np.array([10.0, 9, 8, 7, 6])
        assert _merge_count(merged, highest, 0) == 3  # 3 is below half of 8, 4 is not below half of 7
        assert _merge_count(merged, highest, -1) == 1 + 2  # the first must go; 2 and 3 for 10 and 9, 4 not for 8
        assert _merge_count(merged, highest, 2) == 2  # the two highest are divided anyhow
        assert _merge_count(merged, 9 * highest, -2) == 5
        assert _merge_count(merged, highest, -9) == 5
        assert _merge_count(merged, highest[:0], 0) == 0

    @pytest.mark.parametrize("wanted", [200, *nightly(400, 402, 900)])
    def test_reaches_the_number_requested(self, wanted):
        out = sm.redistribute(egg_of(400), EGG, vertices=wanted)
        assert out.mesh.n_vertices == pytest.approx(wanted, rel=0.01)
        assert out.mesh.check(self_intersections=True).ok
        assert (out.mesh.genus, out.converged) == (0, True)

    def test_the_same_number_of_vertices_is_nearer(self):
        part = sm.TriangleMesh(*box())
        even = even_box()
        out = sm.redistribute(even, part, vertices=even.n_vertices)
        points = part.sampled(20_000, rng=0).points
        assert out.mesh.n_vertices <= even.n_vertices
        assert data_to_mesh(out.mesh, points) < 0.75 * data_to_mesh(even, points)

    @pytest.mark.nightly
    def test_keeps_holes(self):
        tube = sm.cylinder(20, 20)
        flared = tube.moved(tube.vertices * (1 + 0.5 * tube.vertices[:, 2:] ** 2) ** [1, 1, 0])
        out = sm.redistribute(tube, flared.triangulated(), vertices=300, reach=1.0)
        assert (out.mesh.genus, out.mesh.n_holes) == (tube.genus, tube.n_holes)
        assert out.mesh.check().ok

    def test_an_interrupt_keeps_the_last_whole_state(self):
        def stop(done, mesh):
            raise KeyboardInterrupt

        with pytest.warns(sm.SimplexMeshWarning, match="interrupted after 1 round;"):
            out = sm.redistribute(egg_of(400), EGG, vertices=900, watch=stop)
        assert (out.interrupted, out.converged, len(out.rounds)) == (True, False, 1)
        assert out.mesh.n_vertices == out.rounds[0].n_vertices

    def test_faces_are_merged_for_others_where_that_pays_only(self):
        ball = sm.sphere(6)  # all faces are similar
        assert redistribute_round(ball, Sphere(), reach=0.5, vertices=ball.n_vertices).rounds[0].merged == 0
        part = sm.targets.Triangles(sm.TriangleMesh(*box()))
        even = even_box()
        step = redistribute_round(even, part, reach=0.2, vertices=even.n_vertices)
        assert step.rounds[0].merged > 10
        assert step.mesh.n_vertices == even.n_vertices

    def test_edges_that_may_go_leave_no_large_faces_and_no_triangles(self):
        mesh = egg_of(400)
        score = face_score(mesh, face_distance(mesh, sm.targets.Triangles(EGG), 0.4)[0], 0.4)
        darts, around, merged = removable_edges(mesh.connectivity, score)
        sizes = mesh.connectivity.face_sizes[around]
        assert (sizes[:, :2].sum(axis=1) - 4 <= MOST_MERGED).all()
        edit = EditableMesh(mesh)
        assert edit.remove_edges(darts[:1]).done.all()
        assert edit.result().mesh.connectivity.face_sizes.min() >= 4
        assert (merged >= score.total[around[:, 0]]).all()


def box():
    """A box of fine triangles, with sharp edges."""
    import pyvista as pv

    surface = pv.Box((-1, 1, -0.7, 0.7, -0.5, 0.5), level=20, quads=False).clean()
    return np.asarray(surface.points, float), surface.regular_faces


@functools.cache
def even_box():
    return sm.reconstruct(sm.TriangleMesh(*box()), vertices=600, adaptation=0.0, creases="none").mesh


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((EGG, EGG, {}), TypeError, "mesh must be a SimplexMesh, not TriangleMesh"),
        (
            (BALL, object(), {}),
            TypeError,
            r"target must have a method gap\(vertices, normals, reach\) or be data; .+",
        ),
        (
            (BALL, EGG, {"threshold": "finest"}),
            ValueError,
            "threshold must be one of 'coarse', 'medium', 'fine', not 'finest': did you mean 'fine'\\?",
        ),
        ((BALL, EGG, {"threshold": 0.0}), ValueError, "threshold must be .*0"),
        ((BALL, EGG, {"vertices": 100}), ValueError, "vertices must be at least the 180 of the mesh, not 100"),
        ((BALL, EGG, {"zones": [3, 92]}), ValueError, r"zones\[1\] is 92, outside 0..91"),
        (
            (BALL, EGG, {"zones": np.ones(7, bool)}),
            ValueError,
            r"zones must be a mask of the 92 faces or of the 180 vertices, not one of shape \(7,\)",
        ),
        ((BALL, EGG, {"reach": -1.0}), ValueError, "reach must be .*"),
        ((BALL, Sphere(), {"level": 3.0}), ValueError, "level, label and inside are for volumes, not for Sphere"),
        ((BALL, Sphere(), {"inside": "below"}), ValueError, "level, label and inside are for .*"),
        ((BALL, EGG, {"zones": [[1], [2, 3]]}), ValueError, "zones must be an array, but its rows have .*"),
        ((BALL, EGG, {"watch": "no"}), TypeError, "watch must be a function of a Round and the mesh, not str"),
        ((BALL, EGG, {"adaptation": 2}), ValueError, "adaptation must be .*"),
    ],
)
def test_bad_arguments_are_named(arguments, error, message):
    mesh, target, options = arguments
    with pytest.raises(error, match=f"^{message}$"):
        sm.refine(mesh, target, **options)


def test_only_new_vertices_get_equal_metric_parameters():
    metric = np.random.default_rng(0).dirichlet([5, 5, 5], egg_of(160).n_vertices)
    step = sm.refine_face(egg_of(160).with_data(metric=metric), 7)
    now = with_even_metric(step).data["metric"]
    assert np.array_equal(now[step.vertex_map], metric)
    new = np.setdiff1d(np.arange(len(now)), step.vertex_map)
    assert len(new) == len(now) - len(metric) > 0
    assert (now[new] == 1 / 3).all()


def test_a_mesh_without_size_is_refused():
    point = egg_of(160).moved(np.ones((160, 3)))
    for action in (sm.refine, sm.redistribute, sm.open_holes):
        with pytest.raises(ValueError, match=r"^mesh must have some size, but all its vertices are at one point$"):
            action(point, sm.targets.Triangles(EGG))


@pytest.mark.filterwarnings("ignore:.*on faces that are folded or cross others")  # a forced low number
def test_redistribute_has_not_converged_when_the_number_was_not_reached():
    assert sm.redistribute(egg_of(160), EGG, vertices=170, rounds=0).converged
    ring = sm.torus(14, 6)
    out = sm.redistribute(ring, ring.triangulated(), vertices=20, rounds=1, iterations=1)
    assert out.mesh.n_vertices > 20
    assert not out.converged
    assert repr(out).endswith("rounds, not converged)")
    assert f"{168 - out.mesh.n_vertices} vertices removed" in repr(out)


def test_redistribute_names_bad_arguments():
    with pytest.raises(TypeError, match=r"^mesh must be a SimplexMesh, not TriangleMesh$"):
        sm.redistribute(EGG, EGG)
    with pytest.raises(ValueError, match=r"^vertices must be .*20.*3$"):
        sm.redistribute(egg_of(160), EGG, vertices=3)
    eight = sm.join(sm.torus(14, 6), sm.torus(14, 6), 0, 0).mesh
    with pytest.raises(ValueError, match=r"^vertices must be at least 24, for genus 2, not 20$"):
        sm.redistribute(eight, EGG, vertices=20)
    with pytest.raises(TypeError, match=r"^watch must be a function of a Round and the mesh, not int$"):
        sm.redistribute(egg_of(160), EGG, watch=3)


def test_the_bottom_of_a_deep_cavity_is_filled(data_folder):
    volume = sm.read_volume(data_folder / "vase_ct.vti")
    points = as_input(volume, level=25).points
    sphere = primitive_around(points, "sphere", 720, facing=None)
    radius = 0.5 * np.linalg.norm(np.ptp(points, axis=0))
    stages = [(6, 2 * radius, 100, 0.1), (6, 0.4 * radius, 100, 0.2), (1, 0.16 * radius, 500, 0.3)]
    start, target = sphere, sm.targets.Isosurface(volume, 25)
    for rigidity, reach, iterations, beta in stages:
        model = sm.DeformableModel(start, target, rigidity=rigidity, reach=reach, beta=beta)
        for _ in model.run(iterations):
            pass
        start = model.mesh
    out = sm.refine(start, volume, level=25)
    away = []
    for mesh in (start, out.mesh):
        surface = mesh.triangulated(method="fan")
        away.append(surface_distance(points, surface.vertices, surface.faces))
    assert (away[0] > 2).mean() > 0.2  # voxels: the bottom is missed
    assert away[0].max() > 8
    assert (away[1] > 2).mean() < 0.01
    assert np.sqrt((away[1] ** 2).mean()) < 0.3 * np.sqrt((away[0] ** 2).mean())
    assert out.mesh.check(self_intersections=True).ok


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "level", "vertices"), [("head_ct.mhd", 500, 3000), ("fandisk.off", None, 2000)])
def test_placed_where_needed_the_same_number_of_vertices_is_a_quarter_nearer(data_folder, name, level, vertices):
    even = sm.reconstruct(data_folder / name, level=level, vertices=vertices, adaptation=0.0, creases="none")
    out = sm.redistribute(even.mesh, data_folder / name, level=level)
    subject = as_input(data_folder / name, level=level)
    points = subject.points[:: max(1, len(subject.points) // 30_000)]
    closed = np.zeros(len(points), bool)  # walls of airways that a model closes over
    for mesh in (even.mesh, out.mesh):
        surface = mesh.triangulated(method="fan")
        deep = surface_distance(points, surface.vertices, surface.faces) > 4
        closed |= deep & inside_surface(points, surface.vertices, surface.faces)
    assert closed.mean() < 0.25
    assert out.mesh.n_vertices <= even.mesh.n_vertices
    assert data_to_mesh(out.mesh, points[~closed]) < 0.75 * data_to_mesh(even.mesh, points[~closed])
    assert not tangled_vertices(out.mesh).any()
