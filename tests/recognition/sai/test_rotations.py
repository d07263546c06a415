"""Tables of rotations: a group, and its coverings of all rotations."""

from __future__ import annotations

import numpy as np
import pytest

from simplexmesh.recognition.sai import rotations as tables
from simplexmesh.recognition.sai.sphere_domain import mobius_centering, mobius_map, sphere_domain
from tests.recognition import reference as reference


class TestGroup:
    def test_is_a_group_of_60_proper_rotations(self):
        group = tables.icosahedral_group()
        assert group.shape == (60, 3, 3)
        assert np.allclose(group @ np.swapaxes(group, 1, 2), np.eye(3))
        assert np.allclose(np.linalg.det(group), 1)
        products = np.einsum("gab,hbc->ghac", group, group).reshape(-1, 3, 3)
        assert reference.angles_between(products, group).min(axis=1).max() < 1e-6

    @pytest.mark.parametrize("frequency", [5, 6, 9])
    def test_takes_the_sphere_to_itself_vertex_by_vertex(self, frequency):
        table, here = tables.rotations(frequency), sphere_domain(frequency)
        for R, turn in zip(table.group, table.turns, strict=True):
            assert np.allclose(here.vertices @ R.T, here.vertices[turn], atol=1e-9)
            assert {tuple(sorted(row)) for row in turn[here.mesh.neighbors]} == {
                tuple(sorted(row)) for row in here.mesh.neighbors
            }


class TestTable:
    def test_no_rotation_is_far_from_one_of_the_table(self):
        rng = np.random.default_rng(1)
        some = np.stack([reference.random_rotation(rng) for _ in range(500)])
        nearest = np.degrees(reference.angles_between(some, tables.rotations(5).matrices).min(axis=1))
        assert nearest.mean() < 7.0
        assert nearest.max() < 15.0

    def test_indices_name_the_nearest_vertex(self):
        table = tables.rotations(5)
        rows = reference.all_images(table)
        assert rows.shape == (len(table), 500)
        here = sphere_domain(5)
        for k in range(0, len(table), 97):
            images = here.vertices @ table.matrices[k].T
            found = np.einsum("ij,ij->i", images, here.vertices[rows[k]])
            assert np.allclose(found, (images @ here.vertices.T).max(axis=1), atol=1e-9)
        assert np.allclose(np.linalg.det(table.matrices), 1)

    @pytest.mark.parametrize("frequency", [4, 13, 0, -1])
    def test_frequency_out_of_range(self, frequency):
        with pytest.raises(ValueError, match=rf"frequency must be at .* not {frequency}"):
            tables.rotations(frequency)


class TestSphere:
    def test_interpolation_is_that_of_the_plain_search_for_a_triangle(self):
        rng = np.random.default_rng(2)
        values, directions = rng.normal(size=500), rng.normal(size=(40, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        here = sphere_domain(5)
        plain = [reference.interpolated(5, values, d) for d in directions]
        assert np.allclose(here.interpolated(values, here.locate(directions)), plain, atol=1e-9)

    def test_walks_end_where_they_should(self):
        rng = np.random.default_rng(3)
        directions = rng.normal(size=(200, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        here = sphere_domain(7)
        near = here.locate(directions)
        nearest = np.argmax(directions @ here.vertices.T, axis=1)
        assert (near.vertex == nearest).mean() > 0.9
        assert (
            np.isin(nearest, near.vertex) | (here.mesh.neighbors[near.vertex] == nearest[:, None]).any(axis=1)
        ).all()
        assert near.weights.min() > -1e-9
        assert np.allclose(near.weights.sum(axis=1), 1)

    def test_boosts_keep_circles_and_angles(self):
        here, b = sphere_domain(5), np.array([0.4, -0.2, 0.3])
        images = mobius_map(here.vertices, b)
        assert np.allclose(np.linalg.norm(images, axis=1), 1)
        turns = np.linspace(0, 2 * np.pi, 9)[:-1]
        circle = np.stack([0.6 * np.cos(turns), 0.6 * np.sin(turns), np.full(8, 0.8)], axis=1)
        moved = mobius_map(circle, b)
        flat = np.linalg.svd(moved - moved.mean(axis=0))[1]
        assert flat[2] < 1e-12 * flat[0]

    def test_centering_undoes_any_boost_but_for_a_rotation(self):
        here = sphere_domain(6)
        weights = 1 + 0.5 * here.vertices[:, 0] ** 2 + 0.3 * here.vertices[:, 1]

        def centered(points):
            for b in mobius_centering(points, weights):
                points = mobius_map(points, b)
            return points

        one = centered(here.vertices)
        other = centered(mobius_map(here.vertices, np.array([0.3, 0.5, -0.2])))
        assert np.allclose(one @ one.T, other @ other.T, atol=1e-6)
