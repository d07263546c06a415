"""Surfaces whose edges are moved onto their creases."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from tests.nightly.marks import nightly
from tests.surface.features.parts import noisy, reference, tessellated
from tests.surface.features.reference import Reference
from tests.surface.features.solids import box

CUBE = sm.divided(pv.Cube().triangulate().clean(), 0.15)


@cache
def scanned(name):
    body = Reference("box", [("+", box((0, 0, 0), (2, 1, 1)))]) if name == "box" else reference(name, 1)
    return body, tessellated(body, "scan", body.edge(5000), 1)


def volume(vertices, faces):
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return np.einsum("ij,ij", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("name", ["plate", "dome", *nightly("box", "crossing")])
def test_bevels_of_scans_are_gone(name):
    body, part = scanned(name)
    moved = sm.aligned(part.mesh)
    true = volume(*body.fine[:2])
    lost, left = (abs(volume(mesh.vertices, mesh.faces) - true) for mesh in (part.mesh, moved))
    assert left < 0.6 * lost
    assert_array_equal(moved.faces, part.mesh.faces)


def test_nothing_else_moves_and_no_triangle_turns():
    part = noisy(scanned("box")[1], 0.1)
    network = sm.feature_lines(part.mesh)
    moved = sm.aligned(part.mesh, network)
    still = np.ones(part.mesh.n_vertices, bool)
    still[np.concatenate([line.vertices for line in network.lines])] = False
    assert_array_equal(moved.vertices[still], part.mesh.vertices[still])
    assert (moved.vertices[~still] != part.mesh.vertices[~still]).any(axis=1).mean() > 0.8
    assert np.linalg.norm(moved.vertices - part.mesh.vertices, axis=1).max() < 2 * part.edge
    assert moved.topology == part.mesh.topology


def test_what_is_aligned_stays():
    assert_allclose(sm.aligned(CUBE).vertices, CUBE.vertices, atol=1e-9)
    ball = sm.sphere(8).triangulated("dual")
    assert_array_equal(sm.aligned(ball).vertices, ball.vertices)


def test_data_and_unit_are_kept():
    mesh = sm.TriangleMesh(CUBE.vertices, CUBE.faces, {"row": np.arange(CUBE.n_vertices)}, "mm")
    out = sm.aligned(mesh)
    assert out.unit == "mm"
    assert_array_equal(out.data["row"], np.arange(CUBE.n_vertices))


def test_a_network_of_another_surface_is_refused():
    with pytest.raises(ValueError, match="network must be one of this surface"):
        sm.aligned(CUBE, sm.feature_lines(sm.sphere(8)))
    with pytest.raises(TypeError, match="network"):
        sm.aligned(CUBE, 3)
