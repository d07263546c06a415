"""Sizes of cells and edges by closed forms, and the field whose surface has the topology of a solid."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simplexmesh.motion.start import solid_mesh


def ball(radius, size=24):
    at = np.indices((size,) * 3) - (size - 1) / 2
    return (radius - np.sqrt((at**2).sum(axis=0))).astype(np.float32)


@pytest.mark.parametrize("radius", [5.3, 9.1])
def test_cells_of_a_size_give_twice_the_vertices_in_triangles(radius):
    _, faces = solid_mesh.isosurface(ball(radius), ball(radius) > 0)
    assert solid_mesh.cell_size(4 * np.pi * radius**2, len(faces) / 2) == pytest.approx(1, rel=0.03)


def test_hexagons_tile_an_area():
    """Each has six corners, each of them in three: twice as many corners as hexagons."""
    side, hexagons = 0.7, 100
    area = hexagons * 6 * np.sqrt(3) / 4 * side**2
    assert solid_mesh.edge_length(area, 2 * hexagons) == pytest.approx(side)


def test_the_surface_of_voxels_is_two_thirds_of_their_faces():
    solid = np.zeros((6, 7, 8), bool)
    solid[1:3, 2:6, 3:6] = True
    size = np.array([2, 4, 3]) * [0.5, 2.0, 3.0]
    faces = 2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0])
    assert solid_mesh.surface_area(solid, np.array([0.5, 2.0, 3.0])) == pytest.approx(2 / 3 * faces)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 40.0])
class TestConsistent:
    def test_a_field_in_its_own_unit_is_clipped_only(self, unit):
        field = ball(8.2)
        found = solid_mesh._consistent(unit * field, field > 0)
        jumps = np.abs(np.diff(field, axis=0))[np.diff(field > 0, axis=0)]
        scaled = np.clip(field / (np.median(jumps) / 2), -3, 3)
        assert_allclose(found, np.where(field > 0, np.maximum(scaled, 0.05), np.minimum(scaled, -0.05)), rtol=1e-5)

    def test_the_solid_decides_on_which_side_a_sample_is(self, unit):
        field, solid = ball(8.2), ball(6.2) > 0
        found = solid_mesh._consistent(unit * field, solid)
        assert ((found > 0) == solid).all()
        assert np.abs(found).min() == pytest.approx(0.05)
        assert np.abs(found).max() == pytest.approx(3)

    def test_cells_that_touch_at_an_edge_have_values_that_separate_them(self, unit):
        solid = np.zeros((6, 6, 6), bool)
        solid[2, 2, 2:4] = solid[3, 3, 2:4] = True
        found = solid_mesh._consistent(np.where(solid, unit, -0.1 * unit), solid)
        assert solid_mesh.PINCHED_INSIDE < solid_mesh.PINCHED_OUTSIDE
        wanted = np.where(solid, solid_mesh.PINCHED_INSIDE, -solid_mesh.PINCHED_OUTSIDE)
        assert_allclose(found[2:4, 2:4, 2], wanted[2:4, 2:4, 2], rtol=1e-6)
        assert_allclose(found[0], -0.1 / 0.55, rtol=1e-6)


def test_relaxation_evens_out_a_sphere():
    """Edges get nearly equal, and vertices stay on it."""
    vertices, faces = solid_mesh.isosurface(ball(8.2), ball(8.2) > 0)
    vertices, faces = solid_mesh.decimated(vertices, faces, 400)
    found, connected = solid_mesh.relaxed(vertices, faces)
    valence = np.bincount(connected.ravel())
    before = np.bincount(faces.ravel())
    assert ((valence - 6) ** 2).sum() < 0.7 * ((before - 6) ** 2).sum()
    sides = np.linalg.norm(found[connected] - found[np.roll(connected, 1, axis=1)], axis=2)
    rough = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
    assert sides.std() / sides.mean() < 0.6 * rough.std() / rough.mean()
    assert np.abs(np.linalg.norm(found - 11.5, axis=1) / 8.2 - 1).max() < 0.06
