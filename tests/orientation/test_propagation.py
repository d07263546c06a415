"""Signs of normals propagated from neighbor to neighbor: outward on bodies of any shape, also thin ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import simplexmesh as sm
from simplexmesh.bench.truth import discretized
from simplexmesh.orientation.propagation import SOFTENING, propagated
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals.orientation import consistent_normals
from simplexmesh.surface.sampled_surface import as_sampled_surface
from tests.surface import reference_normals


def inward(points, outside):
    """Share of the normals of points without normals that point inward."""
    return float(((consistent_normals(as_sampled_surface(points)) * outside).sum(axis=1) < 0).mean())


@given(st.integers(0, 2**31 - 1), st.integers(4, 40))
def test_equals_its_twin(seed, n):
    rng = np.random.default_rng(seed)
    points, normals = rng.normal(size=(2, n, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    ring = as_sampled_surface(points).around(sm.nearest(3))
    squares = ((points[ring.members] - points[np.repeat(ring.centers, ring.valence)]) ** 2).sum(axis=1)
    rows = [ring[i] for i in range(n)]
    expected = reference_normals.propagated(rows, points, normals, SOFTENING * np.median(squares))
    np.testing.assert_allclose(propagated(ring.offsets, ring.members, points, normals), expected, atol=1e-12)


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_a_torus_points_outward(noise):
    ring = discretized.torus(84, 30, irregular=True)
    edge = np.linalg.norm(ring.vertices[1] - ring.vertices[0])
    points = ring.vertices + noise * edge * np.random.default_rng(0).normal(size=ring.vertices.shape)
    assert inward(points, ring.exact.normals) == 0


@pytest.mark.parametrize("seed", range(3))
def test_does_not_depend_on_the_order_of_the_points(seed):
    ring = discretized.torus(60, 24, irregular=True)
    order = np.random.default_rng(seed).permutation(len(ring.vertices))
    assert inward(ring.vertices[order], ring.exact.normals[order]) == 0


def test_a_thin_plate_has_two_sides():
    x = np.linspace(-1, 1, 41)
    top = np.stack([*(part.ravel() for part in np.meshgrid(x, x)), np.full(41 * 41, 0.06)], axis=1)
    rim = np.concatenate([np.stack([x, 0 * x + 1, 0 * x], 1), np.stack([x, 0 * x - 1, 0 * x], 1)])
    rim = np.concatenate([rim, rim[:, [1, 0, 2]]])
    points = np.concatenate([top, top * [1, 1, -1], rim])
    outside = np.concatenate([np.tile([0, 0, 1.0], (len(top), 1)), np.tile([0, 0, -1.0], (len(top), 1)), rim])
    faces = np.abs(points[:, :2]).max(axis=1) < 0.9  # near the rim planes are oblique
    found = consistent_normals(as_sampled_surface(points))
    assert ((found * outside).sum(axis=1)[faces] > 0).all()


def test_each_component_points_outward():
    ball = sm.sphere(8).vertices
    points = np.concatenate([ball, 0.2 * ball + [9, 0, 0]])
    assert inward(points, np.concatenate([ball, ball])) == 0


def test_points_without_neighbors_or_normals_stay():
    ring = Neighborhoods(np.arange(4), [0, 1, 2, 2, 2], [1, 0], np.zeros(4, bool))
    points = np.array([[0, 0, 1.0], [0.1, 0, 1], [5, 5, 5], [7, 7, 7]])
    normals = np.array([[0, 0, 1.0], [0, 0, -1], [0, 0, 0], [1, 0, 0]])
    found = propagated(ring.offsets, ring.members, points, normals)
    assert abs(found[0, 2] + found[1, 2]) == 2
    np.testing.assert_array_equal(found[2:], normals[2:])


@pytest.mark.parametrize(("name", "wrong"), [("lion_head.off", 0.015), ("elephant.off", 0.01), ("fandisk.off", 0.0)])
def test_of_scans_hardly_any_point_inward(data_folder, name, wrong):
    mesh = sm.read_triangles(data_folder / name)
    assert inward(mesh.vertices, mesh.vertex_normals) <= wrong  # spread breadth first 15, 14, 5 %
