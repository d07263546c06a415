"""Kernels of the automatic initialization equal their references."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy import ndimage
from scipy.spatial import ConvexHull

from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.mesh.shapes import torus
from simplexmesh.mesh.triangles import _kernels_relaxation
from simplexmesh.motion.start import _kernels_remesh, _kernels_topology, topology
from simplexmesh.orientation import _kernels_grid
from tests.motion.start import reference as reference
from tests.nightly.marks import nightly

SHAPE = (7, 8, 9)
seeds = st.integers(0, 2**32 - 1)


def points(rng, count=20):
    return 1 + rng.random((count, 3)) * (np.array(SHAPE) - 3)


@given(seeds)
def test_samples_near_points(seed):
    rng = np.random.default_rng(seed)
    at, reach = points(rng, 5), rng.uniform(0.5, 2.5)
    out = np.zeros(SHAPE, bool)
    _kernels_grid.mark_near(at, reach, out)
    assert_array_equal(out, reference.near(at, reach, SHAPE))


@given(seeds, st.tuples(st.integers(1, 7), st.integers(1, 8), st.integers(1, 9)), st.floats(0.0, 0.8))
def test_floods_fill_the_component_of_the_first_corner(seed, shape, share):
    wall = np.random.default_rng(seed).random(shape) < share
    filled = wall.copy()
    _kernels_grid.flood(filled)
    assert_array_equal(filled, wall | reference.outside(wall))


def test_a_flood_finds_its_way_along_a_pipe_that_turns_all_six_ways():
    wall = np.ones((6, 6, 6), bool)
    ends = [(0, 0, 0), (4, 0, 0), (4, 2, 0), (0, 2, 0), (0, 4, 0), (0, 4, 4), (2, 4, 4), (2, 4, 2), (2, 2, 2)]
    for one, other in itertools.pairwise(ends):
        wall[tuple(slice(min(pair), max(pair) + 1) for pair in zip(one, other, strict=True))] = False
    _kernels_grid.flood(wall)
    assert wall.all()


@given(seeds)
def test_trilinear_weights_there_and_back(seed):
    rng = np.random.default_rng(seed)
    at, values, field = points(rng), rng.normal(size=20), rng.normal(size=SHAPE)
    layer = np.zeros(SHAPE)
    _kernels_grid.splat(at, values, layer)
    assert_allclose(layer, reference.splat(at, values, SHAPE), atol=1e-12)
    found, gradients = np.zeros(20), np.zeros((20, 3))
    _kernels_grid.interpolate(field, at, found, gradients)
    wanted = reference.interpolate(field, at)
    assert_allclose(found, wanted[0], atol=1e-12)
    assert_allclose(gradients, wanted[1], atol=1e-12)
    assert_allclose((layer * field).sum(), values @ found)  # the one is the transpose of the other


@given(seeds)
def test_thinning(seed):
    rng = np.random.default_rng(seed)
    solid = np.pad(ndimage.gaussian_filter(rng.normal(size=(6, 7, 8)), 0.7) > -0.1, 1)
    keep = solid & (rng.random(solid.shape) < 0.1)
    cells = rng.permutation(np.argwhere(solid & ~keep))
    out = solid.copy()
    _kernels_topology.thin(out, keep, cells, topology._ADJACENCY6, topology._ADJACENCY26, 50)
    assert_array_equal(out, reference.thin(solid, keep, cells, 50))


def test_a_bridge_over_a_corner_does_not_connect():
    block = np.zeros((5, 5, 5), bool)
    for cell in ((1, 2, 2), (1, 2, 1), (1, 1, 1), (2, 1, 1), (2, 1, 2), (2, 2, 2)):
        block[cell] = True  # a ring of six cells
    out, keep = block.copy(), np.zeros_like(block)
    _kernels_topology.thin(out, keep, np.array([[2, 2, 2]]), topology._ADJACENCY6, topology._ADJACENCY26, 1)
    assert_array_equal(out, reference.thin(block, keep, [(2, 2, 2)], 1))
    assert out[2, 2, 2]  # or the ring would open


def uneven(seed):
    """A closed triangulation of a bumpy sphere with valences from 3 upwards."""
    vertices = np.random.default_rng(seed).normal(size=(150, 3))
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    faces = ConvexHull(vertices).simplices.astype(np.int64)
    inwards = np.einsum("ij,ij->i", np.cross(*(vertices[faces[:, j]] for j in (1, 2))), vertices[faces[:, 0]]) < 0
    faces[inwards] = faces[inwards, ::-1]
    return vertices * (1 + 0.1 * np.sin(5 * vertices[:, :1])), faces


def canonical(faces):
    faces = np.asarray(faces)
    first = faces.argmin(axis=1)
    return sorted(map(tuple, np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)))


@pytest.mark.parametrize("seed", range(3))
def test_flipping(seed):
    vertices, faces = uneven(seed)
    mates = half_edge_mates(faces)
    corners, kernel_mates = faces.ravel().copy(), mates.ravel().astype(np.int64)
    valence = np.bincount(corners)
    flips = _kernels_remesh.flip_round(vertices, corners, kernel_mates, valence)
    wanted, count = reference.flip_round(vertices, faces, mates)
    assert flips == count > 0
    assert canonical(corners.reshape(-1, 3)) == canonical(wanted)
    assert_array_equal(kernel_mates, half_edge_mates(corners.reshape(-1, 3)).ravel())
    assert_array_equal(valence, np.bincount(corners))


@pytest.mark.parametrize("step", [0.5, 3.0])
@pytest.mark.parametrize("seed", [0, *nightly(1, 2)])
def test_relaxing(seed, step):
    vertices, faces = uneven(seed)
    corners, mates = faces.ravel().copy(), half_edge_mates(faces).ravel().astype(np.int64)
    first = np.full(len(vertices), -1)
    first[corners] = np.arange(len(corners))
    out = vertices.copy()
    _kernels_relaxation.relax_round(out, corners, mates, first, step)
    assert_allclose(out, reference.relax_round(vertices, faces, step), atol=1e-12)
    assert np.abs(out - vertices).max() > 0


def turned_to_smallest(face):
    at = int(np.argmin(face))
    return tuple(int(v) for v in np.roll(face, -at))


@settings(max_examples=3)
@given(seeds, st.integers(4, 80), st.sampled_from([0.5, -2.0]))
def test_collapsing_the_shortest_edges(seed, triangles, turn):
    """On convex hulls and, with links that forbid collapses, on thin tori."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        vertices = rng.normal(size=(40, 3))
        vertices /= np.linalg.norm(vertices, axis=1)[:, None]
        faces = ConvexHull(vertices).simplices.astype(np.int64)
        out = np.einsum("ij,ij->i", np.cross(*(vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))),
                        vertices[faces].mean(axis=1)) < 0  # fmt: skip
        faces[out] = faces[out][:, ::-1]
    else:
        donut = torus(12, 6, tube_radius=0.3).triangulated()
        vertices = donut.vertices + rng.normal(scale=0.02, size=donut.vertices.shape)
        faces = np.array(donut.faces, np.int64)
    positions, corners = np.array(vertices, order="C"), faces.ravel().copy()
    mates = np.array(half_edge_mates(faces), np.int64).ravel()
    left = _kernels_remesh.collapse_shortest(positions, corners, mates, triangles, turn)
    kept = corners[corners != _kernels_remesh.REMOVED].reshape(-1, 3)
    at, wanted = reference.collapse_shortest(vertices, faces, triangles, turn)
    assert left == len(kept) == len(wanted)
    assert {turned_to_smallest(face) for face in kept} == {turned_to_smallest(face) for face in wanted}
    used = np.unique(kept)
    assert_allclose(positions[used], [at[v] for v in used], atol=1e-12)
    assert_array_equal(half_edge_mates(kept).ravel() >= 0, True)
