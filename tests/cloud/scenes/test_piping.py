"""Pipe lines: elements that continue each other, seen from a side, with gaps, clear of themselves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import cKDTree

from simplexmesh._base.vectors import norm, normalized
from tests.cloud.scenes.piping import Make, View, measures, pipe_line
from tests.cloud.scenes.scoring import untangent
from tests.cloud.scenes.test_shapes import exact_distance
from tests.nightly.marks import nightly

CLEAN = View(noise=0.0, outliers=0.0, around=360.0, gaps=0)
SEEDS = [0, *nightly(*range(1, 8))]


def directions(line):
    """Directions of the center line at the start and the end of each element."""
    for part in line.elements:
        shape = line.shapes[part.shape]
        if part.kind == "bend":
            spokes = [np.array([np.cos(u), np.sin(u), 0]) for u in shape.extent[0]]
            yield tuple(np.cross(shape.axis, spoke @ shape.frame) for spoke in spokes)
        else:
            yield (normalized(part.end - part.start),) * 2


@pytest.mark.parametrize("seed", SEEDS)
class TestElements:
    def test_continue_each_other(self, seed):
        line = pipe_line(seed, make=Make(reducers=2), count=2000)
        ways = list(directions(line))
        for k in range(len(line.elements) - 1):
            one, other = line.elements[k : k + 2]
            assert_allclose(one.end, other.start, atol=1e-13)
            assert_allclose(ways[k][1], ways[k + 1][0], atol=1e-13)
            assert_allclose(one.end_radius, other.radius, rtol=1e-14)
        for part in line.elements:
            if part.kind == "bend":
                bend = line.shapes[part.shape]
                assert max(untangent(bend, line.shapes[k]) for k in bend.joins) < 1e-12
                assert (bend.radius, bend.tube_radius) == (part.bend_radius, part.radius)

    def test_points_are_on_them(self, seed):
        line = pipe_line(seed, make=Make(reducers=1, tees=1), view=CLEAN)
        for k, shape in enumerate(line.shapes):
            assert_allclose(exact_distance(shape, line.points[line.labels == k]), 0, atol=1e-12)
        for part in line.elements:
            if part.kind != "bend":
                points = line.points[line.labels == part.shape]
                along = (points - part.start) @ normalized(part.end - part.start)
                length = norm(part.end - part.start)
                assert -1e-12 < along.min() < 0.05 * length
                assert 0.95 * length < along.max() < length + 1e-12

    def test_measures(self, seed):
        line = pipe_line(seed, 13, count=2000)
        assert [part.kind for part in line.elements] == ["straight", "bend"] * 6 + ["straight"]
        for part in line.elements:
            assert 0.03 <= part.radius <= 0.15
            if part.kind == "bend":
                assert 1.25 <= part.bend_radius / part.radius <= 10
                assert np.radians(15) <= part.angle <= np.radians(120)
            else:
                assert 4 <= norm(part.end - part.start) / part.radius <= 15

    def test_keep_clear_of_each_other(self, seed):
        tangled = Make(ratios=(1.25, 2), angles=(90, 120), lengths=(4, 6))
        line = pipe_line(seed, 20, make=tangled, view=CLEAN, count=30_000)
        trees = [cKDTree(line.points[line.labels == part.shape]) for part in line.elements]
        for a in range(len(trees)):
            for b in range(a + 2, len(trees)):
                if not (b == a + 2 and line.elements[a].kind == "straight"):
                    assert trees[a].query(trees[b].data)[0].min() > line.elements[a].radius

    def test_picks_are_points_of_straight_parts(self, seed):
        line = pipe_line(seed)
        straight = [part.shape for part in line.elements if part.kind == "straight"]
        assert_array_equal(line.labels[line.picks], straight)

    def test_pass_a_wall_and_a_floor(self, seed):
        line = pipe_line(seed, view=CLEAN, count=30_000)
        radius = line.elements[0].radius
        pipes = line.points[line.labels < 12]
        for number in (12, 13):
            wall = line.shapes[number]
            nearest = wall.distance(pipes).min()
            assert 0.5 * radius < nearest < 4 * radius
            assert wall.holds(wall.coordinates(pipes)).all()


@pytest.mark.parametrize("seed", SEEDS)
class TestSight:
    def test_of_pipes_is_an_arc(self, seed):
        line = pipe_line(seed, view=View(noise=0.0, outliers=0.0, gaps=0, walls=False))
        for part in line.elements:
            shape = line.shapes[part.shape]
            around = shape.coordinates(line.points[line.labels == part.shape])[:, 1 if part.kind == "bend" else 0]
            gaps = np.diff(np.sort(around), append=np.sort(around)[0] + 2 * np.pi)
            assert np.radians(160) - 1e-9 < gaps.max() < np.radians(190)
            assert np.sort(gaps)[-2] < np.radians(30)

    def test_is_of_one_side_through_bends(self, seed):
        """Where two elements meet, their arcs have the same middle."""
        line = pipe_line(seed, view=View(noise=0.0, outliers=0.0, gaps=0, walls=False), count=200_000)
        ways = list(directions(line))
        for k, (one, other) in enumerate(pairwise(line.elements)):
            to = line.points - one.end
            near = (norm(to) < 1.3 * one.radius) & (np.abs(to @ ways[k][1]) < 0.2 * one.radius)
            sides = [to[near & (line.labels == part.shape)] for part in (one, other)]
            across = [normalized(side - np.outer(side @ ways[k][1], ways[k][1])).mean(axis=0) for side in sides]
            assert min(map(len, sides)) > 50
            assert normalized(across[0]) @ normalized(across[1]) > np.cos(np.radians(20))

    def test_has_gaps(self, seed):
        view = View(noise=0.0, outliers=0.0, gaps=3, around=360.0)
        line = pipe_line(seed, view=view, count=80_000)
        ends = measures(line.elements)
        assert line.gaps.shape == (3, 2)
        lost = np.zeros(12)
        for low, high in line.gaps:
            radius = line.elements[np.searchsorted(ends, low) - 1].radius
            assert radius <= high - low <= 5 * radius
            lost += np.clip(np.minimum(ends[1:], high) - np.maximum(ends[:-1], low), 0, None)
            for part, start in zip(line.elements, ends[:-1], strict=True):
                if part.kind == "straight":
                    points = line.points[line.labels == part.shape]
                    along = start + (points - part.start) @ normalized(part.end - part.start)
                    assert not ((along > low + 1e-9) & (along < high - 1e-9)).any()
        assert (lost < 0.5 * np.diff(ends)).all()


class TestOptions:
    def test_reducers_change_the_radius(self):
        line = pipe_line(0, 13, make=Make(reducers=3), view=CLEAN, count=20_000)
        reducers = [part for part in line.elements if part.kind == "reducer"]
        assert len(reducers) == 3
        for part in reducers:
            assert 0.5 <= min(part.radius, part.end_radius) / max(part.radius, part.end_radius) <= 0.8
            for at, radius in ((part.start, part.radius), (part.end, part.end_radius)):
                cone = line.shapes[part.shape]
                assert_allclose(norm(at - cone.point) * np.tan(cone.half_angle), radius, rtol=1e-12)

    def test_more_reducers_than_places(self):
        with pytest.raises(ValueError, match=r"^a line of 3 elements has room for 1 reducers, not 2$"):
            pipe_line(0, 3, make=Make(reducers=2))

    def test_tees(self):
        line = pipe_line(1, make=Make(tees=2), view=CLEAN)
        assert len(line.tees) == 2
        for branch, main in line.tees:
            side, pipe = line.shapes[branch], line.shapes[main]
            assert_allclose(side.axis @ pipe.axis, 0, atol=1e-14)
            assert_allclose(pipe.distance(side.point[None]), -pipe.radius, atol=1e-14)
            assert 0.4 <= side.radius / pipe.radius <= 0.9
            assert pipe.distance(line.points[line.labels == branch]).min() > -1e-12
            mouth = line.points[line.labels == main]
            mouth = mouth[(mouth - side.point) @ side.axis > 0]
            assert side.distance(mouth).min() > -1e-12
            assert side.distance(mouth).min() < 0.1 * side.radius

    def test_noise_is_in_radii_and_outliers_a_share(self):
        line = pipe_line(2, view=View(noise=0.03, outliers=0.2))
        away = np.concatenate([exact_distance(s, line.points[line.labels == k]) for k, s in enumerate(line.shapes)])
        assert_allclose(line.noise, 0.03 * line.elements[0].radius)
        assert_allclose(away.std(), line.noise, rtol=0.02)
        assert_allclose((line.labels < 0).mean(), 0.2, atol=1e-4)

    def test_without_walls(self):
        line = pipe_line(2, view=View(walls=False))
        assert {shape.kind for shape in line.shapes} == {"cylinder", "torus"}

    def test_of_a_seed_is_one(self):
        one, other, third = (pipe_line(seed, count=4000) for seed in (5, 5, 6))
        assert_array_equal(one.points, other.points)
        assert one.elements[0].radius != third.elements[0].radius

    def test_a_last_bend_joins_only_what_is_before(self):
        assert [shape.joins for shape in pipe_line(0, 4, count=2000).shapes[:4] if shape.kind == "torus"] == [
            (0, 2),
            (2,),
        ]
