"""Surfaces coarsened along lines: the number asked for, lines kept, places near."""

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.motion.targets.triangles import surface_distance
from simplexmesh.surface.features.coarsened import coarsened


def can(offset=0.0):
    """Return a cylinder, and its half-edges on both rims."""
    surface = sm.divided(pv.Cylinder(resolution=48, height=2.0).triangulate().clean(), 0.1)
    surface = sm.TriangleMesh(surface.vertices + offset, surface.faces)
    faces = surface.faces.astype(np.int64)
    at = np.abs(surface.vertices - offset)
    rim = np.isclose(at[:, 0], 1.0) & (np.hypot(at[:, 1], at[:, 2]) > 0.49)
    normals = surface.face_vectors / np.linalg.norm(surface.face_vectors, axis=1, keepdims=True)
    cap = np.abs(normals[:, 0]) > 0.5
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    keys = np.sort(ends, axis=2) @ [surface.n_vertices, 1]
    both = np.intersect1d(keys[cap], keys[~cap])
    sharp = np.isin(keys, both)
    assert rim[ends[sharp]].all()
    return surface, sharp


def test_as_many_triangles_and_edges_of_lines_are_left_as_asked_for():
    surface, sharp = can()
    coarse, left = coarsened(surface, sharp, 500, np.ones(surface.n_vertices))
    assert abs(coarse.n_faces + left.sum() - 500) <= 4
    assert (coarse.genus, coarse.n_borders) == (0, 0)


def test_lines_go_through_their_own_vertices_and_stay_closed():
    surface, sharp = can()
    numbered = sm.TriangleMesh(surface.vertices, surface.faces, {"number": np.arange(surface.n_vertices)})
    coarse, left = coarsened(numbered, sharp, 400, np.ones(surface.n_vertices))
    faces = coarse.faces.astype(np.int64)
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)[left]
    degree = np.bincount(ends[:, 0], minlength=coarse.n_vertices)
    assert set(degree) == {0, 2}  # each half-edge of two rims has its opposite
    on = np.flatnonzero(degree)
    given = coarse.data["number"].astype(np.int64)[on]
    np.testing.assert_array_equal(coarse.vertices[on], surface.vertices[given])
    assert (np.abs(coarse.vertices[on, 0]) == 1.0).all()


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_it_stays_near_wherever_it_is(offset):
    surface, sharp = can(offset)
    coarse, _ = coarsened(surface, sharp, 600, np.ones(surface.n_vertices))
    away = surface_distance(surface.vertices - offset, coarse.vertices - offset, coarse.faces)
    assert away.max() < 0.02  # of a radius of 0.5
    assert coarse.volume == pytest.approx(surface.volume, rel=0.02)


def test_dear_vertices_stay():
    surface, sharp = can()
    upper = surface.vertices[:, 0] > 0
    dear, _ = coarsened(surface, sharp, 600, np.where(upper, 100.0, 1.0))
    alike, _ = coarsened(surface, sharp, 600, np.ones(surface.n_vertices))
    assert (dear.vertices[:, 0] > 0).mean() > (alike.vertices[:, 0] > 0).mean() + 0.1
