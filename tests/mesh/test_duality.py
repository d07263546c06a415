"""Duality: triangulations to simplex meshes and back; invalid input is refused with a reason."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from simplexmesh._base.errors import SimplexMeshWarning, TopologyError
from simplexmesh.mesh import _kernels, lattices, shapes
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.triangulation import dual_triangles, fan
from tests.mesh import reference as reference
from tests.mesh.families import ALL, CLOSED, OPEN, together

seeds = st.integers(0, 2**32 - 1)
OCTAHEDRON = lattices.polyhedron("octahedron")
TWO = (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]), [[0, 1, 2], [2, 1, 3]])


def back(mesh):
    return dual_triangles(mesh.vertices, mesh.connectivity)


class TestThereAndBack:
    @pytest.mark.parametrize("name", ALL)
    def test_dual_of_the_dual_has_the_same_darts(self, name):
        mesh = ALL[name]
        again = dual(back(mesh))
        assert_array_equal(again.connectivity.twin, mesh.connectivity.twin)
        assert_array_equal(again.connectivity.hole_darts, mesh.connectivity.hole_darts)

    def test_also_for_several_components(self):
        mesh = together(CLOSED["torus"], CLOSED["ellipsoid"].moved(CLOSED["ellipsoid"].vertices + 20))
        assert_array_equal(dual(back(mesh)).connectivity.twin, mesh.connectivity.twin)

    @given(seed=seeds, name=st.sampled_from(sorted(ALL)))
    def test_numbers_of_triangles_and_corners_do_not_matter(self, seed, name):
        rng = np.random.default_rng(seed)
        points, triangles = back(ALL[name])
        mesh = dual((points, triangles))
        corner, order = rng.permutation(len(points)), rng.permutation(len(triangles))
        turned = np.array([np.roll(t, k) for t, k in zip(triangles, rng.integers(0, 3, len(triangles)), strict=True)])
        other = dual((points[np.argsort(corner)], corner[turned][order]))
        for fact in ("n_vertices", "n_faces", "n_holes", "genus", "n_components"):
            assert getattr(other, fact) == getattr(mesh, fact)
        assert_allclose(other.vertices[: len(order)], mesh.vertices[order], atol=1e-12)
        assert_allclose(other.area, mesh.area)
        assert_array_equal(np.sort(other.connectivity.face_sizes), np.sort(mesh.connectivity.face_sizes))

    @pytest.mark.parametrize("name", ALL)
    def test_fan_keeps_the_surface(self, name):
        mesh = ALL[name]
        points, triangles = fan(mesh.vertices, mesh.connectivity)
        assert_array_equal(points[: mesh.n_vertices], mesh.vertices)
        assert len(points) == mesh.n_vertices + mesh.n_faces
        a, b, c = points[triangles].transpose(1, 0, 2)
        assert_allclose(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, mesh.area)
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        edges, count = np.unique(edges, axis=0, return_counts=True)
        assert len(points) - len(edges) + len(triangles) == mesh.connectivity.euler - mesh.n_holes
        assert (count == 1).sum() == mesh.connectivity.face_sizes[mesh.connectivity.face_is_hole].sum()
        assert count.max() == 2


class TestOpen:
    def test_border_edges_become_vertices_at_their_midpoints(self):
        mesh = dual(TWO)
        assert mesh.n_vertices == 2 + 4
        assert (mesh.n_holes, mesh.n_faces, mesh.genus) == (1, 4, 0)
        midpoints = {(0.5, 0, 0), (0, 0.5, 0), (1, 0.5, 0), (0.5, 1, 0)}
        assert {tuple(p) for p in mesh.vertices[2:].tolist()} == midpoints
        assert_allclose(mesh.vertices[:2], [[1 / 3, 1 / 3, 0], [2 / 3, 2 / 3, 0]])

    @pytest.mark.parametrize("name", OPEN)
    def test_a_border_vertex_lies_between_its_triangle_and_the_borders_before_and_after(self, name):
        mesh = OPEN[name]
        c = mesh.connectivity
        on_hole = c.face_is_hole[c.face].any(axis=1)
        n = int((~on_hole).sum())
        assert on_hole[n:].all()
        triangle, before, after = c.neighbors[n:].T
        assert (triangle < n).all()
        assert on_hole[before].all()
        assert_array_equal(c.neighbors[after, 1], np.arange(n, len(on_hole)))
        assert_array_equal(c.neighbors[before, 2], np.arange(n, len(on_hole)))

    def test_one_triangle_is_a_tetrahedron_with_a_hole(self):
        mesh = dual((np.eye(3), [[0, 1, 2]]))
        assert (mesh.n_vertices, mesh.n_faces, mesh.n_holes) == (4, 3, 1)

    def test_orientation_of_an_open_surface_is_kept(self):
        up, down = dual(TWO), dual((TWO[0], np.flip(TWO[1], axis=1)))
        bowl = (OCTAHEDRON[0], OCTAHEDRON[1][:7, ::-1])
        assert dual(bowl).volume < 0
        # About the triangles; on the border of so small a surface normals may tip over.
        assert (up.normals[:2, 2] > 0).all()
        assert (down.normals[:2, 2] < 0).all()


class TestOrientation:
    @given(seed=seeds, name=st.sampled_from(sorted(CLOSED)))
    def test_triangles_turned_at_random_are_turned_back(self, seed, name):
        points, triangles = back(CLOSED[name])
        over = np.random.default_rng(seed).random(len(triangles)) < 0.4
        mixed = np.where(over[:, None], triangles[:, ::-1], triangles)
        with pytest.warns(SimplexMeshWarning, match="flipped") if over.any() else np.errstate():
            mesh = dual((points, mixed))
        assert mesh.genus == CLOSED[name].genus
        assert mesh.volume > 0
        assert_allclose(mesh.volume, dual((points, triangles)).volume)

    def test_inside_out_is_flipped_unless_disabled(self):
        inside_out = (OCTAHEDRON[0], OCTAHEDRON[1][:, ::-1])
        with pytest.warns(SimplexMeshWarning, match="flipped 8 triangles of inside-out components"):
            assert dual(inside_out).volume > 0
        assert dual(inside_out, outward=False).volume < 0

    def test_far_from_the_origin_inside_out_is_what_it_is_near(self):
        points, triangles = back(shapes.sphere(6))
        for away in 1e6 * np.random.default_rng(0).normal(size=(8, 3)):
            with pytest.warns(SimplexMeshWarning, match="of inside-out components"):
                assert dual((points + away, triangles[:, ::-1])).volume > 0

    def test_few_turned_triangles_are_turned_back_on_an_open_surface(self):
        uv, triangles = lattices.sheet(4, 4)
        points = np.column_stack([uv, np.zeros(len(uv))])
        triangles[5] = triangles[5, ::-1]
        with pytest.warns(SimplexMeshWarning, match="flipped 1 triangle$"):
            mesh = dual((points, triangles))
        inner = mesh.connectivity.neighbors.max(axis=1) < len(triangles)
        assert (mesh.normals[inner, 2] > 0).all()

    def test_moebius_strip_is_refused(self):
        n = 9
        i = np.arange(n)
        a, b, c, d = i, i + n, (i + 1) % n, (i + 1) % n + n
        c[-1], d[-1] = d[-1], c[-1]
        faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
        angle = 2 * np.pi * i / n
        side = np.stack(
            [np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1
        )
        ring = np.stack([3 * np.cos(angle), 3 * np.sin(angle), 0 * angle], axis=1)
        with pytest.raises(TopologyError, match=r"must be orientable; the surface of triangle 0, with corners \["):
            dual((np.concatenate([ring + side, ring - side]), faces))


class TestRepairs:
    def test_repeated_corners_copies_and_unused_corners(self):
        points = np.vstack([OCTAHEDRON[0], [[9, 9, 9]]])
        faces = [*OCTAHEDRON[1].tolist(), [3, 3, 4], OCTAHEDRON[1][2, [1, 2, 0]].tolist()]
        with pytest.warns(SimplexMeshWarning, match="dropped 1 triangle with a repeated corner, dropped 1 duplicate"):
            mesh = dual((points, faces))
        assert (mesh.n_vertices, mesh.n_faces) == (8, 6)

    def test_sheets_that_touch_in_a_corner_are_split(self):
        points = np.vstack([OCTAHEDRON[0], OCTAHEDRON[0][1:] + 2 * np.eye(3)[0]])
        second = np.where(OCTAHEDRON[1] == 1, 0, OCTAHEDRON[1] + 5)  # its corner 1 is the first one's corner 0
        second[OCTAHEDRON[1] == 0] = 6
        with pytest.warns(SimplexMeshWarning, match="split 1 vertex where sheets touch, the first being 0"):
            mesh = dual((points, np.concatenate([OCTAHEDRON[1], second])))
        assert (mesh.n_components, mesh.genus, mesh.n_faces) == (2, 0, 12)

    def test_borders_that_touch_in_a_corner_are_split(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]])
        with pytest.warns(SimplexMeshWarning, match="split 1 vertex"):
            mesh = dual((points, [[0, 1, 2], [0, 3, 4]]))
        assert (mesh.n_components, mesh.n_holes) == (2, 2)


class TestRefusals:
    def test_an_edge_with_three_triangles(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
        message = "the edge of corners 0 and 1 has 3: 0, 1, 2"
        with pytest.raises(TopologyError, match=message):
            dual((points, [[0, 1, 2], [1, 0, 3], [0, 1, 4]]))

    @pytest.mark.parametrize(
        ("triangles", "error", "message"),
        [
            (3, TypeError, "triangles must be .* not int"),
            ((np.eye(3), np.zeros((0, 3), int)), ValueError, "at least one face"),
            ((np.eye(3), [[0, 1, 99]]), ValueError, r"triangles.faces\[0, 2\] is 99, outside 0..2"),
            ((np.eye(3), [[0, 1]]), ValueError, r"triangles.faces must have shape \(\*, 3\), not \(1, 2\)"),
            ((np.full((3, 3), np.nan), [[0, 1, 2]]), ValueError, "triangles.vertices must be finite"),
            ((np.eye(3), [[0, 0, 1]]), TopologyError, "three different corners"),
        ],
    )
    def test_bad_input(self, triangles, error, message):
        with pytest.raises(error, match=message):
            dual(triangles)


@given(seed=seeds, n=st.integers(1, 40), corners=st.integers(3, 30))
def test_half_edges_equal_their_naive_twin(seed, n, corners):
    rng = np.random.default_rng(seed)
    faces = np.array([rng.permutation(corners)[:3] for _ in range(n)])
    mates, crowded = _kernels.half_edge_mates(faces)
    expected = reference.half_edge_mates(faces.tolist())
    assert (crowded >= 0) == (expected is None)
    if expected is not None:
        assert_array_equal(mates, expected)


def test_takes_whatever_has_triangles():
    import pyvista

    points, faces = back(shapes.sphere(3))
    expected = dual((points, faces)).connectivity.twin
    polydata = pyvista.PolyData.from_regular_faces(points, faces)
    for triangles in (SimpleNamespace(vertices=points, faces=faces), polydata, [points.tolist(), faces.tolist()]):
        assert_array_equal(dual(triangles).connectivity.twin, expected)


def test_outward_is_a_flag():
    triangles = shapes.sphere(2).triangulated("dual")
    with pytest.raises(TypeError, match="outward must be true or false, not str 'no'"):
        dual(triangles, outward="no")
    with pytest.raises(TypeError, match="outward must be true or false, not str 'no'"):
        triangles.oriented(outward="no")
