"""Comparison of signatures: exact where the sphere is symmetric, near elsewhere, and several answers, not one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.numerics.rigid import point_to_plane_fit, rigid_fit
from simplexmesh.recognition.sai.match import distinct, rotation_differences
from simplexmesh.recognition.sai.partial_signatures import (
    Signature,
    scale_factor,
    scaled_directions,
    signature_of,
    smoothed,
)
from simplexmesh.recognition.sai.rotations import rotations
from simplexmesh.recognition.sai.sphere_domain import sphere_domain
from tests.nightly.marks import nightly
from tests.recognition import reference as reference

F = 5


def sai_of(body, hidden=None):
    """A signature without a fit: the body's own shape sampled at the sphere's vertices."""
    return sm.SAI(round((body.n_vertices / 20) ** 0.5), body, hidden)


def bumpy(frequency=F, seed=0, turn=None):
    """A body given by its radius in each direction, and that direction turned first."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    height = rng.uniform(-0.25, 0.4, 6)
    here = sphere_domain(frequency)
    at = here.vertices if turn is None else here.vertices @ turn
    radius = 1 + (height * np.exp((at @ directions.T - 1) / 0.2)).sum(axis=1)
    return here.mesh.moved(here.vertices * radius[:, None])


class TestSearch:
    def test_is_the_plain_sum_for_every_rotation(self):
        rng = np.random.default_rng(0)
        table = rotations(F)
        n = sphere_domain(F).mesh.n_vertices
        a, b = (Signature(rng.normal(size=n), np.ones(n, bool), sphere_domain(F).vertices) for _ in range(2))
        total, common = rotation_differences(a, b, table)
        assert np.allclose(total, reference.search(reference.all_images(table), a.values, b.values), rtol=1e-4)
        assert (common == n).all()

    @pytest.mark.parametrize("seed", range(2))
    def test_of_what_both_see(self, seed):
        rng = np.random.default_rng(seed)
        table = rotations(F)
        n = sphere_domain(F).mesh.n_vertices
        a, b = (Signature(rng.normal(size=n), rng.random(n) < 0.6, sphere_domain(F).vertices) for _ in range(2))
        total, common = rotation_differences(a, b, table)
        plain, count = reference.search_seen(reference.all_images(table), a.values, a.seen, b.values, b.seen)
        assert np.array_equal(common, count)
        assert np.allclose(total, plain, rtol=1e-4)


class TestExact:
    @pytest.mark.parametrize("g", [0, 7, 23, 41, 59])
    def test_turns_of_the_icosahedron_are_found_exactly(self, g):
        table = rotations(F)
        one = sai_of(bumpy())
        mesh = one.mesh.moved(one.mesh.vertices[table.turns[g]])  # phi_b(p) = phi_a(R p)
        other = sai_of(mesh)
        (found, *_) = sm.match(other, one)
        assert found.distance < 1e-9
        assert np.allclose(found.rotation, table.group[g], atol=1e-6)
        assert np.array_equal(found.vertices_target, table.turns[g])
        assert np.array_equal(found.vertices_source, np.arange(one.n_vertices))
        assert np.allclose(found.T_target_source, np.eye(4), atol=1e-6)  # the objects are in the same place

    def test_without_refinement_too(self):
        table = rotations(F)
        one = sai_of(bumpy())
        k = 60 * 17 + 5
        values = one.angles[reference.all_images(table)[k]]
        total, _ = rotation_differences(signature_of(one), Signature(values, ~one.hidden, one.directions), table)
        assert int(total.argmin()) == k


class TestNear:
    @pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
    def test_any_turn_is_found_to_a_fraction_of_the_mesh_width(self, seed):
        R = reference.random_rotation(np.random.default_rng(seed))
        one, other = sai_of(bumpy(7)), sai_of(bumpy(7, turn=R.T))
        (found, *_) = sm.match(other, one)
        assert reference.angle(found.rotation, R) < 2.0  # vertices are 5.6 degrees apart
        assert reference.angle(found.T_target_source[:3, :3], R) < 2.0
        assert np.linalg.det(found.rotation) == pytest.approx(1)

    @pytest.mark.nightly
    def test_agrees_with_the_thesis_first_method_of_two_scales(self):
        R = reference.random_rotation(np.random.default_rng(11))
        one, other = sai_of(bumpy()), sai_of(bumpy(turn=R.T))
        (found, *_) = sm.match(other, one, smoothing=0, limit=np.pi)
        slow = reference.two_scales(F, one.angles, other.angles, coarse=15.0, reach=8.0)
        assert reference.angle(found.rotation, slow) < 3.0
        assert found.distance**2 <= reference.distance(F, one.angles, other.angles, slow)

    def test_refinement_only_improves(self):
        R = reference.random_rotation(np.random.default_rng(5))
        one, other = sai_of(bumpy()), sai_of(bumpy(turn=R.T))
        for smoothing in (0, 2):
            plain = sm.match(other, one, refine=False, smoothing=smoothing)[0]
            assert sm.match(other, one, smoothing=smoothing)[0].distance < plain.distance

    def test_distance_is_that_of_the_rotation_returned(self):
        R = reference.random_rotation(np.random.default_rng(6))
        one, other = sai_of(bumpy()), sai_of(bumpy(seed=3, turn=R))
        for found in sm.match(other, one, smoothing=0, limit=np.pi):
            plain = reference.distance(F, one.angles, other.angles, found.rotation)
            assert found.distance**2 == pytest.approx(plain, rel=1e-6)

    def test_mirrored_bodies_are_not_taken_for_each_other(self):
        body = bumpy()
        rows = np.argmax((sphere_domain(F).vertices * [-1, 1, 1]) @ sphere_domain(F).vertices.T, axis=1)
        mirrored = body.moved(body.vertices[rows] * [-1, 1, 1])
        same, other = sm.match(sai_of(body), sai_of(body))[0], sm.match(sai_of(mirrored), sai_of(body))[0]
        assert np.linalg.det(other.rotation) == pytest.approx(1)
        assert other.distance > 0.01
        assert same.distance < 1e-9


class TestHypotheses:
    def test_are_apart_and_in_order(self):
        found = sm.match(sai_of(bumpy(seed=2)), sai_of(bumpy()), best=6)
        assert 1 < len(found) <= 6
        assert [one.distance for one in found] == sorted(one.distance for one in found)
        turns = np.stack([one.rotation for one in found])
        between = reference.angles_between(turns, turns) + 10 * np.eye(len(found))
        assert between.min() >= np.radians(15) - 1e-9

    def test_hold_every_symmetry_of_a_symmetric_body(self):
        here = sphere_domain(F)
        radius = 1 + 0.2 * np.abs(here.vertices[:, 0]) ** 3 + 0.1 * here.vertices[:, 1] ** 2
        body = sai_of(here.mesh.moved(here.vertices * radius[:, None]))
        found = sm.match(body, body, best=4)
        assert found[3].distance < 1e-3
        flips = np.stack([np.diag(d) for d in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])]).astype(float)
        turns = np.stack([one.rotation for one in found])
        assert np.degrees(reference.angles_between(flips, turns).min(axis=1)).max() < 1.0

    def test_separate_keeps_the_first_of_each_neighborhood(self):
        turns = Rotation.from_rotvec(
            np.radians([[0, 0, 0], [0, 0, 10], [0, 0, 20], [0, 0, 31], [90, 0, 0]])
        ).as_matrix()
        assert distinct(turns, 9) == [0, 2, 4]
        assert distinct(turns, 2) == [0, 2]

    def test_none_without_the_overlap_asked_for(self):
        hidden = np.ones(500, bool)
        hidden[:250] = False
        one = sai_of(bumpy(), hidden=hidden)
        found = sm.match(one, one, minimum_overlap=0.9, scale=1.0)
        assert found
        assert all(each.overlap >= 0.9 for each in found)


class TestOcclusion:
    def test_areas_about_the_center_grow_by_k(self):
        center = np.array([0.0, 0.6, 0.8])
        here = sphere_domain(12)
        for k in (0.4, 1.0, 1.7):
            sources, exist = scaled_directions(here.vertices, center, k)
            cap = sources @ center > np.cos(0.7)  # what lands in the image of a cap
            area = here.cell_areas[cap & exist].sum()
            assert area == pytest.approx(k * 2 * np.pi * (1 - np.cos(0.7)), rel=0.08)
            assert np.allclose(np.linalg.norm(sources, axis=1), 1)

    def test_scale_one_is_the_identity(self):
        here = sphere_domain(F)
        sources, exist = scaled_directions(here.vertices, np.array([1.0, 0, 0]), 1.0)
        assert exist.all()
        assert np.allclose(sources, here.vertices, atol=1e-7)

    def test_factor_is_that_of_equation_6_8(self):
        here = sphere_domain(F)
        hidden = here.vertices[:, 2] < 0
        whole, part = sai_of(bumpy()), sai_of(bumpy(), hidden=hidden)
        k = 4 * np.pi * part.visible_area / (4 * np.pi * part.visible_fraction * whole.area)
        assert scale_factor(whole, part) == pytest.approx(k)

    def test_half_a_signature_finds_its_place_on_the_whole(self):
        R = reference.random_rotation(np.random.default_rng(8))
        whole = sai_of(bumpy(7))
        hidden = sphere_domain(7).vertices @ [0.6, 0, 0.8] < 0.1
        half = sai_of(bumpy(7, turn=R.T), hidden)
        (found, *_) = sm.match(half, whole, scale=1.0 / scale_factor(whole, half))
        assert found.scaled == "source"
        assert found.overlap > 0.95
        assert reference.angle(found.rotation, R) < 5.0
        assert not np.isin(found.vertices_source, np.flatnonzero(hidden)).any()

    def test_the_part_may_be_either_of_the_two(self):
        R = reference.random_rotation(np.random.default_rng(8))
        whole = sai_of(bumpy(7))
        hidden = sphere_domain(7).vertices @ [0.6, 0, 0.8] < 0.1
        half = sai_of(bumpy(7, turn=R.T), hidden)
        (found, *_) = sm.match(whole, half, scale=1.0 / scale_factor(whole, half))
        assert found.scaled == "target"
        assert reference.angle(found.rotation, R.T) < 6.0
        assert not np.isin(found.vertices_target, np.flatnonzero(hidden)).any()

    def test_unknown_scale_is_found(self):
        whole = sai_of(bumpy(7))
        shrunk = signature_of(sai_of(bumpy(7), sphere_domain(7).vertices[:, 0] < 0.2), scale=0.5)
        part = sm.SAI(
            7,
            whole.mesh.moved(
                sphere_domain(7).interpolated(whole.mesh.vertices, sphere_domain(7).locate(shrunk.sources))
            ),
            ~shrunk.seen,
        )
        found = sm.match(part, whole)[0]
        assert 1.4 < found.scale < 2.9
        away = np.linalg.norm(found.points_target - found.points_source, axis=1)  # the object is where it was
        assert np.median(away) < 0.1

    def test_smoothing_does_not_let_hidden_values_in(self):
        neighbors = sphere_domain(F).mesh.neighbors
        seen = sphere_domain(F).vertices[:, 2] > 0
        values = np.where(seen, 2.0, 1e6)
        assert np.allclose(smoothed(values, seen, neighbors, 3)[seen], 2.0)

    def test_the_rim_is_left_out_and_tips_are_cut(self):
        hidden = sphere_domain(F).vertices[:, 2] < 0
        one = sai_of(bumpy(), hidden)
        part = signature_of(one, limit=0.2)
        rim = hidden[one.mesh.neighbors].any(axis=1) & ~hidden
        assert rim.any()
        assert not part.seen[rim | hidden].any()
        assert part.seen[~(rim | hidden)].all()
        assert np.allclose(part.values[part.seen], np.clip(one.angles, -0.2, 0.2)[part.seen])

    def test_angles_grow_with_the_piece_of_surface_a_vertex_stands_for(self):
        coarse, fine = sai_of(bumpy(5)), sai_of(bumpy(10))  # four times the vertices
        finer = signature_of(coarse, scale=4.0)
        at = finer.seen & (sphere_domain(5).vertices @ coarse.center > np.cos(1.0))
        same = sphere_domain(10).interpolated(fine.angles, sphere_domain(10).locate(finer.sources))
        assert np.corrcoef(finer.values[at], same[at])[0, 1] > 0.9
        assert np.median(np.abs(finer.values - same)[at]) < 0.3 * np.median(np.abs(same[at]))


class TestRigid:
    def test_a_mirror_image_is_met_by_a_rotation(self):
        points = np.random.default_rng(0).normal(size=(20, 3))
        T = rigid_fit(points, points * [1, 1, -1])
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1)

    def test_one_correspondence_gives_a_shift(self):
        point, shift = np.array([[1.0, 2, 3]]), np.array([0.1, 0.2, 0.3])
        T = rigid_fit(point, point + shift)
        assert np.allclose(point_to_plane_fit(point, point + shift, np.array([[0, 0, 1.0]]), T)[:3, 3], shift)

    def test_points_then_planes(self):
        rng = np.random.default_rng(0)
        ellipsoid = sm.ellipsoid((3, 2, 1), 8)
        R, t = reference.random_rotation(rng), np.array([4.0, -2, 1])
        slide = rng.normal(size=ellipsoid.vertices.shape) * 0.05
        slide -= (slide * ellipsoid.normals).sum(1, keepdims=True) * ellipsoid.normals
        source = (ellipsoid.vertices + slide) @ R.T + t
        start = rigid_fit(source, ellipsoid.vertices)
        found = point_to_plane_fit(source, ellipsoid.vertices, ellipsoid.normals, start)
        assert reference.angle(found[:3, :3], R.T) < min(0.1, reference.angle(start[:3, :3], R.T) + 0.05)
        assert np.allclose(found[:3, :3] @ t + found[:3, 3], 0, atol=0.02)

    def test_slides_tell_what_normals_leave_open(self):
        """On a ball the normals know nothing of turns: where points correspond does."""
        globe, rng = sm.sphere(8), np.random.default_rng(0)
        turn = Rotation.from_rotvec(np.array([[0, 0, 0.1]])).as_matrix()[0]
        rough = globe.vertices @ turn.T + 0.01 * rng.normal(size=(globe.n_vertices, 1)) * globe.normals
        found = point_to_plane_fit(rough, globe.vertices, globe.normals, np.eye(4))
        assert reference.angle(found[:3, :3], turn.T) < 0.05

    def test_slides_tell_little_against_normals(self):
        """All points have slid around an ellipsoid that lies where it lay: 5.7 degrees, of which hardly any is left."""
        axes, rng = np.array([1.3, 1.0, 0.8]), np.random.default_rng(0)
        ellipsoid = sm.ellipsoid(axes, 8)
        turn = Rotation.from_rotvec(np.array([[0, 0, 0.1]])).as_matrix()[0]
        match_shifts = (ellipsoid.vertices / axes) @ turn.T * axes
        match_shifts += 0.01 * rng.normal(size=(len(match_shifts), 1)) * ellipsoid.normals
        found = point_to_plane_fit(match_shifts, ellipsoid.vertices, ellipsoid.normals, np.eye(4))
        assert 0.1 < reference.angle(found[:3, :3], np.eye(3)) < 1


class TestDoor:
    def test_two_frequencies(self):
        with pytest.raises(ValueError, match="target must have the frequency of source, 6, not 5"):
            sm.match(sai_of(bumpy(6)), sai_of(bumpy()))

    @pytest.mark.parametrize("factor", [0.5, 1.3])
    def test_that_objects_differ_in_size_is_told(self, factor):
        one = bumpy()
        with pytest.warns(sm.SimplexMeshWarning, match=f"^target is {factor} times as large as source in the best"):
            sm.match(sai_of(one), sai_of(one.scaled(factor)))

    @pytest.mark.filterwarnings("ignore:.* in the best match")
    @pytest.mark.parametrize("factor", [3, 0.1, 25.4, 1000])
    def test_that_parts_are_in_two_units_is_told(self, factor):
        one = bumpy()
        part = sai_of(one, one.vertices[:, 2] > 0.6 * one.vertices[:, 2].max())
        with pytest.warns(
            sm.SimplexMeshWarning, match=r"^target is about .* as source: parts are compared in one unit"
        ):
            sm.match(part, sai_of(one.scaled(factor)))

    def test_not_a_signature(self):
        with pytest.raises(TypeError, match=r"source must be an SAI, made by sm\.sai, not SimplexMesh"):
            sm.match(bumpy(), sai_of(bumpy()))

    @pytest.mark.parametrize(
        "wrong",
        [
            {"best": 0},
            {"best": 101},
            {"minimum_overlap": 0.0},
            {"minimum_overlap": 1.5},
            {"smoothing": -1},
            {"limit": 0.0},
            {"limit": 4.0},
            {"scale": 0.0},
            {"scale": "big"},
        ],
    )
    def test_options_out_of_range(self, wrong):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            sm.match(sai_of(bumpy()), sai_of(bumpy()), **wrong)
