"""Registration: the motion applied is the one found, symmetric objects are said to be, bad input is told."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.numerics import _kernels_local_fits as planes
from simplexmesh.recognition.register import _kernels_pose_scoring as kernels
from simplexmesh.recognition.register import pose_scoring
from simplexmesh.recognition.register import register as registration
from simplexmesh.recognition.register.icp import about_origin
from simplexmesh.recognition.register.oriented_points import OrientedPoints, oriented_points
from simplexmesh.recognition.register.pose_candidates import pose_candidates
from simplexmesh.recognition.register.pose_scoring import (
    SAME_ANGLE,
    SAME_SHIFT,
    distinct,
    motion_rows,
    source_of,
    target_grid,
)
from simplexmesh.recognition.register.verify import Verifier
from tests.nightly.marks import nightly
from tests.recognition import reference as reference


def lumpy(count, rng, noise=0.0):
    """New points on a body without symmetry, 4 or so in diameter."""
    points = reference.lumpy(16).triangulated().sampled(count, rng=rng).points
    return points + noise * rng.normal(size=points.shape)


def motion(rng, shift=3.0):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = reference.random_rotation(rng), shift * rng.normal(size=3)
    return T


def moved(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def disc(count, bores, rng):
    """Points on a disc with a hole in the middle and bores around it: it fits under as many turns, and turned over."""
    turns = 2 * np.pi * np.arange(bores) / bores
    middles = 0.65 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    flat = rng.uniform(-1, 1, (20 * count, 2))
    hollow = np.linalg.norm(flat[:, None] - middles, axis=2).min(axis=1) < 0.16
    flat = flat[(np.linalg.norm(flat, axis=1) < 1) & (np.linalg.norm(flat, axis=1) > 0.25) & ~hollow]
    parts = [np.column_stack([flat, rng.choice([-0.2, 0.2], len(flat))])]
    for middle, radius in ((np.zeros(2), 1.0), (np.zeros(2), 0.25), *((each, 0.16) for each in middles)):
        turn = rng.uniform(0, 2 * np.pi, int(20 * count / 4 * 2 * np.pi * radius * 0.4 / 2))
        ring = middle + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        parts.append(np.column_stack([ring, rng.uniform(-0.2, 0.2, len(ring))]))
    points = np.concatenate(parts)
    return points[rng.choice(len(points), count, replace=False)]


def turn_between(T, S):
    return np.degrees(np.linalg.norm(rotation_vector(T[:3, :3].T @ S[:3, :3])))


def turns(vectors):
    return Rotation.from_rotvec(vectors).as_matrix()


def rotation_vector(R):
    return Rotation.from_matrix(R).as_rotvec()


class TestMotionsAreFound:
    @pytest.mark.parametrize("seed", [0, *nightly(1, 2, 3)])
    def test_of_a_whole_body_sampled_anew(self, seed):
        rng = np.random.default_rng(seed)
        T = motion(rng)
        found = sm.register(lumpy(3000, rng, 0.005), moved(T, lumpy(3000, rng, 0.005)))
        assert turn_between(found.T_target_source, T) < 0.5
        assert_allclose(found.T_target_source[:3, 3], T[:3, 3], atol=0.02)
        assert not found.ambiguous
        assert found.overlap > 0.9

    def test_exactly_where_the_points_are_the_same(self):
        rng = np.random.default_rng(5)
        points, T = lumpy(2000, rng), motion(rng)
        found = sm.register(points, moved(T, points))
        assert_allclose(found.T_target_source, T, atol=1e-4)
        assert found.error < 1e-4

    @pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
    def test_of_a_part(self, seed):
        rng = np.random.default_rng(seed)
        points, T = lumpy(6000, rng), motion(rng)
        points = points[points @ rng.normal(size=3) > 0.0]
        found = sm.register(points, moved(T, lumpy(5000, rng)))
        assert turn_between(found.T_target_source, T) < 2.0
        assert found.overlap > 0.85

    @pytest.mark.parametrize("size", [1e-4, *nightly(1e5)])
    def test_in_any_unit(self, size):
        rng = np.random.default_rng(1)
        T = motion(rng)
        T[:3, 3] *= size
        found = sm.register(size * lumpy(2000, rng), moved(T, size * lumpy(2000, rng)))
        assert turn_between(found.T_target_source, T) < 0.5
        assert_allclose(found.T_target_source[:3, 3] / size, T[:3, 3] / size, atol=0.02)

    def test_the_same_every_time(self):
        rng = np.random.default_rng(2)
        a, b = lumpy(500, rng), lumpy(500, rng)
        assert np.array_equal(sm.register(a, b).T_target_source, sm.register(a, b).T_target_source)

    def test_between_kinds_of_data(self):
        rng = np.random.default_rng(3)
        mesh, T = reference.lumpy(8), motion(rng)
        cloud = sm.PointCloud(mesh.vertices, mesh.normals).transformed(T)
        for source in (mesh, mesh.triangulated()):
            assert turn_between(sm.register(source, cloud).T_target_source, T) < 0.5

    def test_points_without_normals_get_those_that_look_out(self):
        mesh = reference.lumpy(16)
        bare = oriented_points(mesh.vertices, "source")
        assert ((bare.normals * mesh.normals).sum(axis=1) > 0.7).mean() > 0.98
        rng = np.random.default_rng(3)
        T = motion(rng)
        cloud = sm.PointCloud(mesh.vertices, mesh.normals).transformed(T)
        assert turn_between(sm.register(lumpy(2000, rng), cloud).T_target_source, T) < 0.5

    def test_a_level_of_a_volume(self):
        grid = np.stack(np.meshgrid(*[np.linspace(-2, 2, 40)] * 3, indexing="ij"), axis=-1)
        blobs = ((0, 0, 0), (0.9, 0.3, 0), (-0.2, 0.8, 0.6))
        values = sum(np.exp(-((grid - c) ** 2).sum(axis=-1) / 0.3) for c in blobs)
        volume = sm.Volume(values.astype(np.float32), spacing=(0.1, 0.1, 0.1))
        turned = sm.Volume(np.ascontiguousarray(values.transpose(1, 0, 2)[::-1]).astype(np.float32), (0.1, 0.1, 0.1))
        found = sm.register(volume, turned, level=0.5)
        T = np.array([[0, -1.0, 0, 3.9], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        assert turn_between(found.T_target_source, T) < 0.5
        dark = sm.register(
            sm.Volume(-volume.values, volume.spacing),
            sm.Volume(-turned.values, turned.spacing),
            level=-0.5,
            inside="below",
        )
        assert_allclose(dark.T_target_source, found.T_target_source, atol=1e-3)

    def test_words_for_volumes_are_for_the_one_that_is_a_volume(self):
        grid = np.stack(np.meshgrid(*[np.linspace(-3, 3, 60)] * 3, indexing="ij"), axis=-1)
        values = (grid**2 / [6, 3, 1.5]).sum(axis=-1) + 0.3 * grid[..., 0] * grid[..., 1] ** 2 / 9
        volume = sm.Volume(values.astype(np.float32), (6 / 59,) * 3, (-3.0,) * 3)
        seen = oriented_points(volume, "source", level=1.0, inside="below")
        cloud = sm.PointCloud(seen.points, seen.normals).transformed(T := motion(np.random.default_rng(2)))
        picks = seen.points[[0, 900, 2000, 4000]]
        by_words = sm.register(volume, cloud, level=1.0, inside="below")
        by_pairs = sm.register(volume, cloud, level=(1.0, None), inside=("below", "above"))
        by_hand = sm.align(volume, cloud, (picks, moved(T, picks)), level=1.0, inside="below")
        for found in (by_words, by_pairs, by_hand):
            assert_allclose(found.T_target_source, T, atol=0.01)

    def test_an_array_is_a_volume_for_inside_too(self):
        grid = np.stack(np.meshgrid(*[np.linspace(-2, 2, 20)] * 3, indexing="ij"), axis=-1)
        values = (grid**2).sum(axis=-1)
        points = [
            oriented_points(data, "source", level=1.0, inside="below").points for data in (values, sm.Volume(values))
        ]
        assert_allclose(*points)


class TestHowExact:
    @pytest.mark.nightly
    def test_nearly_as_exact_as_noise_allows(self):
        """No unbiased estimate has less than the information of both surfaces' points (Cramér and Rao)."""
        rng, noise, count = np.random.default_rng(0), 0.05, 12_000
        surface = reference.lumpy(16).triangulated().sampled(20_000, rng=0)
        points, normals = surface.points - surface.points.mean(axis=0), surface.normals
        rows_ = np.hstack([np.cross(points, normals), normals])
        least = 2 * noise**2 * np.linalg.inv(rows_.T @ rows_ * (count / len(points)))
        squares = []
        for _ in range(3):
            T = motion(rng)
            found = sm.register(lumpy(count, rng, noise), moved(T, lumpy(count, rng, noise)))
            squares.append(np.radians(turn_between(found.T_target_source, T)) ** 2)
        assert np.mean(squares) < 3 * np.trace(least[:3, :3])

    def test_a_coarse_part_is_not_bent_otherwise_than_a_fine_whole(self):
        """Points brought to planes of their neighbors lie 0.01 farther inside on the coarse part; it would shift."""
        rng = np.random.default_rng(0)
        part = lumpy(2400, rng, 0.001)
        part = part[part[:, 0] > 0]
        found = sm.register(part, lumpy(16_000, rng, 0.001))
        middle = part.mean(axis=0)
        assert np.linalg.norm(moved(found.T_target_source, middle) - middle) < 0.002
        assert turn_between(found.T_target_source, np.eye(4)) < 0.15


class TestWhatIsUncertain:
    def test_an_ellipsoid_has_four_poses_and_each_fits(self):
        rng = np.random.default_rng(0)
        body = sm.ellipsoid((3, 2, 1), 16).triangulated()
        source, target = (body.sampled(3000, rng=rng).points for _ in range(2))
        found = sm.register(source, target)
        assert found.ambiguous
        assert len(found.open_motions) == 0
        equal = [pose for pose in found.poses if pose.equivalent]
        assert len(equal) == 3
        for pose in equal:
            at = moved(pose.T_target_source, source)
            assert np.abs(((at / [3, 2, 1]) ** 2).sum(axis=1) - 1).max() < 0.05

    @pytest.mark.parametrize("bores", [3, *nightly(4, 9)])
    def test_a_disc_fits_under_as_many_turns_as_it_has_bores_and_turned_over(self, bores):
        rng = np.random.default_rng(0)
        T = motion(rng)
        found = sm.register(disc(5000, bores, rng), moved(T, disc(5000, bores, rng)))
        equal = [found.T_target_source, *(pose.T_target_source for pose in found.poses if pose.equivalent)]
        assert found.ambiguous
        assert len(found.open_motions) == 0
        assert len(equal) == 2 * bores
        for pose in equal:
            turn = rotation_vector(np.linalg.inv(T[:3, :3]) @ pose[:3, :3])
            angle = np.linalg.norm(turn)
            about = np.abs(turn[2]) / max(angle, 1e-9)
            step = angle * bores / (2 * np.pi) if about > 0.5 else 0.0
            assert about > 0.999 or angle < 0.02 or (about < 0.02 and abs(angle - np.pi) < 0.02)
            assert abs(step - round(step)) < 0.02

    def test_a_ball_has_three_open_motions(self):
        rng, body = np.random.default_rng(0), sm.sphere(16).triangulated()
        found = sm.register(body.sampled(2000, rng=rng).points, body.sampled(2000, rng=rng).points)
        assert found.ambiguous
        assert len(found.open_motions) == 3

    def test_a_torus_lies_on_itself_in_every_pose_and_wherever_it_slides(self):
        rng = np.random.default_rng(0)
        body, shift = sm.torus(60, 24, radius=2.0, tube_radius=0.7).triangulated(), np.array([5.0, -3, 1])
        source = body.sampled(2000, rng=rng).points
        found = sm.register(source, body.sampled(2000, rng=rng).points + shift)
        (open_motion,) = found.open_motions
        poses = [found.T_target_source, *(pose.T_target_source for pose in found.poses if pose.equivalent)]
        assert found.ambiguous
        for pose in poses:
            for turn in (0.0, 1.0, 2.5):
                slid, length = np.eye(4), np.linalg.norm(open_motion[:3])
                slid[:3, :3] = turns(turn * open_motion[None, :3] / length)[0]
                axis = np.cross(open_motion[:3], open_motion[3:]) / length**2  # a point that stays
                slid[:3, 3] = axis - slid[:3, :3] @ axis
                at = moved(slid @ pose, source) - shift
                assert np.abs(np.hypot(np.hypot(at[:, 0], at[:, 1]) - 2, at[:, 2]) - 0.7).max() < 0.03

    def test_an_open_motion_is_the_turn_about_the_axis(self):
        rng = np.random.default_rng(0)
        shift = np.array([5.0, -3, 1])
        body = sm.ellipsoid((2, 1, 1), 16).triangulated()
        found = sm.register(body.sampled(2000, rng=rng).points, body.sampled(2000, rng=rng).points + shift)
        (open_motion,) = found.open_motions
        turn = open_motion[:3] / np.linalg.norm(open_motion[:3])
        assert abs(turn[0]) > 0.99
        assert_allclose(np.cross(open_motion[:3], shift) + open_motion[3:], 0, atol=0.1 * np.linalg.norm(open_motion))

    @pytest.mark.nightly
    def test_errors_are_as_large_as_the_covariance_says(self):
        rng = np.random.default_rng(0)
        squares = []
        for _ in range(6):
            T = motion(rng, shift=0.3)
            found = sm.register(lumpy(1500, rng, 0.01), moved(T, lumpy(1500, rng, 0.01)))
            error = T @ np.linalg.inv(found.T_target_source)
            x = np.concatenate([rotation_vector(error[:3, :3]), error[:3, 3]])
            squares.append(x @ np.linalg.solve(found.covariance, x) / 6)
        assert 0.1 < np.mean(squares) < 10

    def test_a_turn_about_a_point_leaves_it_where_it_is(self):
        rng = np.random.default_rng(0)
        point, turn = rng.normal(size=(2, 3))
        x = about_origin(point) @ np.concatenate([turn, np.zeros(3)])
        assert_allclose(np.cross(x[:3], point) + x[3:], 0, atol=1e-12)


def scored_pair(rng):
    """A body and the grid of another sample of it, as `register` scores motions of one onto the other."""
    source, target = (oriented_points(lumpy(600, rng), name) for name in ("source", "target"))
    unit = target.extent
    source, target = (each.normalized_to(each.points.mean(axis=0), unit).on_planes() for each in (source, target))
    return source_of(source, target, (source.sample(400, rng), source.sample(500, rng)), 1.0), target_grid(target)


class TestKernels:
    @given(st.integers(0, 2**32 - 1), st.integers(3, 20), st.floats(-6, 6), st.floats(0, 1))
    def test_planes_are_those_of_the_eigenvectors(self, seed, count, size, flatness):
        rng = np.random.default_rng(seed)
        points = 10.0**size * (rng.normal(size=(60, 3)) * [1, 0.7, flatness] + rng.normal(size=3))
        near = rng.integers(0, len(points), (15, count))
        near[:, 0] = np.arange(15)
        out = np.empty((15, 3)), np.empty(15), np.empty((15, 3))
        planes.fit_planes(len(near), points, near, *out)
        _, spread, smooth = reference.plane_fits(points, near)
        scale = 10.0**size
        assert_allclose(out[1], np.maximum(spread, 0), atol=1e-12 * scale**2)
        assert_allclose((out[0] ** 2).sum(axis=1), 1)
        local = points[near] - points[near].mean(axis=1, keepdims=True)
        assert_allclose((np.einsum("nka,na->nk", local, out[0]) ** 2).mean(axis=1), out[1], atol=1e-12 * scale**2)
        assert_allclose(np.einsum("na,na->n", points[near].mean(axis=1) - out[2], out[0]), 0, atol=1e-9 * scale)
        gap = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", local, local))
        sure = gap[:, 1] - gap[:, 0] > 1e-3 * gap[:, 2]
        assert_allclose(out[2][sure], smooth[sure], atol=1e-9 * scale)

    @given(st.integers(0, 2**32 - 1), st.integers(10, 40), st.floats(-6, 6))
    def test_surfaces_of_second_degree_are_those_of_least_squares(self, seed, count, size):
        rng = np.random.default_rng(seed)
        points = 10.0**size * (rng.normal(size=(60, 3)) * [1, 0.7, 0.2] + rng.normal(size=3))
        near = np.stack([rng.permutation(60)[:count] for _ in range(8)])
        normals = rng.normal(size=(8, 3)) * 0.2 + [0, 0, 1]
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        out = np.empty((2, 8, 3))
        planes.fit_quadrics(len(near), points, near, normals, *out)
        places, tilted = reference.quadrics(points, near, normals)
        assert_allclose(out[0], places, atol=1e-5 * 10.0**size)
        assert_allclose(out[1], tilted, atol=1e-4)

    def test_what_tells_no_surface_stays(self):
        points, normals = np.linspace(0, 1, 20)[:, None] * [1.0, 2, 3], np.tile([0.0, 0, 1], (20, 1))
        out = np.empty((2, 20, 3))
        planes.fit_quadrics(20, points, np.tile(np.arange(20), (20, 1)), normals, *out)
        assert_allclose(out[0], points[:1].repeat(20, axis=0))
        assert_allclose(out[1], normals)

    def test_votes_are_right_by_themselves(self):
        """Refinement hides votes that are a bin off: of a body that is only moved nearly all must be half a bin near.

        A bin is 15 degrees about the normal.
        """
        rng = np.random.default_rng(0)
        points = rng.normal(size=(60, 3))
        normals = points / np.linalg.norm(points, axis=1, keepdims=True)
        normals = normals @ turns(np.array([[0.3, 0.2, 0.1]]))[0]
        T = motion(rng)
        one = OrientedPoints(points, normals, 0.1, 0.0, points)
        other = OrientedPoints(moved(T, points), normals @ T[:3, :3].T, 0.1, 0.0, moved(T, points))
        found = pose_candidates(one, other, 4.0, rng).reshape(60, -1, 3, 4)
        at = np.einsum("rpij,nj->rpni", found[..., :3], points) + found[..., None, :, 3]
        home = np.linalg.norm(at - moved(T, points), axis=-1).min(axis=-1) < 1e-9  # the point meets its own image
        angle = np.array([[turn_between(each, T) for each in row] for row in found])
        best = np.where(home, angle, 180.0)[:, 0]  # of the peak with most votes
        assert np.mean(best < 7.6) > 0.9

    def test_scores_are_those_of_the_plain_sum(self):
        rng = np.random.default_rng(1)
        source, grid = scored_pair(rng)
        motions = motion_rows(turns(0.05 * rng.normal(size=(5, 3))), 0.01 * rng.normal(size=(5, 3)))
        width, rows = source.scoring_width(0), source.scoring_rows
        (scores,) = pose_scoring.scores([source], grid, [motions])
        for motion_, score in zip(motions.reshape(-1, 3, 4), scores, strict=True):
            at = moved(np.vstack([motion_, [0, 0, 0, 1]]), source.surface.points[rows])
            near = grid.planes[grid.nearest[tuple(((at - grid.low) / grid.cell).astype(int).T)]]
            lack = ((at - near[:, :3]) * near[:, 3:]).sum(axis=1)
            far = np.linalg.norm(at - near[:, :3], axis=1)
            alike = (source.surface.normals[rows] @ motion_[:, :3].T * near[:, 3:]).sum(axis=1)
            on = (far <= 2 * max(grid.cell, width)) & (alike > 0)
            mark = np.maximum(1 - (lack / width) ** 2, -1)
            assert score == pytest.approx(float((on * mark * alike).mean()), rel=1e-6)

    def test_noise_of_a_known_deviation_takes_a_quarter_of_the_score(self):
        rng = np.random.default_rng(7)
        flat = np.column_stack([rng.uniform(-0.5, 0.5, (3000, 2)), np.zeros(3000)])
        up, noise = np.tile([0.0, 0.0, 1.0], (3000, 1)), 0.02
        rough = flat + noise * rng.normal(size=(3000, 1)) * up
        source = pose_scoring.Source(OrientedPoints(rough, up, 0.02, noise, rough), *[np.arange(3000)] * 2, 1.0, noise)
        still = motion_rows(np.eye(3)[None], np.zeros((1, 3)))
        (score,) = pose_scoring.scores(
            [source], target_grid(OrientedPoints(flat, up, 0.02, 0.0, flat)), [still], stage=2
        )
        assert score[0] == pytest.approx(0.75, abs=0.03)

    def test_out_of_the_grid_nothing_speaks_for_a_motion_nor_against_it(self):
        """One point in the middle of two cells a side, samples there and beyond each side, all of them near."""
        steps = np.vstack([np.zeros((1, 3)), 1.2 * np.eye(3), -1.2 * np.eye(3)])
        columns = np.hstack([1 + steps, np.tile([0, 0, 1.0], (7, 1))]).T.copy()
        target = np.array([[1, 1, 1, 0, 0, 1.0]])
        grid = kernels.TargetGrid(target, np.zeros((2, 2, 2), np.int32), np.zeros(3), 1.0)
        motion_, owner, scores = motion_rows(np.eye(3)[None], np.zeros((1, 3))), np.zeros(1, np.int64), np.zeros(1)
        sources = kernels.SourceColumns(columns, np.array([0, 7]))
        kernels.score_motions(len(motion_), motion_, owner, sources, grid, np.array([5.0]), scores)
        assert scores[0] == pytest.approx(1 / 7)
        sources = kernels.SourceColumns(columns[:, [0, 3]].copy(), np.array([0, 2]))
        kernels.refine_motions(len(motion_), motion_, owner, sources, grid, np.array([[5.0]]))
        assert_allclose(motion_, motion_rows(np.eye(3)[None], np.zeros((1, 3))), atol=1e-12)

    @given(st.integers(0, 2**32 - 1), st.integers(1, 12))
    def test_motions_that_differ_are_those_of_plain_code(self, seed, most):
        rng = np.random.default_rng(seed)
        motions = motion_rows(turns(0.15 * rng.normal(size=(20, 3))), 0.1 * rng.normal(size=(20, 3)))
        kept, angle, shift = distinct(motions, most, 2.5, factor=1.4), 1.4 * SAME_ANGLE, 1.4 * 2.5 * SAME_SHIFT
        assert kept.tolist() == reference.distinct_motions(motions, most, angle, shift)

    def test_each_cell_of_a_grid_names_a_point_of_the_nearest_cell_with_points(self):
        points = lumpy(300, np.random.default_rng(3))
        grid = target_grid(oriented_points(points, "target"))
        cells = np.floor((points - grid.low) / grid.cell)
        at = np.random.default_rng(4).integers(0, grid.nearest.shape, (500, 3))
        found = np.linalg.norm(cells[grid.nearest[tuple(at.T)]] - at, axis=1)
        assert_allclose(found, np.linalg.norm(cells[:, None] - at, axis=2).min(axis=0))

    @pytest.mark.parametrize("stage", [0, 1])
    def test_many_sources_are_scored_and_refined_as_each_alone(self, stage):
        rng = np.random.default_rng(4)
        whole, grid = scored_pair(rng)
        part = whole.surface.points[:, 0] > 0
        other = replace(whole.surface, points=whole.surface.points[part], normals=whole.surface.normals[part])
        sources = [whole, pose_scoring.Source(other, np.arange(40), np.arange(0, 150, 3), 0.4, whole.noise)]
        motions = [motion_rows(turns(0.2 * rng.normal(size=(n, 3))), 0.02 * rng.normal(size=(n, 3))) for n in (7, 4)]
        scores = pose_scoring.scores(sources, grid, motions, stage=stage, every=2)
        moved_ = pose_scoring.refined(sources, grid, motions, stage=stage)
        for k, source in enumerate(sources):
            (alone,) = pose_scoring.scores([source], grid, [motions[k]], stage=stage, every=2)
            assert_allclose(scores[k], alone, rtol=1e-12)
            assert_allclose(moved_[k], pose_scoring.refined([source], grid, [motions[k]], stage=stage)[0], atol=1e-12)
            assert np.abs(moved_[k] - motions[k]).max() > 1e-3
        assert [len(each) for each in pose_scoring.scores(sources, grid, [np.zeros((0, 12)), motions[1]])] == [0, 4]

    def test_following_takes_the_steps_of_gauss_and_newton(self):
        """Each a least squares problem of its own, solved plainly."""
        rng = np.random.default_rng(2)
        source, grid = scored_pair(rng)
        motion_ = motion_rows(turns(0.1 * rng.normal(size=(1, 3))), 0.02 * rng.normal(size=(1, 3)))
        columns, step, width = source.columns(source.refining_rows), motion_.copy(), 0.08
        sources = kernels.SourceColumns(columns, np.array([0, columns.shape[1]]))
        kernels.refine_motions(len(step), step, np.zeros(1, np.int64), sources, grid, np.array([[width]]))
        plain = reference.step_to_planes(motion_[0], columns.T, grid.nearest, grid.low, grid.cell, grid.planes, width)
        assert_allclose(step[0], plain, atol=1e-9)


def test_a_verdict_is_perfect_for_the_same_surface():
    rng = np.random.default_rng(0)
    one = oriented_points(lumpy(800, rng), "source")
    evaluation = Verifier.of(one, one, one.extent, 500, rng).evaluated(np.eye(4))
    assert evaluation.score == pytest.approx(1.0)
    assert evaluation.overlap == 1.0
    assert evaluation.error == pytest.approx(0.0, abs=1e-12)


class TestBadInput:
    def test_too_few_points(self):
        with pytest.raises(ValueError, match="source must hold at least 50 points to be registered, not 20"):
            sm.register(np.random.default_rng(0).normal(size=(20, 3)), sm.sphere(8))

    def test_not_numbers(self):
        points = lumpy(500, np.random.default_rng(0))
        points[3, 1] = np.nan
        with pytest.raises(ValueError, match=r"target: points must be finite"):
            sm.register(sm.sphere(8), points)

    def test_out_of_the_range_of_numbers(self):
        points = lumpy(500, np.random.default_rng(0))
        with pytest.raises(ValueError, match=r"source must be within 1e-60 and 1e\+60 .*, not be .*e-160 long"):
            sm.register(1e-160 * points, sm.sphere(8))

    def test_all_in_one_place(self):
        with (
            pytest.warns(sm.SimplexMeshWarning, match="merged 99"),
            pytest.raises(ValueError, match="source: points must be at least 4, not 1"),
        ):
            sm.register(np.ones((100, 3)), sm.sphere(8))

    def test_on_a_line(self):
        line = np.linspace(0, 1, 100)[:, None] * [1.0, 2, 3]
        with pytest.raises(ValueError, match="source must be points on a surface"):
            sm.register(line, sm.sphere(8))

    def test_nothing_in_common(self):
        rng = np.random.default_rng(0)
        flat = np.concatenate([rng.uniform(-1, 1, size=(800, 2)), np.zeros((800, 1))], axis=1)
        with pytest.raises(ValueError, match="source and target must agree somewhere"):
            sm.register(flat, sm.torus(radius=2.0, tube_radius=0.7))

    def test_two_halves_that_hardly_overlap(self):
        points = lumpy(6000, np.random.default_rng(0))
        with pytest.warns(sm.SimplexMeshWarning, match="may be wrong") as heard:
            found = sm.register(points[points[:, 0] < 0.1], points[points[:, 0] > -0.1])
        assert 0 < found.score < 0.1
        figures = re.findall(r"[\d.]+%?", str(heard[0].message))  # those that the result shows, and the limit
        assert figures == [*re.findall(r"[\d.]+%?", repr(found))[:2], "0.1"]

    def test_closed_surfaces_that_hardly_agree_are_told(self, data_folder):
        """A mirrored femur scored above those of chance without a word; one of few vertices is no other."""
        femur = sm.read_triangles(data_folder / "femur.off")
        femur = sm.simplify(femur, 0.002 * femur.diagonal)
        mirrored = sm.TriangleMesh(femur.vertices * [-1, 1, 1], femur.faces[:, ::-1])
        with pytest.warns(
            sm.SimplexMeshWarning, match=r"score is 0\.\d\d, its overlap \d+%, and closed surfaces of one"
        ):
            assert 0.1 < sm.register(mirrored, femur).score < 0.5
        assert sm.register(sm.simplify(femur, 0.01 * femur.diagonal), femur).score < 0.5

    @pytest.mark.parametrize("count", [60, 120, 199])
    def test_that_few_points_tell_no_pose_is_told(self, count):
        """Of 60 points all poses were wrong, of 120 half of them, without a word."""
        one, other = (lumpy(count, np.random.default_rng(seed)) for seed in (0, 1))
        with pytest.warns(sm.SimplexMeshWarning, match=f"^the best pose found may be wrong: {count} points tell"):
            sm.register(one, other)
        assert sm.register(one, one + np.array([1.0, 2, 3])).error < 1e-6  # the same points tell it

    def test_other_poses_have_their_overlap(self):
        """Of an ellipsoid, whole, on three quarters of it, turned by half about the long axis or not."""
        whole = sm.ellipsoid((3, 2, 1), 16).triangulated().sampled(4000)
        part = whole.points[:, 0] < 1
        found = sm.register(whole, whole.selected(part))
        assert sum(pose.equivalent for pose in found.poses) >= 1
        assert_allclose(
            [pose.overlap for pose in (found, *found.poses)], part.mean(), atol=0.06
        )  # a little beyond its border is near too

    def test_two_known_units(self):
        with pytest.raises(ValueError, match="source and target must have one unit, not m and mm: use in_unit"):
            sm.register(*(sm.sphere(8).in_unit(unit, unit) for unit in ("m", "mm")))

    @pytest.mark.parametrize("size", [1e-3, 1e3])
    def test_two_units(self, size):
        rng = np.random.default_rng(0)
        with pytest.raises(ValueError, match="source and target must be in one unit: points of the larger are"):
            sm.register(size * lumpy(1500, rng), lumpy(1500, rng))

    def test_in_common_on_too_few_points(self, monkeypatch):
        monkeypatch.setattr(registration, "uncertainty", lambda *_: (np.full((6, 6), np.inf), float("inf")))
        with pytest.raises(ValueError, match="at least 12 points in common"):
            sm.register(*2 * [lumpy(1000, np.random.default_rng(0))])

    def test_a_signature_is_no_data(self):
        signature = sm.sai(sm.ellipsoid((3, 2, 1), 12), 5)
        with pytest.raises(TypeError, match=r"^source must be a Volume, .*, not SAI$"):
            sm.register(signature, sm.sphere(12))

    def test_no_such_file(self, tmp_path):
        with pytest.raises(OSError, match="absent"):
            sm.register(tmp_path / "absent.ply", sm.sphere(8))

    def test_level_of_what_is_no_volume(self):
        with pytest.raises(ValueError, match="source: level and label are for volumes"):
            sm.register(sm.sphere(8), sm.sphere(8), level=0.5)

    def test_levels_of_three(self):
        with pytest.raises(ValueError, match="level must be one or a pair"):
            sm.register(sm.sphere(8), sm.sphere(8), level=(1, 2, 3))


def test_opposite_normals_of_a_sheet_or_of_points_are_flipped_with_a_warning(tmp_path):
    body = reference.lumpy(16)
    whole = body.triangulated()
    sheet = whole.faces[(whole.vertices[whole.faces][:, :, 2] > 0).all(axis=1)]
    inward = sm.PointCloud(body.vertices, -body.normals)
    T = motion(np.random.default_rng(3))
    library = sm.ModelLibrary(tmp_path / "models.sml")
    library.add("body", body)
    with pytest.warns(sm.SimplexMeshWarning, match="point inwards and were flipped"):
        library.add("inward", inward)
    for data in (inward, (whole.vertices, sheet[:, ::-1])):
        with pytest.warns(sm.SimplexMeshWarning, match="source and target are opposite"):
            found = sm.register(data, moved(T, body.vertices))
        assert_allclose(found.T_target_source, T, atol=0.05)
        with pytest.warns(sm.SimplexMeshWarning, match="opposite to those of the models"):
            names = {each.name for each in library.recognize(data)}
        assert names == {"body", "inward"}
