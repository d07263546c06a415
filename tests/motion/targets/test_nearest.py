"""The nearest surfel that faces a vertex equals that of an exhaustive search, whatever is cached."""

from copy import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplexmesh.data.points import PointCloud
from simplexmesh.motion.targets.points import Points
from simplexmesh.motion.targets.surfels import _kernels_gaps
from simplexmesh.motion.targets.surfels.surfels import assembled
from tests.motion.targets import reference as naive
from tests.motion.targets.test_points import noisy_torus, sphere_points, torus_points

# ---- searches


def check_search(s, place, normal, reach):
    """Check a search without a known candidate: the nearest surfel, the sorted list, the bound of all others."""
    cache, query = _kernels_gaps.empty_cache(1), (tuple(place), tuple(normal), reach)
    found = _kernels_gaps.nearest_searched(s, cache, 0, query)
    assert found == naive.nearest_facing(s.table, place, normal, s.oriented, reach)
    squared, bound = ((s.table[:, :3] - place) ** 2).sum(axis=1), cache.known[0, 6] ** 2
    known = _kernels_gaps.nearest_cached(s.points, s.heads, s.oriented, cache.known, cache.listed, 0, query)
    nearest = squared[found] if found in cache.listed else reach**2  # 16 nearer ones may almost face the right way
    assert known == (found if nearest < bound * (1 - 2e-12) else _kernels_gaps.STALE)
    around = naive.around(s.table, place, normal, s.oriented, 4 * reach**2)
    count = min(np.count_nonzero(squared[around] < bound * (1 - 1e-12)), _kernels_gaps.NEAREST)
    np.testing.assert_array_equal(cache.listed[0, :count], around[:count])
    if count < len(around):
        assert bound <= squared[around[count]] * (1 + 1e-12)
    if count < _kernels_gaps.NEAREST - 1:  # fewer are listed only where the others are far
        slack = squared[found] + 2 * s.heads[:, 6].min() ** 2 if found >= 0 else np.inf
        assert bound >= min(4 * reach**2, slack) * (1 - 1e-12)


@given(seed=st.integers(0, 10_000), oriented=st.booleans(), n=st.sampled_from([3, 9, 40, 400, 1500]))
def test_search_finds_the_nearest_and_the_candidates_around_it(seed, oriented, n):
    rng = np.random.default_rng(seed)
    table = np.zeros((n, 12))
    table[:, :3], table[:, 3:6] = torus_points(n, rng)
    table[rng.random(n) < 0.1, 3:6] = 0.0  # no direction is known there
    s = assembled(table, np.ones(n), np.ones(n), oriented=oriented)
    for _ in range(20):
        check_search(s, rng.uniform(-1.4, 1.4, 3), sphere_points(1, rng)[0], rng.uniform(0.05, 1.5))


def test_search_among_many_alike():
    # from the center of a sphere all surfels are as far; half of them almost face the right way, and are a bit nearer
    rng = np.random.default_rng(6)
    table = np.zeros((1500, 12))
    facing = rng.random(1500) < 0.5
    table[:, :3] = sphere_points(1500, rng) * (1 + 0.01 * facing + 1e-3 * rng.random(1500))[:, None]
    cosine = np.where(facing, 0.5, 0.1)
    table[:, 3:6] = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine], axis=1)
    s = assembled(table, np.ones(1500), np.ones(1500), oriented=True)
    for place in 1e-3 * sphere_points(50, rng):
        check_search(s, place, np.array([0, 0, 1.0]), 2.0)


# ---- vertices in motion


@given(
    seed=st.integers(0, 10_000),
    oriented=st.booleans(),
    step=st.sampled_from([0.0, 0.003, 0.02, 0.1]),
    turn=st.sampled_from([0.0, 0.05, 1.0]),
    reach=st.sampled_from([0.1, 0.4, np.inf]),
)
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
        fresh = copy(target)
        fresh._cache = _kernels_gaps.empty_cache(0)
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
        listed = target._cache.listed
        assert ((listed >= 0) & (listed < len(target._surfels.table))).all()  # a kernel reads there unchecked


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
        listed = target._cache.listed
        assert ((listed >= 0) & (listed < len(target._surfels.table))).all()  # a kernel reads there unchecked
        np.testing.assert_array_equal(target.gap(places, normals, reach), fresh.gap(places, normals, reach))
        mixed = rng.permutation(50)
        np.testing.assert_array_equal(
            target.gap(places[mixed], normals[mixed], reach), fresh.gap(places, normals, reach)[mixed]
        )


@pytest.mark.parametrize("oriented", [False, True])
def test_gaps_of_an_edited_mesh_are_those_of_a_fresh_target(oriented):
    rng = np.random.default_rng(3)
    target = Points(PointCloud(*torus_points(3000, rng)) if oriented else torus_points(3000, rng)[0])
    places, normals = torus_points(600, rng)
    places = places + 0.05 * normals
    new, outward = torus_points(200, rng)
    stays = rng.random(600) < 0.7
    for some, directions in (
        (np.concatenate([places, new]), np.concatenate([normals, outward])),
        (places[stays], normals[stays]),
    ):
        target.gap(places, normals, 0.3)
        fresh = copy(target)
        fresh._cache = _kernels_gaps.empty_cache(0)
        np.testing.assert_array_equal(target.gap(some, directions, 0.3), fresh.gap(some, directions, 0.3))
