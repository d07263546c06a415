"""Kernels of decimation against naive references: regions, order of removal, the queue, T7, vertex placement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from simplexmesh.mesh import shapes
from simplexmesh.mesh.decimation import _kernels_collapse as kernels
from simplexmesh.mesh.decimation import _kernels_regions as regions
from simplexmesh.mesh.decimation import _kernels_swap as swapping
from simplexmesh.mesh.decimation.coarsening import WEIGHTS
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from tests.mesh.decimation.reference import Decimation, regions_of, shaken
from tests.mesh.operators.reference import Loops
from tests.mesh.operators.test_editing import MESHES

names = st.sampled_from(["sphere", "torus", "two tori", "plane", "cylinder", "torus with holes"])
seeds = st.integers(0, 2**16)


def corners_of(edit, mesh, weights, max_extent):
    """The faces as arrays for the kernels."""
    return regions.corners_of(edit._darts, mesh.connectivity.components, max_extent, weights)


def assert_same_region(row, region, w):
    """Check all numbers of a row against integrals over the triangles."""
    area, centroid, squares, vector = region.surface()
    length, _, rim_squares = region.rim()
    assert_allclose(row[0], area)
    assert_allclose(row[1:4], centroid, atol=1e-12)
    assert_allclose(row[4:10], squares[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)], atol=1e-12)
    assert_allclose(row[10:13], vector, atol=1e-12)
    assert_allclose(row[13], length)
    assert_allclose(row[17:23], rim_squares[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)], atol=1e-12)
    assert_allclose(regions.energy(row, w), region.energy(w), atol=1e-12)


@settings(max_examples=10)
@given(name=names, seed=seeds)
def test_regions_are_integrals_and_merge(name, seed):
    mesh = shaken(MESHES[name], seed)
    w = WEIGHTS._replace(normals=0.7, extent=0.2, rim=0.4)
    max_extent = np.full(len(mesh.connectivity.face_sizes), np.inf)
    rows, expected = corners_of(EditableMesh(mesh), mesh, w, max_extent).regions, regions_of(mesh)
    rng = np.random.default_rng(seed)
    on_rims = [f for f, region in expected.items() if len(region.segments)] or list(expected)
    for f, g in (*rng.choice(list(expected), (4, 2)), *rng.choice(on_rims, (4, 2))):
        assert_same_region(rows[f], expected[f], w)
        row = np.empty(regions.ROW_SIZE)
        regions.merge(rows[f], rows[g], row)
        both = expected[f] + expected[g]
        assert_same_region(row, both, w)
        parts = sum(regions.energy(rows[x], w) for x in (f, g))
        assert regions.energy(row, w) >= parts * (1 - 1e-9)
        for limits in rng.uniform(0, (0.3, 1.0), (10, 2)):
            assert regions.exceeds_limits(row, *limits) == both.exceeds_limits(*limits)


STRICT = (
    {},
    {"turn": 0.99},
    {"bend": 0.5},
    {"quality": 0.8},
    {"imbalance": 3.0},
    {"min_component": 40},
    {"max_size": 7},
    {"extent": 0.1, "normals": 0.0},
    {"rim": 30.0},
    {"max_deviation": 0.02},
)


@pytest.mark.parametrize("strict", STRICT, ids=str)
@settings(max_examples=1)
@given(name=names, seed=seeds, count=st.integers(10, 20))
def test_the_order_of_removal_is_that_of_the_naive_reference(strict, name, seed, count):
    mesh = shaken(MESHES[name], seed)
    weights = WEIGHTS._replace(**strict)
    edit = EditableMesh(mesh)
    edit._reserve(count)
    rng = np.random.default_rng(seed)
    max_extent = rng.choice([np.inf, 0.3, 0.0], len(mesh.connectivity.face_sizes), p=(0.7, 0.2, 0.1))
    corners = corners_of(edit, mesh, weights, max_extent)
    twin = Decimation(mesh, weights, max_extent)
    done = kernels.collapse_cheapest(edit._darts, corners, weights, count)
    assert done == twin.run(count)
    d, out = edit._darts, edit.result()
    assert Loops(out.mesh.connectivity).canonical() == twin.loops.canonical(out.vertex_map)
    for f, loop in twin.loops.faces.items():
        if f not in twin.loops.holes:
            dart = next(x for x in range(3 * loop[0], 3 * loop[0] + 3) if d.twin[x] // 3 == loop[1])
            assert_same_region(corners.regions[d.face[dart]], twin.regions[f], weights)
            assert_allclose(corners.points[d.face[dart]], twin.points[f], atol=1e-10)
            assert corners.max_extent[d.face[dart]] == twin.max_extent[f]


@pytest.mark.parametrize("necks", [False, True])
def test_no_three_faces_make_a_thin_neck(necks):
    tube = shapes.cylinder(6, 16)
    tube = shaken(tube.moved(tube.vertices * (0.3, 0.3, 3.0)), 0)
    lax = WEIGHTS._replace(turn=-1.0, bend=-1.0, quality=0.0, extent=1.0, normals=0.0, necks=necks, max_size=100)
    edit = EditableMesh(tube)
    edit._reserve(60)
    corners = corners_of(edit, tube, lax, np.full(len(tube.connectivity.face_sizes), np.inf))
    kernels.collapse_cheapest(edit._darts, corners, lax, 60)
    c = edit.result().mesh.connectivity
    beside = {f: set() for f in np.flatnonzero(~c.face_is_hole).tolist()}
    for a, b in c.edge_faces[~c.face_is_hole[c.edge_faces].any(axis=1)].tolist():
        beside[a].add(b)
        beside[b].add(a)
    rings = {frozenset((a, b, x)) for a in beside for b in beside[a] for x in beside[a] & beside[b]}
    assert bool(rings - {frozenset(faces) for faces in c.face.tolist()}) == necks


@pytest.mark.parametrize("strict", [{}, {"turn": 0.9}, {"quality": 0.8}], ids=str)
@settings(max_examples=3)
@given(name=names, seed=seeds)
def test_edges_are_swapped_as_in_the_naive_reference(strict, name, seed):
    weights = WEIGHTS._replace(**strict)
    edit = EditableMesh(shaken(MESHES[name], seed))
    edit.swap_edges(np.random.default_rng(seed).choice(3 * edit.n_slots, 12))
    mesh = edit.result().mesh
    max_extent = np.random.default_rng(seed).choice([np.inf, 0.0], len(mesh.connectivity.face_sizes), p=(0.9, 0.1))
    edit = EditableMesh(mesh)
    corners, twin, d = corners_of(edit, mesh, weights, max_extent), Decimation(mesh, weights, max_extent), edit._darts
    for dart in range(d.twin.size):
        a, b = dart // 3, int(d.twin[dart]) // 3
        if a < b:
            assert swapping.may_swap(d, corners, dart, weights) == twin.may_swap(a, b)
    swapping.swap_unequal(d, corners, weights)
    after = Decimation(edit.result().mesh, weights, max_extent)
    after.points = dict(enumerate(corners.points))
    loops = {frozenset(loop): f for f, loop in after.loops.faces.items()}
    assert len(loops) == len(corners.points)
    rows = [[x // 3 for x in edit.around(f)] for f in range(len(corners.points))]
    number = {f: loops[frozenset(row)] for f, row in enumerate(rows)}
    after.points = {number[f]: point for f, point in enumerate(corners.points)}
    after.max_extent = {number[f]: value for f, value in enumerate(max_extent)}
    assert not any(after.may_swap(a, b) for a, b in edit.result().mesh.connectivity.edge_vertices.tolist())


@pytest.mark.parametrize("name", ["sphere", "plane"])
def test_vertices_are_placed_at_the_centroids_of_dual_triangles(name):
    mesh = shaken(MESHES[name], 1)
    edit = EditableMesh(mesh)
    max_extent = np.full(len(mesh.connectivity.face_sizes), np.inf)
    max_extent[3] = 0
    corners = corners_of(edit, mesh, WEIGHTS, max_extent)
    swapping.place_vertices(edit._darts, corners)
    c = mesh.connectivity
    fixed = c.face_is_hole[c.vertex_faces].any(axis=1) | (c.vertex_faces == 3).any(axis=1)
    expected = np.where(fixed[:, None], mesh.vertices, corners.points[c.vertex_faces].mean(axis=1))
    assert_allclose(edit.result().mesh.vertices, expected, atol=1e-12)
