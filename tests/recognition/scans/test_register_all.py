"""Several scans get the poses they were taken from: in any order, in groups, with what fits nowhere named."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.recognition.scans import pose_graph
from simplexmesh.recognition.scans.pose_graph import motions, optimized
from simplexmesh.recognition.scans.register_all import names_of
from simplexmesh.recognition.scans.scan_pairs import Measured, Scan, contact
from tests.nightly.marks import nightly
from tests.recognition import reference as reference

BUNNY = ("000", "045", "090", "180", "270", "315")


def views(count, rng, seed=0, noise=0.002, body=None, samples=8000):
    """What is seen of a body, or a lumpy one, from around, each view in its own frame, and T_body_scan of each."""
    cloud = (body or reference.lumpy(16, seed)).triangulated().sampled(samples, rng=rng)
    scans, poses = [], []
    for angle in 2 * np.pi * np.arange(count) / count:
        facing = cloud.normals @ [np.cos(angle), np.sin(angle), 0.3] > 0.1
        points = cloud.points[facing] + noise * rng.normal(size=(facing.sum(), 3))
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = reference.random_rotation(rng), rng.normal(size=3)
        scans.append((points - T[:3, 3]) @ T[:3, :3])
        poses.append(T)
    return scans, np.array(poses)


def off(found, poses, group):
    """Angles in degrees and shifts between poses found and true ones, both in the frame of the group's first scan."""
    errors = [np.linalg.solve(poses[group[0]], poses[k]) @ np.linalg.inv(found.poses[k]) for k in group]
    return np.array(
        [[np.degrees(Rotation.from_matrix(E[:3, :3]).magnitude()), np.linalg.norm(E[:3, 3])] for E in errors]
    ).T


def measured(T, deviation=0.01):
    return Measured(T, deviation**2 * np.eye(6), 0.0, 0.5, 1.0)


class TestPoses:
    def test_of_views_around_a_body_in_any_order(self):
        rng = np.random.default_rng(3)
        scans, poses = views(5, rng)
        order = [2, 0, 4, 1, 3]
        found = sm.register_all([scans[k] for k in order])
        assert found.groups == ((0, 1, 2, 3, 4),)
        assert found.alone == found.doubtful == ()
        angles, shifts = off(found, poses[order], range(5))
        assert angles.max() < 0.5
        assert shifts.max() < 0.03  # of a body 4 in diameter
        np.testing.assert_array_equal(found.poses[0], np.eye(4))
        assert len(found.residuals) == len(found.edges)
        assert found.residuals[[edge.accepted for edge in found.edges]].max() < 0.03
        assert (found.covariance[0] == 0).all()
        assert (np.linalg.eigvalsh(found.covariance[1:]) > 0).all()

    @pytest.mark.nightly
    def test_in_any_unit(self):
        scans, poses = views(3, np.random.default_rng(4))
        poses[:, :3, 3] *= 1000
        found = sm.register_all([1000 * scan for scan in scans])
        angles, shifts = off(found, poses, range(3))
        assert angles.max() < 0.5
        assert shifts.max() < 30

    @pytest.mark.nightly
    def test_do_not_depend_on_which_way_normals_point(self):
        """Scans of which some are inside out; at once, or where it takes a second look."""
        scans, poses = views(4, np.random.default_rng(6))
        clouds = [sm.PointCloud(scan, sm.vertex_normals(scan)) for scan in scans]
        for k in (0, 2, 3):
            clouds[k] = replace(clouds[k], normals=-clouds[k].normals)
        with pytest.warns(sm.SimplexMeshWarning, match=r"were turned over: scans\[1\]$"):
            found = sm.register_all(clouds)
        assert found.groups == ((0, 1, 2, 3),)
        assert found.flipped == (1,)
        assert off(found, poses, range(4))[0].max() < 0.5

    @pytest.mark.nightly
    def test_normals_that_nobody_gave_are_not_told_to_be_turned_over(self):
        scans, poses = views(3, np.random.default_rng(6))
        inward = [sm.PointCloud(scan, -sm.vertex_normals(scan)) for scan in scans]
        found = sm.register_all([inward[0], scans[1], inward[2]])
        assert found.groups == ((0, 1, 2),)
        assert found.flipped == ()
        assert off(found, poses, range(3))[0].max() < 0.5

    def test_of_scans_whose_outside_is_not_plain(self):
        """Half a bowl and all of it: the normals of both are taken for inward, of one rightly."""
        rng = np.random.default_rng(2)
        bowl = reference.lumpy(16).triangulated().sampled(9000, rng=rng)
        part, whole = bowl.selected(bowl.points[:, 2] < 0), bowl.selected(bowl.points[:, 2] < 0.6)
        T = np.eye(4)
        T[:3, :3] = reference.random_rotation(rng)
        with pytest.warns(sm.SimplexMeshWarning, match="were turned over"):
            found = sm.register_all([replace(part, normals=-part.normals).transformed(T), whole])
        assert off(found, np.array([np.linalg.inv(T), np.eye(4)]), range(2))[0].max() < 0.5

    def test_of_a_small_piece_of_a_large_scan_touch_in_both_orders(self):
        rng = np.random.default_rng(9)
        body = reference.lumpy(16).triangulated()
        whole, dense = body.sampled(6000, rng=rng).points, body.sampled(40_000, rng=rng).points
        piece = dense[np.linalg.norm(dense - dense[5], axis=1) < 0.12 * body.diagonal]
        one, other = Scan.all_of([whole, piece], ("whole", "piece"))
        T = np.eye(4)
        T[:3, 3] = (one.center - other.center) / one.unit
        assert one.surface.area > 20 * other.surface.area
        assert min(contact(one, other, T)) > 0.8
        assert contact(one, other, T) == contact(other, one, np.linalg.inv(T))

    @pytest.mark.parametrize("count", [300, 900, 5000])
    def test_near_is_what_is_in_common_and_agrees_however_sparse(self, count):
        """Points beyond the border of the other scan counted as near to it and off it."""
        rng = np.random.default_rng(count)
        body = sm.ellipsoid((1, 0.5, 0.4), 20).triangulated()
        one, other = (body.sampled(count, rng=rng).points for _ in range(2))
        one, other = one[one[:, 0] < 0.3], other[other[:, 0] > -0.3]
        common = min(np.mean(one[:, 0] > -0.3), np.mean(other[:, 0] < 0.3))
        first, second = Scan.all_of([one, other], ("one", "other"))
        T = np.eye(4)
        T[:3, 3] = (first.center - second.center) / first.unit
        for wider in (1.0, 2.0):
            near, agreement = contact(first, second, T, wider=wider)
            assert near == pytest.approx(common, abs=0.15)
            assert agreement > 0.97

    def test_what_is_sparse_is_near_too(self):
        """Two scans of a sheet, each of which is the sparser the nearer it comes to the middle of the other."""
        rng, both = np.random.default_rng(0), []
        for side in (1, -1):
            x, y = 3 * rng.uniform(size=6000) ** 3 - 2.25, rng.uniform(-1, 1, 6000)
            both.append(np.column_stack([side * x, y, -0.15 * x**2 - 0.2 * y**2]))
        common = np.mean(both[0][:, 0] > -0.75)
        first, second = Scan.all_of(both, ("one", "other"))
        T = np.eye(4)
        T[:3, 3] = (first.center - second.center) / first.unit
        near, agreement = contact(first, second, T)
        assert near == pytest.approx(common, abs=0.04)
        assert agreement > 0.97

    @pytest.mark.parametrize("body", [sm.ellipsoid((3, 2, 1), 20), *nightly(sm.torus(radius=2.0, tube_radius=0.5))])
    def test_of_symmetric_scans_are_told_to_be_one_of_several(self, body):
        at = body.vertices
        turned = at @ reference.random_rotation(np.random.default_rng(0))
        with pytest.warns(sm.SimplexMeshWarning, match=r"about as well in other ones: scans\[0\], scans\[1\]$"):
            found = sm.register_all([at[at[:, 2] > -0.3], turned[at[:, 2] < 0.3]])
        assert {(e.source, e.target) for e in found.edges if e.ambiguous} == {(0, 1), (1, 0)}
        assert any("ambiguous" in repr(edge) for edge in found.edges)
        assert found.doubtful == (0, 1)

    @pytest.mark.nightly
    def test_of_a_nearly_symmetric_body_are_right_or_told_to_be_doubtful(self, recwarn):
        """An ellipsoid with a low bump that some of the views see, so that its half turns are no symmetries."""
        body = sm.ellipsoid((3, 2, 1.3), 20)
        bump = 0.04 * np.exp(-((body.vertices - [0, 1.4, 0.9]) ** 2).sum(axis=1) / 0.15)
        bumpy = body.moved(body.vertices + bump[:, None] * body.normals)
        scans, poses = views(6, np.random.default_rng(3), body=bumpy, samples=16_000)
        found = sm.register_all(scans)
        told = [str(each.message) for each in recwarn if "poses may be wrong" in str(each.message)]
        right = off(found, poses, range(6))[0].max() < 1  # of one group
        assert right == (not told)
        assert bool(found.doubtful) == bool(told)

    @pytest.mark.nightly
    def test_two_bodies_are_two_groups_and_what_fits_nowhere_is_named(self):
        rng = np.random.default_rng(5)
        (a, true_a), (b, true_b) = views(6, rng), views(6, rng, seed=7)
        stray = sm.torus(radius=2.0, tube_radius=0.5).triangulated().sampled(3000, rng=rng).points
        with pytest.warns(sm.SimplexMeshWarning) as told:
            found = sm.register_all([a[0], b[0], stray, a[1], b[1]])
        assert found.groups == ((0, 3), (1, 4), (2,))
        assert [str(each.message) for each in told] == [
            "the scans form 2 groups that do not fit each other: scans[0], scans[3]; scans[1], scans[4]",
            "scans that fit none of the others have no pose among them: scans[2]",
        ]
        for places, true in (((0, 3), true_a), ((1, 4), true_b)):
            pair = np.empty((5, 4, 4))
            pair[list(places)] = true[:2]
            assert off(found, pair, places)[0].max() < 0.5
        assert "scans[2] alone" in repr(found)

    @pytest.mark.nightly
    def test_of_the_bunny(self, data_folder):
        known = sm.read_poses(data_folder / "bun.conf")
        names = [f"bun{angle}.ply" for angle in BUNNY]
        found = sm.register_all([data_folder / name for name in names])
        assert found.names == tuple(names)
        assert found.groups == ((0, 1, 2, 3, 4, 5),)
        true, ours = np.array([known[name] for name in names])[:, :3, :3], found.poses[:, :3, :3]
        u, _, v = np.linalg.svd((true @ np.swapaxes(ours, 1, 2)).sum(axis=0))
        common = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
        assert (
            max(np.degrees(Rotation.from_matrix(R.T @ common @ S).magnitude()) for R, S in zip(true, ours, strict=True))
            < 0.3
        )


class TestPoseGraph:
    def circle(self, count, rng):
        """Poses on a circle, and those measured between all pairs of them, exactly."""
        true = motions(rng.normal(size=(count, 6)))
        true[0] = np.eye(4)
        pairs = list(combinations(range(count), 2))
        return true, pairs, [np.linalg.solve(true[j], true[i]) for i, j in pairs]

    def test_exact_pairs_give_exact_poses(self):
        rng = np.random.default_rng(0)
        true, pairs, between = self.circle(5, rng)
        near = motions(0.05 * rng.normal(size=(5, 6))) @ true
        near[0] = np.eye(4)
        found, _ = optimized(near, pairs, [measured(T) for T in between], 1.0)
        np.testing.assert_allclose(found, true, atol=1e-5)

    def test_scans_of_one_exact_plane_have_poses_that_may_be_wrong(self):
        """No distance remains between them, so that their pose has a covariance of zero."""
        wall = np.append(np.random.default_rng(0).uniform(0, [3, 2], (2000, 2)), np.zeros((2000, 1)), axis=1)
        for unit in (1e-6, 1.0, 1e6):
            with pytest.warns(sm.SimplexMeshWarning, match=r"poses may be wrong, .*: scans\[0\], scans\[1\]$"):
                found = sm.register_all([unit * wall, unit * (wall + np.array([0.2, 0, 0]))])
            assert np.abs(found.poses[:, 2, 3]).max() < 1e-9 * unit
            assert np.isfinite(found.covariance).all()

    def test_derivatives_are_those_of_the_residuals(self, monkeypatch):
        """Near poses that fit exactly, against differences."""
        rng = np.random.default_rng(4)
        true, pairs, between = self.circle(4, rng)
        seen = {}

        def watched(residuals, start, jacobian, **_):
            x = np.zeros_like(start)
            steps = 1e-6 * np.eye(len(x))
            seen["differences"] = np.stack([(residuals(x + s) - residuals(x - s)) / 2e-6 for s in steps], axis=1)
            seen["derivatives"] = jacobian(x)
            return least_squares(residuals, start, jacobian)

        monkeypatch.setattr(pose_graph, "least_squares", watched)
        optimized(true, pairs, [measured(T, 0.5) for T in between], 1.0)
        np.testing.assert_allclose(seen["derivatives"], seen["differences"], atol=1e-6)

    def test_a_pair_that_contradicts_the_others_counts_little(self):
        rng = np.random.default_rng(1)
        true, pairs, between = self.circle(6, rng)
        wrong = list(between)
        wrong[3] = motions(np.array([[0.0, 0, 1.5, 1, 0, 0]]))[0] @ wrong[3]
        found, _ = optimized(true, pairs, [measured(T) for T in wrong], 1.0)
        np.testing.assert_allclose(found, true, atol=0.01)  # a mean would be off by a tenth of the 1.5

    def test_errors_are_spread_over_a_ring_by_the_weight_of_each_pair(self):
        pairs = [(1, 0), (2, 1), (0, 2)]
        shift = motions(np.array([[0.0, 0, 0, 0.003, 0, 0]]))[0]
        weights = [measured(shift), measured(np.eye(4)), measured(np.eye(4), 0.02)]
        found, covariances = optimized(np.tile(np.eye(4), (3, 1, 1)), pairs, weights, 1.0)
        # variances 1, 1 and 4 share the 0.003 by which the ring does not close
        np.testing.assert_allclose(found[:, 0, 3], [0, 0.0025, 0.0020], atol=2e-5)
        assert covariances[2][3, 3] > covariances[1][3, 3] > 0

    def test_a_pose_between_pairs_that_contradict_is_uncertain(self):
        shift = motions(np.array([[0.0, 0, 0, 0.4, 0, 0]]))[0]
        pairs = [(1, 0), (1, 0), (2, 0)]
        sure, _ = optimized(np.tile(np.eye(4), (3, 1, 1)), pairs, [measured(np.eye(4))] * 3, 1.0)
        _, covariances = optimized(
            np.tile(np.eye(4), (3, 1, 1)), pairs, [measured(np.eye(4)), measured(shift), measured(np.eye(4))], 1.0
        )
        np.testing.assert_allclose(sure, np.tile(np.eye(4), (3, 1, 1)), atol=1e-6)
        assert covariances[1, 3, 3] > 4 * 0.01**2  # of one pair alone 1
        assert (np.linalg.eigvalsh(covariances[1:]) > 0).all()


def test_files_of_one_name_in_several_folders_are_told_apart():
    paths = [Path("a", "scan.ply"), Path("b", "scan.ply"), "other.ply", np.zeros((9, 3))]
    assert names_of(paths) == (str(paths[0]), str(paths[1]), "other.ply", "scans[3]")


class TestBadInput:
    @pytest.mark.parametrize(
        ("scans", "kind", "said"),
        [
            ([np.zeros((99, 3))], ValueError, "scans must be at least 2, not 1"),
            (np.zeros((99, 3)), TypeError, "scans must be a list of scans, not ndarray"),
            ([sm.sphere(12), sm.sphere(4).vertices[:20]], ValueError, r"scans\[1\] must hold at least 50 points"),
            ([sm.sphere(12), sm.sphere(12, radius=0.001)], ValueError, r"in one unit: scans\[1\] has an extent of"),
            ([sm.sphere(8).in_unit(u, u) for u in ("mm", "m")], ValueError, "one unit, not m and mm: use in_unit"),
        ],
    )
    def test_gets_one_sentence(self, scans, kind, said):
        with pytest.raises(kind, match=said):
            sm.register_all(scans)
