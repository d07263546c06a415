"""Arrays and unit of data on the mesh that was fitted to it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import simplexmesh as sm
from simplexmesh.motion.reconstruct.result import with_data_of

pytestmark = pytest.mark.usefixtures("coarse_starts")

DENSE = sm.sphere(24).triangulated()
SIDE = (DENSE.vertices[:, 0] > 0).astype(np.int32)
COLORS = np.where(SIDE[:, None], [255, 0, 0], [0, 0, 255]).astype(np.uint8)
DATA = {"height": DENSE.vertices[:, 2], "side": SIDE, "colors": COLORS}
SURFACE = sm.TriangleMesh(DENSE.vertices, DENSE.faces, DATA, "mm")
CLOUD = sm.PointCloud(DENSE.vertices, DENSE.vertex_normals, DATA, "mm")
SPACING = float(np.sqrt(DENSE.area / DENSE.n_vertices))
SOURCES = pytest.mark.parametrize("source", [SURFACE, CLOUD], ids=["triangles", "points"])


def check(mesh, within):
    """Whether the mesh has the unit, heights, sides and colors of what it is near."""
    x, _, z = mesh.vertices.T
    inside = np.abs(x) > 2 * SPACING
    assert mesh.unit == "mm"
    assert_allclose(mesh.data["height"], z, atol=within)
    assert_array_equal(mesh.data["side"][inside], x[inside] > 0)
    assert_array_equal(mesh.data["colors"][inside], np.where(x[inside, None] > 0, [255, 0, 0], [0, 0, 255]))


@SOURCES
def test_a_vertex_has_the_values_of_what_it_is_near(source):
    check(with_data_of(sm.sphere(7), source), within=SPACING)


def test_on_a_triangle_values_are_linear():
    square = sm.TriangleMesh([[0, 0, 0], [3, 0, 0], [3, 2, 0], [0, 2, 0]], [[0, 1, 2], [0, 2, 3]])
    x, y, _ = square.vertices.T
    sheet = sm.plane(4, 5).scaled(0.1)
    sheet = sheet.moved(sheet.vertices - sheet.bounds.mean(axis=0) + [1.5, 1, 0.5])
    found = with_data_of(sheet, square.with_data(f=1 + 2 * x - 3 * y))
    assert_allclose(found.data["f"], 1 + 2 * sheet.vertices[:, 0] - 3 * sheet.vertices[:, 1], atol=1e-12)


@SOURCES
def test_on_a_sample_its_value_is_taken(source):
    some = sm.sphere(24)
    assert_allclose(with_data_of(some, source).data["height"], some.vertices[:, 2], atol=1e-12)


def test_a_mesh_keeps_its_own_arrays():
    ball = sm.sphere(7).with_data(height=np.zeros(980), own=np.ones(980))
    found = with_data_of(ball, CLOUD)
    assert not found.data["height"].any()
    assert sorted(found.data) == ["colors", "height", "own", "side"]


@SOURCES
def test_reconstruct_carries_all(source):
    check(sm.reconstruct(source, vertices=600, creases="none").mesh, within=SPACING)


def test_reconstruct_carries_the_unit_of_a_volume_and_of_scans():
    x, y, z = np.mgrid[-8:9, -8:9, -8:9]
    ball = sm.Volume(6.3 - np.sqrt(x**2 + y**2 + z**2), unit="mm")
    assert sm.reconstruct(ball, level=0.0, vertices=300).mesh.unit == "mm"
    halves = [CLOUD.selected(CLOUD.points[:, 2] * sign > -0.2) for sign in (1, -1)]
    check(sm.reconstruct(halves, vertices=600, poses=[np.eye(4)] * 2, creases="none").mesh, within=SPACING)
