"""The start from a closed surface itself: its topology, also where walls and handles are thinner than any cell."""

import numpy as np
import pytest
import pyvista as pv
from numpy.testing import assert_allclose

import simplexmesh as sm
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.start.from_triangles import start_from_triangles
from simplexmesh.motion.targets.triangles import Triangles


def box(*sides):
    box = pv.Box(np.column_stack([np.zeros(3), sides]).ravel()).triangulate().clean()
    return sm.TriangleMesh(box.points.astype(float), box.regular_faces)


@pytest.mark.parametrize("vertices", [600, 3000])
@pytest.mark.parametrize(
    "surface",
    [box(100, 60, 2), sm.torus(60, 20, radius=1.0, tube_radius=0.1).triangulated(), sm.sphere(8).triangulated()],
    ids=["plate", "ring", "ball"],
)
def test_is_an_even_mesh_on_the_surface_with_its_genus(surface, vertices):
    start = start_from_triangles(surface, vertices)
    mesh, edge = start.mesh, float(np.sqrt(4 / np.sqrt(27) * surface.area / vertices))
    assert (mesh.genus, start.report.genus, start.report.is_open) == (surface.topology.genus,) * 2 + (False,)
    assert mesh.n_vertices == pytest.approx(vertices, rel=0.02)
    assert not tangled_vertices(mesh).any()
    assert mesh.volume > 0
    assert np.abs(Triangles(surface).closest(mesh.vertices)[0]).max() < 0.75 * edge
    assert_allclose(mesh.bounds, surface.bounds, atol=1.5 * edge)
    assert str(start.report) == f"start of genus {mesh.genus}, from the triangles themselves"


def test_is_none_of_open_surfaces_of_several_bodies_and_where_it_would_be_tangled():
    two = np.concatenate([box(1, 1, 1).vertices, box(1, 1, 1).vertices + 3])
    one = box(1, 1, 1).faces
    assert start_from_triangles(sm.TriangleMesh(two, np.concatenate([one, one + 8])), 500) is None
    assert start_from_triangles(sm.TriangleMesh(two[:8], one[1:]), 500) is None
    assert start_from_triangles(sm.TriangleMesh(two[:8] * [1, 1, 1e-3], one), 500) is None


def test_surfaces_that_would_be_divided_into_very_many_triangles_start_from_points():
    start, _ = as_input(box(1, 1, 1)).start(150_000, None)
    assert start.report.grid
