"""Neighbors of points that are dense along lines: the least step at which they span a surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from simplexmesh.numerics.plane_fits import planes
from simplexmesh.numerics.scan_lines import NARROW, neighbors, steps


def lines(gap, noise=0.0):
    """Points one apart on 30 lines."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(400.0), gap * np.arange(30)))
    points = np.stack([x, y, 0 * x], axis=1)
    return points + noise * np.random.default_rng(0).normal(size=points.shape)


def width(points):
    across, along = np.linalg.eigvalsh(np.cov(points.T))[1:]
    return across / along


@pytest.mark.parametrize("gap", [1, 3, 10, 25])
def test_the_least_step_that_spans_a_surface_is_taken(gap):
    points = lines(gap, 0.05)
    tree, places = cKDTree(points), points[::371]
    found, near = steps(tree, places, 16), neighbors(tree, places, 16)[1]
    assert (found > 0).all()
    assert (np.median(found) > 1) == (gap > 5)  # wider ones leave sixteen neighbors on a line
    ranked = tree.query(places, k=512)[1]
    for row, step in enumerate(found):
        np.testing.assert_array_equal(near[row], ranked[row, : 16 * step : step])
        assert width(points[near[row]]) > NARROW
        assert step == 1 or width(points[ranked[row, : 8 * step : step // 2]]) <= NARROW


def test_a_wire_keeps_its_nearest():
    wire = np.arange(3000.0)[:, None] * [1, 2, 3]
    tree = cKDTree(wire)
    assert not steps(tree, wire[::100], 8).any()
    distance, near = neighbors(tree, wire[::100], 8)
    expected = tree.query(wire[::100], k=8)
    np.testing.assert_array_equal(near, expected[1])
    np.testing.assert_array_equal(distance, expected[0])


def test_fewer_points_than_an_eighth_asks_for_are_taken_as_they_are():
    corners = np.random.default_rng(0).normal(size=(5, 3)) * [1, 1e-3, 1e-3]
    np.testing.assert_array_equal(np.sort(neighbors(cKDTree(corners), corners, 5)[1], axis=1), [[0, 1, 2, 3, 4]] * 5)


@pytest.mark.parametrize("gap", [1, 10, 25])
def test_planes_of_lines_of_a_scanner_face_up(gap):
    assert np.abs(planes(lines(gap, 0.2)).normals[:, 2]).min() > 0.9
