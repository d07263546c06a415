"""The nearest surfel that faces a vertex equals that of an exhaustive search, whatever is cached."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplexmesh.data.points import PointCloud
from simplexmesh.motion.targets import _kernels_nearest, _kernels_wide
from simplexmesh.motion.targets import _kernels_simd as simd
from simplexmesh.motion.targets._kernels_pointers import data_pointer, stack_floats, stack_integers
from simplexmesh.motion.targets.points import Points
from simplexmesh.motion.targets.surfels import _assembled
from tests import reference_targets as naive
from tests.test_targets_points import noisy_torus, sphere_points, torus_points

NONE, NEAREST, CAPACITY = _kernels_nearest.NONE, _kernels_wide.NEAREST, _kernels_wide.CAPACITY


# ---- kernels against their twins


@numba.njit
def eight_at_once(values, number, out):
    """Fill `out` (5, 8) with SIMD operations on ``values[:8]``, ``values[8:]`` and a number, and return bit masks."""
    one, two = simd.load(data_pointer(values), 0), simd.load(data_pointer(values), 8)
    simd.store(data_pointer(out), 0, one + two)
    simd.store(data_pointer(out), 8, number - two)
    simd.store(data_pointer(out), 16, one * number)
    simd.store(data_pointer(out), 24, simd.maximum(one, two))
    simd.store(data_pointer(out), 32, simd.maximum(one, number))
    mask = simd.less_equal(one, number)
    return mask, simd.less(one, number), simd.trailing_zeros(mask), simd.population_count(mask)


@given(values=st.lists(st.sampled_from([-1.0, 0.0, 0.5, 2.0, np.inf, np.nan]), min_size=16, max_size=16))
@settings(deadline=None, max_examples=40)
def test_vectors_are_eight_numbers(values):
    values, out = np.array(values), np.zeros((5, 8))
    one, two = values[:8], values[8:]
    mask, below, first, count = eight_at_once(values, 0.5, out)
    expected = [one + two, 0.5 - two, 0.5 * one, np.where(one > two, one, two), np.where(one > 0.5, one, 0.5)]
    np.testing.assert_array_equal(out, expected)
    assert mask == ((one <= 0.5) << np.arange(8)).sum()
    assert below == ((one < 0.5) << np.arange(8)).sum()
    assert first == (np.argmax(one <= 0.5) if mask else 64)
    assert count == (one <= 0.5).sum()


@given(values=st.lists(st.integers(0, 50), max_size=_kernels_wide.TRIM_FROM + 8))
@settings(deadline=None, max_examples=60)
def test_the_nearest_are_kept_in_order(values):
    n = len(values)
    candidates, distances = np.zeros(CAPACITY, np.int64), np.zeros(CAPACITY)
    candidates[:n], distances[:n] = np.arange(n), values
    count, following = sort_candidates(candidates, distances, n)
    assert count == min(n, NEAREST)
    np.testing.assert_array_equal(distances[:count], sorted(values)[:count])
    np.testing.assert_array_equal(np.array(values)[candidates[:count]], distances[:count])
    assert len(set(candidates[:count])) == count
    assert following == (sorted(values)[count] if n > count else np.inf)


@numba.njit
def sort_candidates(candidates, distances, count):
    return _kernels_wide.keep_nearest(data_pointer(candidates), data_pointer(distances), count)


@numba.njit
def search_from(place, normal, tree, fold, limit, found, list_limit, listed):
    nodes, leaves, first, slack, inner, base = tree
    pointers = data_pointer(nodes), data_pointer(leaves), data_pointer(first), data_pointer(slack), inner, base
    candidates, distances = stack_integers(CAPACITY), stack_floats(CAPACITY)
    found, squared, count, bound = _kernels_wide.search(
        pointers, *place, *normal, fold, naive_facing, naive_loose, limit, found, list_limit, candidates, distances
    )
    for k in range(count):
        listed[k] = candidates[k]
    return found, squared, count, bound


naive_facing, naive_loose = naive.FACING, naive.FACING - naive.TURN


def check_search(s, place, normal, reach, list_limit):
    """Check a search without a known candidate: the nearest surfel, the sorted candidates, the bound of all others."""
    listed = np.zeros(NEAREST, np.int64)
    found, _, count, bound = search_from(
        tuple(place), tuple(normal), s.wide_tree, 1.0 if s.oriented else -1.0, reach**2, NONE, list_limit, listed
    )
    at = naive.nearest_facing(s.table, place, normal, s.oriented, reach)
    assert found == (at if at >= 0 else NONE)
    squared = ((s.table[:, :3] - place) ** 2).sum(axis=1)
    around = naive.around(s.table, place, normal, s.oriented, np.inf)
    np.testing.assert_array_equal(listed[:count], around[:count])
    assert count <= NEAREST
    if count < len(around):
        assert bound <= squared[around[count]] * (1 + 1e-12)
    slack = list_limit if at < 0 else squared[at] + s.wide_tree[3].min()
    assert count >= min(
        NEAREST, len(naive.around(s.table, place, normal, s.oriented, min(list_limit, slack) * (1 - 1e-12)))
    )


@given(
    seed=st.integers(0, 10_000),
    oriented=st.booleans(),
    n=st.sampled_from([3, 9, 40, 400, 1500]),
    list_limit=st.sampled_from([0.0, 0.05, 1.0, 1e300]),
)
@settings(deadline=None, max_examples=40)
def test_search_finds_the_nearest_and_the_candidates_around_it(seed, oriented, n, list_limit):
    rng = np.random.default_rng(seed)
    table = np.zeros((n, 12))
    table[:, :3], table[:, 3:6] = torus_points(n, rng)
    table[rng.random(n) < 0.1, 3:6] = 0.0  # no direction is known there
    s = _assembled(table, np.ones(n), np.ones(n), oriented=oriented)
    for _ in range(20):
        check_search(s, rng.uniform(-1.4, 1.4, 3), sphere_points(1, rng)[0], rng.uniform(0.05, 1.5), list_limit)


def test_search_among_many_alike():
    # from the center of a sphere all surfels are as far; half of them almost face the right way, and are a bit nearer
    rng = np.random.default_rng(6)
    table = np.zeros((1500, 12))
    facing = rng.random(1500) < 0.5
    table[:, :3] = sphere_points(1500, rng) * (1 + 0.01 * facing + 1e-3 * rng.random(1500))[:, None]
    cosine = np.where(facing, 0.5, 0.1)
    table[:, 3:6] = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine], axis=1)
    s = _assembled(table, np.ones(1500), np.ones(1500), oriented=True)
    for place in 1e-3 * sphere_points(50, rng):
        check_search(s, place, np.array([0, 0, 1.0]), 2.0, 4.0)


# ---- vertices in motion


@given(
    seed=st.integers(0, 10_000),
    oriented=st.booleans(),
    step=st.sampled_from([0.0, 0.003, 0.02, 0.1]),
    turn=st.sampled_from([0.0, 0.05, 1.0]),
    reach=st.sampled_from([0.1, 0.4, np.inf]),
)
@settings(deadline=None, max_examples=25)
def test_cached_answers_for_moving_vertices_equal_those_of_a_search(seed, oriented, step, turn, reach):
    # the second sheet faces the other way, now and then it is the nearer one
    rng = np.random.default_rng(seed)
    points, normals = torus_points(600, rng)
    inner, inward = torus_points(300, rng, r=0.3)
    cloud = PointCloud(np.concatenate([points, inner]), np.concatenate([normals, -inward]) if oriented else None)
    target = Points(cloud)
    places, directions = torus_points(60, rng)
    places = places + rng.uniform(-0.3, 0.6, (60, 1)) * directions
    for _ in range(6):
        warm = target.gap(places, directions, reach)
        fresh = Points.__new__(Points)
        fresh._initialize(target.surfels, target.center)
        np.testing.assert_array_equal(warm, fresh.gap(places, directions, reach))
        places = places + step * rng.normal(size=places.shape)
        directions = directions + turn * rng.normal(size=places.shape)
        directions = directions / np.linalg.norm(directions, axis=1)[:, None]


def test_the_answer_does_not_depend_on_the_calls_before():
    points = noisy_torus(0.005, 9, n=6000)
    warm = Points(points)
    rng = np.random.default_rng(10)
    places, normals = torus_points(3000, rng)
    for step in (0.2, 0.1, 0.05, 0.01, 0.0):
        moved = places + step * rng.normal(size=places.shape)
        warm_gap = warm.gap(moved, normals, 0.25)
        np.testing.assert_array_equal(warm_gap, Points(points).gap(moved, normals, 0.25))
        assert np.isfinite(warm_gap).any()
    fewer = places[::7]
    np.testing.assert_array_equal(warm.gap(fewer, normals[::7], 0.25), Points(points).gap(fewer, normals[::7], 0.25))


@pytest.mark.parametrize("reach", [0.5, np.inf])
def test_where_nothing_faces_a_vertex_there_is_no_gap_and_the_cache_stays_valid(reach):
    points, normals = torus_points(2000, np.random.default_rng(2))
    target = Points(PointCloud(points[points[:, 2] > 0.2], normals[points[:, 2] > 0.2]))
    places, down = np.zeros((5, 3)), np.tile([0.0, 0.0, -1.0], (5, 1))
    for _ in range(2):
        assert np.isnan(target.gap(places, down, reach)).all()
        listed = target._cache[1]
        assert ((listed >= 0) & (listed < len(target.surfels))).all()  # a kernel reads there unchecked


@pytest.mark.parametrize("reach", [0.5, np.inf])
def test_right_above_data_that_faces_another_way_there_is_no_gap(reach):
    rng = np.random.default_rng(0)
    square = np.column_stack([rng.uniform(-1, 1, (300, 2)), np.zeros(300)])
    target = Points(PointCloud(square, np.tile([0.0, 0.0, 1.0], (300, 1))))
    places = np.column_stack([rng.uniform(-0.8, 0.8, (200, 2)), rng.uniform(-0.2, 0.2, 200)])
    for direction in ([0.0, 0.0, -1.0], [0.1, 0.2, -0.97], [0.6, 0.8, 0.0]):
        assert np.isnan(target.gap(places, np.tile(direction, (200, 1)), reach)).all()


@pytest.mark.parametrize("n", [5, 9, 2000])  # one leaf, two, many: the fewer, the more places in the tree are empty
@pytest.mark.parametrize("columns", [slice(1, 2), slice(None)], ids=["y", "xyz"])
@pytest.mark.parametrize("broken", [np.nan, np.inf, 1e200, 1e300])
def test_vertices_that_are_not_finite_have_no_gap_and_do_not_affect_others(broken, columns, n):
    rng = np.random.default_rng(2)
    target, fresh = (Points(torus_points(n, np.random.default_rng(1))[0]) for _ in range(2))
    places, normals = torus_points(50, rng)
    wrong = places.copy()
    wrong[::7, columns] = broken
    for reach in (0.3, np.inf):
        gap = target.gap(wrong, normals, reach)
        assert not np.isfinite(gap[::7]).any()
        np.testing.assert_array_equal(
            np.delete(gap, np.s_[::7]), np.delete(fresh.gap(places, normals, reach), np.s_[::7])
        )
        listed = target._cache[1]
        assert ((listed >= 0) & (listed < len(target.surfels))).all()  # a kernel reads there unchecked
        np.testing.assert_array_equal(target.gap(places, normals, reach), fresh.gap(places, normals, reach))
        mixed = rng.permutation(50)
        np.testing.assert_array_equal(
            target.gap(places[mixed], normals[mixed], reach), fresh.gap(places, normals, reach)[mixed]
        )


@pytest.mark.parametrize("oriented", [False, True])
def test_vertices_that_remain_when_a_mesh_is_edited_keep_their_cache(oriented):
    rng = np.random.default_rng(3)
    target = Points(PointCloud(*torus_points(3000, rng)) if oriented else torus_points(3000, rng)[0])
    places, normals = torus_points(600, rng)
    places = places + 0.05 * normals
    target.gap(places, normals, 0.3)
    new, outward = torus_points(200, rng)
    stays = rng.random(600) < 0.7
    for some, directions, same in (
        (np.concatenate([places, new]), np.concatenate([normals, outward]), np.arange(600)),
        (places[stays], normals[stays], np.flatnonzero(stays)),
    ):
        before, listed = (part.copy() for part in target._cache)
        state = _kernels_nearest.empty_cache(len(some))
        s = target.surfels
        surfels = s.tree.points, s.heads, s.oriented
        _kernels_nearest.transfer_cache(some, directions, target.center, 1.0, *surfels, target._cache, state)
        np.testing.assert_array_equal(state[0][: len(same)], before[same])
        np.testing.assert_array_equal(state[1][: len(same)], listed[same])
        gap = target.gap(some, directions, 0.3)
        fresh = Points.__new__(Points)
        fresh._initialize(s, target.center)
        np.testing.assert_array_equal(gap, fresh.gap(some, directions, 0.3))
        target.gap(places, normals, 0.3)
