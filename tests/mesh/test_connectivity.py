"""The topology of a simplex mesh: facts about darts, faces, edges, components and neighborhoods."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import _kernels
from simplexmesh.mesh.connectivity import Connectivity
from tests.mesh import reference as reference
from tests.mesh.families import ALL, CLOSED, HOLES, SPHERES, flipped, renumbered, together

TETRAHEDRON = [[3, 6, 9], [0, 11, 7], [1, 5, 10], [2, 8, 4]]
meshes = st.sampled_from(sorted(ALL)).map(ALL.get)
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("name", ALL)
class TestEveryMesh:
    def test_euler_relation(self, name):
        c = ALL[name].connectivity
        assert c.euler == c.n_vertices - c.n_edges + len(c.face_sizes) == 2 * (c.n_components - c.genus)
        assert c.genus == ("torus" in name)
        assert c.n_holes == HOLES.get(name, 0)
        assert c.n_faces + c.n_holes == len(c.face_sizes) == len(c.face_offsets) - 1
        assert 2 * c.n_edges == 3 * c.n_vertices

    def test_neighbors_are_mutual(self, name):
        c = ALL[name].connectivity
        i = np.arange(c.n_vertices)[:, None, None]
        assert (c.neighbors[c.neighbors] == i).any(axis=2).all()
        assert_array_equal(c.twin.ravel()[c.twin], np.arange(3 * c.n_vertices).reshape(-1, 3))

    def test_faces_walk_along_edges_with_themselves_on_the_left(self, name):
        c = ALL[name].connectivity
        for f, (begin, end) in enumerate(zip(c.face_offsets[:-1], c.face_offsets[1:], strict=True)):
            darts = c.face_darts[begin:end]
            assert end - begin == c.face_sizes[f] >= 3
            assert (c.face.ravel()[darts] == f).all()
            assert_array_equal(c.twin.ravel()[darts] // 3, np.roll(c.face_vertices[begin:end], -1))
        assert_array_equal(np.sort(c.face_darts), np.arange(3 * c.n_vertices))

    def test_faces_are_numbered_by_their_smallest_dart(self, name):
        c = ALL[name].connectivity
        smallest = np.minimum.reduceat(c.face_darts, c.face_offsets[:-1])
        assert (np.diff(smallest) > 0).all()

    def test_edges(self, name):
        c = ALL[name].connectivity
        assert c.edge_vertices.shape == (c.n_edges, 2)
        assert (c.edge_vertices[:, 0] < c.edge_vertices[:, 1]).all()
        assert (c.neighbors[c.edge_vertices[:, 0]] == c.edge_vertices[:, 1:]).any(axis=1).all()
        assert len(np.unique(c.edge_vertices, axis=0)) == c.n_edges
        assert_array_equal(np.bincount(c.edge_faces.ravel()), c.face_sizes)
        for vertices, faces in zip(c.edge_vertices[:50], c.edge_faces[:50], strict=True):
            for vertex in vertices:
                assert set(faces) <= set(c.vertex_faces[vertex])

    def test_kernels_equal_their_twins(self, name):
        c = ALL[name].connectivity
        for ours, theirs in zip(
            _kernels.face_orbits(c.twin.reshape(-1)), reference.face_orbits(c.twin.ravel()), strict=True
        ):
            assert_array_equal(ours, theirs)
        assert_array_equal(c.components, reference.component_labels(c.neighbors))

    def test_neighbors_alone_give_the_same_darts(self, name):
        c = ALL[name].connectivity
        again = Connectivity.from_neighbors(c.neighbors, c.hole_darts)
        assert_array_equal(again.twin, c.twin)
        assert_array_equal(again.face_is_hole, c.face_is_hole)


@pytest.mark.parametrize("size", [0, 1, 2, 5])
@pytest.mark.parametrize("name", ["icosahedron-2", "torus", "plane"])
def test_rings_are_the_vertices_within_so_many_edges(name, size):
    c = ALL[name].connectivity
    offsets, vertices = c.rings(size)
    assert offsets[-1] == len(vertices)
    assert [ring.tolist() for ring in np.split(vertices, offsets[1:-1])] == reference.rings(c.neighbors, size)


@given(mesh=meshes, seed=seeds)
def test_renumbering_changes_nothing_but_numbers(mesh, seed):
    order = np.random.default_rng(seed).permutation(mesh.n_vertices)
    other = renumbered(mesh, order).connectivity
    c = mesh.connectivity
    assert (other.genus, other.n_holes, other.n_components) == (c.genus, c.n_holes, c.n_components)
    assert_array_equal(np.sort(other.face_sizes), np.sort(c.face_sizes))
    assert_array_equal(np.sort(order[other.neighbors], axis=1), np.sort(c.neighbors[order], axis=1))


@pytest.mark.parametrize("name", ALL)
def test_seen_from_inside_faces_run_backward(name):
    mesh = ALL[name]

    def loops(c, step):
        faces = np.split(c.face_vertices, c.face_offsets[1:-1])
        turned = [f[::step] for f in faces]
        return {(hole, *np.roll(f, -f.argmin())) for f, hole in zip(turned, c.face_is_hole, strict=True)}

    assert loops(flipped(mesh).connectivity, -1) == loops(mesh.connectivity, 1)


def test_components_add_up():
    mesh = together(ALL["torus"], ALL["plane"], ALL["icosahedron-1"], ALL["torus"])
    c = mesh.connectivity
    assert (c.n_components, c.genus, c.n_holes) == (4, 2, 1)
    assert_array_equal(
        np.bincount(c.components), [ALL[k].n_vertices for k in ("torus", "plane", "icosahedron-1", "torus")]
    )


def test_shapes_have_the_faces_of_their_polyhedra():
    for name, (sides, corners) in {"tetrahedron": (3, 4), "octahedron": (4, 6), "icosahedron": (5, 12)}.items():
        for f in (2, 5):
            sizes = np.bincount(SPHERES[f"{name}-{f}"].connectivity.face_sizes, minlength=7)
            assert sizes[sides] == corners
            assert sizes.sum() == corners + sizes[6]
    assert (CLOSED["torus"].connectivity.face_sizes == 6).all()


def test_a_hole_may_be_named_by_any_of_its_darts():
    c = ALL["cylinder"].connectivity
    darts = c.face_darts[c.face_is_hole[c.face.ravel()[c.face_darts]]]
    again = Connectivity(c.twin, darts)
    assert_array_equal(again.hole_darts, c.hole_darts)
    assert (c.face_is_hole[c.face.ravel()[c.hole_darts]]).all()


def test_arrays_are_read_only_small_and_copied():
    twin = np.array(TETRAHEDRON)
    c = Connectivity(twin)
    twin[0, 0] = 5
    assert c.twin[0, 0] == 3
    for values in (c.twin, c.neighbors, c.face, c.face_darts, c.edge_faces, c.components, c.face_vertices):
        assert values.dtype == np.int32
        assert not values.flags.writeable
    assert c.neighbors is c.neighbors


@pytest.mark.parametrize(
    ("twin", "error", "message"),
    [
        ([[0, 1]], ValueError, r"twin must have shape \(\*, 3\), not \(1, 2\)"),
        ([[0.5, 1, 2]] * 4, TypeError, "twin must be whole numbers"),
        (np.zeros((0, 3), int), TopologyError, "not 0"),
        ([[3, 6, 99], *TETRAHEDRON[1:]], ValueError, r"twin\[0, 2\] is 99, outside 0..11"),
        ([[3, 6, 8], *TETRAHEDRON[1:]], TopologyError, "at vertex 0 the twin of dart 2 is 8, whose twin is 10"),
        ([[1, 0, 9], [3, 11, 7], [6, 5, 10], [2, 8, 4]], TopologyError, "vertex 0 is its own neighbor"),
        ([[3, 4, 8], [0, 1, 11], [9, 10, 2], [6, 7, 5]], TopologyError, "vertex 0 must have three different"),
    ],
)
def test_what_is_no_mesh_is_refused(twin, error, message):
    with pytest.raises(error, match=message):
        Connectivity(twin)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Connectivity.from_neighbors(3), r"^neighbors must have shape \(\*, 3\), not \(\)$"),
        (lambda: Connectivity.from_neighbors([[1, 2], [3]]), "^neighbors must be an array, but its rows have"),
        (lambda: Connectivity(TETRAHEDRON, [[1, 2], [3]]), "^hole_darts must be an array, but its rows have"),
    ],
)
def test_what_is_no_table_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_one_sided_neighbors_and_absent_holes_are_refused():
    with pytest.raises(TopologyError, match="vertex 1 is a neighbor of vertex 0, but 0 is not one of its neighbors"):
        Connectivity.from_neighbors([[1, 2, 3], [4, 3, 2], [0, 1, 3], [0, 2, 1], [1, 2, 3]])
    with pytest.raises(ValueError, match=r"hole_darts\[0\] is 12, outside 0..11"):
        Connectivity(TETRAHEDRON, [12])
