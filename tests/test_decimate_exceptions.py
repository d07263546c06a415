"""Reduction of faces with fewer than five or more than seven vertices by T7, against a naive reference."""

from __future__ import annotations

import copy

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh.mesh import _kernels_exceptions as exceptions
from simplexmesh.mesh import shapes
from simplexmesh.mesh.coarsening import LAX
from simplexmesh.mesh.decimate import decimate
from simplexmesh.mesh.editing import EditableMesh
from tests.reference_decimate import shaken
from tests.reference_operators import Loops
from tests.test_decimate_kernels import corners_of
from tests.test_mesh_editing import MESHES, complete

names = st.sampled_from(["sphere", "torus", "two tori", "plane", "cylinder"])
seeds = st.integers(0, 2**16)
UNLIMITED = LAX._replace(turn=-2.0, quality=0.0)


def uneven(name, seed):
    """A mesh with random edge swaps, and the largest extents of its regions: 0 for some faces, which are fixed."""
    edit = EditableMesh(shaken(MESHES[name], seed))
    rng = np.random.default_rng(seed)
    edit.swap_edges(rng.choice(3 * edit.n_slots, 12))
    mesh = edit.result().mesh
    return mesh, rng.choice([np.inf, 0.0], len(mesh.connectivity.face_sizes), p=(0.95, 0.05))


def excess(loops):
    """The number of vertices by which each face is too small or too large."""
    return {f: 0 if f in loops.holes else max(5 - len(v), len(v) - 7, 0) for f, v in loops.faces.items()}


def reducible(loops, fixed, touched, steps, before):
    """Whether up to `steps` swaps beside touched exceptions reduce the excess, which may grow by one in between."""
    now = excess(loops)
    for f in [f for f in touched if now[f]]:
        for a, b in sorted({tuple(sorted(e)) for e in loops.edges(f)} if len(loops.faces[f]) > 7 else ends(loops, f)):
            four = loops.around(a, b)
            around = {x for x, loop in loops.faces.items() if {a, b} & set(loop)}
            if around & fixed or loops.refuse_swap(a, b):
                continue
            after = copy.deepcopy(loops)
            after.swap(a, b)
            total = sum(excess(after).values())
            if total < before:
                return True
            if steps > 1 and total <= before + 1 and reducible(after, fixed, touched | {*four}, steps - 1, before):
                return True
    return False


def ends(loops, f):
    """The edges that end at a face."""
    loop = loops.faces[f]
    other = {e for g in loops.faces if g != f for e in map(tuple, map(sorted, loops.edges(g)))}
    return {e for e in other if len(set(e) & set(loop)) == 1}


def reduced(mesh, max_extent, weights, steps):
    """The mesh after the kernel, and the excess that it returns."""
    edit = EditableMesh(mesh)
    edit._reserve(4)
    corners = corners_of(edit, mesh, weights, max_extent)
    left = exceptions.reduce_exceptions(edit._darts, corners, weights, steps)
    return edit.result().mesh, left


@settings(max_examples=5, deadline=None)
@given(name=names, seed=seeds, steps=st.integers(1, 2))
def test_no_short_sequence_is_left_that_reduces_the_excess(name, seed, steps):
    mesh, max_extent = uneven(name, seed)
    out, left = reduced(mesh, max_extent, UNLIMITED, steps)
    assert complete(out.connectivity)
    before, after = Loops(mesh.connectivity), Loops(out.connectivity)
    assert left == sum(excess(after).values()) <= sum(excess(before).values())
    loops = {frozenset(v): f for f, v in after.faces.items()}
    kept = {f for f in np.flatnonzero(max_extent == 0).tolist() if f not in before.holes}
    assert all(frozenset(before.faces[f]) in loops for f in kept)  # fixed faces keep their vertices
    fixed = after.holes | {loops[frozenset(before.faces[f])] for f in kept}
    worst = [f for f, more in excess(after).items() if more]
    total = sum(excess(after).values())
    assert not any(reducible(after, fixed, {f}, steps, total) for f in worst)


@settings(max_examples=10, deadline=None)
@given(name=names, seed=seeds)
def test_a_sequence_that_reduces_nothing_is_undone(name, seed):
    mesh, _ = uneven(name, seed)
    loops = Loops(mesh.connectivity)
    max_extent = np.full(len(mesh.connectivity.face_sizes), np.inf)
    big = UNLIMITED._replace(min_component=10**6)  # all components are smaller
    assert_array_equal(reduced(mesh, max_extent, big, 3)[0].neighbors, mesh.neighbors)
    if not any(reducible(loops, loops.holes, {f}, 2, sum(excess(loops).values())) for f in loops.faces):
        assert_array_equal(reduced(mesh, max_extent, UNLIMITED, 2)[0].neighbors, mesh.neighbors)


def test_short_sequences_eliminate_the_exceptions_of_a_ball():
    """A ball with random edge swaps."""
    ball = shapes.sphere(6)
    edit = EditableMesh(ball)
    edit.swap_edges(np.random.default_rng(1).choice(3 * edit.n_slots, 30))
    mesh = edit.result().mesh
    sizes = mesh.connectivity.face_sizes
    assert ((sizes < 5) | (sizes > 7)).sum() > 3
    out, left = reduced(mesh, np.full(len(sizes), np.inf), UNLIMITED, 3)
    assert left == 0
    assert set(out.connectivity.face_sizes.tolist()) == {5, 6, 7}


def test_smooth_shapes_have_no_exceptions():
    for mesh, count in ((shapes.torus(40, 20), 200), (shapes.sphere(20), 300), (shapes.ellipsoid((1, 2, 3), 16), 400)):
        assert len(decimate(mesh, vertices=count).exceptions) == 0
