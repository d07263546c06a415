"""Batches: equal to single edits, in memory order or as given, with the reasons of those skipped."""

from __future__ import annotations

import copy
import pickle

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from simplexmesh.mesh import shapes
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import REASONS
from tests.mesh.operators import reference
from tests.mesh.operators.test_editing import MESHES, alive_darts, labels_hold, names, seeds


@given(name=names, seed=seeds)
def test_batches_equal_their_edits_one_by_one(name, seed):
    mesh, rng = MESHES[name], np.random.default_rng(seed)
    many, single = EditableMesh(mesh), EditableMesh(mesh)
    for method in ("swap_edges", "remove_edges", "swap_edges"):
        darts = rng.choice(alive_darts(many), 30)
        before = many._darts.twin[darts].copy()
        batch = getattr(many, method)(darts, in_order=True)
        assert sum(batch.reasons.values()) == (~batch.done).sum()
        for dart, twin, status in zip(darts, before, batch.status, strict=True):
            if single._darts.twin[dart] != twin or not single._darts.alive[dart // 3]:
                assert REASONS[int(status)] == "touched by an earlier edit"
            else:
                assert getattr(single, method)([dart]).status[0] == status
    assert_array_equal(many.result().mesh.connectivity.twin, single.result().mesh.connectivity.twin)
    assert_array_equal(many.result().mesh.vertices, single.result().mesh.vertices)


@given(name=names, seed=seeds, method=st.sampled_from(["swap", "remove", "insert", "remove_faces", "refine_faces"]))
def test_batches_are_applied_in_memory_order_by_default(name, seed, method):
    mesh, rng = MESHES[name], np.random.default_rng(seed)
    loose, sorted_ = EditableMesh(mesh), EditableMesh(mesh)
    c = mesh.connectivity
    count = len(c.face_sizes) if method.endswith("faces") else c.twin.size
    chosen = rng.integers(0, count, 30)
    order = np.argsort(chosen, kind="stable")
    args = (chosen,)
    if method == "insert":
        across = np.concatenate([rng.choice(loose.around(int(f)), 1) for f in c.face.reshape(-1)[chosen]])
        args = chosen, across, rng.uniform(0.2, 0.8, (30, 2))
    call = method if method.endswith("faces") else f"{method}_edges"
    one = getattr(loose, call)(*args)
    other = getattr(sorted_, call)(*(values[order] for values in args), in_order=True)
    assert one.reasons == other.reasons
    assert_array_equal(one.status[order], other.status)
    assert_array_equal(one.witness[order], other.witness)
    assert_array_equal(loose.result().mesh.connectivity.twin, sorted_.result().mesh.connectivity.twin)
    assert_array_equal(loose.result().mesh.vertices, sorted_.result().mesh.vertices)


@given(name=names, seed=seeds)
def test_batches_of_faces_equal_their_edges_one_by_one(name, seed):
    mesh, rng = MESHES[name], np.random.default_rng(seed)
    many, single = EditableMesh(mesh), EditableMesh(mesh)
    number = {f: f for f in range(len(mesh.connectivity.face_sizes))}  # of the faces of `many` in `single`
    for method in ("refine_faces", "remove_faces", "refine_faces"):
        there = np.array(sorted(number))
        faces = rng.choice(there, 12)
        batch = getattr(many, method)(faces, in_order=True)
        assert sum(batch.reasons.values()) == (~batch.done).sum()
        touched = set()
        for face, status in zip(faces.tolist(), batch.status.tolist(), strict=True):
            assert status == expected_of_face(single, method, number[face], touched)
        labels_hold(many)
        assert_array_equal(many.result().mesh.connectivity.twin, single.result().mesh.connectivity.twin)
        assert_array_equal(many.result().mesh.connectivity.hole_darts, single.result().mesh.connectivity.hole_darts)
        assert_array_equal(many.result().mesh.vertices, single.result().mesh.vertices)
        d, e = many._darts, single._darts
        alive = np.flatnonzero(d.face_dart[: many._used[1]] >= 0)
        number = dict(zip(alive.tolist(), e.face[d.face_dart[alive]].tolist(), strict=True))
    many.undo()
    assert_array_equal(many.result().mesh.connectivity.twin, mesh.connectivity.twin)
    assert_array_equal(many.result().mesh.vertices, mesh.vertices)


def expected_of_face(edit, method, face, touched):
    """Apply T6 or T5 by the reference, and return the expected status; `touched` is of this batch."""
    if face in touched:
        return 1
    if edit._darts.face_hole[face]:
        return 9
    if method == "refine_faces":
        reference.refine_face(edit, face)
        touched.add(face)
        return 0
    beside = [edit.faces_beside(int(dart))[1] for dart in edit.around(face)]
    if any(edit._darts.face_hole[other] for other in beside):
        return 10
    status = reference.remove_face(edit, face)
    if not status:
        touched.update([face, *beside])
    return status


def test_the_order_of_memory_is_that_of_large_numbers_too():
    """Darts above 2 ** 16, some of them repeated."""
    mesh = shapes.sphere(60)
    darts = np.random.default_rng(0).integers(0, 3 * mesh.n_vertices, 3000)
    darts[:50] = darts[-50:]
    order = np.argsort(darts, kind="stable")
    one, other = EditableMesh(mesh), EditableMesh(mesh)
    loose, ordered = one.swap_edges(darts), other.swap_edges(darts[order], in_order=True)
    assert_array_equal(loose.status[order], ordered.status)
    assert_array_equal(one.result().mesh.connectivity.twin, other.result().mesh.connectivity.twin)


def test_the_outcome_of_a_batch_can_be_copied_and_pickled():
    batch = EditableMesh(shapes.sphere(4)).swap_edges([0, 2, 500])
    for again in (copy.deepcopy(batch), pickle.loads(pickle.dumps(batch))):
        assert repr(again) == repr(batch)
        assert_array_equal(again.status, batch.status)
