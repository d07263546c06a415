"""Trees, plane fits and frames against the definitions."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_local_fits import fit_plane
from simplexmesh.numerics._kernels_tree import within
from simplexmesh.numerics.kd_tree import kd_tree, nearest
from simplexmesh.numerics.plane_fits import planes, sided, spacing_of


def test_planes_of_one_side_are_those_of_a_wall():
    """A wall thinner than the neighborhoods, seen by normals 30 degrees off."""
    rng, n = np.random.default_rng(0), 2000
    outward = np.repeat([[0, 0, 1.0], [0, 0, -1.0]], n // 2, axis=0)
    points = np.column_stack([rng.random((n, 2)), 0.05 * (outward[:, 2] > 0)])
    turn = rng.uniform(0, 2 * np.pi, n)
    rough = np.cos(0.5) * outward + np.sin(0.5) * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    found = planes(points)
    assert (np.abs(found.normals[:, 2]) < 0.99).mean() > 0.1
    np.testing.assert_allclose(sided(points, rough, found.near), outward, atol=1e-9)


def test_a_point_alone_on_its_side_keeps_its_normal():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, 0.1]])
    normals = np.array([[0, 0, 1.0]] * 4 + [[0, 0, -1.0]])
    np.testing.assert_array_equal(sided(corners, normals, cKDTree(corners).query(corners, 5)[1]), normals)


def test_points_of_no_plane_keep_their_normals():
    """Points on a line, one of them in forty places at once, and rough normals."""
    points = np.concatenate([np.zeros((40, 3)), np.arange(1, 41)[:, None] * [1.0, 2, 3]])
    normals = np.tile([0.0, 0, 1], (80, 1))
    np.testing.assert_array_equal(sided(points, normals, planes(points).near), normals)
    np.testing.assert_array_equal(sided(points[:1], normals[:1], np.zeros((1, 1), np.int64)), normals[:1])


@given(seed=st.integers(0, 10_000), n=st.integers(1, 300), k=st.integers(1, 9), copies=st.booleans())
def test_tree_finds_the_nearest(seed, n, k, copies):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 6, (n, 3)).astype(float) if copies else rng.normal(size=(n, 3))
    k = min(k, n)
    queries = rng.normal(size=(20, 3)) * 3
    distance, index = nearest(kd_tree(points), queries, k)
    expected = np.sort(np.linalg.norm(points[None] - queries[:, None], axis=2), axis=1)[:, :k]
    np.testing.assert_allclose(distance, expected, atol=1e-12)
    assert all(len(set(row)) == k for row in index)


@given(seed=st.integers(0, 10_000), n=st.integers(1, 300), radius=st.sampled_from([0.0, 0.4, 2.0, 9.0]))
def test_tree_finds_all_within_a_radius_or_every_third(seed, n, radius):
    rng = np.random.default_rng(seed)
    tree, place, found = kd_tree(rng.normal(size=(n, 3))), rng.normal(size=3), np.full(n, -1)
    expected = np.flatnonzero(np.linalg.norm(tree.points - place, axis=1) <= radius)
    assert within(tree, tuple(place), radius, 1, found) == len(expected)
    np.testing.assert_array_equal(np.sort(found[: len(expected)]), expected)
    some = np.full(n, -1)
    within(tree, tuple(place), radius, 3, some)
    np.testing.assert_array_equal(some[: -(-len(expected) // 3)], found[: len(expected) : 3])


@given(seed=st.integers(0, 10_000), n=st.integers(4, 60), radius=st.sampled_from([0.7, 3.0, np.inf]))
def test_a_plane_has_the_principal_axes_of_weighted_moments(seed, n, radius):
    rng = np.random.default_rng(seed)
    points, place, normal = rng.normal(size=(n, 3)) * [1, 0.6, 0.2] + 5, 5 + 0.1 * rng.normal(size=3), np.zeros(3)
    middle, moments = fit_plane(points, np.arange(n), tuple(place), radius, normal)
    d = points - place
    w = np.maximum(1 - (d**2).sum(axis=1) / radius**2, 0.02)
    expected = np.average(d, weights=w, axis=0)
    values, axes = np.linalg.eigh(np.cov(d.T, aweights=w, ddof=0))
    np.testing.assert_allclose(middle, expected, atol=1e-12)
    np.testing.assert_allclose(moments, values, atol=1e-12)
    np.testing.assert_allclose(abs(axes[:, 0] @ normal), 1)


@given(st.integers(0, 10_000))
def test_tangents_complete_a_right_handed_frame(seed):
    n = np.random.default_rng(seed).normal(size=3)
    n /= np.linalg.norm(n)
    u, v = np.reshape(tangents(*n), (2, 3))
    np.testing.assert_allclose(np.stack([u, v, n]) @ np.stack([u, v, n]).T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.cross(u, v), n, atol=1e-14)


def test_planes_tell_spacing_and_noise():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.uniform(-1, 1, (4000, 2)), np.zeros(4000)])
    assert abs(planes(flat).spacing / np.sqrt(4 / 4000) - 1) < 0.1
    assert abs(spacing_of(cKDTree(flat)) / np.sqrt(4 / 4000) - 1) < 0.1
    found = planes(flat + [0, 0, 0.003] * rng.normal(size=(4000, 1)))
    assert abs(found.noise / 0.003 - 1) < 0.15
    assert (abs(found.normals[:, 2]) > 0.8).mean() > 0.9
