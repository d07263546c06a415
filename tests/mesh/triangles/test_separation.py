"""Bodies that touch, taken apart: cubes of a lattice and bodies that pass through each other at one edge."""

import itertools

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

import simplexmesh as sm
from simplexmesh.data.cutting.dividing import halved_where_crowded
from simplexmesh.mesh.triangles.separation import separated, without_repeated

CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
TURN = Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).as_matrix()


def cubes(places, rng=None):
    """Return unit cubes with shared corners, turned so that rounding is as it is anywhere, with random diagonals."""
    rng = rng or np.random.default_rng(0)
    vertices = (np.asarray(places)[:, None] + CORNERS).reshape(-1, 3)
    quads = (8 * np.arange(len(places))[:, None, None] + QUADS).reshape(-1, 4)
    quads = np.take_along_axis(quads, (np.arange(4) + rng.integers(0, 2, (len(quads), 1))) % 4, axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    turned = vertices @ TURN.T
    first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)[1:]
    return sm.TriangleMesh(turned[first], inverse.reshape(-1)[faces])


def apart(mesh):
    """Return the surfaces with vertices in the middle of edges where they meet, taken apart, and how many edges."""
    mesh, crowded = halved_where_crowded(mesh)
    faces, sources = separated(mesh.vertices, mesh.faces)
    return sm.TriangleMesh(mesh.vertices[sources], faces), crowded


@pytest.mark.parametrize("seed", range(5))
def test_cubes_that_share_walls_are_closed_bodies_of_their_own(seed):
    filled = np.argwhere(np.random.default_rng(seed).random((4, 4, 4)) < 0.5)
    mesh, crowded = apart(cubes(filled))
    assert crowded
    touching_at_edges = mesh.topology
    assert touching_at_edges.n_components == len(filled)
    assert touching_at_edges.euler == 2 * len(filled)
    assert mesh.volume == pytest.approx(len(filled))


def without_walls(filled):
    """Return the surface of filled cells, whose corners lie apart from all others' edges."""
    cells = np.argwhere(filled)
    mesh = cubes(cells)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    centers = (cells + 0.5) @ TURN.T
    walls = mesh.faces[(np.linalg.norm(middle[:, None] - centers, axis=2) < 0.6).sum(axis=1) == 1]
    return sm.TriangleMesh(mesh.vertices, walls)


def test_columns_that_touch_along_edges_whose_ends_they_share():
    """Two of three cubes, joined by one at each end: at both ends of the edges between them the surface is one."""
    filled = np.zeros((2, 2, 3), bool)
    filled[0, 0], filled[1, 1] = True, True
    filled[0, 1, [0, 2]] = True
    found, crowded = apart(without_walls(filled))
    assert crowded == 1
    assert found.topology.n_borders == 0
    assert found.volume == pytest.approx(8)


def test_a_triangle_that_is_there_twice_counts_once():
    faces = np.array([[0, 1, 2], [2, 1, 0], [1, 2, 0], [3, 4, 5]])
    assert without_repeated(faces).tolist() == [[0, 1, 2], [2, 1, 0], [3, 4, 5]]


@pytest.mark.parametrize("seed", [*range(4), 24, 98, 105])
def test_a_lattice_that_touches_itself_is_closed_and_keeps_its_volume(seed):
    """Without the walls between cubes: as many bodies as are connected by walls."""
    filled = np.random.default_rng(seed).random((4, 4, 4)) < 0.35
    mesh = without_walls(filled)
    with pytest.raises(sm.TopologyError):
        _ = mesh.topology
    found, _ = apart(mesh)
    assert found.topology.n_borders == 0
    assert found.topology.n_components == ndimage.label(filled)[1]
    assert found.volume == pytest.approx(filled.sum())


def test_bodies_that_pass_through_each_other_at_one_edge_stay_whole():
    """By angles alone, the inner sides of one would end at the other."""
    wedge = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0.5], [0, 1, 0.5]], float)
    faces = np.array([[0, 3, 1], [0, 1, 2], [1, 3, 2], [0, 2, 3]])
    turned = wedge @ Rotation.from_euler("z", 45, degrees=True).as_matrix().T
    both = sm.TriangleMesh(np.concatenate([wedge, turned]), np.concatenate([faces, faces + 4])).welded(report=False)
    mesh, crowded = apart(both)
    assert crowded == 1
    assert (mesh.topology.n_components, mesh.topology.euler) == (2, 4)


def test_triangles_turned_over_elsewhere_stay_where_they_are():
    mesh = cubes([[0, 0, 0], [0, 1, 1]])  # which share an edge
    _, crowded = apart(mesh)
    assert crowded == 1
    shared = np.isin(mesh.faces, np.intersect1d(mesh.faces[:12], mesh.faces[12:])).sum(axis=1) == 2
    faces = np.where(shared[:, None], mesh.faces, mesh.faces[:, ::-1])
    found, _ = apart(sm.TriangleMesh(mesh.vertices, faces))
    assert found.volume != pytest.approx(2)
    with pytest.warns(sm.SimplexMeshWarning, match="flipped"):
        assert found.oriented().volume == pytest.approx(2)


def test_a_sheet_on_a_body_gets_a_border_there():
    cube = cubes([[0, 0, 0]])
    fin = sm.TriangleMesh(
        np.concatenate([cube.vertices, [[2.0, 2.0, 2.0]]]), np.concatenate([cube.faces, [[*cube.faces[0, :2], 8]]])
    )
    mesh, crowded = apart(fin)
    assert crowded == 1
    assert (mesh.topology.n_components, mesh.topology.n_borders) == (2, 1)


def test_a_sheet_around_the_edge_of_a_body_is_joined_to_itself():
    """Its two sides lie right beside those of the wedge, each of which is nearer to one of them than the other is."""
    wedge = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0.5], [0, 1, 0.5]], float)
    faces = np.array([[0, 3, 1], [0, 1, 2], [1, 3, 2], [0, 2, 3]])
    for order in ([[1, 0, 4], [0, 1, 5]], [[0, 1, 4], [1, 0, 5]]):
        around = np.array([[1, -0.2, 0.5], [-0.2, 1, 0.5]])
        mesh, crowded = apart(sm.TriangleMesh(np.concatenate([wedge, around]), np.concatenate([faces, order])))
        assert crowded == 1
        assert (mesh.topology.n_components, mesh.topology.n_borders) == (2, 1)
