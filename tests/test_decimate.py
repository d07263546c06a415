"""Decimating: what stays, how near the surface the result is, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh.errors import TopologyError
from simplexmesh.mesh import shapes
from simplexmesh.mesh.decimate import decimate
from simplexmesh.mesh.least import least_vertices
from tests.test_mesh_editing import MESHES, complete

names = st.sampled_from(["sphere", "torus", "two tori", "plane", "cylinder", "torus with holes"])
parts = st.floats(0.2, 1.0)


def topology(mesh):
    """The numbers that stay."""
    return mesh.genus, mesh.n_holes, mesh.n_components


@settings(max_examples=30)
@given(name=names, part=parts)
def test_topology_stays(name, part):
    mesh = MESHES[name]
    wanted = max(2 * round(part * mesh.n_vertices / 2), least_vertices(mesh.connectivity) + 40)
    out = decimate(mesh, vertices=min(wanted, mesh.n_vertices))
    assert complete(out.mesh.connectivity)
    assert topology(out.mesh) == topology(mesh)
    assert out.mesh.n_vertices == min(wanted, mesh.n_vertices)
    assert np.isfinite(out.mesh.vertices).all()


def test_maps_tell_where_everything_went():
    ball = shapes.sphere(8)
    out = decimate(ball, vertices=300)
    kept = out.vertex_map >= 0
    assert_array_equal(np.sort(out.vertex_map[kept]), np.arange(300))
    assert (out.face_map >= 0).sum() == out.mesh.n_faces
    sizes = out.mesh.connectivity.face_sizes
    assert_array_equal(out.exceptions, np.flatnonzero((sizes < 5) | (sizes > 7)))


def test_as_many_vertices_as_there_are_leave_the_mesh_as_it_is():
    ball = shapes.sphere(4)
    out = decimate(ball, vertices=ball.n_vertices)
    assert_array_equal(out.mesh.vertices, ball.vertices)
    assert_array_equal(out.mesh.neighbors, ball.neighbors)
    assert out.largest < 1e-12


@pytest.mark.parametrize(
    ("given_", "error", "says"),
    [
        ({}, TypeError, "give vertices or tolerance"),
        ({"vertices": 100, "tolerance": 0.1}, TypeError, "not both"),
        ({"vertices": 101}, ValueError, "vertices must be even.*not 101"),
        ({"vertices": 1000}, ValueError, "at most 320, as many as the mesh has, not 1000"),
        ({"vertices": 2}, TopologyError, "at least 4, the fewest with genus 0, 0 holes, not 2"),
        ({"vertices": 10.0}, TypeError, "vertices must be a whole number"),
        ({"tolerance": 0.0}, ValueError, "tolerance must be above 0"),
        ({"tolerance": np.nan}, ValueError, "tolerance must be finite"),
    ],
)
def test_bad_input_is_told(given_, error, says):
    with pytest.raises(error, match=says):
        decimate(shapes.sphere(4), **given_)


def test_only_a_mesh_is_decimated():
    with pytest.raises(TypeError, match="mesh must be a SimplexMesh, not list"):
        decimate([], vertices=4)
