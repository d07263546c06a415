"""Corners of many lines, which noise shows as several of few."""

from types import SimpleNamespace

import numpy as np
import pytest

from simplexmesh.motion.creases import lines as joining
from simplexmesh.motion.creases.line import CreaseLine
from simplexmesh.motion.creases.lines import _meeting as meeting
from simplexmesh.motion.creases.lines import joined, without_loops


def line(start, end, count=30):
    return CreaseLine(np.linspace(start, end, count), closed=False, angle=1.0)


def ends(lines):
    return np.unique(np.array([each.points[[0, -1]] for each in lines]).reshape(-1, 3), axis=0, return_counts=True)


def star(apart, toward):
    """Lines from two nodes that are some way apart, as if from places `toward` times as far beyond the middle."""
    a, b = np.array([[-apart / 2, 0, 0], [apart / 2, 0, 0]])
    ways = {1: ([10, 10, 0], [10, -10, 0]), -1: ([-10, 10, 0], [-10, -10, 0])}
    out = [line(a, b, 5)]
    for side, node in ((-1, a), (1, b)):
        for way in ways[side]:
            from_ = node * (1 - toward)
            points = np.linspace(from_, from_ + np.array(way, float), 60)
            points[0] = node
            out.append(CreaseLine(points, closed=False, angle=1.0))
    return out


def test_lines_of_one_corner_meet_in_it():
    lines = joined(star(1.0, toward=1.0), 1.0)
    places, counts = ends(lines)
    assert len(lines) == 4
    (middle,) = places[counts == 4]
    np.testing.assert_allclose(middle, 0, atol=1e-6)


def test_corners_apart_stay():
    for lines in (star(2.9, toward=0.0), star(3.5, toward=1.0)):
        assert len(joined(lines, 1.0)) == 5


def test_parallel_lines_stay():
    rungs = [line([0, 0, 0], [0, 2, 0], 5), *(line([0, y, 0], [x, y, 0]) for y in (0, 2) for x in (-10, 10))]
    assert len(joined(rungs, 1.0)) == 5


def test_closed_lines_and_none_are_left():
    turn = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = CreaseLine(0.1 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]), closed=True, angle=1.0)
    assert joined([ring], 1.0) == [ring]
    assert joined([], 1.0) == []


def test_six_lines_of_four_nodes():
    """Three bars that cross: three edges that point outward and three inward meet in one place."""
    corner, rng = np.zeros(3), np.random.default_rng(0)
    ways = np.concatenate([np.eye(3), -np.eye(3)])[[0, 5, 1, 3, 2, 4]]
    nodes = 0.6 * rng.normal(size=(3, 3))
    lines = [line(corner, node, 4) for node in nodes]
    for k, way in enumerate(ways):
        points = np.linspace(corner, 12 * way, 60)
        points[0] = nodes[k // 2]
        lines.append(CreaseLine(points, closed=False, angle=1.0))
    places, counts = ends(joined(lines, 1.0))
    assert counts.max() == 6
    assert np.linalg.norm(places[counts.argmax()]) == pytest.approx(0, abs=0.1)


def left_out(*courses):
    """Which of some courses, each with its nodes and its angle, are left out at a side of 1."""
    lines = [
        SimpleNamespace(points=points, vertices=np.array(nodes), angle=np.array([angle]), closed=False)
        for points, nodes, angle in courses
    ]
    found = without_loops(SimpleNamespace(lines=lines, without=lambda *gone: gone), 1.0)
    return found if isinstance(found, tuple) else None


def arc(radius, first, last):
    turn = np.radians(np.linspace(first, last, 200))
    return radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])


def test_the_flatter_of_two_courses_goes_however_long():
    assert left_out((arc(10, 0, 300), [1, 2], 0.3), (arc(11, 0, 300), [2, 1], 1.5)) == (0,)


def test_a_short_piece_that_closes_a_long_line_stays():
    assert left_out((arc(10, 5, 355), [1, 2], 1.5), (arc(10, -5, 5), [1, 2], 1.4)) is None


def test_what_stays_beside_its_node_goes():
    assert left_out((arc(0.5, 0, 360), [1, 1], 1.5), (arc(5, 0, 360), [1, 1], 1.5)) == (0,)


def test_rims_that_touch_are_closed_lines():
    """Two rings that a short line joins, so that each seems to lead from one end of it to the other."""
    ends = np.array([[10.0, -0.7, 0.0], [10.0, 0.7, 0.0]])
    up = np.array([0.0, 0.0, 0.3])
    rings = [np.vstack([ends[1], arc(10, 6, 354) + side * up, ends[0]]) for side in (-1, 1)]
    found = joined([CreaseLine(points, closed=False, angle=1.0) for points in (*rings, ends)], 1.0)
    assert [line.closed for line in found] == [True, True]
    assert all(line.length == pytest.approx(20 * np.pi, rel=0.02) for line in found)


def test_clusters_of_short_lines_are_tried_once(monkeypatch):
    """A crumpled surface, through points of two walls, had 6,142 lines, of which each tried its whole cluster again."""
    rng, tried = np.random.default_rng(0), []
    monkeypatch.setattr(joining, "_meeting", lambda lines, side: tried.append(len(lines)) or meeting(lines, side))
    nodes = 30.0 * np.arange(8)[:, None, None] * np.eye(3)[0] + rng.uniform(-0.85, 0.85, (8, 6, 3))
    lines = [line(cluster[a], cluster[b], 4) for cluster in nodes for a in range(6) for b in range(a)]
    lines += [line(node, np.add(node, [0, 12.0, 0]), 8) for cluster in nodes for node in cluster]
    out = joined(lines, 1.0)
    assert len(lines) == 8 * (15 + 6)
    assert tried == 8 * [6]
    assert sum(each.length > 10 for each in out) == 8 * 6
